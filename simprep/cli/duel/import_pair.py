"""`simprep duel import`: two people into one stream."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from simprep.cli.file_options import BodyModel, FileFps, JointMap, Scale, Up
from simprep.cli.output import BaseCommand, Json, Output, Quiet


@dataclass(frozen=True)
class DuelImport(BaseCommand):
    """Import two people recorded together, in one frame, and write them as one stream.

    One file per person (the formats of `simprep import`), or one file with both: a .bvh of two ROOTs, a .pkl of InterHuman, or
    an .npz of joint positions (T, 2, J, 3) with `joint_names` and `fps`; or a folder of Inter-X. Each person moves a body with
    their own legs, so that distances are kept.

    Example: simprep duel import 18_01.bvh 19_01.bvh -o handshake.npz
    """

    OUT_IS_FILE = True

    files: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="A [B]", help_behavior_hint="")]
    """The file of each person, or one file with both; a folder stands for the one file of simprep in it."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="OUT", help_behavior_hint="")] = None
    """The .npz file to write; default: the files' names joined by +, in the current folder."""

    like: Annotated[Path | None, tyro.conf.arg(metavar="STREAM", help_behavior_hint="")] = None
    """Use the bodies and the frame rate of this stream, so that both can be joined; default: bodies with the recorded
    people's legs."""

    fps: Annotated[float | None, tyro.conf.arg(metavar="FLOAT", help_behavior_hint="")] = None
    """Frames per second of the result; default: that of --like, else the files', at most 60."""

    up: Up = None

    scale: Scale = None

    joint_map: JointMap = None

    file_fps: FileFps = None

    body_model: BodyModel = None

    offset: Annotated[float | None, tyro.conf.arg(metavar="SECONDS", help_behavior_hint="")] = None
    """Time of B's first frame after A's, for two files of different starts or lengths; both are cut to the time that they
    share. Default: both have the same frames."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.archive import find_archive
        from simprep.duel.stream.import_pair import import_pair
        from simprep.duel.stream.store import KIND, SCHEMA, read_stream, save_stream
        from simprep.duel.stream.stream import PLAYERS
        from simprep.errors import MotionFileError, SettingError
        from simprep.motion.store import SCHEMA as MOTION_SCHEMA

        if len(self.files) not in (1, 2):
            raise SettingError(f"{len(self.files)} files; valid: one per person, or one with both people")
        second = self.files[1] if len(self.files) == 2 else None
        bodies, fps = None, self.fps
        if self.like is not None:
            a, b = read_stream(self.like).pair
            bodies, fps = (a.character, b.character), a.fps if fps is None else fps
        pair = import_pair(
            self.files[0], second, fps, self.up, self.scale, self.joint_map, bodies=bodies, offset=self.offset,
            file_fps=self.file_fps, body_model=self.body_model,
        )  # fmt: skip
        target = self.out or Path(f"{pair.stream.name}.npz")
        kind = ("simprep motion", MOTION_SCHEMA) if second else (KIND, SCHEMA)
        if target.resolve() in [find_archive(file, *kind).resolve() for file in self.files]:
            raise MotionFileError(target, "is a file to import; give another with -o")
        written = save_stream(pair.stream, target)
        report = pair.report
        low, middle, high = report.distance_m
        output.say(
            f"{pair.stream.name}: {report.frames} frames at {report.fps:g} per second, {report.duration_s:.2f} s; "
            f"root distance {low:.2f} to {high:.2f} m, median {middle:.2f} m"
        )
        for player, other, angle, share in zip(PLAYERS, PLAYERS[::-1], report.facing_deg, report.facing_share):
            output.say(f"{player} faces {other} in {100 * share:.0f} % of the frames, median error {angle:.0f} degrees")
        for player, imported in zip(PLAYERS, pair.imports):
            for warning in imported.warnings:
                output.warn(f"{player}: {warning}")
        if fps is not None and report.fps != fps:
            output.warn(f"a saved stream keeps its {report.fps:g} frames per second; not {fps:g}")
        if bodies is not None and any(motion.character != body for motion, body in zip(pair.stream.players, bodies)):
            output.warn(
                f"what simprep saved keeps its bodies, which are not those of {self.like}: the two cannot be joined"
            )
        for warning in report.warnings:
            output.warn(warning)
        output.say(f"written: {written}")
        return {**asdict(report), "imports": [item.as_dict() for item in pair.imports], "out": str(written)}
