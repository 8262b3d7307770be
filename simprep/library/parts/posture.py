"""Trunk and arm poses as hinge angles, from named degrees and key poses."""

from collections.abc import Mapping, Sequence

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES, Character
from simprep.humanoid_model import humanoid
from simprep.motion.curves import key_curve
from simprep.motion.rotations import axis_rotation

Pose = Mapping[str, float]
"""Hinge angles by name [deg]; `arms_` before an arm hinge sets both sides."""

RELAXED: Pose = {
    "arms_shoulder_flexion": -3, "arms_shoulder_abduction": 7, "arms_shoulder_rotation": 8, "arms_elbow_flexion": 16,
    "arms_forearm_pronation": 12,
}  # fmt: skip
"""Arms hanging beside the body."""


def hinge_angles(pose: Pose, character: Character = humanoid()) -> FloatArray:
    """Hinge vector (joints,) of a named pose [rad]; hinges not named are zero.

    Raises:
        UnknownNameError: no such hinge.
    """
    out = np.zeros(len(character.joints))
    for name, degrees in pose.items():
        names = [f"{side}_{name[5:]}" for side in SIDES] if name.startswith("arms_") else [name]
        for one in names:
            out[character.joint(one)] = np.radians(degrees)
    return out


def key_poses(keys: Sequence[tuple[float, Pose]], times: FloatArray, character: Character = humanoid()) -> FloatArray:
    """Hinge angles (T, joints) through key poses [rad].

    Args:
        keys: (time [s], pose), in order of time.
        times: (T,) [s].
        character: whose hinges.

    Raises:
        UnknownNameError: no such hinge.
    """
    return key_curve([time for time, _ in keys], np.array([hinge_angles(pose, character) for _, pose in keys]))(times)


def set_hinges(hinges: FloatArray, values: Mapping[str, FloatArray | float], character: Character = humanoid()) -> None:
    """Write columns of a hinge array (T, joints) in place; values are (T,) or one number per hinge name [rad].

    Raises:
        UnknownNameError: no such hinge.
    """
    for name, value in values.items():
        hinges[:, character.joint(name)] = value


def trunk_rotation(yaw: FloatArray, pitch: FloatArray, roll: FloatArray) -> FloatArray:
    """Pelvis rotations (T, 3, 3) from yaw to the left, pitch forward and roll left side up, each (T,) [rad]."""
    return axis_rotation("z", yaw) @ axis_rotation("y", pitch) @ axis_rotation("x", roll)
