"""A comparison with a baseline as a picture: how far each number moved, in multiples of what it may move."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from simprep.regression.compare import BETTER, MOVED, SAME, WORSE, Row
from simprep.report.figures import COLOURS, new_figure

SHOWN = 40
"""Most rows."""
EDGE = 4.0
"""What moved by more times what is allowed is drawn at the edge."""
_COLOUR = {WORSE: COLOURS[3], MOVED: COLOURS[3], BETTER: COLOURS[4], SAME: COLOURS[0]}


def plot_comparison(rows: Sequence[Row]) -> Any:
    """A matplotlib figure with a line for each number, the farthest moved first; 1 is what is allowed.

    Args:
        rows: those that were judged are drawn, one at least (`judged`).
    """
    shown = sorted(judged(rows), key=lambda row: -abs(moved(row)))[:SHOWN]
    places = np.array([moved(row) for row in shown])
    figure = new_figure(8.5, 0.22 * len(shown) + 1.2)
    axes = figure.add_subplot()
    axes.axvspan(-1, 1, color="#e8e8e8", zorder=0)
    axes.axvline(0, color="black", lw=0.8)
    for number, (row, place) in enumerate(zip(shown, np.clip(places, -EDGE, EDGE))):
        axes.plot([0, place], [number, number], color=_COLOUR[row.verdict], lw=1.2)
        axes.plot(place, number, "o", color=_COLOUR[row.verdict], ms=4)
    axes.set_yticks(range(len(shown)), [f"{row.case}: {row.metric}" for row in shown], fontsize=6)
    axes.set_ylim(len(shown) - 0.5, -0.5)
    axes.set_xlim(-1.05 * EDGE, 1.05 * EDGE)
    axes.tick_params(axis="x", labelsize=7)
    axes.set_xlabel(
        f"now minus before, in multiples of what is allowed ({EDGE:g} and more at the edge); red: worse or moved, green: better",
        fontsize=7,
    )
    return figure


def judged(rows: Sequence[Row]) -> list[Row]:
    """Rows with a number on both sides and a range between which it may lie."""
    return [row for row in rows if row.verdict in _COLOUR and None not in (row.before, row.now, row.low, row.high)]


def moved(row: Row) -> float:
    """How far a judged row moved, in multiples of what is allowed; 0 where it did not move at all."""
    assert row.before is not None
    assert row.now is not None
    assert row.low is not None
    assert row.high is not None
    change = row.now - row.before
    allowed = row.high - row.before if change > 0 else row.before - row.low
    return 0.0 if change == 0 else change / allowed if allowed > 0 else float(np.copysign(np.inf, change))
