"""Standing soles that stay where they are: legs follow by inverse kinematics, whatever their joint axes are."""

from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.character import SIDES, Character
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.rotations import axis_rotation, rotation_matrix
from simprep.preparation.planting import plant_feet

STEPS = 20
LARGEST_STEP = 0.1
DAMPING = 1e-3
"""Of the least squares, in m²: a straight leg stays where it is."""
TURN_M = 0.1
"""An error of 1 rad of a foot weighs as much as this distance [m]."""
DONE_M = 1e-5
EXACT_M = 0.01
"""The closed form fits a leg whose feet it misses by less [m]."""


@dataclass(frozen=True)
class HeldSoles:
    """A motion whose standing feet stay.

    Attributes:
        qpos: (T, nq).
        missed_m: largest distance of a foot from where it should be [m].
    """

    qpos: FloatArray
    missed_m: float


def hold_soles(qpos: FloatArray, standing: BoolArray, fps: float, character: Character) -> HeldSoles:
    """Hold standing feet; between stances the correction fades.

    Legs whose axes meet are solved in closed form, pelvis included (`simprep.preparation.planting`). For any others only
    the corrections are taken from there, and the legs follow step by step.

    Args:
        qpos: (T, nq).
        standing: (T, 2) feet that must not slide.
        fps: frames per second [1/s].
        character: whose poses they are, with the groups `left_leg` and `right_leg`.

    Raises:
        SimprepError: the character lacks legs.
    """
    planted = plant_feet(qpos, None, standing, np.ones(len(qpos)), np.zeros(2), fps, character)
    missed = float(planted.foot_error.max())
    if missed < EXACT_M:
        return HeldSoles(planted.qpos, missed)
    corrections = planted.corrections
    corrections[..., 2] = 0.0  # heights are the floor's business
    before = forward_kinematics(qpos, character)
    out, missed = qpos.copy(), 0.0
    data = mujoco.MjData(character.model)
    for side, (name, foot) in enumerate(zip(SIDES, character.feet, strict=True)):
        moved = np.flatnonzero(np.abs(corrections[:, side]).max(axis=1) > DONE_M)
        goal = before.xpos[:, foot] + corrections[:, side, :3]
        turn = axis_rotation("z", corrections[:, side, 3]) @ rotation_matrix(before.xquat[:, foot])
        joints = character.joint_indices(character.group(f"{name}_leg"))
        for frame in moved:
            error = _reach(character, data, out[frame], joints, foot + 1, goal[frame], turn[frame])
            missed = max(missed, error)
    return HeldSoles(out, missed)


def _reach(
    character: Character,
    data: mujoco.MjData,
    pose: FloatArray,
    joints: IndexArray,
    body: int,
    goal: FloatArray,
    turn: FloatArray,
) -> float:
    """Bring a segment to a pose by damped least squares over some joints; `pose` changes. Gives what distance is left [m]."""
    model = character.model
    low, high = character.limits[joints].T
    jacobian = np.zeros((2, 3, model.nv))
    wanted, now, back, difference, spin = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(3)
    mujoco.mju_mat2Quat(wanted, turn.ravel())
    for _ in range(STEPS):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        now[:] = data.xquat[body]
        mujoco.mju_negQuat(back, now)
        mujoco.mju_mulQuat(difference, wanted, back)
        mujoco.mju_quat2Vel(spin, difference, 1.0)
        error = np.concatenate([goal - data.xpos[body], TURN_M * spin])
        if np.abs(error).max() < DONE_M:
            break
        mujoco.mj_jacBody(model, data, jacobian[0], jacobian[1], body)
        columns = np.concatenate([jacobian[0], TURN_M * jacobian[1]])[:, 6 + joints]
        step = columns.T @ np.linalg.solve(columns @ columns.T + DAMPING * np.eye(6), error)
        pose[7 + joints] = np.clip(pose[7 + joints] + np.clip(step, -LARGEST_STEP, LARGEST_STEP), low, high)
    return float(np.linalg.norm(goal - data.xpos[body]))
