"""An approach seen from above, and its level of preparation over time (2013 paper, Fig. 9 and 11)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from simprep.controller.influence import Influence
from simprep.controller.runtime.approach import Approach
from simprep.controller.runtime.task import Task
from simprep.controller.spaces import REACH_M
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.report.figures import new_figure, save_figure


def plot_approach(
    result: Approach, tasks: Sequence[Task], path: str | Path, title: str, others: Sequence[Motion] = ()
) -> Path:
    """Draw the path coloured by level of preparation, goals, sources of influence, footprints; below, both over time.

    MissingExtraError without matplotlib.

    Args:
        result: the approach.
        tasks: what it was asked to do.
        path: the PNG file.
        title: heading.
        others: people around it; only the paths of their roots are drawn.
    """
    figure = new_figure(9.0, 7.6)
    figure.suptitle(title, fontsize=11)
    plan, below = figure.subplots(2, 1, height_ratios=[2.2, 1.0])
    motion = result.motion
    root, level = motion.qpos[:, :2], result.level
    feet = forward_kinematics(motion.qpos, motion.character).foot_points[:, :, :, :2].mean(axis=2)
    for side, colour in enumerate(("#2f6fb3", "#c2452d")):
        landed = motion.contacts[:, side] & ~np.concatenate([[False], motion.contacts[:-1, side]])
        plan.plot(*feet[landed, side].T, "s", color=colour, ms=4, alpha=0.5, label=("left foot", "right foot")[side])
    plays = np.isnan(level)
    plan.plot(*root.T, color="#9aa3ad", lw=1.0, label="while a target plays" if plays.any() else None)
    dots = plan.scatter(*root[~plays].T, c=level[~plays], cmap="viridis", vmin=0, vmax=1, s=10, zorder=3)
    figure.colorbar(dots, ax=plan, label="level of preparation α", shrink=0.8)
    from matplotlib.patches import Circle

    seen: list[Influence] = []
    for number, task in enumerate(tasks):
        plan.plot(*task.goal, "*", color="#b8860b", ms=13, zorder=4, label="goal" if number == 0 else None)
        plan.add_patch(Circle(task.goal, REACH_M, fill=False, ls=":", color="#b8860b"))
        for influence in task.influences:
            if influence not in seen:
                _draw_influence(plan, influence, motion.duration, first=not seen)
                seen.append(influence)
    for number, other in enumerate(others):
        way = other.qpos[:, :2]
        label = "other people (drawn only, no physics)" if number == 0 else None
        plan.plot(*way.T, color="#a8322a", lw=1.4, alpha=0.8, label=label)
        plan.plot(*way[-1], "o", color="#a8322a", ms=7)
    for number, frame in enumerate(result.launches):
        plan.plot(*root[frame], "P", color="black", ms=8, zorder=5, label="launch" if number == 0 else None)
    plan.set_aspect("equal", adjustable="datalim")
    plan.set_xlabel("x [m]", fontsize=8)
    plan.set_ylabel("y [m]", fontsize=8)
    plan.legend(fontsize=7, loc="upper left", framealpha=0.8)
    time = motion.times
    below.plot(time, level, color="#3a8a4d", label="α in effect (filtered)")
    for action in result.actions:
        at = action.frame / motion.fps
        below.plot([at, at + 0.5], [action.alpha] * 2, color="#5b616b", lw=2, alpha=0.6)
    below.plot([], [], color="#5b616b", lw=2, alpha=0.6, label="α chosen")
    begins = [action.frame / motion.fps for action in result.actions]
    distances = [action.goal_distance for action in result.actions]
    below.plot(begins, distances, "o--", color="#b8860b", ms=3, label="to the goal [m]")
    for frame in result.launches:
        below.axvline(frame / motion.fps, color="black", ls=":", lw=0.9)
    below.set_xlim(0, motion.duration)
    below.set_ylim(-0.05, None)
    below.set_xlabel("time [s]", fontsize=8)
    below.legend(fontsize=7)
    for axes in (plan, below):
        axes.grid(alpha=0.25)
        axes.tick_params(labelsize=7)
    return save_figure(figure, path)


def _draw_influence(plan: Any, influence: Influence, duration: float, first: bool) -> None:
    way = influence.at(np.array([0.0, duration]))
    if np.any(way[0] != way[1]):
        plan.plot(*way.T, "--", color="#7a4fa3", lw=1.2)
    plan.plot(*way[1], "X", color="#7a4fa3", ms=10, zorder=4, label="source of influence" if first else None)
    names = [f"{name} {share:.0%}" if share < 1 else name for name, share in influence.targets.items()]
    plan.annotate(", ".join(names), way[1], xytext=(8, -12), textcoords="offset points", fontsize=7, color="#7a4fa3")
