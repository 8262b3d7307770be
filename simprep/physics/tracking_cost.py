"""How well simulated samples follow the reference: the cost that `mpc` minimises."""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.motion.rotations import cross
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
        self._feet = list(feet)
        self._foot_entries = [1 + foot for foot in feet]  # in a rollout's records, whose entry 0 means nothing
        self._ratio = ratio
        every = max(1, round(weights.instants / (ratio * world_dt)))
        self._instants = np.arange(every, steps + 1, every) - 1  # rollout record index k is the state after step k
        if self._instants[-1] != steps - 1:
            self._instants = np.append(self._instants, steps - 1)
        self._time_weight = np.ones(len(self._instants))
        self._time_weight[-1] += weights.final * len(self._instants)
        self._scales: dict[int, list[FloatArray]] = {}  # by how many instants count
        self._qpos, self._qvel = reference.qpos, np.ascontiguousarray(reference.qvel[:, qvel_index])
        self._xpos = reference.kinematics.xpos
        self._com = reference.kinematics.com
        self._foot_quat = reference.kinematics.xquat[:, self._feet]
        self._planner_dt = ratio * world_dt
        self._foot_velocity = np.gradient(self._xpos[:, self._feet], world_dt, axis=0)
        self._last = len(reference.qpos) - 1

    def residuals(self, step: int, record: Record, theta: FloatArray) -> FloatArray:
        """Weighted errors (n, R) of every sample, whose squares add up to its cost.

        Instants beyond the end of the reference do not count.

        Args:
            step: index of the rollout's start state in the reference.
            record: rollout records qpos, qvel, xpos, subtree_com, (n, steps, ...).
            theta: (n, knots, sampled) offsets [rad].
        """
        w, n = self._weights, len(theta)
        effort = np.sqrt(w.effort / theta[0].size) * theta.reshape(n, -1)
        frames = step + self._ratio * (1 + self._instants)
        count = int(np.searchsorted(frames, self._last, side="right"))
        if count == 0:
            return np.asarray(effort)
        pick, state = self._instants[:count], frames[:count]
        # positions recorded after a step belong to the state before it
        xpos = record["xpos"][:, pick, 1:]  # (n, t, segments, 3)
        com = record["subtree_com"][:, pick, 1]
        target_xpos, target_com = self._xpos[state - self._ratio], self._com[state - self._ratio]
        error = xpos - target_xpos
        foot = xpos[:, :, self._feet, :]
        target_foot = target_xpos[:, self._feet, :]
        com_foot = (com[:, :, None] - foot) - (target_com[:, None] - target_foot)
        # backward difference over a planner step, so the reference's central one is taken half a step earlier
        before = record["xpos"][:, (pick - 1)[:, None], self._foot_entries]
        foot_velocity = (foot - before) / self._planner_dt
        target_foot_velocity = self._foot_velocity[state - self._ratio - self._ratio // 2]
        velocity_error = record["qvel"][:, pick] - self._qvel[state]
        parts: tuple[FloatArray, ...] = (
            error[:, :, :1],
            error[:, :, 1:] - self._pelvis_share * error[:, :, :1],
            _rotation_error(record["qpos"][:, pick, 3:7], self._qpos[state, 3:7]),
            velocity_error[..., :3],
            velocity_error[..., 3:6],
            com_foot,
            (foot - target_foot)[..., 2],
            foot_velocity - target_foot_velocity,
            velocity_error[..., 6:],
        )
        if w.foot_orientation:
            turned = record["xquat"][:, pick[:, None], self._foot_entries]
            parts += (_rotation_error(turned, self._foot_quat[state - self._ratio]),)
        if count not in self._scales:
            self._scales[count] = self._scales_of(count, xpos.shape[2], velocity_error.shape[2] - 6)
        ends = np.cumsum([0, *(part[0, 0].size for part in parts)])
        out = np.empty((n, len(pick) * ends[-1] + effort.shape[1]))
        at_instants = out[:, : len(pick) * ends[-1]].reshape(n, len(pick), -1)  # a view
        for part, scale, first, after in zip(parts, self._scales[count], ends, ends[1:]):
            np.multiply(part.reshape(n, len(pick), -1), scale, out=at_instants[..., first:after])
        out[:, at_instants[0].size :] = effort
        return out

    def _scales_of(self, count: int, segments: int, hinges: int) -> list[FloatArray]:
        """Factors (count, 1) of each part of the residuals at the first instants."""
        w = self._weights
        weight = self._time_weight[:count] / self._time_weight[:count].sum()
        own, relative = w.position / segments, w.relative / segments
        factors = (
            # own e^2 + relative (e - p)^2 of a segment's error e and the pelvis' p is (own + relative) (e - share p)^2 and
            # own share p^2: half the numbers for the same sum
            own * (1 + (segments - 1) * self._pelvis_share),
            own + relative,
            4 * w.orientation,
            w.velocity,
            w.spin,
            w.com_to_foot / 2,
            w.foot_height / 2,
            w.foot_velocity / 2,
            w.joint_velocity / hinges,
            4 * w.foot_orientation / 2,
        )
        return [np.sqrt(factor * weight)[:, None] for factor in factors]


def _rotation_error(a: FloatArray, b: FloatArray) -> FloatArray:
    """Vector part (..., 3) of conj(a) b for unit quaternions wxyz: the sine of half the angle between them, along the axis."""
    return np.asarray(a[..., :1] * b[..., 1:] - b[..., :1] * a[..., 1:] - cross(a[..., 1:], b[..., 1:]))
