"""Which frames of a fight a film strip shows: those at which a fist or foot is out."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from simprep.duel.fight.fight import Fight
from simprep.duel.labels.labels import Label
from simprep.errors import SettingError
from simprep.report.duel.label_text import short_text


def strip_frames(fight: Fight, count: int) -> tuple[int, ...]:
    """`count` rising frames spread over a fight, or all frames of a shorter one.

    The fight is divided into equal parts. Each shows the attack nearest to its middle, where the limb is out farthest:
    at the end of the attack, or in the middle of one that is out and back. A part without attacks shows its middle.

    Args:
        fight: what to show.
        count: number of pictures.

    Raises:
        SettingError: no pictures wanted.
    """
    if count < 1:
        raise SettingError(f"{count} pictures; valid: at least 1")
    frames = len(fight.stream)
    if count >= frames:
        return tuple(range(frames))
    out = np.array(
        sorted(
            {_farthest(one.start, one.end, one.label) for one in fight.actions if Label.from_code(one.label).attacks}
        )
    )
    edges = np.linspace(0, frames, count + 1).astype(int)
    chosen = []
    for first, after in pairwise(edges):
        middle = (first + after) // 2
        near = out[(out >= first) & (out < after)]
        chosen.append(int(near[np.argmin(np.abs(near - middle))]) if len(near) else int(middle))
    return tuple(chosen)


def strip_captions(fight: Fight, frames: Sequence[int]) -> tuple[str, ...]:
    """What the fighters do in some frames: `A: RK up, B: neutral`."""
    out = []
    for frame in frames:
        # a limb is out farthest in the frame in which the next action begins: that of its attack is meant
        words = []
        for player, name in enumerate(fight.stream.names):
            own = [one for one in fight.of(player) if one.start < frame or one.start == 0]
            words.append(f"{name}: {short_text(Label.from_code(own[-1].label)) or 'neutral'}")
        out.append(", ".join(words))
    return tuple(out)


def _farthest(start: int, end: int, code: int) -> int:
    label = Label.from_code(code)
    quick = "fwdbwd" in (label.left_punch, label.right_punch)
    return (start + end) // 2 if quick else end - 1
