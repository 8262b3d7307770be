"""`simprep import`: a motion file onto the humanoid or a robot."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from simprep.cli.file_options import BodyModel, Clip, FileFps, JointMap, Scale, Up
from simprep.cli.output import BaseCommand, Json, Output, Quiet, Robot
from simprep.errors import MotionFileError


@dataclass(frozen=True)
class Import(BaseCommand):
    """Retarget a motion file onto the humanoid or a robot, set its feet on the floor, and write it as .npz.

    Reads BVH, Acclaim (.amc with its .asf beside it), DeepMimic, AMASS and SMPL, TRC, C3D, OpenSim's MOT and CSV of joint
    angles (docs/formats.md), recognised by content. What the file does not state (vertical axis, length unit, meaning of
    joint names) is found, and reported; the options below override it.

    Example: simprep import walk.bvh -o walk.npz
    """

    OUT_IS_FILE = True

    file: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="FILE", help_behavior_hint="")]
    """The motion file, or a folder with one .npz of simprep."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="OUT", help_behavior_hint="")] = None
    """The .npz file to write; default: the file's name, in the current folder."""

    robot: Robot = None

    fps: Annotated[float | None, tyro.conf.arg(metavar="FLOAT", help_behavior_hint="")] = None
    """Frames per second of the result; default: the file's, at most 60."""

    up: Up = None

    scale: Scale = None

    joint_map: JointMap = None

    file_fps: FileFps = None

    body_model: BodyModel = None

    clip: Clip = None

    strict: bool = False
    """Make a doubtful result an error: a limb that points elsewhere than the file's though the body could (by more than
    5 deg in 5 % of the frames, or 15 deg in one), or that is out of its reach for long. Nothing is written then."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.archive import find_archive
        from simprep.cli.resolve import imported, resolve_robot
        from simprep.motion.store import SCHEMA, save_motion

        file = find_archive(self.file, "simprep motion", SCHEMA)
        body = resolve_robot(self.robot)
        reading = {
            "fps": self.fps, "up": self.up, "scale": self.scale, "joint_map": self.joint_map,
            "file_fps": self.file_fps, "body_model": self.body_model, "clip": self.clip,
        }  # fmt: skip
        result = imported(file, body, **reading)
        if self.strict and result.report.doubtful:
            raise MotionFileError(file, f"doubtful: {result.report.warnings[0]}; without --strict it is written")
        target = self.out or Path(f"{file.stem}.npz")
        if target.resolve() == file.resolve():
            raise MotionFileError(target, "is the file to import; give another with -o")
        try:
            written = save_motion(result.motion, target)
        except OSError as error:
            raise MotionFileError(target, f"cannot be written ({error.strerror})") from None
        report = result.report
        output.say(
            f"{file.name}: {report.recognised}; {report.frames} frames at {report.fps:g} per second, {report.duration_s:.2f} s; "
            f"{report.up} up, {report.scale:.4g} m per unit; mean joint distance to the source {report.residual_mm:.1f} mm"
            + (
                f" ({report.check.worst_residual_mm:.1f} in frame {report.check.worst_residual_frame})"
                if report.check
                else ""
            )
        )
        if report.check:
            worst = report.check.worst_limb
            limb = report.check.limbs[worst]
            output.say(
                f"limbs: 95 % of the frames within {limb.p95_deg:.1f} deg of the source, worst {limb.max_deg:.1f} "
                f"({worst.replace('_', ' ')})" + ("; doubtful" if report.doubtful else "")
            )
        for warning in report.warnings:
            output.warn(warning)
        output.say(f"written: {written}")
        return {**report.as_dict(), "out": str(written)}
