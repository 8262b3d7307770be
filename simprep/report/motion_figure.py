"""A motion or a run over time: root height, joint angles, contacts; of a run also its reference and torques."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simprep.arrays import IndexArray
from simprep.character import SIDES, Character
from simprep.errors import UnknownNameError
from simprep.motion.contacts import stances
from simprep.motion.motion import Motion
from simprep.physics.run import DONE, Run
from simprep.report.figures import COLOURS, new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LINES = (*COLOURS, "#1b9e9e", "#d1659b", "#8fae3c", "#e0913a", "#111111")


def plot_motion(motion: Motion, joints: str | Sequence[str] | None = None, path: str | Path | None = None) -> "Figure":
    """Figure of root height, joint angles by group, and contacts over time; events are dotted lines.

    Args:
        motion: what to draw.
        joints: names of joints or of groups of the character (`left_arm`), one or several; None for all.
        path: PNG file to write; None to write none.

    Raises:
        UnknownNameError: no such joint or group.
        MissingExtraError: matplotlib is not installed.
    """
    groups = _groups(motion.character, joints)
    figure, panels = _panels(motion.name, len(groups) + 2)
    _draw(panels, motion, groups)
    return _finish(figure, panels, motion, path)


def plot_run(run: Run, joints: str | Sequence[str] | None = None, path: str | Path | None = None) -> "Figure":
    """Figure of a run as of `plot_motion`; its reference is dashed, and what was not simulated is shaded.

    Torques are shares of the servos' limits, of each group the largest among the joints drawn.

    Args:
        run: of one body; of several draw `run.body(k)`.
        joints: names of joints or of groups of the character, one or several; None for all.
        path: PNG file to write; None to write none.

    Raises:
        UnknownNameError: no such joint or group.
        MissingExtraError: matplotlib is not installed.
    """
    reference = run.reference
    groups = _groups(reference.character, joints)
    title = f"{reference.name} with {run.controller}: {run.end} at {run.end_s:.2f} s, {run.end_reason}"
    figure, panels = _panels(title, len(groups) + 3)
    _draw(panels, reference, groups, "reference")
    _draw(panels, run.simulated_motion(), groups, "simulated")
    share = 100 * np.abs(run.torque) / run.torque_limit
    for colour, (group, chosen) in zip(LINES, groups.items()):
        label = group.replace("_", " ")
        panels[-1].plot(run.time[:-1], share[:, chosen].max(axis=1), color=colour, lw=0.7, label=label)
    panels[-1].set_title("largest servo torque [% of its limit]", fontsize=9, loc="left")
    panels[-1].set_ylim(0, 105)
    if run.end != DONE:
        for axes in panels:
            axes.axvline(run.end_s, color=COLOURS[3], lw=1.5)
            axes.axvspan(run.end_s, reference.duration, color="black", alpha=0.08, lw=0)
        where = panels[0].get_xaxis_transform()
        panels[0].text(run.end_s, 0.03, f" {run.end}", color=COLOURS[3], fontsize=8, transform=where)
    return _finish(figure, panels, reference, path)


def _groups(character: Character, joints: str | Sequence[str] | None) -> dict[str, IndexArray]:
    """Indices of the joints to draw, by their panel."""
    grouped = {name for names in character.groups.values() for name in names}
    groups = {**character.groups, "other joints": tuple(name for name in character.joints if name not in grouped)}
    wanted: set[str] = set(character.joints if joints is None else ())
    for name in (joints,) if isinstance(joints, str) else joints or ():
        if name not in character.groups and name not in character.joints:
            valid = (*character.groups, *character.joints)
            raise UnknownNameError(f"joint or group of joints of {character.name}", name, valid)
        wanted |= set(character.groups.get(name, (name,)))
    kept = {group: [name for name in names if name in wanted] for group, names in groups.items()}
    order = sorted(kept, key=lambda group: not group.startswith(SIDES))  # so that left and right stand side by side
    return {group: character.joint_indices(kept[group]) for group in order if kept[group]}


def _panels(title: str, count: int) -> tuple["Figure", list[Any]]:
    """Panels in two columns; the last is as wide as both if there is no other beside it."""
    rows = -(-count // 2)
    figure = new_figure(13.0, 1.9 * rows + 0.6)
    figure.suptitle(title, fontsize=11)
    grid = figure.add_gridspec(rows, 2)
    alone = count - 1 if count % 2 else None
    return figure, [figure.add_subplot(grid[k // 2, :] if k == alone else grid[k // 2, k % 2]) for k in range(count)]


def _draw(panels: Sequence[Any], motion: Motion, groups: Mapping[str, IndexArray], kind: str = "") -> None:
    """Height, contacts and angles in the first panels; faint for a `reference`."""
    faint = kind == "reference"
    style: dict[str, Any] = {"lw": 1.0, "ls": (0, (3, 2)), "alpha": 0.5} if faint else {"lw": 1.2}
    height, feet, *angles = panels
    height.plot(motion.times, motion.qpos[:, 2], color=COLOURS[0], label=kind or None, **style)
    height.set_title("height of the root [m]", fontsize=9, loc="left")
    for side, colour in enumerate(COLOURS[2:4]):
        bars = np.array(stances(motion.contacts[:, side])).reshape(-1, 2) / motion.fps  # from and to [s]
        bars[:, 1] -= bars[:, 0]
        low, high = (0.65, 0.80) if faint else (0.85, 1.25)
        feet.broken_barh(bars, (low - side, high - low), color=colour, alpha=0.5 if faint else 1.0)
    feet.set_yticks([1, 0], [f"{side} foot" for side in SIDES])
    feet.set_ylim(-0.5, 1.5)
    feet.set_title("contacts" + (", those of the reference pale" if kind else ""), fontsize=9, loc="left")
    for axes, (group, chosen) in zip(angles, groups.items()):
        for colour, joint in zip(LINES * len(chosen), chosen):
            name = motion.character.joints[joint].removeprefix(f"{group.split('_')[0]}_").replace("_", " ")
            degrees = np.degrees(motion.qpos[:, 7 + joint])
            axes.plot(motion.times, degrees, color=colour, label=None if faint else name, **style)
        axes.set_title(f"{group.replace('_', ' ')} [°]", fontsize=9, loc="left")


def _finish(figure: "Figure", panels: Sequence[Any], motion: Motion, path: str | Path | None) -> "Figure":
    for axes in panels:
        for frame in set(motion.events.values()):
            axes.axvline(frame / motion.fps, color="black", lw=0.8, ls=":")
        axes.set_xlim(0, max(motion.duration, 1 / motion.fps))
        axes.grid(alpha=0.3)
        axes.tick_params(labelsize=7)
        if axes.get_legend_handles_labels()[0]:
            axes.legend(fontsize=6.5, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    for frame in set(motion.events.values()):
        names = ", ".join(name.replace("_", " ") for name, at in motion.events.items() if at == frame)
        where = panels[0].get_xaxis_transform()
        panels[0].text(frame / motion.fps, 0.97, names, fontsize=7, rotation=90, ha="right", va="top", transform=where)
    for axes in panels[-2:]:
        axes.set_xlabel("time [s]", fontsize=8)
    if path is not None:
        save_figure(figure, path)
    return figure
