"""The cost that posture optimisation minimises, and its descent, one frame at a time (paper, section 5.3, Eq. 6-10).

The cost is a sum of norms with an analytic gradient, through MuJoCo's body Jacobians. Each step goes along the gradient
divided by the Gauss-Newton matrix of the norms (each replaced by the parabola that touches it from above), halved until
the cost falls: it gets to the optimum in 10 steps, which plain gradient descent does not.
"""

from dataclasses import dataclass
from math import sqrt
from threading import get_ident
from typing import NamedTuple

import mujoco
import numpy as np
from scipy.linalg.lapack import dposv

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.character import Character
from simprep.motion.kinematics import working_memory
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings

_DAMPING = 1e-5  # keeps hinges that move no body centre (wrist, pronation) where they are
_ENOUGH = 2e-3  # a step that gains less than this share of the reduction so far is the last


class Costs(NamedTuple):
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
        wanted: (2,) where C_b wants the COM on the floor, less the part of the bodies that do not move [m]; None: no C_b.
        fixed_smoothness: part of the bodies that do not move in the sum of C_m [m per frame squared].
        anchors: (1, M, 3) body centres of the blended posture, of the bodies that move [m]; or (2, M, 3), followed by
            those that continue the two frames before in a straight line, for C_m.
    """

    qpos: FloatArray
    hinges: FloatArray
    wanted: FloatArray | None
    fixed_smoothness: float
    anchors: FloatArray

    def after(self, before_last: FloatArray, last: FloatArray) -> "PostureFrame":
        """The frame with C_m after other centres (M, 3) of the bodies that move, two frames and one frame earlier [m]."""
        anchors = np.array([self.anchors[0], 2 * last - before_last])
        return PostureFrame(self.qpos, self.hinges, self.wanted, self.fixed_smoothness, anchors)


class _Posture(NamedTuple):
    """A frame's costs at some hinges, and what its gradient there takes from them."""

    hinges: FloatArray
    change: FloatArray  # (K,) from the blended hinges [rad]
    offsets: FloatArray  # (1 or 2, M, 3) from the anchors [m]
    distances: FloatArray  # (1 or 2, M) their smooth norms [m]
    com: FloatArray | None  # (2,) from where C_b wants it [m]
    costs: Costs


