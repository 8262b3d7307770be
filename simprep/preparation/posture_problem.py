"""The cost that posture optimisation minimises, and its descent, one frame at a time (paper, section 5.3, Eq. 6-10).

The cost is a sum of norms with an analytic gradient, through MuJoCo's body Jacobians. Each step goes along the gradient
divided by the Gauss-Newton matrix of the norms (each replaced by the parabola that touches it from above), halved until
the cost falls: it gets to the optimum in 10 steps, which plain gradient descent does not.
"""

from dataclasses import dataclass
from math import sqrt

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from simprep.character import Character, IntArray
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings

Array = NDArray[np.float64]

_DAMPING = 1e-5  # keeps hinges that move no body centre (wrist, pronation) where they are
_ENOUGH = 2e-3  # a step that gains less than this share of the reduction so far is the last


@dataclass(frozen=True)
class Costs:
    """Cost terms of one posture (paper, Eq. 6-10), with smooth norms, as they are minimised.

    Attributes:
        balance: C_b, distance from the COM to the support centre, or where else it is wanted, on the floor [m].
        style: C_s, mean distance of the body centres from the blended posture [m].
        smoothness: C_m, mean second difference of the body centres [m per frame squared].
        total: weighted sum, plus the joint term of `PreparationSettings.joint_weight`.
    """

    balance: float
    style: float
    smoothness: float
    total: float


@dataclass(frozen=True)
class PostureFrame:
    """What the cost of one frame is measured against (`PostureProblem.frame`).

    Attributes:
        qpos: (nq,) blended posture.
        hinges: (K,) its balancing hinges [rad].
        com_fixed: (2,) part of the bodies that do not move in the COM on the floor [m].
        centre: (2,) where C_b wants the COM on the floor [m]; None leaves out C_b.
        fixed_smoothness: part of the bodies that do not move in the sum of C_m [m per frame squared].
        anchors: (1, M, 3) body centres of the blended posture, of the bodies that move [m]; or (2, M, 3), followed by
            those that continue the two frames before in a straight line, for C_m.
    """

    qpos: Array
    hinges: Array
    com_fixed: Array
    centre: Array | None
    fixed_smoothness: float
    anchors: Array


