"""Lengths of the limbs, and arms in closed form over all frames at once (legs: `simprep.motion.limb_ik`)."""

from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.character import SIDES, Character
from simprep.humanoid_model import humanoid
from simprep.motion.limb_ik import ball_joint_angles, two_bar_bend

SIGNS = {"left": 1.0, "right": -1.0}
"""Abduction, rotation, inversion and pronation turn the other way on the right."""


@dataclass(frozen=True)
class LimbLengths:
    """Lengths and offsets of the limbs [m].

    Attributes:
        thigh, shank: hip to knee to ankle.
        upper_arm: shoulder to elbow.
        forearm: elbow to the middle of the fist, wrist straight.
        hip: (2, 3) left and right hip centre in the pelvis frame.
        shoulder: (2, 3) left and right shoulder centre in the thorax frame.
    """

    thigh: float
    shank: float
    upper_arm: float
    forearm: float
    hip: FloatArray
    shoulder: FloatArray


@lru_cache(maxsize=16)
def limb_lengths(character: Character = humanoid()) -> LimbLengths:
    """Lengths of the limbs of a body in its reference pose, read from its model.

    Raises:
        SettingError: the character lacks a segment of the limbs.
    """
    start = character.model.body_pos[1:]
    down = {part: -float(start[character.segment(f"left_{part}")][2]) for part in ("shank", "foot", "forearm", "hand")}
    return LimbLengths(
        thigh=down["shank"],
        shank=down["foot"],
        upper_arm=down["forearm"],
        forearm=down["hand"] - float(fist_middle("left", character)[2]),
        hip=np.array([start[character.segment(f"{side}_thigh")] for side in SIDES]),
        shoulder=np.array([start[character.segment(f"{side}_upper_arm")] for side in SIDES]),
    )


def fist_middle(side: str, character: Character) -> FloatArray:
    """Middle (3,) of the `left` or `right` fist, hand frame [m]: the site of that name, else the centre of mass.

    Raises:
        SettingError: the character lacks that hand.
    """
    hand = character.segment(f"{side}_hand")
    site = mujoco.mj_name2id(character.model, mujoco.mjtObj.mjOBJ_SITE, character.segments[hand])
    return np.array(character.model.site_pos[site] if site >= 0 else character.model.body_ipos[1 + hand])


def leg_joints(character: Character = humanoid()) -> IndexArray:
    """Joints (2, N) of the left and right leg as indices into `Character.joints`, from the hip down.

    The character needs the groups `left_leg` and `right_leg`. Our humanoid's N is 6: hip flexion, abduction, rotation,
    knee flexion, ankle dorsiflexion, inversion.
    """
    return np.array([character.joint_indices(character.groups[f"{side}_leg"]) for side in SIDES], dtype=np.intp)


def arm_angles(side: str, fist: FloatArray, pole: FloatArray, character: Character = humanoid()) -> FloatArray:
    """Shoulder flexion, abduction, rotation and elbow flexion (T, 4) that put a fist at a point, wrist straight [rad].

    Args:
        side: `left` or `right`.
        fist: (T, 3) in the thorax frame, x forward, y left, z up, from the base of the thorax [m].
        pole: (T, 3) direction in the thorax frame into which the elbow points.
        character: the body.
    """
    lengths = limb_lengths(character)
    reach = fist - lengths.shoulder[SIDES.index(side)]
    distance = np.linalg.norm(reach, axis=-1)
    along = reach / distance[:, None]
    outward = pole - np.sum(pole * along, axis=-1, keepdims=True) * along
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    elbow = two_bar_bend(distance, lengths.upper_arm, lengths.forearm)
    # angle at the shoulder between the upper arm and the line to the fist
    offset = np.arctan2(lengths.forearm * np.sin(elbow), lengths.upper_arm + lengths.forearm * np.cos(elbow))[:, None]
    z = -(np.cos(offset) * along + np.sin(offset) * outward)
    y = np.cross(along, outward)
    rotation = np.stack([np.cross(y, z), y, z], axis=-1)
    shoulder = ball_joint_angles(rotation) * [-1.0, SIGNS[side], -SIGNS[side]]
    return np.concatenate([shoulder, elbow[:, None]], axis=-1)
