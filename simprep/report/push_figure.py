"""Polar plot of the largest pushes survived, by direction; MissingExtraError without matplotlib."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from simprep.report.figures import COLOURS, new_figure, save_figure

TICKS = ("0°\nforward", "45°", "90°\nleft", "135°", "180°\nbackward", "225°", "270°\nright", "315°")


def plot_push_limits(table: Mapping[str, Sequence[Any]], path: str | Path, title: str) -> Path:
    """Largest forces survived, seen from above, forward up. Three or more directions are joined.

    Args:
        table: in order of the angle from 0, see `simprep.study.push_limits.PushLimits.by_direction`.
        path: the PNG file.
        title: heading of the figure.
    """
    figure = new_figure(6.2, 6.6)
    figure.suptitle(title, fontsize=10)
    axes = figure.add_subplot(projection="polar")
    axes.set_theta_zero_location("N")
    keys = ("max_force_n", "low_n", "high_n")
    angle, median, low, high = np.radians(table["directions_deg"]), *(np.array(table[key], float) for key in keys)
    interval = {"color": COLOURS[2], "alpha": 0.25, "label": "least to largest of the seeds"}
    if len(angle) > 2:
        around = np.append(angle, angle[0] + 2 * np.pi)
        axes.fill_between(around, np.append(low, low[0]), np.append(high, high[0]), lw=0, **interval)
        axes.plot(around, np.append(median, median[0]), color=COLOURS[2], lw=1.5)
    else:
        axes.vlines(angle, low, high, lw=6, **interval)
    axes.plot(angle, median, "o", color=COLOURS[2], ms=5, label="median")
    flagged = np.array(table["at_least"], bool)
    if flagged.any():
        axes.plot(angle[flagged], high[flagged], "^", mfc="none", color=COLOURS[3], label="largest tried, survived")
    for place, force in zip(angle, median):
        axes.annotate(f"{force:.0f} N", (place, force), (5, 5), textcoords="offset points", fontsize=7)
    axes.set_rlim(0, 1.15 * max(float(high.max()), 100.0))
    axes.set_rlabel_position(22.5)
    axes.yaxis.set_major_formatter("{x:.0f} N")
    axes.set_thetagrids(range(0, 360, 45), TICKS)
    axes.tick_params(labelsize=8)
    axes.tick_params(axis="x", pad=10)
    axes.grid(alpha=0.3)
    figure.legend(fontsize=8, loc="outside lower center", ncols=3)
    return save_figure(figure, path)