class PostureProblem:
    """The cost of a frame (`frame`) as a function of the K balancing hinges, which move M segments.

    Args:
        character: whose postures they are; its `balancing` joints move.
        settings: weights and the smoothing of the norms.

    Attributes:
        columns: (K,) entries of a pose that the optimisation changes.
        low: (K,) lower limits [rad], high: (K,) upper limits.
        moved: (M,) segments that move.
    """

    def __init__(self, character: Character, settings: PreparationSettings = DEFAULT_SETTINGS) -> None:
        self.model = character.model
        self.data = working_memory(self.model, get_ident())
        self.settings = settings
        joints = character.joint_indices(character.balancing)
        self.columns = 7 + joints
        self._velocities = 6 + joints
        self.low = self.model.jnt_range[1 + joints, 0]
        self.high = self.model.jnt_range[1 + joints, 1]
        moved = _moved_segments(self.model, 1 + joints)
        self.moved, self._fixed = np.flatnonzero(moved), np.flatnonzero(~moved)
        self._moved_ids = self.moved + 1  # in the model, which begins with the world
        mass = self.model.body_mass[1:]
        self._share = mass / mass.sum()
        self._moved_share, self._fixed_share = self._share[self.moved], self._share[self._fixed]
        self._jacobian = np.zeros((len(self.moved), 3, self.model.nv))
        self._jacobians = [(int(i), self._jacobian[row]) for row, i in enumerate(self._moved_ids)]
        self._rows = np.zeros((3 * len(self.moved) + 2, len(joints)))  # of the Gauss-Newton matrix: bodies, then COM
        self._body_rows = self._rows[:-2].reshape(len(self.moved), 3, -1)
        self._eps = settings.smooth_norm
        self._eps2 = self._eps**2
        self._weights = np.array([[settings.style_weight], [settings.smoothness_weight]]) / len(mass)
        self._qpos = self.data.qpos
        self._xipos = self.data.xipos

    def frame(
        self,
        qpos: FloatArray,
        centre: FloatArray | None,
        last: FloatArray | None = None,
        before_last: FloatArray | None = None,
    ) -> PostureFrame:
        """A frame whose posture is to be optimised.

        Args:
            qpos: (nq,) blended posture.
            centre: (2,) where C_b wants the COM on the floor [m]; None leaves out C_b.
            last: (segments, 3) optimised body centres one frame earlier [m]; None leaves out C_m.
            before_last: (segments, 3) two frames earlier.
        """
        centres = self.centres_of(qpos)
        goal = np.full(2, np.nan) if centre is None else centre
        straight_on, first = centres, 1
        if last is not None and before_last is not None:
            straight_on, first = 2 * last - before_last, 0
        return self.frames(qpos[None], centres[None], goal[None], straight_on[None], first)[0]

    def frames(
        self, qpos: FloatArray, centres: FloatArray, goals: FloatArray, straight_on: FloatArray, first: int
    ) -> list[PostureFrame]:
        """Frames of a motion.

        Args:
            qpos: (T, nq) blended postures.
            centres: (T, segments, 3) their body centres [m].
            goals: (T, 2) where C_b wants the COM on the floor [m]; NaN leaves out C_b.
            straight_on: (T, segments, 3) body centres that continue the two frames before in a straight line [m].
            first: first frame with C_m.
        """
        offsets = (centres - straight_on).take(self._fixed, axis=1)
        smoothness = np.add.reduce(self._distances(offsets) - self._eps, axis=1).tolist()
        wanted = goals - self._fixed_share @ centres.take(self._fixed, axis=1)[..., :2]
        absent = np.isnan(wanted[:, 0]).tolist()
        hinges = qpos.take(self.columns, axis=1)
        anchors = np.stack([centres, straight_on], axis=1).take(self.moved, axis=2)
        return [
            PostureFrame(
                qpos[t], hinges[t], None if absent[t] else wanted[t], smoothness[t], anchors[t, : 1 + (t >= first)]
            )
            for t in range(len(qpos))
        ]

    def _distances(self, offsets: FloatArray) -> FloatArray:
        """Smooth norms (...) of (..., 3), not yet 0 at 0."""
        distances: FloatArray = np.sqrt(np.vecdot(offsets, offsets) + self._eps2)
        return distances

    def _within(self, hinges: FloatArray) -> FloatArray:
        return np.asarray(np.minimum(np.maximum(hinges, self.low), self.high))

    def moved_centres(self, frame: PostureFrame, hinges: FloatArray) -> FloatArray:
        """Centres (M, 3) of the bodies that move, with these balancing hinges, world [m]."""
        self._qpos[:] = frame.qpos
        self._qpos[self.columns] = hinges
        mujoco.mj_kinematics(self.model, self.data)
        return np.asarray(self._xipos.take(self._moved_ids, axis=0))

    def centres_of(self, qpos: FloatArray) -> FloatArray:
        """Body centres (segments, 3) of a whole posture (nq,)."""
        self._qpos[:] = qpos
        mujoco.mj_kinematics(self.model, self.data)
        return np.array(self._xipos[1:])

    def com_of(self, qpos: FloatArray) -> FloatArray:
        """COM (2,) on the floor of a whole posture (nq,) [m]."""
        return np.asarray(self._share @ self.centres_of(qpos)[:, :2])

    def com_jacobian(self, qpos: FloatArray) -> FloatArray:
        """Jacobian (2, K) of `com_of` by the balancing hinges [m/rad]."""
        self.centres_of(qpos)
        mujoco.mj_comPos(self.model, self.data)
        jacobian = np.zeros((3, self.model.nv))
        mujoco.mj_jacSubtreeCom(self.model, self.data, jacobian, 1)
        return np.asarray(jacobian[:2].take(self._velocities, axis=1))

    def costs(self, frame: PostureFrame, hinges: FloatArray) -> Costs:
        """Cost terms of a frame at (K,) hinges."""
        return self._at(frame, hinges).costs

    def costs_of_all(self, frames: list[PostureFrame], hinges: FloatArray, moved: FloatArray) -> FloatArray:
        """`costs` (N, 4) of N frames at (N, K) hinges, with their `moved_centres` (N, M, 3)."""
        s, n = self.settings, len(self._share)
        blended, straight_on = (np.array([frame.anchors[i] for frame in frames]) for i in (0, -1))
        style, smoothness = ((self._distances(moved - at) - self._eps).sum(axis=1) / n for at in (blended, straight_on))
        smoothness += np.array([frame.fixed_smoothness for frame in frames]) / n
        smoothness[[len(frame.anchors) == 1 for frame in frames]] = 0.0
        wanted = np.array([(np.nan, np.nan) if frame.wanted is None else frame.wanted for frame in frames])
        com = self._moved_share @ moved[..., :2] - wanted
        balance = np.nan_to_num(np.sqrt((com * com).sum(axis=1) + self._eps2) - self._eps)
        change = hinges - np.array([frame.hinges for frame in frames])
        total = s.balance_weight * balance + s.style_weight * style + s.smoothness_weight * smoothness
        total += s.joint_weight / 2 * (change * change).sum(axis=1)
        return np.stack([balance, style, smoothness, total], axis=1)

    def _at(self, frame: PostureFrame, hinges: FloatArray) -> _Posture:
        p = self.moved_centres(frame, hinges)
        s, n = self.settings, len(self._share)
        offsets = p - frame.anchors
        distances = self._distances(offsets)
        balance, smoothness, com = 0.0, 0.0, None
        if frame.wanted is not None:
            com = self._moved_share.dot(p)[:2] - frame.wanted
            x, y = com.tolist()
            balance = sqrt(x * x + y * y + self._eps2) - self._eps
        style, *others = np.add.reduce(distances - self._eps, axis=1).tolist()
        style /= n
        if others:
            smoothness = (others[0] + frame.fixed_smoothness) / n
        total = s.balance_weight * balance + s.style_weight * style + s.smoothness_weight * smoothness
        change = hinges - frame.hinges
        total += s.joint_weight / 2 * float(change.dot(change))
        return _Posture(hinges, change, offsets, distances, com, Costs(balance, style, smoothness, total))

    def gradient(self, frame: PostureFrame, hinges: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Gradient (K,) [m/rad] of a frame's cost at (K,) hinges [rad], and the (K, K) damped Gauss-Newton matrix [m/rad^2]."""
        return self._gradient_here(frame, self._at(frame, hinges))

    def _gradient_here(self, frame: PostureFrame, posture: _Posture) -> tuple[FloatArray, FloatArray]:
        """`gradient` at the posture of which `moved_centres` were found last."""
        model, data, s = self.model, self.data, self.settings
        mujoco.mj_comPos(model, data)
        for body_id, out in self._jacobians:
            mujoco.mj_jacBodyCom(model, data, out, None, body_id)
        jacobian = self._jacobian.take(self._velocities, axis=2)  # (M, 3, K)
        pulls = self._weights[: len(posture.distances)] / posture.distances  # (1 or 2, M)
        forces = pulls[..., None] * posture.offsets
        force, pull = forces[0], pulls[0]
        if len(pulls) > 1:
            force, pull = force + forces[1], pull + pulls[1]
        gradient = force.ravel().dot(jacobian.reshape(force.size, -1)) + s.joint_weight * posture.change
        np.multiply(jacobian, np.sqrt(pull)[:, None, None], out=self._body_rows)
        rows = self._rows[:-2]
        if posture.com is not None:
            rows, scale = self._rows, s.balance_weight / sqrt(posture.com.dot(posture.com) + self._eps2)
            com = self._moved_share.dot(jacobian.reshape(len(force), -1)).reshape(3, -1)[:2]
            gradient += (scale * posture.com).dot(com)
            np.multiply(com, sqrt(scale), out=rows[-2:])
        curvature = rows.T.dot(rows)
        curvature.reshape(-1)[:: len(gradient) + 1] += s.joint_weight + _DAMPING
        return gradient, curvature

    def minimise(self, frame: PostureFrame, *starts: FloatArray) -> tuple[FloatArray, int]:
        """Descend from the best of some (K,) hinges, brought within the joint limits, in at most `settings.max_steps` steps.

        Returns:
            The hinges, of no higher cost than the starts; and the steps taken.
        """
        tried = [self._at(frame, self._within(start)) for start in starts]
        best = min(tried, key=lambda posture: posture.costs.total)
        if best is not tried[-1]:
            self.moved_centres(frame, best.hinges)
        first = best.costs.total
        steps = 0
        while steps < self.settings.max_steps:
            found = self._step(frame, best)
            if found is None:
                break
            steps += 1
            gained, best = best.costs.total - found.costs.total, found
            if gained < _ENOUGH * (first - found.costs.total) or gained < 1e-7:
                break
        return best.hinges, steps

    def _step(self, frame: PostureFrame, posture: _Posture) -> _Posture | None:
        """One step down from the posture of which `moved_centres` were found last; None where there is none."""
        gradient, curvature = self._gradient_here(frame, posture)
        hinges = posture.hinges
        held = hinges == np.where(gradient > 0, self.low, self.high)
        if np.count_nonzero(held):  # a hinge pressed against its limit takes no part in this step
            gradient[held] = 0.0
            curvature[held] = 0.0
            curvature[:, held] = 0.0
            curvature[held, held] = 1.0
        if self.settings.descent == "steepest":
            bend = float(gradient @ curvature @ gradient)
            direction = gradient * (float(gradient @ gradient) / bend if bend > 0 else 0.0)
        else:
            _, direction, failed = dposv(curvature.T, gradient, overwrite_a=True)  # symmetric; LAPACK wants columns
            if failed:
                direction = gradient
        for _ in range(6):
            trial = self._at(frame, self._within(hinges - direction))
            if trial.costs.total < posture.costs.total:
                return trial
            direction /= 2
        return None


def _moved_segments(model: mujoco.MjModel, joint_ids: IndexArray) -> BoolArray:
    """Segments (segments,) that some of these joints move: the joints' own and all that hang on them."""
    moved = np.zeros(model.nbody, dtype=bool)
    moved[model.jnt_bodyid[joint_ids]] = True
    for body in range(1, model.nbody):  # a parent comes before its children
        moved[body] |= moved[model.body_parentid[body]]
    return moved[1:]
