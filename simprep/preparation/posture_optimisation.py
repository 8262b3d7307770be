"""Posture optimisation: the upper body moves so that the COM comes over its support (paper, section 5.3, Eq. 6-10).

The cost is a sum of norms. Its gradient is analytic, through MuJoCo's body Jacobians. Each step goes along the gradient
divided by the Gauss-Newton matrix of the norms (each norm replaced by the parabola that touches it from above), halved until
the cost falls: still descent with at most 10 steps, but it gets to the optimum in them, which plain gradient descent does
not. The descent starts from the blended posture, or from it plus the change of the previous frame where that costs less.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv
from scipy.ndimage import gaussian_filter1d

from simprep.humanoid import BODIES, DEFAULT_BODY, UPPER_BODY_HINGES, Body, humanoid_model
from simprep.preparation.com_path import displacement_path, displacement_repair
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings

Array = NDArray[np.float64]

N_UPPER = len(UPPER_BODY_HINGES)
MOVED = tuple(i for i, name in enumerate(BODIES) if not name.endswith(("pelvis", "thigh", "shank", "foot")))
"""Bodies that the upper-body hinges move, as indices into `BODIES`."""

_UPPER_QPOS = slice(7, 7 + N_UPPER)
_UPPER_QVEL = slice(6, 6 + N_UPPER)
_MOVED = np.array(MOVED)
_FIXED = np.array([i for i in range(len(BODIES)) if i not in MOVED])
_DIAGONAL = np.diag_indices(N_UPPER)
_DAMPING = 1e-5  # keeps hinges that move no body centre (wrist, pronation) where they are
_REPAIRS = 3
_REPAIRED_M = 1e-6
_REPAIR_S = 0.03  # time constant of the repairs
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


class PostureProblem:
    """The cost of one frame as a function of the 25 upper-body hinges.

    Args:
        body: the humanoid.
        settings: weights and the smoothing of the norms.
    """

    def __init__(self, body: Body = DEFAULT_BODY, settings: PreparationSettings = DEFAULT_SETTINGS) -> None:
        self.model = humanoid_model(body)
        self.data = mujoco.MjData(self.model)
        self.settings = settings
        self.low = self.model.jnt_range[1 : 1 + N_UPPER, 0].copy()
        self.high = self.model.jnt_range[1 : 1 + N_UPPER, 1].copy()
        mass = self.model.body_mass[1:]
        self._share = mass / mass.sum()
        self._moved_share = self._share[_MOVED]
        self._jacobian = np.zeros((len(MOVED), 3, self.model.nv))
        self._rows = [(int(i) + 1, self._jacobian[k]) for k, i in enumerate(MOVED)]
        self._eps = settings.smooth_norm
        self._hinges = self.data.qpos[_UPPER_QPOS]
        self._xipos = self.data.xipos

    def set_frame(
        self, qpos: Array, centre: Array | None, last: Array | None = None, before_last: Array | None = None
    ) -> Array:
        """Fix the frame that the next evaluations are about.

        Args:
            qpos: (44,) blended posture.
            centre: (2,) support centre, or where else C_b wants the COM on the floor [m]; None leaves out C_b.
            last: (17, 3) optimised body centres one frame earlier [m]; None leaves out C_m.
            before_last: (17, 3) two frames earlier.

        Returns:
            (25,) the hinges of the blended posture.
        """
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        centres = self._xipos[1:].copy()
        self._blended = centres[_MOVED]
        self._com_fixed = self._share[_FIXED] @ centres[_FIXED, :2]
        self._centre = centre
        self._expected: Array | None = None
        self._fixed_smoothness = 0.0
        if last is not None and before_last is not None:
            expected = 2 * last - before_last
            self._expected = expected[_MOVED]
            self._fixed_smoothness = float(self._norm(centres[_FIXED] - expected[_FIXED]).sum())
        self._start = np.array(qpos[_UPPER_QPOS])
        return self._start

    def _norm(self, difference: Array) -> Array:
        return np.asarray(np.sqrt((difference * difference).sum(axis=-1) + self._eps**2) - self._eps)

    def body_centres(self, hinges: Array) -> Array:
        """Body centres (17, 3) with these upper-body hinges, world [m]."""
        self._hinges[:] = hinges
        mujoco.mj_kinematics(self.model, self.data)
        return np.array(self._xipos[1:])

    def centres_of(self, qpos: Array) -> Array:
        """Body centres (17, 3) of a whole posture (44,); moves root and legs, so `set_frame` must follow."""
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        return np.array(self._xipos[1:])

    def com_of(self, qpos: Array) -> Array:
        """COM (2,) on the floor of a whole posture (44,) [m]; `set_frame` must follow."""
        return np.asarray(self._share @ self.centres_of(qpos)[:, :2])

    def com_jacobian(self, qpos: Array) -> Array:
        """Jacobian (2, 25) of `com_of` by the upper-body hinges [m/rad]; `set_frame` must follow."""
        self.data.qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacSubtreeCom(self.model, self.data, jacobian, 1)
        return jacobian[:2, _UPPER_QVEL]

    def costs(self, hinges: Array) -> Costs:
        """Cost terms at (25,) hinges."""
        self._hinges[:] = hinges
        mujoco.mj_kinematics(self.model, self.data)
        p = self._xipos[1 + _MOVED]
        s = self.settings
        n = len(BODIES)
        balance = smoothness = 0.0
        if self._centre is not None:
            balance = float(self._norm(self._com_fixed + self._moved_share @ p[:, :2] - self._centre))
        style = float(self._norm(p - self._blended).sum()) / n
        if self._expected is not None:
            smoothness = (float(self._norm(p - self._expected).sum()) + self._fixed_smoothness) / n
        total = s.balance_weight * balance + s.style_weight * style + s.smoothness_weight * smoothness
        change = hinges - self._start
        total += s.joint_weight / 2 * float(change @ change)
        return Costs(balance, style, smoothness, total)

    def gradient(self, hinges: Array) -> tuple[Array, Array]:
        """Gradient of the total cost and the Gauss-Newton matrix of its norms.

        Args:
            hinges: (25,) [rad].

        Returns:
            gradient: (25,) [m/rad].
            curvature: (25, 25) positive semidefinite [m/rad^2].
        """
        model, data, s = self.model, self.data, self.settings
        self._hinges[:] = hinges
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        for body_id, out in self._rows:
            mujoco.mj_jacBodyCom(model, data, out, None, body_id)
        jacobian = self._jacobian[:, :, _UPPER_QVEL]  # (10, 3, 25)
        p = self._xipos[1 + _MOVED]
        eps2, n = self._eps**2, len(BODIES)
        r = p - self._blended
        pull = s.style_weight / n / np.sqrt((r * r).sum(axis=1) + eps2)  # (10,)
        force = pull[:, None] * r
        if self._expected is not None:
            r = p - self._expected
            smooth = s.smoothness_weight / n / np.sqrt((r * r).sum(axis=1) + eps2)
            force = force + smooth[:, None] * r
            pull = pull + smooth
        flat = jacobian.reshape(-1, N_UPPER)
        gradient = force.ravel() @ flat
        weighted = flat * np.repeat(np.sqrt(pull), 3)[:, None]
        curvature = weighted.T @ weighted
        gradient = gradient + s.joint_weight * (hinges - self._start)
        curvature[_DIAGONAL] += s.joint_weight
        if self._centre is not None:
            r = self._com_fixed + self._moved_share @ p[:, :2] - self._centre
            scale = s.balance_weight / np.sqrt(r @ r + eps2)
            com = np.tensordot(self._moved_share, jacobian[:, :2], axes=1)  # (2, 25)
            gradient = gradient + scale * (r @ com)
            curvature += scale * (com.T @ com)
        return gradient, curvature

    def minimise(self, start: Array) -> tuple[Array, int]:
        """Descend from a posture, within the joint limits, in at most `settings.max_steps` steps.

        Args:
            start: (25,) hinges, within their limits.

        Returns:
            The hinges, of no higher cost than the start; and the steps taken.
        """
        hinges = start
        first = cost = self.costs(hinges).total
        steps = 0
        while steps < self.settings.max_steps:
            gradient, curvature = self.gradient(hinges)
            held = ((hinges <= self.low) & (gradient > 0)) | ((hinges >= self.high) & (gradient < 0))
            if held.any():  # a hinge pressed against its limit takes no part in this step
                gradient = np.where(held, 0.0, gradient)
                curvature[held] = 0.0
                curvature[:, held] = 0.0
            curvature[_DIAGONAL] += _DAMPING + held
            _, direction, failed = dposv(curvature, gradient)
            if failed:
                direction = gradient
            length = 1.0
            for _ in range(6):
                trial = np.clip(hinges - length * direction, self.low, self.high)
                trial_cost = self.costs(trial).total
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


@dataclass(frozen=True)
class OptimisedPostures:
    """Result of `optimise_postures`.

    Attributes:
        qpos: (T, 44).
        before: (T, 4) costs C_b, C_s, C_m, C of the blended posture after the optimised ones of the two frames before; NaN where
            the optimisation was skipped.
        after: (T, 4) costs of the result.
        steps: (T,) descent steps taken.
        goals: (T, 2) where C_b wanted the COM on the floor [m]; NaN where it was left out.
    """

    qpos: Array
    before: Array
    after: Array
    steps: NDArray[np.int64]
    goals: Array


def optimise_postures(
    qpos: Array,
    com: Array,
    centres: Array,
    share: Array,
    fps: float,
    body: Body = DEFAULT_BODY,
    settings: PreparationSettings = DEFAULT_SETTINGS,
    measure: bool = True,
) -> OptimisedPostures:
    """Optimise the upper body frame by frame; root and legs stay exactly as they are.

    With `support_smoothing` above 0, C_b draws the COM along a smooth path that comes nearer to the support centre in every
    frame (`com_path`), and where the smoothing of the postures has led the COM farther away, it is put back. With 0, C_b
    draws it to the support centre, and is left out in flight.

    Args:
        qpos: (T, 44) blended postures.
        com: (T, 3) their COM [m].
        centres: (T, 2) support centres [m]; NaN in flight.
        share: (T,) how much of the change is used, 0 (skipped) to 1.
        fps: frames per second [1/s].
        body: the humanoid.
        settings: weights and step limit.
        measure: whether to give the costs before and after; NaN otherwise.
    """
    goals = centres
    if settings.support_smoothing > 0:
        path = displacement_path(centres - com[:, :2], settings.com_reach, settings.support_smoothing * fps)
        goals = com[:, :2] + path
    problem = PostureProblem(body, settings)
    n = len(qpos)
    change = np.zeros((n, N_UPPER))
    steps = np.zeros(n, dtype=np.int64)
    last: Array | None = None
    before_last: Array | None = None
    for frame in np.flatnonzero(share > 0).tolist():
        if frame > 0 and share[frame - 1] <= 0:  # the optimisation begins: its history is the blended motion
            last = problem.centres_of(qpos[frame - 1])
            before_last = problem.centres_of(qpos[max(frame - 2, 0)])
        blended = problem.set_frame(qpos[frame], _present(goals[frame]), last, before_last)
        start = np.clip(blended, problem.low, problem.high)
        if frame > 0:
            warm = np.clip(blended + change[frame - 1], problem.low, problem.high)
            if problem.costs(warm).total < problem.costs(start).total:
                start = warm
        best, steps[frame] = problem.minimise(start)
        change[frame] = best - blended
        last, before_last = problem.body_centres(best), last
    if settings.change_smoothing > 0:
        change = gaussian_filter1d(change, settings.change_smoothing * fps, axis=0, mode="nearest")
    out = qpos.copy()
    hinges = out[:, _UPPER_QPOS] + share[:, None] * change
    out[:, _UPPER_QPOS] = np.where(share[:, None] > 0, np.clip(hinges, problem.low, problem.high), out[:, _UPPER_QPOS])
    if settings.support_smoothing > 0:
        _repair(problem, out, com[:, :2], centres, share, fps)

    before, after = np.full((n, 4), np.nan), np.full((n, 4), np.nan)
    if not measure:
        return OptimisedPostures(out, before, after, steps, goals)
    last = before_last = None
    for frame in np.flatnonzero(share > 0).tolist():
        if frame > 0 and share[frame - 1] <= 0:
            last = problem.centres_of(qpos[frame - 1])
            before_last = problem.centres_of(qpos[max(frame - 2, 0)])
        blended = problem.set_frame(qpos[frame], _present(goals[frame]), last, before_last)
        final = out[frame, _UPPER_QPOS]
        before[frame] = _row(problem.costs(blended))
        after[frame] = _row(problem.costs(final))
        last, before_last = problem.body_centres(final), last
    return OptimisedPostures(out, before, after, steps, goals)


def _repair(problem: PostureProblem, qpos: Array, com: Array, centres: Array, share: Array, fps: float) -> None:
    """Change postures in place so that the COM is nearer to the support centre than `com`, by the least hinge changes."""
    pull = centres - com
    moved = np.zeros_like(com)
    active = np.flatnonzero(share > 0)
    for _ in range(_REPAIRS):
        moved[active] = [problem.com_of(qpos[frame]) for frame in active] - com[active]
        push = displacement_repair(moved, pull, share, _REPAIR_S * fps)
        frames = np.flatnonzero(np.abs(push).max(axis=1) > _REPAIRED_M)
        if len(frames) == 0:
            return
        for frame in frames.tolist():
            jacobian = problem.com_jacobian(qpos[frame])
            change = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T, push[frame])
            qpos[frame, _UPPER_QPOS] = np.clip(qpos[frame, _UPPER_QPOS] + change, problem.low, problem.high)


def _present(centre: Array) -> Array | None:
    return None if np.isnan(centre[0]) else centre


def _row(costs: Costs) -> tuple[float, float, float, float]:
    return costs.balance, costs.style, costs.smoothness, costs.total
