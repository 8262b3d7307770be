"""`simprep duel join`: several clips of the same people into one stream."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from simprep.cli.output import BaseCommand, Json, Output, Quiet


@dataclass(frozen=True)
class DuelJoin(BaseCommand):
    """Join several clips of the same people into one stream that remembers its seams.

    Example: simprep duel join round1.npz round2.npz -o fight.npz
    """

    OUT_IS_FILE = True

    streams: Annotated[
        tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="STREAM [STREAM ...]", help_behavior_hint="")
    ]
    """Streams that `simprep duel import` wrote, or their folders, in order."""

    out: Annotated[Path, tyro.conf.arg(aliases=("-o",), metavar="OUT", help_behavior_hint="")] = Path("stream.npz")
    """The .npz file to write (default stream.npz)."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from dataclasses import replace

        from simprep.archive import find_archive
        from simprep.duel.stream.store import KIND, SCHEMA, read_stream, save_stream
        from simprep.duel.stream.stream import check_stream, concatenate_streams
        from simprep.errors import MotionFileError, SettingError

        if not self.streams:
            raise SettingError("no streams to join; valid: one or more files that `simprep duel import` wrote")
        files = [find_archive(path, KIND, SCHEMA) for path in self.streams]
        if self.out.resolve() in [path.resolve() for path in files]:
            raise MotionFileError(self.out, "is a stream to join; give another with -o")
        # errors then name files; the result has a name of its own
        named = [replace(read_stream(path), name=str(path)) for path in files]
        stream = concatenate_streams(named, self.out.stem)
        report = check_stream(stream)
        for warning in report.warnings:
            output.warn(warning)
        written = save_stream(stream, self.out)
        output.say(
            f"{report.clips} clips, {report.frames} frames at {report.fps:g} per second, {report.duration_s:.2f} s"
        )
        output.say(f"written: {written}")
        return {**asdict(report), "seams": list(stream.seams), "out": str(written)}
