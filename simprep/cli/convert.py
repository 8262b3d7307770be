"""`simprep convert`: a motion file of one format into another."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from simprep.cli.file_options import BodyModel, Clip, FileFps, JointMap, Scale, Up
from simprep.cli.output import BaseCommand, Json, Output, Quiet, Robot
from simprep.errors import MotionFileError


@dataclass(frozen=True)
class Convert(BaseCommand):
    """Write a motion in another format: BVH, TRC, C3D, OpenSim's MOT and STO, CSV of joint angles, .npz of simprep and more.

    A file of joint angles of one of our characters is taken as it is. Any other is first retargeted onto the character, as
    `simprep import` does. docs/formats.md says what each format keeps.

    Example: simprep convert walk.bvh walk.mot
    """

    source: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="A", help_behavior_hint="")]
    """The motion file to read, or the name of a motion of the library."""

    target: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="B", help_behavior_hint="")]
    """The file to write; its extension tells the format."""

    to: Annotated[str | None, tyro.conf.arg(metavar="FORMAT", help_behavior_hint="")] = None
    """Name of the format to write, where the extension does not tell it."""

    robot: Robot = None

    fps: Annotated[float | None, tyro.conf.arg(metavar="FLOAT", help_behavior_hint="")] = None
    """Frames per second of the result; default: the file's, at most 60 where it is retargeted."""

    file_fps: FileFps = None

    up: Up = None

    scale: Scale = None

    joint_map: JointMap = None

    body_model: BodyModel = None

    clip: Clip = None

    strict: bool = False
    """Make a doubtful retargeting an error, as `simprep import` does. Nothing is written then."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.motion.export import export_motion
        from simprep.motion.formats.registry import format_to_write

        form = format_to_write(self.target, self.to)
        if self.target.resolve() == Path(self.source).resolve():
            raise MotionFileError(self.target, "is the file to read; give another")
        motion, report = self._read(output)
        for warning in report.get("warnings", ()):
            output.warn(warning)
        lost = export_motion(motion, self.target, form)
        for note in lost:
            output.warn(f"{form.title}: {note}")
        output.say(
            f"{self.source}: {report['recognised']}; {len(motion)} frames at {motion.fps:g} per second, {motion.duration:.2f} s"
        )
        output.say(f"written: {self.target} ({form.title})")
        return {**report, "format": form.name, "lost": list(lost), "out": str(self.target)}

    def _read(self, output: Output) -> tuple[Any, dict[str, Any]]:
        from simprep.cli.resolve import imported, resolve_motion, resolve_robot

        path = Path(self.source)
        if not path.suffix and len(path.parts) == 1 and not path.exists():
            motion = resolve_motion(self.source, output.warn, robot=self.robot)
            if self.fps is not None:
                motion = motion.resample(self.fps)
            return motion, {"recognised": "a motion of the library", "frames": len(motion), "fps": motion.fps}
        reading = {
            "fps": self.fps, "up": self.up, "scale": self.scale, "joint_map": self.joint_map,
            "file_fps": self.file_fps, "body_model": self.body_model, "clip": self.clip,
        }  # fmt: skip
        result = imported(path, resolve_robot(self.robot), **reading)
        if self.strict and result.report.doubtful:
            raise MotionFileError(path, f"doubtful: {result.report.warnings[0]}; without --strict it is written")
        return result.motion, result.report.as_dict()
