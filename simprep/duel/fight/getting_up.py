"""How a fighter who has fallen gets up: rolls over to prone where needed, then by the built-in motion `get_up_prone`."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.library import library_motion
from simprep.motion.curves import minimum_jerk
from simprep.motion.edit import move
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import rotation_matrix
from simprep.motion.turns import turned

FACING = 0.6
"""Who lies with the chest's front so far down (up), as the vertical part of its direction, is prone (supine)."""
SETTLE_S, ROLL_S = 1.2, 1.0
"""Time in which arms and legs come to where getting up begins, and further time for half a turn about the long axis [s]."""
ROLL_M = 0.15
"""Height of the long axis above the floor in a roll: rolled without slipping, the body moves by this times the angle [m]."""
EITHER_RAD = 2.0
"""Who has to turn by more than this may as well roll the other way [rad]."""
LIE_S = 0.8
"""Time to come to rest after a roll [s]."""
PRONE, SUPINE, SIDE = "prone", "supine", "side"


def lying(qpos: FloatArray, character: Character) -> str:
    """How a body (nq,) lies: `prone`, `supine` or on its `side`."""
    thorax = forward_kinematics(qpos[None], character).xquat[0, character.segment("thorax")]
    front = float(rotation_matrix(thorax)[2, 0])
    return PRONE if front < -FACING else SUPINE if front > FACING else SIDE


def held(qpos: FloatArray, fps: float, character: Character, seconds: float) -> Motion:
    """A motion that keeps a pose (nq,)."""
    frames = max(2, round(seconds * fps) + 1)
    contacts = np.zeros((frames, 2), dtype=bool)
    return Motion(np.repeat(qpos[None], frames, axis=0), fps, contacts, name="lies", character=character)


def way_up(qpos: FloatArray, character: Character) -> Motion | None:
    """From a pose (nq,) that lies face down to standing, where the body lies; None for a body of which no way up is known."""
    return _way(qpos, character, True)


def roll_over(qpos: FloatArray, character: Character, others: FloatArray | None = None) -> Motion | None:
    """From any pose (nq,) that lies to lying face down; None for a body of which no way up is known.

    The body rolls about its long axis the short way, without slipping, while arms and legs come to where getting up begins.
    Who lies on the back rolls away from where others are on the floor (2,), if that is given [m].
    """
    return _way(qpos, character, False, others)


def _way(qpos: FloatArray, character: Character, up: bool, others: FloatArray | None = None) -> Motion | None:
    known = library_motion("get_up_prone")
    if known.character != character:
        return None
    along = _direction(qpos, character)
    turn = along - _direction(known.qpos[0], character)
    placed = move(known, turn=turn)
    axis = np.array([np.cos(along), np.sin(along), 0.0])
    now, first = (Rotation.from_quat(one[3:7], scalar_first=True) for one in (qpos, placed.qpos[0]))
    angle = _roll(now.apply([1.0, 0.0, 0.0]), axis)
    aside = np.cross(axis, [0.0, 0.0, 1.0])[:2]  # where a turn by a positive angle leads
    if others is not None and abs(angle) > EITHER_RAD and angle * float(aside @ (qpos[:2] - others)) < 0:
        angle -= 2 * np.pi * float(np.sign(angle))
    rest = (first * (Rotation.from_rotvec(angle * axis) * now).inv()).as_rotvec()
    there = qpos[:2] + ROLL_M * angle * aside
    placed = move(placed, tuple(there - turned(known.qpos[0, :2], turn)))
    seconds = SETTLE_S + ROLL_S * abs(angle) / np.pi
    share = minimum_jerk(np.arange(round(seconds * placed.fps)) / (seconds * placed.fps))[:, None]
    lead = qpos + share * (placed.qpos[0] - qpos)
    rolled = Rotation.from_rotvec(share * rest) * Rotation.from_rotvec(share * angle * axis) * now
    lead[:, 3:7] = rolled.as_quat(scalar_first=True)
    after = placed.qpos if up else np.repeat(placed.qpos[:1], round(LIE_S * placed.fps), axis=0)
    contacts = placed.contacts if up else np.zeros((len(after), 2), dtype=bool)
    return replace(
        placed,
        qpos=np.concatenate([lead, after]),
        contacts=np.concatenate([np.zeros((len(lead), 2), dtype=bool), contacts]),
        name=placed.name if up else "roll_over",
        events={},
    )


def _roll(front: FloatArray, axis: FloatArray) -> float:
    """By how much a body turns about its long axis (3,) for its front (3,) to be down, the short way [rad]."""
    across = np.cross(axis, [0.0, 0.0, -1.0])  # where down goes in a quarter of a turn
    return -float(np.arctan2(front @ across, -front[2]))


def _direction(qpos: FloatArray, character: Character) -> float:
    """Direction on the floor from pelvis to thorax of a pose (nq,) [rad]."""
    found = forward_kinematics(qpos[None], character).xpos[0]
    x, y = (found[character.segment("thorax")] - found[character.segment("pelvis")])[:2]
    return float(np.arctan2(y, x))
