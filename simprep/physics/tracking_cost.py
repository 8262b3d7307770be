"""How well simulated samples follow the reference: the cost that `mpc` minimises."""

from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.physics.reference import Reference
from simprep.physics.rollouts import Record

_TINY = 1e-12


@dataclass(frozen=True)
class CostWeights:
    """Weights of the squared errors, averaged over segments and over the instants of the horizon.

    Attributes:
        position: global segment positions [1/m^2].
        relative: segment positions relative to the pelvis [1/m^2].
        orientation: root orientation [1/rad^2].
        velocity: root linear velocity [s^2/m^2].
        spin: root angular velocity [s^2/rad^2].
        com_to_foot: COM relative to each foot, against the reference [1/m^2].
        foot_height: height of each foot [1/m^2].
        foot_velocity: velocity of each foot, against sliding in stance [s^2/m^2].
        foot_orientation: orientation of each foot: toes do not move where ankles are right [1/rad^2].
        joint_velocity: hinge velocities [s^2/rad^2].
        effort: offsets themselves [1/rad^2].
        final: extra weight of the last instant, as a multiple of all others together.
        instants: time between two scored instants [s].
    """

    position: float = 60.0
    relative: float = 200.0
    orientation: float = 10.0
    velocity: float = 0.5
    spin: float = 0.05
    com_to_foot: float = 30.0
    foot_height: float = 20.0
    foot_velocity: float = 0.5
    foot_orientation: float = 0.6
    joint_velocity: float = 0.02
    effort: float = 0.5
    final: float = 1.0
    instants: float = 0.05


