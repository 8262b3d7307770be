"""Plots of the validation study as PNG, written atomically; MissingExtraError without matplotlib (extra `report`)."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import median_filter

from simprep.arrays import BoolArray, FloatArray
from simprep.errors import MissingExtraError
from simprep.files import atomic_path
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.support import polygons, signed_distance, support_centre, support_points

COLOURS = ("#5b616b", "#b8860b", "#2f6fb3", "#c2452d", "#3a8a4d", "#7a4fa3")
BODY_COLOURS = dict(zip(("blue", "red", "green", "violet"), COLOURS[2:]))
"""Names and colours of bodies that are shown together, in turn (`body_colour`)."""
DPI = 110
DEBOUNCE_S = 0.05

Series = tuple[FloatArray, FloatArray]


def body_colour(number: int) -> tuple[str, str]:
    """Name and colour (`#rrggbb`) of a body shown beside others, counted from 0."""
    return list(BODY_COLOURS.items())[number % len(BODY_COLOURS)]


def plot_com_and_support(motions: Mapping[str, Motion], frames: Sequence[int], path: str | Path, title: str) -> Path:
    """COM projection against the support polygon and its centre, seen from above (Fig. 7 and 8 of the 2013 paper).

    Args:
        motions: label to motion; one row of panels each. Their frames must belong to the same instants.
        frames: one column of panels each; all within every motion.
        path: the PNG file.
        title: heading of the figure.
    """
    figure = new_figure(2.3 * len(frames) + 0.6, 2.5 * len(motions) + 0.5)
    figure.suptitle(title, fontsize=11)
    for row, (label, motion) in enumerate(motions.items()):
        kinematics = forward_kinematics(motion.qpos[list(frames)], motion.character)
        contacts = motion.contacts[list(frames)]
        for column, frame in enumerate(frames):
            axes = figure.add_subplot(len(motions), len(frames), row * len(frames) + column + 1)
            _draw_support(axes, kinematics, contacts, column)
            axes.set_title(f"{frame / motion.fps:.2f} s", fontsize=8)
            if column == 0:
                axes.set_ylabel(f"{label}\ny [m]", fontsize=8)
            if row == len(motions) - 1:
                axes.set_xlabel("x [m]", fontsize=8)
            if row == column == 0:
                axes.legend(fontsize=6, loc="upper left", framealpha=0.7)
    return save_figure(figure, path)


def support_margin(motion: Motion) -> Series:
    """Times [s] and signed distances [m] (T,) of the COM projection to the support polygon's edge, positive inside.

    Contacts pass a median filter of 50 ms, since a simulated foot chatters while it takes up load. NaN in flight.
    """
    kinematics = forward_kinematics(motion.qpos, motion.character)
    width = 2 * round(motion.fps * DEBOUNCE_S / 2) + 1
    contacts = median_filter(motion.contacts.astype(np.uint8), size=(width, 1), mode="nearest").astype(bool)
    points, mask = support_points(kinematics.foot_points, contacts)
    return motion.times, signed_distance(points, mask, kinematics.com[:, :2])


def plot_margins(
    panels: Mapping[str, Mapping[str, Series]], path: str | Path, title: str, launch_s: float | None = None
) -> Path:
    """Balance margin over time, one panel per kind of motion, one line per arm.

    Args:
        panels: panel title to (label to (time [s], margin [m])).
        path: the PNG file.
        title: heading of the figure.
        launch_s: instant marked by a vertical line [s].
    """
    figure = new_figure(8.5, 2.1 * len(panels) + 0.9)
    figure.suptitle(title, fontsize=11)
    longest = max(float(time[-1]) for lines in panels.values() for time, _ in lines.values())
    for index, (name, lines) in enumerate(panels.items()):
        axes = figure.add_subplot(len(panels), 1, index + 1)
        for colour, (label, (time, margin)) in zip(COLOURS, lines.items()):
            axes.plot(time, 100 * margin, color=colour, lw=1.1, label=label)
            axes.plot(time[-1], 100 * margin[-1], "x" if time[-1] < longest - 0.1 else "", color=colour)
        axes.axhline(0, color="black", lw=0.6)
        if launch_s is not None:
            axes.axvline(launch_s, color="black", lw=0.8, ls=":")
            axes.text(launch_s, 1.0, " launch", fontsize=7, va="top", transform=axes.get_xaxis_transform())
        axes.set_xlim(0, longest)
        axes.set_ylim(*_robust_limits([100 * margin for _, margin in lines.values()]))
        axes.set_title(name, fontsize=9, loc="left")
        axes.set_ylabel("COM to edge [cm]\n(inside > 0)", fontsize=8)
        axes.tick_params(labelsize=7)
        if index == 0:
            handles, labels = axes.get_legend_handles_labels()
            figure.legend(handles, labels, fontsize=7, loc="outside lower center", ncols=len(lines))
    axes.set_xlabel("time [s]", fontsize=8)
    return save_figure(figure, path)


def plot_blending_curves(
    curves: Mapping[str, Callable[[FloatArray, float], FloatArray]], constants: Mapping[str, float], path: str | Path
) -> Path:
    """Blending weight against level of preparation (Fig. 5 of the 2013 paper).

    Args:
        curves: name to function of (alpha, C).
        constants: name of a body part to its constant C; one panel each.
        path: the PNG file.
    """
    figure = new_figure(3.3 * len(constants), 3.2)
    alpha = np.linspace(0, 1, 201)
    for index, (part, constant) in enumerate(constants.items()):
        axes = figure.add_subplot(1, len(constants), index + 1)
        for (name, curve), style, colour in zip(curves.items(), ("-", "--", ":"), COLOURS[2:]):
            axes.plot(alpha, curve(alpha, constant), style, color=colour, label=name)
        axes.set_title(f"{part}, C = {constant:g}", fontsize=9)
        axes.set_xlabel("level of preparation α", fontsize=8)
        axes.set_ylabel("blending weight", fontsize=8)
        axes.set_aspect("equal")
        axes.grid(alpha=0.3)
        axes.tick_params(labelsize=7)
    axes.legend(fontsize=7, loc="upper left")
    return save_figure(figure, path)


def _draw_support(axes: Any, kinematics: Kinematics, contacts: BoolArray, index: int) -> None:
    points, mask = support_points(kinematics.foot_points[index : index + 1], contacts[index : index + 1])
    com = kinematics.com[index, :2]
    middle = points[0].mean(axis=0)
    soles = kinematics.foot_points[index, ..., :2]
    outlines = polygons(soles, np.ones(soles.shape[:2], dtype=bool))
    for outline, stands, colour in zip(outlines, contacts[index], ("#2f6fb3", "#c2452d")):
        sole = (outline - middle).T
        axes.fill(*sole, facecolor=colour if stands else "none", edgecolor=colour, alpha=0.45, lw=0.8)
    corners = polygons(points, mask)[0] - middle
    if len(corners):
        axes.fill(*corners.T, facecolor="#9aa3ad", edgecolor="#5b616b", alpha=0.3, label="support polygon")
        centre = support_centre(points, mask)[0]
        axes.plot(*np.stack([com, centre]).T - middle[:, None], color="black", lw=0.7)
        axes.plot(*(centre - middle), "+", color="black", ms=8, label="centre of support")
    axes.plot(*(com - middle), "o", color="#111111", ms=4, label="COM")
    axes.set_aspect("equal")
    axes.set_xlim(-0.55, 0.55)
    axes.set_ylim(-0.45, 0.45)
    axes.tick_params(labelsize=6)


def _robust_limits(values: list[FloatArray]) -> tuple[float, float]:
    """Limits that a body lying metres from its feet does not stretch."""
    known = np.concatenate([value[np.isfinite(value)] for value in values])
    if not len(known):
        return -1.0, 1.0
    low, high = np.quantile(known, [0.01, 0.995])
    return max(float(low), -45.0) - 2.0, float(high) + 2.0


def new_figure(width: float, height: float) -> Any:
    """An empty matplotlib figure with an image canvas, width and height in inches."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtraError("plotting", "report") from None
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save_figure(figure: Any, path: str | Path) -> Path:
    """Write a figure as PNG, atomically."""
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=DPI, format="png")
    return Path(path)
