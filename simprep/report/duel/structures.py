"""The coupled motion transition graph as a picture: G1 and G2 as columns of labels (2008 paper, section 3.3)."""

from pathlib import Path
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IndexArray, IntArray
from simprep.duel.labels.labels import Label
from simprep.duel.model.structures import CoupledGraph
from simprep.duel.stream.stream import PLAYERS
from simprep.report.duel.label_text import COLOUR_OF, full_text, kind_of
from simprep.report.figures import COLOURS, new_figure, save_figure

COLUMN, TEXT = 1.0, 2.15
"""Distance of nodes and of their labels from the middle."""
CROSS_COLOURS = (COLOURS[5], COLOURS[1])


def plot_structures(graph: CoupledGraph, path: str | Path, nodes: int = 24, edges: int = 60, crosses: int = 24) -> Path:
    """Draw G1, G2 and the cross edges of a coupled graph; MissingExtraError without matplotlib.

    Every graph is complete; drawn are the labels with most actions, by kind, and the edges that the stream walks most
    often.

    Args:
        graph: what to draw.
        path: the PNG file.
        nodes: most labels of each player.
        edges: most edges of each of G1 and G2.
        crosses: most cross edges towards each player.
    """
    figure = new_figure(13.0, 2.2 + 0.33 * min(nodes, max(len(one) for one in graph.graphs)))
    axes = figure.add_subplot()
    shown, places = [], []
    for player, one in enumerate(graph.graphs):
        sizes = np.bincount(one.node[one.node >= 0], minlength=len(one))
        frequent = np.argsort(-sizes, kind="stable")[:nodes]
        kept = np.array(sorted(frequent, key=lambda node: _order(int(one.labels[node]))), dtype=np.intp)
        shown.append(kept)
        places.append(np.stack([np.full(len(kept), (2 * player - 1) * COLUMN), np.linspace(1, -1, len(kept))], axis=1))
        _draw_edges(axes, one.counts[np.ix_(kept, kept)], places[-1], places[-1], edges, COLOURS[0])
    for player in (0, 1):
        counts = graph.cross_counts[player][np.ix_(shown[1 - player], shown[player])]
        _draw_edges(axes, counts, places[1 - player], places[player], crosses, CROSS_COLOURS[player])
    for player, one in enumerate(graph.graphs):
        _draw_nodes(axes, graph, player, shown[player], places[player])
        actions = int(np.sum(one.node >= 0))
        title = f"G{player + 1}: {PLAYERS[player]}"
        text = f"{len(one)} labels, {actions} actions, {int(one.counts.sum())} transitions; drawn: the {len(shown[player])} most frequent"
        side = 2 * player - 1
        axes.text(side * COLUMN, 1.13, title, ha="center", fontsize=11, fontweight="bold")
        axes.text(side * COLUMN, 1.08, text, ha="center", fontsize=7)
    _legend(axes)
    axes.set_xlim(-TEXT - 0.9, TEXT + 0.9)
    axes.set_ylim(-1.22, 1.18)
    axes.axis("off")
    return save_figure(figure, path)


def _order(code: int) -> tuple[int, str]:
    label = Label.from_code(code)
    return list(COLOUR_OF).index(kind_of(label)), full_text(label)


def _draw_edges(axes: Any, counts: IntArray, source: FloatArray, target: FloatArray, most: int, colour: str) -> None:
    """The most frequent edges: arcs within a column, straight between columns."""
    order = np.argsort(-counts, axis=None, kind="stable")[:most]
    strongest = max(1, int(counts.max(initial=0)))
    for flat in order[::-1]:
        row, column = np.unravel_index(int(flat), counts.shape)
        number = int(counts[row, column])
        if not number:
            continue
        strength = number / strongest
        start, end = source[row], target[column]
        within = start[0] == end[0]
        if within and row == column:  # a label that follows itself
            look = {"mfc": "none", "mec": colour, "mew": 0.5 + 2 * strength, "alpha": 0.3 + 0.6 * strength}
            axes.plot(start[0] * 1.05, start[1], "o", ms=9, **look)
            continue
        bend = 0.32 * np.sign(start[0]) * np.sign(end[1] - start[1]) if within else 0.03
        axes.annotate(
            "", end, start, zorder=2, arrowprops={
                "arrowstyle": "-|>,head_length=0.35,head_width=0.16", "color": colour, "lw": 0.4 + 2.6 * strength,
                "alpha": 0.25 + 0.6 * strength, "shrinkA": 6, "shrinkB": 8, "connectionstyle": f"arc3,rad={bend}",
            },
        )  # fmt: skip


def _draw_nodes(axes: Any, graph: CoupledGraph, player: int, shown: IndexArray, places: FloatArray) -> None:
    one = graph.graphs[player]
    sizes = np.array([len(one.members(int(node))) for node in shown])
    side = 2 * player - 1
    for node, size, place in zip(shown, sizes, places):
        label = Label.from_code(int(one.labels[node]))
        colour = COLOUR_OF[kind_of(label)]
        axes.scatter(*place, s=25 + 200 * size / sizes.max(), color=colour, edgecolor="black", lw=0.6, zorder=5)
        where = (side * TEXT, place[1])
        axes.text(*where, f"{full_text(label)}  ({size})", fontsize=7.5, ha="left" if player else "right", va="center")
        axes.plot([place[0], where[0]], [place[1]] * 2, ":", color=COLOURS[0], lw=0.5, alpha=0.5, zorder=1)


def _legend(axes: Any) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], ls="", marker="o", color=colour, mec="black", label=kind) for kind, colour in COLOUR_OF.items()
    ]
    handles += [
        Line2D([], [], color=COLOURS[0], lw=2, label="edge: next action"),
        Line2D([], [], color=CROSS_COLOURS[0], lw=2, label="cross edge: what B does, what A begins then"),
        Line2D([], [], color=CROSS_COLOURS[1], lw=2, label="cross edge: what A does, what B begins then"),
    ]
    note = "label: limbs | attack reacted to | first and last foot (actions); wider: walked more often"
    axes.legend(handles=handles, fontsize=8, loc="lower center", ncols=5, frameon=False, title=note, title_fontsize=8)
