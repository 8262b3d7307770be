"""The way from any moment of a motion to standing still: what a tracker follows where its reference ends."""

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.humanoid_model import GRAVITY
from simprep.motion.curves import dying_away, minimum_jerk
from simprep.motion.edit import yaw
from simprep.motion.kinematics import forward_kinematics

BRAKE_S = 0.9
"""Time from the last pose to standing [s]."""
STILL_MPS, LEVEL_M = 0.25, 0.04
"""A body slower than this [m/s], both soles within this of the floor [m], keeps its pose instead."""


def standing_tail(poses: FloatArray, fps: float, character: Character, frames: int) -> FloatArray:
    """Poses (frames, nq) that go on after `poses` and end standing upright.

    The root goes on to where a pendulum of the body's height would come to rest, its extrapolated centre of mass (Hof et
    al. 2005), and the legs come under it. Arms and trunk keep their pose, so a guard stays up.

    Args:
        poses: (2 or more, nq) last poses of the motion.
        fps: frames per second of both [1/s].
        character: whose poses they are.
        frames: how many; what is left after `BRAKE_S` holds still.
    """
    last = poses[-1]
    velocity = (poses[-1, :3] - poses[-2, :3]) * fps
    soles = forward_kinematics(poses[-1:], character).foot_points[0, ..., 2].min(axis=1)
    still = float(np.hypot(*velocity[:2])) < STILL_MPS and float(np.abs(soles).max()) < LEVEL_M
    goal = last.copy() if still else _upright(last, character)
    rate = np.sqrt(GRAVITY / goal[2])
    goal[:2] = last[:2] + velocity[:2] / rate
    s = np.minimum(np.arange(1, frames + 1) / (BRAKE_S * fps), 1.0)
    share = minimum_jerk(s)[:, None]
    travel = dying_away(s, 0.0, BRAKE_S)[:, None]  # of a speed of 1, on top of the way to the goal
    hinge_velocity = (poses[-1, 7:] - poses[-2, 7:]) * fps
    low, high = character.limits.T
    out = np.empty((frames, len(last)))
    out[:, :3] = last[:3] + share * (goal[:3] - last[:3]) + travel * velocity
    turn = Rotation.from_quat([last[3:7], goal[3:7]], scalar_first=True)
    way = (turn[1] * turn[0].inv()).as_rotvec()
    out[:, 3:7] = (Rotation.from_rotvec(share * way) * turn[0]).as_quat(scalar_first=True)
    out[:, 7:] = np.clip(last[7:] + share * (goal[7:] - last[7:]) + travel * hinge_velocity, low, high)
    return out


def _upright(pose: FloatArray, character: Character) -> FloatArray:
    """Standing with the heading, arms and trunk of a pose."""
    goal = pose.copy()
    heading = float(yaw(pose[3:7]))
    goal[3:7] = np.cos(heading / 2), 0.0, 0.0, np.sin(heading / 2)
    legs = 7 + character.joint_indices([*character.groups["left_leg"], *character.groups["right_leg"]])
    goal[legs] = character.standing_qpos[legs]
    goal[2] = 1.0
    goal[2] -= forward_kinematics(goal[None], character).foot_points[..., 2].min()
    return goal
