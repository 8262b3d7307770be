"""Picture of stability by dose: pushes seen from above, and how many runs complete each level of other doses."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from simprep.report.figures import COLOURS, new_figure, save_figure
from simprep.report.push_figure import TICKS

_LABELS = {
    "friction": "friction", "strength": "motor strength [share]", "noise": "sensor noise [multiple]",
    "horizon": "look-ahead [s]", "samples": "samples",
    "push_launch": "push at launch", "push_stance": "push in mid-stance",
}  # fmt: skip


def plot_stability(measures: Mapping[str, Mapping[str, Any]], path: str | Path, title: str) -> Path:
    """Largest pushes by direction, forward up, and the share of seeds that complete each level, harder to the right.

    Args:
        measures: as in the `measures` of `simprep.study.stability_results.content_of`, one or more.
        path: the PNG file.
        title: heading of the figure.
    """
    pushes = {name: one for name, one in measures.items() if "directions_deg" in one}
    others = {name: one for name, one in measures.items() if name not in pushes}
    columns = bool(pushes) + bool(others)
    figure = new_figure(5.4 * columns, max(4.8, 1.5 * len(others) + 0.8))
    figure.suptitle(title, fontsize=10)
    grid = figure.add_gridspec(max(1, len(others)), columns)
    if pushes:
        _pushes(figure.add_subplot(grid[:, 0], projection="polar"), pushes)
    for row, (name, one) in enumerate(others.items()):
        _levels(figure.add_subplot(grid[row, columns - 1]), name, one)
    return save_figure(figure, path)


def _pushes(axes: Any, pushes: Mapping[str, Mapping[str, Any]]) -> None:
    axes.set_theta_zero_location("N")
    largest = 100.0
    for (name, one), colour in zip(pushes.items(), COLOURS[2:]):
        angle = np.radians(one["directions_deg"])
        middle, low, high = (np.array(one[f"{key}_n"], float) for key in ("median", "low", "high"))
        axes.vlines(angle, low, high, color=colour, lw=4, alpha=0.3)
        close = np.arange(len(angle) + (len(angle) > 2)) % len(angle)
        axes.plot(angle[close], middle[close], "o-", color=colour, ms=4, lw=1.2, label=_LABELS[name])
        largest = max(largest, float(high.max()))
    axes.set_rlim(0, 1.1 * largest)
    axes.set_rlabel_position(22.5)
    axes.yaxis.set_major_formatter("{x:.0f} N")
    axes.set_thetagrids(range(0, 360, 45), TICKS)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7, loc="lower left", bbox_to_anchor=(-0.1, -0.12))


def _levels(axes: Any, name: str, one: Mapping[str, Any]) -> None:
    unit = "_s" if "levels_s" in one else ""
    levels, share = one[f"levels{unit}"], 100 * np.array(one["completed_share"])
    places = np.arange(len(levels))
    axes.bar(places, share, color=COLOURS[2], alpha=0.7, width=0.8)
    axes.set_xticks(places, [f"{level:.3g}" for level in levels], fontsize=7)
    axes.set_ylim(0, 105)
    axes.set_yticks([0, 50, 100], ["0", "50", "100 %"], fontsize=7)
    axes.set_ylabel("completed", fontsize=7)
    middle = one[f"median{unit}"]
    axes.set_title(f"{_LABELS[name]}: limit {middle:.3g}", fontsize=8)
