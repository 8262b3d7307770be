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
from simprep.character import Character
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


class InverseDynamics:
    """Torques that references of one character need, by `mj_inverse`.

    In each frame, contact forces within the friction pyramid, at all points near the floor, supply the root's six rows
    of the equations of motion as well as they can (non-negative least squares). The rest is left out, since nothing
    else may push the root. Frames of the last reference that are already known are not computed again.

    Args:
        character: who moves.
        settings: rate, smoothing and contact settings.
    """

    def __init__(self, character: Character, settings: InverseDynamicsSettings | None = None) -> None:
        self._settings = settings or InverseDynamicsSettings()
        # a copy, because the model is shared; contacts are found here, and limits must not push
        self._model = model = copy(character.model)
        model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        self._data = mujoco.MjData(model)
        self._candidates = contact_candidates(model)
        self._joints = scene_bodies(model, (character,))[0].joint_qvel
        self._weight = model.body_mass.sum() * GRAVITY
        self._edges = PYRAMID_EDGES * [self._settings.friction, self._settings.friction, 1.0]
        self._reference: Reference | None = None
        self._known: dict[int, FloatArray] = {}  # torques of frames of this reference

    def torques(self, reference: Reference, since: int = 0, until: int | None = None) -> FloatArray:
        """Actuator torques (rows, controls) that a reference needs [N m].

        Args:
            reference: the motion at the simulation's steps, 0 to N.
            since: step of the first row.
            until: step of the last row; None: N. The rows have the same bits whatever these two are.
        """
        if reference is not self._reference:
            self._reference, self._known = reference, {}
        fps, last = reference.motion.fps, len(reference.qvel) - 1
        since, until = min(since, last), last if until is None else min(until, last)
        sigma, stride = self._settings.smoothing * fps, max(1, round(fps / self._settings.rate))
        reach = round(_TRUNCATE * sigma) + 1
        # what lies within reach of the wanted rows, on the grid of the whole motion
        first = max(0, since - reach) // stride * stride
        after = min(last, -(-(until + reach) // stride) * stride)
        frames = np.unique(np.append(np.arange(first, after + 1, stride), after))
        begin, end = max(0, first - reach - 1), min(last, after + reach + 1) + 1
        qvel = gaussian_filter1d(reference.qvel[begin:end], sigma, axis=0, mode="nearest", truncate=_TRUNCATE)
        qacc = np.gradient(qvel, 1 / fps, axis=0)
        for frame in frames.tolist():
            if frame not in self._known:
                self._known[frame] = self._needed(reference.qpos[frame], qvel[frame - begin], qacc[frame - begin])
        steps = np.arange(first, after + 1)
        torques = np.array([self._known[frame] for frame in frames.tolist()])
        dense = np.stack([np.interp(steps, frames, column) for column in torques.T], axis=1)
        smooth = gaussian_filter1d(dense, sigma, axis=0, mode="nearest", truncate=_TRUNCATE)
        return np.asarray(smooth[since - first : until - first + 1])

    def _needed(self, qpos: FloatArray, qvel: FloatArray, qacc: FloatArray) -> FloatArray:
        """Actuator torques (controls,) of one frame."""
        data = self._data
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos, qvel, qacc
        mujoco.mj_inverse(self._model, data)
        needed = data.qfrc_inverse
        return np.asarray((needed - self._contact_torques(needed))[self._joints])

    def _contact_torques(self, needed: FloatArray) -> FloatArray:
        """Generalised force (nv,) of the contact forces that supply the root's rows best."""
        model, data, candidates, settings = self._model, self._data, self._candidates, self._settings
        low = candidates.low(data, settings.reach)
        if len(low) == 0:
            return np.zeros(model.nv)
        geom = candidates.geom[low]
        turned = data.geom_xmat[geom].reshape(-1, 3, 3) @ candidates.centre[low, :, None]
        points = data.geom_xpos[geom] + turned[:, :, 0]
        points[:, 2] -= candidates.radius[low]
        jacobians = np.empty((len(low), 3, model.nv))
        for jacobian, point, body in zip(jacobians, points, candidates.body[low].tolist()):
            mujoco.mj_jac(model, data, jacobian, None, point, body)
        columns = (self._edges @ jacobians).reshape(-1, model.nv)  # (4 points, nv): generalised force of unit pushes
        # a point just above the floor in the reference is less likely to bear load in the simulation
        heights = np.repeat(np.maximum(points[:, 2], 0.0), 4)
        reluctance = settings.regularisation * (1 + 50 * (heights / settings.reach) ** 2)
        system = np.concatenate([columns[:, :6].T, np.diag(reluctance)])
        wanted = np.concatenate([needed[:6] / self._weight, np.zeros(len(columns))])
        return np.asarray(self._weight * (nonnegative_least_squares(system, wanted) @ columns))


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
