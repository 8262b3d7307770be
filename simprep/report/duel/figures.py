"""Plots of two-person streams; MissingExtraError without matplotlib (extra `report`)."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.labels.segmentation import Cuts
from simprep.duel.stream.stream import PLAYERS, DuelStream
from simprep.errors import SettingError
from simprep.report.figures import COLOURS, new_figure, save_figure


def plot_cuts(
    stream: DuelStream,
    force: tuple[FloatArray, FloatArray],
    cuts: Cuts,
    path: str | Path,
    first: int = 0,
    after: int | None = None,
) -> Path:
    """Contact force of both players with the cuts (Fig. 2 and 3 of the 2008 paper), and the height of the lower legs.

    Args:
        stream: two people.
        force: contact force (T,) of each, in body weights.
        cuts: where actions begin.
        path: the PNG file.
        first: first frame shown.
        after: frame after the last one shown; None: 12 s later.

    Raises:
        SettingError: no frames to show.
    """
    from simprep.motion.kinematics import forward_kinematics

    after = min(len(stream), first + round(12 * stream.fps)) if after is None else after
    if not 0 <= first < after <= len(stream):
        raise SettingError(f"frames {first} to {after}; valid: 0 <= first < after <= {len(stream)}")
    figure = new_figure(11.0, 5.0)
    figure.suptitle(f"Contact force and cuts: {stream.name}", fontsize=11)
    seconds = np.arange(first, after) / stream.fps
    for number, player in enumerate(PLAYERS):
        axes = figure.add_subplot(2, 1, number + 1)
        axes.plot(seconds, force[number][first:after], color=COLOURS[0], lw=1.2, label="contact force")
        frames = cuts.frames[number]
        frames = frames[(frames >= first) & (frames < after)]
        axes.vlines(frames / stream.fps, 0, 1, COLOURS[3], lw=0.8, transform=axes.get_xaxis_transform(), label="cuts")
        axes.plot(frames / stream.fps, force[number][frames], "v", color=COLOURS[3], ms=4)
        for seam in stream.seams:
            if first < seam < after:
                axes.axvline(seam / stream.fps, color="black", lw=1.5)
        motion = stream.players[number]
        feet = forward_kinematics(motion.qpos[first:after], motion.character).xpos[:, motion.character.feet, 2]
        right = axes.twinx()
        for side, height, colour in zip(("left", "right"), feet.T, COLOURS[1:]):
            right.plot(seconds, height, ":", color=colour, lw=1, label=f"{side} ankle")
        right.set_ylabel("ankle height [m]", fontsize=8)
        axes.set_ylabel(f"{player}: force [body weights]", fontsize=8)
        axes.set_xlim(seconds[0], seconds[-1] + 1 / stream.fps)
        for each in (axes, right):
            each.tick_params(labelsize=7)
        if number == 0:
            axes.legend(fontsize=7, loc="upper left")
            right.legend(fontsize=7, loc="upper right")
    axes.set_xlabel("time [s]", fontsize=8)
    return save_figure(figure, path)


def plot_components(curve: Sequence[Mapping[str, float]], path: str | Path) -> Path:
    """Log density by number of principal components (Fig. 11 of the 2008 paper), and its gain over one Gaussian.

    Args:
        curve: from `simprep.duel.model.evaluation.components_curve`.
        path: the PNG file.
    """
    figure = new_figure(9.0, 3.6)
    numbers = [one["components"] for one in curve]
    panels = (("", "mean log density [nats]"), ("_gain", "gain over one Gaussian for all labels [nats]"))
    for place, (suffix, title) in enumerate(panels):
        axes = figure.add_subplot(1, 2, place + 1)
        for part, label, colour in (("train", "training", COLOURS[0]), ("held_out", "held out", COLOURS[3])):
            axes.plot(numbers, [one[part + suffix] for one in curve], "o-", color=colour, ms=4, label=label)
        axes.set_xlabel("principal components of the pose", fontsize=8)
        axes.set_title(title, fontsize=9)
        axes.tick_params(labelsize=7)
        axes.legend(fontsize=7)
    return save_figure(figure, path)