class TrackingCost:
    """Scores rollouts against a reference.

    Args:
        reference: what to track, at the world's timestep.
        ratio: steps of the world in one step of the planner.
        world_dt: timestep of the world [s].
        steps: planner steps in a rollout.
        qvel_index: which entries of the reference's qvel the planner's model has.
        feet: left and right foot, indices of the body's segments.
        weights: cost weights.
    """

    def __init__(
        self,
        reference: Reference,
        ratio: int,
        world_dt: float,
        steps: int,
        qvel_index: IndexArray,
        feet: tuple[int, int],
        weights: CostWeights,
    ) -> None:
        self._weights = weights
        self._pelvis_share = weights.relative / max(weights.position + weights.relative, _TINY)
        every = max(1, round(weights.instants / (ratio * world_dt)))
        instants = np.arange(every, steps + 1, every) - 1  # rollout record index k is the state after step k
        self._even = every > 1 and steps % every == 0
        self._instants = instants if instants[-1] == steps - 1 else np.append(instants, steps - 1)
        self._ratio, self._planner_dt = ratio, ratio * world_dt
        self._after = ratio * (1 + self._instants)  # steps of the world from the start to each instant
        self._time_weight = np.ones(len(self._instants))
        self._time_weight[-1] += weights.final * len(self._instants)
        self._last = len(reference.qpos) - 1
        kinematics, both = reference.kinematics, list(feet)
        frames, segments, hinges = len(kinematics.com), kinematics.xpos.shape[1], len(qvel_index) - 6
        left, right = feet
        self._feet = _two(1 + left, 1 + right)  # in a rollout's records, whose entry 0 means nothing
        self._foot_heights = _two(3 * left + 2, 3 * right + 2)  # in flat positions
        foot = kinematics.xpos[:, both]
        self._xpos = kinematics.xpos.reshape(frames, -1)
        self._com_foot = (kinematics.com[:, None] - foot).reshape(frames, -1)
        self._foot_quat = kinematics.xquat[:, both]
        self._foot_velocity = np.gradient(foot, world_dt, axis=0).reshape(frames, -1)
        self._qpos, self._qvel = reference.qpos, np.ascontiguousarray(reference.qvel[:, qvel_index])
        self._axes = np.tile(np.arange(3), segments - 1)
        factors = self._factors_of(segments, hinges)
        ends = np.cumsum([0, *map(len, factors)]).tolist()
        self._parts = [slice(first, after) for first, after in pairwise(ends)]
        self._factors = np.concatenate(factors)
        self._scales: dict[int, FloatArray] = {}  # by how many instants count

    def residuals(self, step: int, record: Record, theta: FloatArray) -> FloatArray:
        """Weighted errors (n, R) of every sample, whose squares add up to its cost.

        Instants beyond the end of the reference do not count.

        Args:
            step: index of the rollout's start state in the reference.
            record: rollout records qpos, qvel, xpos, subtree_com, (n, steps, ...).
            theta: (n, knots, sampled) offsets [rad].
        """
        n, size = len(theta), theta[0].size
        count = bisect_right(self._after, self._last - step)
        end = count * len(self._factors)
        out = np.empty((n, end + size))
        if count:
            errors = out[:, :end]
            self._write_errors(step, record, errors.reshape(n, count, -1))  # a view
            errors *= self._scale(count)
        np.multiply(theta.reshape(n, size), np.sqrt(self._weights.effort / size), out=out[:, end:])
        return out

    def _write_errors(self, step: int, record: Record, out: FloatArray) -> None:
        """Fill (n, instants, errors) part by part; numbers are moved as little as can be, since every sample pays for it."""
        position, turn, root, com_foot, foot_height, foot_velocity, hinges, foot_turn = (
            out[..., part] for part in self._parts
        )
        instants, after = self._instants[: out.shape[1]], self._after[: out.shape[1]]
        pick, state = self._rows(instants, 0), self._rows(after, step)
        # positions recorded after a step belong to the state before it
        lagging = self._rows(after, step - self._ratio)
        xpos = record["xpos"][:, pick]  # (n, t, 1 + segments, 3)
        np.subtract(_flat(xpos[:, :, 1:]), self._xpos[lagging], out=position)
        foot_height[:] = position[..., self._foot_heights]
        others = position[..., 3:]
        others -= (self._pelvis_share * position[..., :3]).take(self._axes, axis=-1)
        _rotation_error(record["qpos"][:, pick, None, 3:7], self._qpos[state, None, 3:7], out=turn)
        qvel, target_qvel = record["qvel"][:, pick], self._qvel[state]
        np.subtract(qvel[..., :6], target_qvel[:, :6], out=root)
        np.subtract(qvel[..., 6:], target_qvel[:, 6:], out=hinges)
        foot = xpos[:, :, self._feet]
        np.subtract(_flat(record["subtree_com"][:, pick, 1, None] - foot), self._com_foot[lagging], out=com_foot)
        # backward difference over a planner step, so the reference's central one is taken half a step earlier
        velocity = foot - record["xpos"][:, self._rows(instants, -1), self._feet]
        velocity /= self._planner_dt
        central = self._foot_velocity[self._rows(after, step - self._ratio - self._ratio // 2)]
        np.subtract(_flat(velocity), central, out=foot_velocity)
        if self._weights.foot_orientation:
            _rotation_error(record["xquat"][:, pick, self._feet], self._foot_quat[lagging], out=foot_turn)

    def _rows(self, indices: IndexArray, on: int) -> slice | IndexArray:
        """Indices moved on by a number; evenly spaced ones as a slice, which is read without a copy."""
        if not self._even:
            return indices + on
        first, last = int(indices[0]) + on, int(indices[-1]) + on
        return slice(first, last + 1, max(1, (last - first) // max(1, len(indices) - 1)))

    def _scale(self, count: int) -> FloatArray:
        """Factors (count * errors,) of the errors at the first instants."""
        if count not in self._scales:
            weight = self._time_weight[:count] / self._time_weight[:count].sum()
            self._scales[count] = np.sqrt(self._factors * weight[:, None]).ravel()
        return self._scales[count]

    def _factors_of(self, segments: int, hinges: int) -> tuple[FloatArray, ...]:
        """Weights of the squares of each part of the errors at an instant."""
        w = self._weights
        own, relative = w.position / segments, w.relative / segments
        return (
            # own e^2 + relative (e - p)^2 of a segment's error e and the pelvis' p is (own + relative) (e - share p)^2 and
            # own share p^2: half the numbers for the same sum
            np.repeat([own * (1 + (segments - 1) * self._pelvis_share), own + relative], [3, 3 * (segments - 1)]),
            np.full(3, 4 * w.orientation),
            np.repeat([w.velocity, w.spin], 3),
            np.full(6, w.com_to_foot / 2),
            np.full(2, w.foot_height / 2),
            np.full(6, w.foot_velocity / 2),
            np.full(hinges, w.joint_velocity / hinges),
            np.full(6 if w.foot_orientation else 0, 4 * w.foot_orientation / 2),
        )


def _two(first: int, second: int) -> slice:
    """Two entries as a slice, which is read without a copy."""
    step = second - first
    stop = second + (1 if step > 0 else -1)
    return slice(first, stop if stop >= 0 else None, step)


def _flat(vectors: FloatArray) -> FloatArray:
    """(n, t, parts, 3) as (n, t, 3 parts)."""
    return vectors.reshape(*vectors.shape[:2], -1)


# a0 b - b0 a - a x b by components: of a's and b's 12 products, the first six less the others, then three less three
_A = np.array([0, 0, 0, 2, 3, 1, 1, 2, 3, 3, 1, 2])
_B = np.array([1, 2, 3, 3, 1, 2, 0, 0, 0, 2, 3, 1])


def _rotation_error(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Vector part of conj(a) b for unit quaternions wxyz: the sine of half the angle between them, along the axis.

    Args:
        a: (n, t, parts, 4).
        b: (t, parts, 4).
        out: (n, t, 3 parts) to write to.
    """
    products = a.transpose(3, 0, 1, 2).take(_A, axis=0)  # each component of all in a row: long rows are faster
    products *= b.transpose(2, 0, 1).take(_B, axis=0)[:, None]
    differences = products[:6] - products[6:]
    np.subtract(differences[:3], differences[3:], out=out.reshape(*a.shape[:3], 3).transpose(3, 0, 1, 2))
