"""Accelerations, contact forces and joint torques that serve weighted tasks best: one small quadratic program.

The unknowns are the accelerations of all degrees of freedom and the forces at the contact points. The equations of motion of
the root, which nothing but contacts can push, say which accelerations some forces allow; so the accelerations are
eliminated, and the program is left with four numbers of 0 or more for each contact point. A whole-body program of all
unknowns (Escande, Mansard and Wieber 2014, for one) has the same solution and costs several times as much.
"""

from dataclasses import dataclass

import daqp
import numpy as np
from scipy.linalg import lapack

from simprep.arrays import FloatArray, IndexArray
from simprep.physics.inverse_dynamics import PYRAMID_EDGES

_MOST = 20.0  # body weights along one edge
_SOFT = 8  # daqp: a constraint that may be broken at a price


@dataclass(frozen=True)
class Tasks:
    """What accelerations are wanted: the sum of squares |A q̈ - a|² that is to be least, as its normal equations.

    Attributes:
        matrix: (nv, nv) sum of Aᵀ A, positive definite.
        vector: (nv,) sum of Aᵀ a.
    """

    matrix: FloatArray
    vector: FloatArray


@dataclass(frozen=True)
class EquationsOfMotion:
    """Of one body with a free root and motors: M q̈ + bias = (0, torques) + Σ Jᵀ force.

    Attributes:
        inertia: M (nv, nv).
        bias: (nv,) Coriolis, centrifugal and gravity forces less passive ones.
        jacobians: J (points, 3, nv) of the contact points.
        motors: (motors,) degrees of freedom that have one.
        torque_limits: (motors,) [N m].
        weight: of the body [N].
    """

    inertia: FloatArray
    bias: FloatArray
    jacobians: FloatArray
    motors: IndexArray
    torque_limits: FloatArray
    weight: float


def best_motion(
    tasks: Tasks, body: EquationsOfMotion, friction: float, regularisation: float
) -> tuple[FloatArray, FloatArray, bool]:
    """Accelerations (nv,), torques (motors,) within their limits [N m], and whether the program was solved.

    Torque limits are soft in the program, since no contact force might satisfy them all; the torques are cut off.

    Args:
        tasks: what is wanted.
        body: its dynamics.
        friction: coefficient of the pyramid in which contact forces stay.
        regularisation: price of the squared forces, as a share of the mean price of what they cause.
    """
    inertia, bias = body.inertia, body.bias
    root = inertia[:6]
    factor = np.linalg.cholesky(tasks.matrix)
    solved = lapack.dpotrs(factor, np.column_stack([tasks.vector, root.T]), lower=1)[0]
    free, response = solved[:, 0], solved[:, 1:]  # what would be best without the root's equations; what changes cost
    stiffness = np.linalg.inv(root @ response)
    spread = response @ stiffness  # (nv, 6): best accelerations for a wrench on the root
    lacking = bias[:6] + root @ free
    motors, limits = body.motors, body.torque_limits
    if not len(body.jacobians):
        qacc = free - spread @ lacking
        return qacc, np.clip((inertia @ qacc + bias)[motors], -limits, limits), True
    edges = PYRAMID_EDGES * [friction, friction, 1.0] * body.weight
    pushes = (edges @ body.jacobians).reshape(-1, len(bias))  # generalised force (4 points, nv) of each edge
    wrenches = pushes[:, :6]
    hessian = wrenches @ stiffness @ wrenches.T
    count = len(hessian)
    hessian[np.diag_indices(count)] += regularisation * np.trace(hessian) / count + 1e-9
    idle = (inertia @ (free - spread @ lacking) + bias)[motors]  # torques without any contact force
    torques = np.ascontiguousarray((inertia[motors] @ spread) @ wrenches.T - pushes[:, motors].T)
    upper = np.concatenate([np.full(count, _MOST), limits - idle])
    lower = np.concatenate([np.zeros(count), -limits - idle])
    sense = np.concatenate([np.zeros(count, np.int32), np.full(len(limits), _SOFT, np.int32)])
    forces, _, flag, _ = daqp.solve(hessian, -(wrenches @ (stiffness @ lacking)), torques, upper, lower, sense)
    qacc = free + spread @ (wrenches.T @ forces - lacking)
    return qacc, np.clip(idle + torques @ forces, -limits, limits), flag > 0
