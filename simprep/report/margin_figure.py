"""Margins of stability over steps or gait cycles: a panel for each direction, left and right in it."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.metrics.margins import DIRECTIONS, NODES
from simprep.report.figures import COLOURS, new_figure, save_figure

_WORDS = {"ml": "sideways, to the outer edge", "front": "to the foremost edge", "back": "to the rearmost edge"}


def plot_step_margins(curves: Mapping[str, FloatArray], path: str | Path, title: str, over: str = "step") -> Path:
    """Each step as a thin line, the mean of a side as a thick one where at least half of its feet stand.

    Args:
        curves: from `simprep.metrics.margins.normalised_curves` (101,) [m], one or more.
        path: the PNG file.
        title: heading of the figure.
        over: what 100 % are, `step` or `cycle`.
    """
    figure = new_figure(3.4 * len(DIRECTIONS), 3.6)
    figure.suptitle(title, fontsize=10)
    percent = np.linspace(0, 100, NODES)
    for number, direction in enumerate(DIRECTIONS):
        axes = figure.add_subplot(1, len(DIRECTIONS), number + 1)
        for side, colour in zip(SIDES, (COLOURS[2], COLOURS[3])):
            own = [1e3 * line for name, line in curves.items() if name.startswith(f"{side}_") and _is(name, direction)]
            if not own:
                continue
            axes.plot(percent, np.transpose(own), color=colour, lw=0.6, alpha=0.4)
            table = np.array(own)  # (steps, 101)
            known = np.isfinite(table)
            enough = 2 * known.sum(axis=0) >= len(own)
            mean = np.where(known, table, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
            axes.plot(percent, np.where(enough, mean, np.nan), color=colour, lw=2, label=f"{side} foot, {len(own)}")
        axes.axhline(0, color="black", lw=0.6)
        axes.set_title(_WORDS[direction], fontsize=9)
        axes.set_xlabel(f"{over} [%]", fontsize=8)
        axes.tick_params(labelsize=7)
        axes.grid(alpha=0.3)
        if number == 0:
            axes.set_ylabel("margin [mm], inside > 0", fontsize=8)
            axes.legend(fontsize=7)
    return save_figure(figure, path)


def _is(name: str, direction: str) -> bool:
    return name.endswith(f"_{direction}_m")
