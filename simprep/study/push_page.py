"""The report of a search for the largest pushes: the weakest direction's last push survived beside the least that was not."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from simprep.motion.kinematics import forward_kinematics
from simprep.physics.run import DONE, Run
from simprep.report.figures import COLOURS
from simprep.report.page import Page, Picture
from simprep.report.replay.actor import Flash, Replay, run_actor, side_by_side
from simprep.study.push_limits import BEFORE_S, PushLimits


@dataclass
class PushRuns:
    """Of each direction the runs of the first seed with the largest push survived and the least that was not.

    Attributes:
        survived: force [N] and run by direction [degrees].
        failed: the same of the pushes that were not survived.
    """

    survived: dict[float, tuple[float, Run]] = field(default_factory=dict)
    failed: dict[float, tuple[float, Run]] = field(default_factory=dict)
    _seed: int | None = None

    def add(self, direction_deg: float, seed: int, force_n: float, run: Run) -> None:
        """Keep a run if it is nearer the limit than what is kept; see `push_limits(on_run=)`."""
        self._seed = seed if self._seed is None else self._seed
        if seed != self._seed:
            return
        kept = self.survived if run.end == DONE else self.failed
        before = kept.get(direction_deg)
        nearer = before is None or (force_n > before[0]) == (run.end == DONE)
        if nearer:
            kept[direction_deg] = (force_n, run)


def push_page(
    title: str,
    limits: PushLimits,
    runs: PushRuns,
    files: Sequence[Path],
    details: Mapping[str, Any],
    warnings: Sequence[str] = (),
) -> Page:
    """A search for the largest pushes.

    Args:
        title: what was pushed, how long and when.
        limits: what came out.
        runs: the runs kept on the way.
        files: what was drawn; all of it is shown.
        details: how it was made.
        warnings: what was said about it.
    """
    table = limits.by_direction()
    weakest = int(np.argmin(table["max_force_n"]))
    angle, force = table["directions_deg"][weakest], table["max_force_n"][weakest]
    headline = (
        f"The weakest direction is {angle:g}° (0 is forward, 90 to the left): a push of {force:.0f} N for "
        f"{limits.settings.duration_s:g} s is survived, the median of {len(limits.settings.seeds)} seed(s)."
    )
    replay = _replay(angle, limits, runs)
    return Page(
        title=title,
        headline=headline,
        replays=[] if replay is None else [replay],
        tables=[_table(table)],
        pictures=[Picture("largest push survived, by direction", path) for path in files if path.suffix == ".png"],
        details=details,
        warnings=warnings,
    )


def _replay(angle: float, limits: PushLimits, runs: PushRuns) -> Replay | None:
    kept = [(runs.survived.get(angle), "survived"), (runs.failed.get(angle), "not survived")]
    known = [(*pair, word) for pair, word in kept if pair is not None]
    settings = limits.settings
    start = min(BEFORE_S, settings.at_s)
    actors = side_by_side(
        [run_actor(run, f"{force:.0f} N, {word}", colour) for (force, run, word), colour in zip(known, COLOURS[2:])]
    )
    flashes = []
    for actor, (force, run, _) in zip(actors, known):
        character = run.reference.character
        frame = min(round(start / run.timestep), run.steps)
        where = forward_kinematics(run.qpos[frame : frame + 1], character).xipos[0]
        x, y, z = where[character.segments.index(settings.segment)]
        place = (float(x + actor.place[0]), float(y + actor.place[1]), float(z))
        flashes.append(Flash(start, settings.duration_s, place, 0.14, f"{force:.0f} N"))
    return Replay(f"{angle:g}°", actors, flashes=tuple(flashes)) if actors else None


def _table(columns: Mapping[str, Sequence[Any]]) -> Table:
    table = Table(title=Text("Largest force survived, over the seeds"), title_justify="left")
    for heading in ("direction [°]", "median [N]", "least [N]", "largest [N]", "at least"):
        table.add_column(Text(heading), justify="right")
    for angle, median, low, high, flagged in zip(*columns.values()):
        table.add_row(f"{angle:g}", f"{median:.0f}", f"{low:.0f}", f"{high:.0f}", "yes" if flagged else "")
    return table
