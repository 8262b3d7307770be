"""Effects of the study as pictures."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from posture_optimization.compared import LABELS, SATURATED, Comparison
from simprep.metrics.effects import HARMS, HELPS, NO_EFFECT, UNDECIDED
from simprep.report.figures import COLOURS, new_figure, save_figure
from simprep.study.plan import BEFORE_PHYSICS

COLOUR = {HELPS: COLOURS[4], HARMS: COLOURS[3], NO_EFFECT: COLOURS[2], UNDECIDED: COLOURS[0], SATURATED: "#c8c8c8"}
SHOWN = 6.0
"""Effects beyond so many times what matters are drawn at the edge."""


def plot_effects(comparisons: Sequence[Comparison], path: str | Path) -> Path:
    """Effects with their intervals, in multiples of the smallest that matters; to the right is better.

    Args:
        comparisons: over all cases of a controller and a disturbance.
        path: the PNG file.
    """
    shown = [one for one in comparisons if one.effect.low is not None]
    controllers = list(dict.fromkeys(one.controller for one in shown))
    rows = max((sum(one.controller == name for one in shown) for name in controllers), default=1)
    figure = new_figure(5.2 * max(1, len(controllers)) + 1.5, 0.21 * rows + 1.8)
    for number, controller in enumerate(controllers):
        axes = figure.add_subplot(1, len(controllers), number + 1)
        own = [one for one in shown if one.controller == controller]
        axes.axvspan(-1, 1, color="#e8e8e8", zorder=0)
        axes.axvline(0, color="black", lw=0.8)
        for row, one in enumerate(own):
            effect, unit = one.effect, one.outcome.better / one.outcome.smallest
            ends = np.clip(sorted((unit * (effect.low or 0.0), unit * (effect.high or 0.0))), -SHOWN, SHOWN)
            axes.plot(ends, [row, row], color=COLOUR[one.says], lw=2)
            axes.plot(np.clip(unit * (effect.estimate or 0.0), -SHOWN, SHOWN), row, "o", color=COLOUR[one.says], ms=4)
        axes.set_yticks(
            range(len(own)),
            [f"{LABELS[one.outcome.name]}, {one.disturbance.replace('_', ' ')}" for one in own],
            fontsize=6,
        )
        axes.set_ylim(len(own) - 0.5, -0.5)
        axes.set_xlim(-SHOWN, SHOWN)
        axes.set_title(
            "motions before physics" if controller == BEFORE_PHYSICS else f"simulated with {controller}", fontsize=9
        )
        axes.set_xlabel("worse  ←  multiples of the smallest effect that matters  →  better", fontsize=7)
        axes.tick_params(axis="x", labelsize=7)
    for name, colour in COLOUR.items():
        figure.axes[0].plot([], [], color=colour, lw=2, label=name) if figure.axes else None
    if figure.axes:
        figure.legend(fontsize=8, loc="outside lower center", ncols=4)
    return save_figure(figure, path)


def plot_worse(comparisons: Sequence[Comparison], path: str | Path) -> Path:
    """Share of pairs that got worse, equal and better, by controller, disturbance and metric of stability.

    Args:
        comparisons: as of `plot_effects`.
        path: the PNG file.
    """
    shown = [one for one in comparisons if one.effect.worse is not None]
    figure = new_figure(7.5, 0.2 * len(shown) + 1.4)
    axes = figure.add_subplot()
    for row, one in enumerate(shown):
        worse, better = one.effect.worse or 0.0, one.effect.better or 0.0
        for left, width, colour in (
            (0, worse, COLOURS[3]),
            (worse, 1 - worse - better, "#d0d0d0"),
            (1 - better, better, COLOURS[4]),
        ):
            axes.barh(row, width, left=left, color=colour, height=0.8)
    names = [f"{one.controller}, {one.disturbance.replace('_', ' ')}: {LABELS[one.outcome.name]}" for one in shown]
    axes.set_yticks(range(len(shown)), names, fontsize=6)
    axes.set_ylim(len(shown) - 0.5, -0.5)
    axes.set_xlim(0, 1)
    axes.set_xlabel("share of pairs: worse (red), equal (grey), better (green) with posture optimisation", fontsize=8)
    return save_figure(figure, path)