class PostureProblem:
    """The cost of a frame (`frame`) as a function of the K balancing hinges, which move M segments.

    Args:
        character: whose postures they are; its `balancing` joints move.
        settings: weights and the smoothing of the norms.

    Attributes:
        columns: (K,) entries of a pose that the optimisation changes.
        low: (K,) lower limits [rad], high: (K,) upper limits.
    """

    def __init__(self, character: Character, settings: PreparationSettings = DEFAULT_SETTINGS) -> None:
        self.model = character.model
        self.data = mujoco.MjData(self.model)
        self.settings = settings
        joints = character.joint_indices(character.balancing)
        self.columns = 7 + joints
        self._velocities = 6 + joints
        self._diagonal = np.diag_indices(len(joints))
        self.low = self.model.jnt_range[1 + joints, 0]
        self.high = self.model.jnt_range[1 + joints, 1]
        moved = _moved_segments(self.model, 1 + joints)
        self._moved, self._fixed = np.flatnonzero(moved), np.flatnonzero(~moved)
        self._moved_ids = self._moved + 1  # in the model, which begins with the world
        mass = self.model.body_mass[1:]
        self._share = mass / mass.sum()
        self._moved_share = self._share[self._moved]
        self._jacobian = np.zeros((len(self._moved), 3, self.model.nv))
        self._rows = [(int(i) + 1, self._jacobian[k]) for k, i in enumerate(self._moved)]
        self._eps = settings.smooth_norm
        self._eps2 = self._eps**2
        self._weights = np.array([[settings.style_weight], [settings.smoothness_weight]]) / len(mass)
        self._qpos = self.data.qpos
        self._xipos = self.data.xipos

    def frame(
        self, qpos: Array, centre: Array | None, last: Array | None = None, before_last: Array | None = None
    ) -> PostureFrame:
        """A frame whose posture is to be optimised.

        Args:
            qpos: (nq,) blended posture.
            centre: (2,) where C_b wants the COM on the floor [m]; None leaves out C_b.
            last: (segments, 3) optimised body centres one frame earlier [m]; None leaves out C_m.
            before_last: (segments, 3) two frames earlier.
        """
        centres = self.centres_of(qpos)
        anchors = [centres[self._moved]]
        fixed_smoothness = 0.0
        if last is not None and before_last is not None:
            straight_on = 2 * last - before_last
            anchors.append(straight_on[self._moved])
            fixed_smoothness = float(self._norm(centres[self._fixed] - straight_on[self._fixed]).sum())
        return PostureFrame(
            qpos=np.array(qpos),
            hinges=np.array(qpos[self.columns]),
            com_fixed=self._share[self._fixed] @ centres[self._fixed, :2],
            centre=centre,
            fixed_smoothness=fixed_smoothness,
            anchors=np.stack(anchors),
        )

    def _norm(self, difference: Array) -> Array:
        return np.asarray(np.sqrt(np.add.reduce(difference * difference, axis=-1) + self._eps2) - self._eps)

    def _pose(self, frame: PostureFrame, hinges: Array) -> None:
        self._qpos[:] = frame.qpos
        self._qpos[self.columns] = hinges
        mujoco.mj_kinematics(self.model, self.data)

    def body_centres(self, frame: PostureFrame, hinges: Array) -> Array:
        """Body centres (segments, 3) of a frame with these balancing hinges, world [m]."""
        self._pose(frame, hinges)
        return np.array(self._xipos[1:])

    def centres_of(self, qpos: Array) -> Array:
        """Body centres (segments, 3) of a whole posture (nq,)."""
        self._qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        return np.array(self._xipos[1:])

    def com_of(self, qpos: Array) -> Array:
        """COM (2,) on the floor of a whole posture (nq,) [m]."""
        return np.asarray(self._share @ self.centres_of(qpos)[:, :2])

    def com_jacobian(self, qpos: Array) -> Array:
        """Jacobian (2, K) of `com_of` by the balancing hinges [m/rad]."""
        self._qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacSubtreeCom(self.model, self.data, jacobian, 1)
        return jacobian[:2].take(self._velocities, axis=1)

    def costs(self, frame: PostureFrame, hinges: Array) -> Costs:
        """Cost terms of a frame at (K,) hinges."""
        self._pose(frame, hinges)
        p = self._xipos.take(self._moved_ids, axis=0)
        s = self.settings
        n = len(self._share)
        balance = smoothness = 0.0
        if frame.centre is not None:
            x, y = (frame.com_fixed + self._moved_share @ p[:, :2] - frame.centre).tolist()
            balance = sqrt(x * x + y * y + self._eps2) - self._eps
        style, *others = np.add.reduce(self._norm(p - frame.anchors), axis=1).tolist()
        style /= n
        if others:
            smoothness = (others[0] + frame.fixed_smoothness) / n
        total = s.balance_weight * balance + s.style_weight * style + s.smoothness_weight * smoothness
        change = hinges - frame.hinges
        total += s.joint_weight / 2 * float(change @ change)
        return Costs(balance, style, smoothness, total)

    def gradient(self, frame: PostureFrame, hinges: Array) -> tuple[Array, Array]:
        """Gradient (K,) [m/rad] of a frame's cost at (K,) hinges [rad], and the (K, K) Gauss-Newton matrix [m/rad^2]."""
        self._pose(frame, hinges)
        return self._gradient_here(frame, hinges)

    def _gradient_here(self, frame: PostureFrame, hinges: Array) -> tuple[Array, Array]:
        """`gradient` at the hinges that `_pose` was called with last."""
        model, data, s = self.model, self.data, self.settings
        mujoco.mj_comPos(model, data)
        for body_id, out in self._rows:
            mujoco.mj_jacBodyCom(model, data, out, None, body_id)
        jacobian = self._jacobian.take(self._velocities, axis=2)  # (M, 3, K), in C order as reshaped below
        p = self._xipos.take(self._moved_ids, axis=0)
        r = p - frame.anchors
        pulls = self._weights[: len(r)] / np.sqrt(np.add.reduce(r * r, axis=2) + self._eps2)  # (1 or 2, M)
        force, pull = np.add.reduce(pulls[..., None] * r, axis=0), np.add.reduce(pulls, axis=0)
        flat = jacobian.reshape(-1, len(self.columns))
        gradient = force.ravel() @ flat
        weighted = flat * np.repeat(np.sqrt(pull), 3)[:, None]
        curvature = weighted.T @ weighted
        gradient = gradient + s.joint_weight * (hinges - frame.hinges)
        curvature[self._diagonal] += s.joint_weight
        if frame.centre is not None:
            r = frame.com_fixed + self._moved_share @ p[:, :2] - frame.centre
            scale = s.balance_weight / np.sqrt(r @ r + self._eps2)
            com = (self._moved_share[None] @ jacobian[:, :2].reshape(len(p), -1)).reshape(2, len(self.columns))
            gradient = gradient + scale * (r @ com)
            curvature += scale * (com.T @ com)
        return gradient, curvature

    def minimise(self, frame: PostureFrame, start: Array) -> tuple[Array, int]:
        """Descend from (K,) hinges, within the joint limits, in at most `settings.max_steps` steps.

        Returns:
            The hinges, of no higher cost than the start; and the steps taken.
        """
        hinges = start
        first = cost = self.costs(frame, hinges).total
        steps = 0
        while steps < self.settings.max_steps:
            gradient, curvature = self._gradient_here(frame, hinges)  # their cost was the last to be computed
            held = ((hinges <= self.low) & (gradient > 0)) | ((hinges >= self.high) & (gradient < 0))
            if held.any():  # a hinge pressed against its limit takes no part in this step
                gradient = np.where(held, 0.0, gradient)
                curvature[held] = 0.0
                curvature[:, held] = 0.0
            curvature[self._diagonal] += _DAMPING + held
            _, direction, failed = dposv(curvature, gradient)
            if failed:
                direction = gradient
            length = 1.0
            for _ in range(6):
                trial = np.minimum(np.maximum(hinges - length * direction, self.low), self.high)
                trial_cost = self.costs(frame, trial).total
                if trial_cost < cost:
                    break
                length /= 2
            else:
                break
            steps += 1
            gained = cost - trial_cost
            hinges, cost = trial, trial_cost
            if gained < _ENOUGH * (first - cost) or gained < 1e-7:
                break
        return hinges, steps


def _moved_segments(model: mujoco.MjModel, joint_ids: IntArray) -> NDArray[np.bool_]:
    """Segments (segments,) that some of these joints move: the joints' own and all that hang on them."""
    moved = np.zeros(model.nbody, dtype=bool)
    moved[model.jnt_bodyid[joint_ids]] = True
    for body in range(1, model.nbody):  # a parent comes before its children
        moved[body] |= moved[model.body_parentid[body]]
    return moved[1:]
