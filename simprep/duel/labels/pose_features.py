"""The features of an action that classifiers learn from: ten poses sampled evenly over it.

Source: the 2008 paper, section 3.2.1. A sampled pose is (p0, q0, p1 ... pm). p0 and q0 are the horizontal translation
and the turn about the vertical of the root since the previous sample (0 for the first). p1 ... pm are the joint
positions in a frame on the floor below the root that turns with its heading, so that jumps remain visible.
"""

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.errors import SettingError
from simprep.motion.edit import yaw
from simprep.motion.kinematics import Kinematics
from simprep.motion.rotations import wrap_angle
from simprep.motion.turns import turned

SAMPLES = 10
"""Poses per action (the paper's N)."""


def motion_features(kinematics: Kinematics, segments: IntArray, samples: int = SAMPLES) -> FloatArray:
    """Features (S, samples * (3 + 3 J)) of one player's actions, J body segments each; see `pose_features`."""
    return pose_features(kinematics.xpos, kinematics.xpos[:, 0], yaw(kinematics.xquat[:, 0]), segments, samples)


def pose_features(
    joints: FloatArray, root: FloatArray, heading: FloatArray, segments: IntArray, samples: int = SAMPLES
) -> FloatArray:
    """Features (S, samples * (3 + 3 J)) of actions from joint positions.

    For each sample: the root's step forward and left since the previous sample, in the heading of that one [m], its
    turn [rad], and the joints in the root's heading frame on the floor [m].

    Args:
        joints: (T, J, 3) joint positions in the world, z up [m].
        root: (T, 3) position of the root [m].
        heading: (T,) direction of the root on the floor, counter-clockwise from x [rad].
        segments: (S, 2 or more) first frame, frame after the last, and columns that are ignored.
        samples: poses per action.

    Raises:
        SettingError: fewer than 2 samples, or a segment outside the frames.
    """
    if samples < 2:
        raise SettingError(f"{samples} poses per action; valid: 2 or more")
    first, last = segments[:, 0], segments[:, 1] - 1
    if len(segments) and (first.min() < 0 or (last < first).any() or last.max() >= len(joints)):
        raise SettingError(f"an action lies outside the {len(joints)} frames, or has none")
    at = first[:, None] + (last - first)[:, None] * np.linspace(0, 1, samples)  # (S, N)
    low = np.minimum(at.astype(np.int64), len(joints) - 1)
    high = np.minimum(low + 1, last[:, None])
    weight = at - low
    angle = heading[low] + weight * wrap_angle(heading[high] - heading[low])
    place = _blend(root, low, high, weight[..., None])
    pose = _blend(joints, low, high, weight[..., None, None])

    pose[..., :2] -= place[..., None, :2]
    pose[..., :2] = turned(pose[..., :2], -angle[..., None])
    motion = np.zeros((*at.shape, 3))
    steps = np.diff(place, axis=1)
    motion[:, 1:, :2] = turned(steps[..., :2], -angle[:, :-1])
    motion[:, 1:, 2] = wrap_angle(np.diff(angle, axis=1))
    flat = pose.reshape(*at.shape, -1)
    return np.concatenate([motion, flat], axis=-1).reshape(len(segments), -1)


def _blend(values: FloatArray, low: IntArray, high: IntArray, weight: FloatArray) -> FloatArray:
    return np.asarray((1 - weight) * values[low] + weight * values[high])
