"""How a fighter who has fallen gets up: from lying face down by the built-in motion `get_up_prone`."""

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
from simprep.motion.turns import rotation_between, turned

FACING = 0.6
"""Who lies with the chest's front so far down (up), as the vertical part of its direction, is prone (supine)."""
SETTLE_S = 1.2
"""Time in which arms and legs come to where getting up begins [s]."""
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
    """From a pose (nq,) lying face down to standing, where the body lies; None for a body of which no such motion is known."""
    known = library_motion("get_up_prone")
    if known.character != character:
        return None
    turn = _direction(qpos, character) - _direction(known.qpos[0], character)
    placed = move(known, turn=turn)
    placed = move(placed, tuple(qpos[:2] - turned(known.qpos[0, :2], turn)))
    first = placed.qpos[0]
    share = minimum_jerk(np.arange(round(SETTLE_S * placed.fps)) / (SETTLE_S * placed.fps))[:, None]
    lead = qpos + share * (first - qpos)
    way = rotation_between(qpos[3:7], first[3:7])
    lead[:, 3:7] = (Rotation.from_rotvec(share * way) * Rotation.from_quat(qpos[3:7], scalar_first=True)).as_quat(
        scalar_first=True
    )
    return replace(
        placed,
        qpos=np.concatenate([lead, placed.qpos]),
        contacts=np.concatenate([np.zeros((len(lead), 2), dtype=bool), placed.contacts]),
        events={},
    )


def _direction(qpos: FloatArray, character: Character) -> float:
    """Direction on the floor from pelvis to thorax of a pose (nq,) [rad]."""
    found = forward_kinematics(qpos[None], character).xpos[0]
    x, y = (found[character.segment("thorax")] - found[character.segment("pelvis")])[:2]
    return float(np.arctan2(y, x))
