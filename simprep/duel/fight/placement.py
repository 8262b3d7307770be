"""Where the next action takes place: it begins at the present root, then drifts half way to its original placement.

Source: the 2008 paper, section 5.1.2. On the floor only, as positions (x, y) and headings; heights and tilts stay.
"""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.fight.floor_move import PEAK_ACCELERATION
from simprep.duel.model.action_features import FloorFrame
from simprep.motion.curves import minimum_jerk
from simprep.motion.rotations import multiply_quat, wrap_angle
from simprep.motion.turns import about_vertical, turned

HALF_WAY = 0.5
"""How much of the way to the original placement an action drifts."""


@dataclass(frozen=True)
class Placement:
    """An action on the floor of the fight.

    Attributes:
        position: (F, 2) root [m].
        turn: (F,) by how much each frame is turned about the vertical against the recording [rad].
    """

    position: FloatArray
    turn: FloatArray

    def poses(self, qpos: FloatArray) -> FloatArray:
        """The recorded poses (F, nq) there."""
        out = qpos.copy()
        out[:, :2] = self.position
        out[:, 3:7] = multiply_quat(about_vertical(self.turn), qpos[:, 3:7])
        return out


@dataclass(frozen=True)
class Aim:
    """A wished position (2,) on the floor [m], and the number of frames after the first one in which to reach it."""

    position: FloatArray
    frames: int


def place(
    root: FloatArray,
    heading: float,
    example_frame: FloorFrame,
    position: FloatArray,
    facing: float,
    frame: FloorFrame,
    length: int,
    aim: Aim | None = None,
    longest: float = np.inf,
    most: float = np.inf,
) -> Placement:
    """Place all F frames of an action: its first where the fighter is, its last half way to the original placement.

    The original placement has the same place in the reference frame of this moment as the example had in its own.

    Args:
        root: (F, 2) root of the example on its floor [m]; frames beyond `length` - 1 follow without further drift.
        heading: of the example's first frame [rad].
        example_frame: reference frame in which the example began.
        position: (2,) of the fighter now [m].
        facing: heading of the fighter now [rad].
        frame: reference frame of this moment.
        length: number of frames of the action.
        aim: a wished position, to which it drifts instead.
        longest: longest drift to a wished position [m].
        most: largest acceleration of any drift [m per frame^2]; it gets shorter.
    """
    here = facing - heading
    there = float(frame.toward - example_frame.toward)
    met = position + turned(root - root[0], here)
    share = minimum_jerk(np.arange(len(root)) / max(length - 1, 1))
    if aim is None:
        back = HALF_WAY * (frame.world_point(example_frame.point(root)) - met)
        farthest = most * max(length - 1, 1) ** 2 / PEAK_ACCELERATION
        back *= min(1.0, farthest / max(float(np.linalg.norm(back[length - 1])), 1e-9))
        placed = met + share[:, None] * back
    else:
        last = min(max(aim.frames, 1), length - 1)
        way = (aim.position - met[last]) * (last / max(aim.frames, 1))
        longest = min(longest, most * max(last, 1) ** 2 / PEAK_ACCELERATION)
        way *= min(1.0, longest / max(float(np.linalg.norm(way)), 1e-9))
        placed = met + minimum_jerk(np.arange(len(root)) / max(last, 1))[:, None] * way
    correction = wrap_angle(there - here)
    return Placement(placed, here + HALF_WAY * share * correction)
