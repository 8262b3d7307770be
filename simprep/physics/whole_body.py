"""Whole-body dynamics of a smooth motion, from MuJoCo: momenta and the external wrench that the motion needs."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from simprep.arrays import FloatArray

FLIGHT_SHARE = 0.1
"""Share of body weight below which a vertical force has no meaningful centre of pressure."""


@dataclass(frozen=True)
class WholeBody:
    """Whole-body quantities of n frames, world frame.

    Attributes:
        com: (n, 3) centre of mass [m].
        com_velocity: (n, 3) [m/s].
        angular_momentum: (n, 3) about the COM [kg m^2/s].
        force: (n, 3) external force that the accelerations need, gravity not counted as external [N].
        torque: (n, 3) the same wrench's moment about the COM [N m].
    """

    com: FloatArray
    com_velocity: FloatArray
    angular_momentum: FloatArray
    force: FloatArray
    torque: FloatArray


def whole_body(model: Any, qpos: FloatArray, qvel: FloatArray, qacc: FloatArray) -> WholeBody:
    """Momenta and needed external wrench by recursive Newton-Euler inverse dynamics (`mj_rne`).

    The root's six rows of M qacc + C are what the world must push with, as no actuator acts on a free root. Captures
    all that a rigid body model knows, angular momentum included; hides what it lacks, such as soft tissue.

    Args:
        model: mujoco.MjModel whose first joint is the free joint of its one kinematic tree.
        qpos: (n, nq).
        qvel: (n, nv).
        qacc: (n, nv).
    """
    data = mujoco.MjData(model)
    n = len(qpos)
    com, velocity, angular = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    force, torque = np.empty((n, 3)), np.empty((n, 3))
    needed = np.empty(model.nv)
    for frame in range(n):
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[frame], qvel[frame], qacc[frame]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_subtreeVel(model, data)
        mujoco.mj_rne(model, data, 1, needed)
        com[frame] = data.subtree_com[1]
        velocity[frame] = data.subtree_linvel[1]
        angular[frame] = data.subtree_angmom[1]
        force[frame] = needed[:3]
        moment = data.xmat[1].reshape(3, 3) @ needed[3:6]  # about the root's origin, in its own frame until here
        torque[frame] = moment + np.cross(data.xpos[1] - data.subtree_com[1], needed[:3])
    return WholeBody(com, velocity, angular, force, torque)


def zero_moment_point(com: FloatArray, force: FloatArray, torque: FloatArray, weight: float) -> FloatArray:
    """Floor point (n, 2) about which the needed wrench has no horizontal moment [m] (Vukobratovic and Borovac 2004).

    With floor contact alone the centre of pressure would have to be there: with a ZMP outside the support polygon the
    motion cannot happen. Captures COM acceleration and rate of angular momentum. Hides friction, and means nothing
    while hands or obstacles bear load. NaN where the vertical force is under a tenth of the weight (flight).

    Args:
        com: (n, 3) centre of mass [m].
        force: (n, 3) needed external force [N].
        torque: (n, 3) needed moment about the COM [N m].
        weight: body weight m g [N].
    """
    bears = force[:, 2] > FLIGHT_SHARE * weight
    vertical = np.where(bears, force[:, 2], np.nan)
    x = com[:, 0] - (com[:, 2] * force[:, 0] + torque[:, 1]) / vertical
    y = com[:, 1] - (com[:, 2] * force[:, 1] - torque[:, 0]) / vertical
    return np.stack([x, y], axis=1)
