"""Plot of a controller's learning curve (Fig. 10 of the 2013 paper); MissingExtraError without matplotlib."""

from collections.abc import Sequence
from pathlib import Path

from simprep.report.figures import COLOURS, new_figure, save_figure


def plot_learning_curve(steps: Sequence[int], returns: Sequence[float], best: float, path: str | Path) -> Path:
    """Average return per state against training steps, beside that of value iteration.

    Args:
        steps: (N,) training steps.
        returns: (N,) exact return of the greedy policy, mean over all states.
        best: the largest return possible, mean over all states.
        path: the PNG file.
    """
    figure = new_figure(5.2, 3.4)
    axes = figure.add_subplot()
    axes.axhline(best, color=COLOURS[0], lw=1.0, ls="--", label="best possible (value iteration)")
    axes.plot([step / 1e6 for step in steps], returns, "o-", ms=3, color=COLOURS[2], label="SARSA, greedy policy")
    axes.set_xlabel("training steps [millions]", fontsize=8)
    axes.set_ylabel("average return per state", fontsize=8)
    axes.set_xlim(left=0)
    axes.grid(alpha=0.3)
    axes.tick_params(labelsize=7)
    axes.legend(fontsize=7, loc="lower right")
    return save_figure(figure, path)
