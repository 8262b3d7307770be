"""The motion graph as a picture: core nodes in the middle, targets around them (2013 paper, Fig. 3)."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from simprep.controller.graph import MotionGraph
from simprep.report.figures import COLOURS, new_figure, save_figure

_PALETTE = (*COLOURS, "#1b9e9e", "#d1659b", "#7f6a3f")


def plot_graph(graph: MotionGraph, path: str | Path, families: Mapping[str, str] | None = None) -> Path:
    """Draw a motion graph; nearer transitions are darker. MissingExtraError without matplotlib.

    Args:
        graph: what to draw.
        path: the PNG file.
        families: family of each target by name; they are grouped and coloured by it.
    """
    families = families or {}
    order = sorted(graph.targets, key=lambda name: families.get(name, ""))
    groups = list(dict.fromkeys(families.get(name, "") for name in order))
    colour = {group: _PALETTE[index % len(_PALETTE)] for index, group in enumerate(groups)}
    figure = new_figure(10.0, 10.0)
    axes = figure.add_subplot()
    corner = 2 * np.pi * np.arange(len(graph.core)) / max(len(graph.core), 1) + np.pi / 4
    place = {name: 0.30 * np.array([np.cos(a), np.sin(a)]) for name, a in zip(graph.core, corner)}
    around = 2 * np.pi * np.arange(len(order)) / max(len(order), 1)
    place |= {name: np.array([np.cos(a), np.sin(a)]) for name, a in zip(order, around)}
    nearest: dict[tuple[str, str], float] = {}
    for transition in graph.transitions:
        if transition.kind != "prepared":
            pair = (transition.source, transition.target)
            nearest[pair] = min(nearest.get(pair, np.inf), transition.distance)
    limit = graph.settings.threshold
    core = set(graph.core)
    for (source, target), distance in sorted(nearest.items(), key=lambda item: -item[1]):
        a, b = place[source], place[target]
        strength = 0.2 + 0.7 * (1 - distance / limit)
        inner = source in core and target in core
        axes.annotate(
            "", b, a, zorder=4 if inner else 2, arrowprops={
                "arrowstyle": "->" if inner else "-", "alpha": strength, "lw": 1.6 if inner else 0.8, "shrinkA": 14, "shrinkB": 8,
                "color": "black" if inner else colour[families.get(target if source in core else source, "")],
                "connectionstyle": f"arc3,rad={0.18 if inner else 0.04}",
            },
        )  # fmt: skip
    for name, angle in zip(order, around):
        spot = place[name]
        shade = colour[families.get(name, "")]
        axes.plot(*spot, "o", color=shade, ms=6)
        flip = np.cos(angle) < 0
        axes.text(
            *(1.03 * spot), name, fontsize=7, color=shade, rotation=np.degrees(angle) + (180 if flip else 0),
            rotation_mode="anchor", ha="right" if flip else "left", va="center",
        )  # fmt: skip
    for name in graph.core:
        box = {"boxstyle": "round,pad=0.4", "fc": "white", "ec": "black"}
        axes.text(*place[name], name, ha="center", va="center", fontsize=10, bbox=box, zorder=5)
    for group in groups:
        axes.plot([], [], "o", color=colour[group], label=group or "target")
    axes.legend(loc="lower left", fontsize=8, title="family of the target", title_fontsize=8)
    lines = (
        f"{len(graph.core)} core nodes, {len(graph.targets)} targets, {len(graph.transitions)} transitions; "
        f"darker: nearer, up to {limit:g} m"
    )
    axes.set_title(lines, fontsize=10, y=0.97)
    axes.set_xlim(-1.35, 1.35)
    axes.set_ylim(-1.35, 1.35)
    axes.set_aspect("equal")
    axes.axis("off")
    return save_figure(figure, path)
