"""What `simprep view` and `simprep render` show: a run, a stream of people, or a motion, from whatever a person names."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from simprep.errors import MotionFileError

if TYPE_CHECKING:
    from simprep.duel.stream.stream import DuelStream
    from simprep.motion.motion import Motion
    from simprep.physics.run import Run

REPORT_FILE = "report.html"
RUN_FILE = "run.npz"


@dataclass(frozen=True)
class Shown:
    """What a name or a path stands for; exactly one of the three is there.

    Attributes:
        name: for titles and files.
        motion: a motion, not simulated.
        run: a simulation of one body or several.
        stream: of people, not simulated.
    """

    name: str
    motion: Motion | None = None
    run: Run | None = None
    stream: DuelStream | None = None

    @property
    def kind(self) -> str:
        """`run`, `stream` or `motion`."""
        return "run" if self.run is not None else "stream" if self.stream is not None else "motion"

    def motions(self) -> tuple[Motion, tuple[Motion, ...]]:
        """What is drawn opaque, and what beside it: the references of a run, the other people."""
        if self.run is not None:
            first, *rest = (self.run.body(number) for number in range(len(self.run.bodies)))
            others = [first.reference] if not rest else [each.simulated_motion() for each in rest]
            return first.simulated_motion(), tuple(others)
        if self.stream is not None:
            return self.stream.players[0], self.stream.players[1:]
        assert self.motion is not None
        return self.motion, ()


def read_shown(text: str, warn: Callable[[str], None], library: Path | None = None, robot: str | None = None) -> Shown:
    """Read what a person names.

    Args:
        text: a run, a stream of people or a motion that simprep wrote; the folder of a result; any motion file
            (docs/formats.md); or the name of a motion of the library.
        warn: receives what an import decided, a line each.
        library: folder of the user's clips.
        robot: whose motion a motion becomes.

    Raises:
        MotionFileError: nothing that can be shown; the message says what would do.
        UnknownNameError: no such name.
    """
    from simprep.archive import schema_of

    path = result_folder(Path(text)) or Path(text)
    name = (path.parent if path.name == RUN_FILE else path).stem or path.resolve().name
    if path.is_dir() and (path / RUN_FILE).is_file():
        path = path / RUN_FILE
    schema = (schema_of(path) or "") if path.suffix == ".npz" and path.is_file() else ""
    if schema.startswith("simprep.run/"):
        from simprep.physics.store import read_run

        return Shown(name, run=read_run(path))
    if schema.startswith("simprep.duel-stream/"):
        from simprep.duel.stream.store import read_stream

        return Shown(name, stream=read_stream(path))
    if schema and not schema.startswith("simprep.motion/"):
        raise MotionFileError(path, f"a file of {schema}; valid: a run, a motion or a stream of people")
    from simprep.cli.resolve import resolve_motion

    shown = str(path) if path != Path(text) else text
    motion = resolve_motion(shown, warn, library, robot)
    return Shown(motion.name, motion=motion)


def result_folder(path: Path) -> Path | None:
    """The folder of a result whose `metrics.json` or `report.html` a path names; None for anything else."""
    if path.name == REPORT_FILE and path.is_file():
        return path.parent
    if path.suffix != ".json" or not path.is_file():
        return None
    try:
        schema = json.loads(path.read_text(encoding="utf-8")).get("schema", "")
    except (ValueError, AttributeError, OSError):
        return None
    return path.parent if str(schema).startswith("simprep.") else None
