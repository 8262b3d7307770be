"""The time line of a fight: who does what when, root distance, contacts, falls. Needs matplotlib (extra `report`)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.fight.fight import NONE, Fight
from simprep.duel.fight.hits import JudgedContact
from simprep.duel.labels.labels import Label
from simprep.duel.stream.stream import root_distance
from simprep.errors import SettingError
from simprep.report.duel.label_text import COLOUR_OF, PALE, kind_of, short_text
from simprep.report.figures import COLOURS, new_figure, save_figure

INTENDED, UNINTENDED, REQUESTED = "#c2452d", "#5b616b", "#7a4fa3"
LETTER_S = 0.055
"""Width of a letter, about, in a row of 15 s [s]."""
LONGEST_S = 300.0


def fight_timeline(
    fight: Fight,
    path: str | Path,
    contacts: Sequence[JudgedContact] = (),
    falls: Sequence[tuple[float, int]] = (),
    row_s: float = 15.0,
) -> Path:
    """Draw a fight row by row: the actions of the fighters as bars, and below them root distance, contacts and falls.

    Args:
        fight: what to draw; readable up to about a minute.
        path: the PNG file.
        contacts: between the fighters; larger marks for larger impulses.
        falls: (time [s], player) of each; what comes after the first is shaded.
        row_s: length of a row [s]; a fight that fits into one fills it.

    Raises:
        SettingError: a fight of more than 5 minutes, or rows that are too short.
        MissingExtraError: matplotlib is not installed.
    """
    stream = fight.stream
    seconds = (len(stream) - 1) / stream.fps
    if seconds > LONGEST_S:
        raise SettingError(f"a time line of {seconds:.0f} s; valid: up to {LONGEST_S:g} s (cut the fight first)")
    if not 1 <= row_s <= 60:
        raise SettingError(f"rows of {row_s} s; valid: 1 to 60")
    count = max(1, int(np.ceil(seconds / row_s - 1e-6)))
    row_s = max(seconds, 1.0) if count == 1 else row_s
    over = min((time for time, _ in falls), default=np.inf)
    people = len(stream.players)
    figure = new_figure(14.0, (1.2 + 0.65 * people) * count + 0.9)
    figure.suptitle(f"{stream.name}: {fight.mode}, {seconds:.1f} s, seed {fight.seed}", fontsize=11)
    grid = figure.add_gridspec(2 * count, 1, height_ratios=[0.5 * people, 0.9] * count)
    distance = root_distance(stream)
    for row in range(count):
        span = (row * row_s, (row + 1) * row_s)
        above = figure.add_subplot(grid[2 * row])
        _draw_actions(above, fight, span)
        below = figure.add_subplot(grid[2 * row + 1], sharex=above)
        _draw_distance(below, distance, stream.fps, span)
        _draw_contacts(below, contacts, [(time, stream.names[player]) for time, player in falls], span)
        above.tick_params(labelbottom=False)
        above.set_xlim(span)
        for axes in (above, below):
            if over < span[1]:  # what was planned and never happened
                axes.axvspan(max(over, span[0]), span[1], color="black", alpha=0.10, lw=0)
            axes.tick_params(labelsize=7)
            axes.spines[["top", "right"]].set_visible(False)
    below.set_xlabel("time [s]", fontsize=8)
    _legend(figure, contacts, any(one.request for one in fight.actions))
    return save_figure(figure, path)


def _draw_actions(axes: Any, fight: Fight, span: tuple[float, float]) -> None:
    fps, names = fight.stream.fps, fight.stream.names
    letter = LETTER_S * (span[1] - span[0]) / 15.0
    for one in fight.actions:
        start, end = one.start / fps, one.end / fps
        shown = (max(start, span[0]), min(end, span[1]))
        if shown[1] <= shown[0]:
            continue
        label, height = Label.from_code(one.label), len(names) - 1 - one.player
        kind = kind_of(label)
        solid = label.attacks or kind == "neutral" or label.jump == "up"
        axes.barh(
            height, shown[1] - shown[0], left=shown[0], height=0.62, color=COLOUR_OF[kind], alpha=1.0 if solid else PALE,
            edgecolor="white", lw=0.8,
        )  # fmt: skip
        text = short_text(label).replace(", ", "\n")
        if text and shown[1] - shown[0] > letter * max(len(line) for line in text.split("\n")):
            bright = label.attacks and kind != "left punch"
            axes.text(
                sum(shown) / 2, height, text, ha="center", va="center", fontsize=6, color="white" if bright else "black"
            )
        if one.moment != NONE and span[0] <= one.moment / fps < span[1]:
            axes.plot(one.moment / fps, height - 0.36, "^", color="black", ms=3, clip_on=False)
        if one.request and span[0] <= start < span[1]:
            axes.plot(start, height + 0.42, "v", color=REQUESTED, ms=5, clip_on=False)
            axes.text(start + 1.5 * letter, height + 0.42, one.request, fontsize=6, color=REQUESTED, va="center")
    axes.set_yticks(range(len(names))[::-1], names, fontsize=9)
    axes.set_ylim(-0.5, len(names) - 0.4)


def _draw_distance(axes: Any, distance: FloatArray, fps: float, span: tuple[float, float]) -> None:
    time = np.arange(len(distance)) / fps
    inside = (time >= span[0] - 1 / fps) & (time <= span[1] + 1 / fps)
    axes.plot(time[inside], distance[inside], color=COLOURS[0], lw=1.2)
    axes.set_ylim(0, max(2.0, 1.05 * float(distance.max())))
    axes.set_ylabel("distance [m]", fontsize=7)
    axes.grid(axis="y", alpha=0.3)


def _draw_contacts(
    axes: Any, contacts: Sequence[JudgedContact], falls: Sequence[tuple[float, str]], span: tuple[float, float]
) -> None:
    level = 0.3 * axes.get_ylim()[1]
    for contact in contacts:
        if span[0] <= contact.start_s < span[1]:
            axes.scatter(
                contact.start_s, level, s=_size(contact.impulse_ns), color=INTENDED if contact.intended else UNINTENDED,
                alpha=0.75, lw=0.5, edgecolor="white", zorder=4,
            )  # fmt: skip
    for time, name in falls:
        if span[0] <= time <= span[1]:
            axes.axvline(time, color="black", lw=1.5)
            axes.text(time, 0.97 * axes.get_ylim()[1], f" {name} falls", fontsize=7, va="top", fontweight="bold")


def _size(impulse: float) -> float:
    """Area of a mark [points^2]."""
    return 12.0 + 8.0 * min(impulse, 40.0)


def _legend(figure: Any, contacts: Sequence[JudgedContact], requests: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    def mark(shape: str, colour: str, label: str, size: float = 5) -> Any:
        return Line2D([], [], ls="", marker=shape, color=colour, ms=size, label=label)

    handles: list[Any] = [Patch(color=colour, label=kind) for kind, colour in COLOUR_OF.items()]
    handles.append(Patch(color=COLOUR_OF["right kick"], alpha=PALE, label="on the way back"))
    handles.append(mark("^", "black", "interaction moment", 4))
    handles.append(Line2D([], [], color=COLOURS[0], lw=1.2, label="root distance"))
    if contacts:
        handles += [
            mark("o", INTENDED, "contact meant (10 N s)", float(np.sqrt(_size(10)))),
            mark("o", UNINTENDED, "not meant (1 N s)", float(np.sqrt(_size(1)))),
        ]
    if requests:
        handles.append(mark("v", REQUESTED, "request"))
    figure.legend(handles=handles, fontsize=7, loc="outside lower center", ncols=8, frameon=False)
