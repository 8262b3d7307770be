"""The report of a search for the largest pushes: the weakest direction's last push survived beside the least that was not."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from simprep.physics.pushes import Push
from simprep.report.page import Page, Picture
from simprep.study.limit_replay import limit_replay
from simprep.study.limit_runs import LimitRuns
from simprep.study.push_limits import BEFORE_S, PushLimits


def push_page(
    title: str,
    limits: PushLimits,
    runs: LimitRuns,
    files: Sequence[Path],
    details: Mapping[str, Any],
    warnings: Sequence[str] = (),
) -> Page:
    """A search for the largest pushes.

    Args:
        title: what was pushed, how long and when.
        limits: what came out.
        runs: the runs at the limit of each direction.
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
    settings = limits.settings
    push = Push(settings.segment, min(BEFORE_S, settings.at_s), settings.duration_s, (0.0, 0.0, 0.0))
    replay = limit_replay(f"{angle:g}°", angle, runs, "{:.0f} N", push)
    return Page(
        title=title,
        headline=headline,
        replays=[] if replay is None else [replay],
        tables=[_table(table)],
        pictures=[Picture("largest push survived, by direction", path) for path in files if path.suffix == ".png"],
        details=details,
        warnings=warnings,
    )


def _table(columns: Mapping[str, Sequence[Any]]) -> Table:
    table = Table(title=Text("Largest force survived, over the seeds"), title_justify="left")
    for heading in ("direction [°]", "median [N]", "least [N]", "largest [N]", "at least"):
        table.add_column(Text(heading), justify="right")
    for angle, median, low, high, flagged in zip(*columns.values()):
        table.add_row(f"{angle:g}", f"{median:.0f}", f"{low:.0f}", f"{high:.0f}", "yes" if flagged else "")
    return table
