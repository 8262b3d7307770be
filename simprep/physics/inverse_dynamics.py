"""Joint torques that a reference motion needs, with the floor bearing the body: the feed-forward of `mpc`'s servos.

To bear a load, a servo must be off its target by torque / kp, a third of a radian at the ankle of a walking person.
Inverse dynamics tells this in advance, so that sampling starts near the solution.
"""

from copy import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import lsq_linear, nnls

from simprep.arrays import FloatArray, IndexArray
from simprep.geoms import bearing_points
from simprep.humanoid_model import GRAVITY
from simprep.physics.bodies import scene_bodies
from simprep.physics.reference import Reference

PYRAMID_EDGES = np.array([[1.0, 0, 1], [-1, 0, 1], [0, 1, 1], [0, -1, 1]])
"""(4, 3) edges of the friction pyramid for a coefficient of 1, upwards."""
_TRUNCATE = 4.0  # standard deviations that the Gaussian over torques reaches


@dataclass(frozen=True)
class InverseDynamicsSettings:
    """How the needed torques are estimated.

    Attributes:
        rate: frames per second at which they are computed [1/s]; interpolated in between.
        smoothing: standard deviation of the Gaussian over velocities, and over the torques [s].
        reach: points up to this height above the floor can bear load [m]; the higher, the less.
        regularisation: weight of the squared contact forces, in body weights; spreads the load over the points.
        friction: sliding friction coefficient of the contact forces.
    """

    rate: float = 60.0
    smoothing: float = 0.02
    reach: float = 0.03
    regularisation: float = 0.02
    friction: float = 0.8


def needed_torques(
    reference: Reference, settings: InverseDynamicsSettings | None = None, since: int = 0, until: int | None = None
) -> FloatArray:
    """Actuator torques (rows, controls) that the reference needs, by inverse dynamics (`mj_inverse`) [N m].

    In each frame, contact forces within the friction pyramid, at all points near the floor, supply the root's six rows
    of the equations of motion as well as they can (non-negative least squares). The rest is left out, since nothing
    else may push the root.

    Args:
        reference: the motion at the simulation's steps, 0 to N.
        settings: rate, smoothing and contact settings.
        since: step of the first row.
        until: step of the last row; None: N. The rows have the same bits whatever these two are.
    """
    settings = settings or InverseDynamicsSettings()
    fps, last = reference.motion.fps, len(reference.qvel) - 1
    since, until = min(since, last), last if until is None else min(until, last)
    # a copy, because the model is shared; contacts are found here, and limits must not push
    model = copy(reference.motion.character.model)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    data = mujoco.MjData(model)
    sigma, stride = settings.smoothing * fps, max(1, round(fps / settings.rate))
    reach = round(_TRUNCATE * sigma) + 1
    # what lies within reach of the wanted rows, on the grid of the whole motion
    first = max(0, since - reach) // stride * stride
    after = min(last, -(-(until + reach) // stride) * stride)
    frames = np.unique(np.append(np.arange(first, after + 1, stride), after))
    begin, end = max(0, first - reach - 1), min(last, after + reach + 1) + 1
    qvel = gaussian_filter1d(reference.qvel[begin:end], sigma, axis=0, mode="nearest", truncate=_TRUNCATE)
    qacc = np.gradient(qvel, 1 / fps, axis=0)
    candidates = contact_candidates(model)
    joints = scene_bodies(model, (reference.motion.character,))[0].joint_qvel
    torques = np.empty((len(frames), model.nu))
    for row, frame in enumerate(frames):
        data.qpos[:] = reference.qpos[frame]
        data.qvel[:], data.qacc[:] = qvel[frame - begin], qacc[frame - begin]
        mujoco.mj_inverse(model, data)
        needed = data.qfrc_inverse
        torques[row] = (needed - _contact_torques(model, data, candidates, needed, settings))[joints]
    steps = np.arange(first, after + 1)
    dense = np.stack([np.interp(steps, frames, column) for column in torques.T], axis=1)
    smooth = gaussian_filter1d(dense, sigma, axis=0, mode="nearest", truncate=_TRUNCATE)
    return np.asarray(smooth[since - first : until - first + 1])


def nonnegative_least_squares(matrix: FloatArray, wanted: FloatArray) -> FloatArray:
    """x >= 0 (n,) that minimises the norm of matrix x - wanted, for a matrix (m, n) and wanted (m,)."""
    try:
        return np.asarray(nnls(matrix, wanted)[0])
    except RuntimeError:  # the active set of a degenerate problem can cycle, the interior-point method cannot
        return np.maximum(lsq_linear(matrix, wanted, bounds=(0.0, np.inf), tol=1e-10).x, 0.0)


@dataclass(frozen=True)
class ContactCandidates:
    """Points that can touch the floor.

    Attributes:
        body: (n,) ids of their bodies.
        geom: (n,) ids of their geoms.
        centre: (n, 3) in the geom's frame [m].
        radius: (n,) about it [m].
    """

    body: IndexArray
    geom: IndexArray
    centre: FloatArray
    radius: FloatArray

    def low(self, data: mujoco.MjData, height: float) -> IndexArray:
        """Those that are lower than a height above the floor [m], by their numbers."""
        middle = data.geom_xpos[self.geom, 2] + (data.geom_xmat[self.geom, 6:] * self.centre).sum(axis=1)
        return np.flatnonzero(middle - self.radius < height)


def contact_candidates(model: mujoco.MjModel) -> ContactCandidates:
    """Points of all geoms that collide."""
    found = [
        (geom, centre, radius)
        for geom in np.flatnonzero(model.geom_contype).tolist()
        for centre, radius in bearing_points(model, geom)
    ]
    geoms = np.array([geom for geom, *_ in found], dtype=np.intp)
    return ContactCandidates(
        model.geom_bodyid[geoms].astype(np.intp),
        geoms,
        np.array([centre for _, centre, _ in found]).reshape(-1, 3),
        np.array([radius for *_, radius in found]),
    )


def _contact_torques(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    candidates: ContactCandidates,
    needed: FloatArray,
    settings: InverseDynamicsSettings,
) -> FloatArray:
    """Generalised force (nv,) of the contact forces that supply the root's rows best."""
    jacobians, heights = [], []
    jacobian = np.zeros((3, model.nv))
    for one in candidates.low(data, settings.reach).tolist():
        geom, radius = candidates.geom[one], candidates.radius[one]
        point = data.geom_xpos[geom] + data.geom_xmat[geom].reshape(3, 3) @ candidates.centre[one]
        mujoco.mj_jac(model, data, jacobian, None, point - [0, 0, radius], int(candidates.body[one]))
        jacobians.append(jacobian.copy())
        heights.append(max(point[2] - radius, 0.0))
    if not jacobians:
        return np.zeros(model.nv)
    edges = PYRAMID_EDGES * [settings.friction, settings.friction, 1.0]
    columns = np.concatenate([edges @ jac for jac in jacobians])  # (4 points, nv): generalised force of unit pushes
    weight = model.body_mass.sum() * GRAVITY
    # a point just above the floor in the reference is less likely to bear load in the simulation
    reluctance = settings.regularisation * (1 + 50 * (np.repeat(heights, 4) / settings.reach) ** 2)
    system = np.concatenate([columns[:, :6].T, np.diag(reluctance)])
    pushes = nonnegative_least_squares(system, np.concatenate([needed[:6] / weight, np.zeros(len(columns))]))
    return np.asarray(weight * (pushes @ columns))
