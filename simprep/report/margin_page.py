"""The report of `simprep margins`."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from simprep.character import SIDES
from simprep.display import fact_table
from simprep.metrics.margins import StepMargin
from simprep.motion.motion import Motion
from simprep.physics.run import Run
from simprep.report.page import Page, Picture
from simprep.report.replay.actor import motion_replay, run_replay

MARKS = 24
"""Most touch-downs that are marked in the replay."""
LEGEND = "Green is the support polygon, red the centre of mass on the floor. The name of a foot is shown when it touches down."


def margin_page(
    subject: Motion | Run,
    steps: Sequence[StepMargin],
    table: Table,
    about: Mapping[str, str],
    files: Sequence[Path],
    details: Mapping[str, Any],
    warnings: Sequence[str] = (),
) -> Page:
    """Margins of the steps of a motion or a run.

    Args:
        subject: what was measured.
        steps: what came out, in order.
        table: the same as a table.
        about: definitions by name (`simprep.metrics.margins.definitions`).
        files: what was drawn; all of it is shown.
        details: how it was made.
        warnings: what was said about it.
    """
    run = subject if isinstance(subject, Run) else None
    name = run.reference.name if run is not None else subject.name if isinstance(subject, Motion) else ""
    replay = run_replay(run) if run is not None else motion_replay(subject) if isinstance(subject, Motion) else None
    marks = tuple((f"{one.side} foot", one.touchdown_s) for one in steps[:MARKS])
    return Page(
        title=f"{name}: margins of stability" + (f", simulated with {run.controller}" if run is not None else ""),
        headline=margin_headline(name, steps),
        replays=[] if replay is None else [replace(replay, marks=marks)],
        tables=[table, fact_table("What the numbers are", about)],
        pictures=[Picture(path.stem, path) for path in files if path.suffix == ".png"],
        details=details,
        warnings=warnings,
        legend=LEGEND,
    )


def margin_headline(name: str, steps: Sequence[StepMargin]) -> str:
    """Steps and their mean margins in a sentence."""
    if not steps:
        return f"{name} has no steps: no foot lands."
    parts = []
    for side in SIDES:
        own = [one for one in steps if one.side == side]
        if own:
            sideways, ahead = (1e3 * np.mean([getattr(one, key) for one in own]) for key in ("ml_m", "front_m"))
            parts.append(f"{sideways:.0f} mm sideways and {ahead:.0f} mm to the front of the {side} foot ({len(own)})")
    return f"{name}: at touch-down the mean margin is {', and '.join(parts)}; positive is inside."
