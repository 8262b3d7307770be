"""Inverse kinematics of whole clips for robots, by the library mink (extra `robots`).

Joints keep their ranges and their largest speeds, the body stays out of the floor and of itself. Every frame starts from
the one before it and goes a few steps of mink's quadratic programme (differential inverse kinematics).
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.character import ROLES, SPEED_SHARE, Character
from simprep.errors import MissingExtraError
from simprep.motion.closed_form import closed_form
from simprep.motion.retarget import RetargetSettings, Solution, Weights
from simprep.motion.retarget_problem import PLACE, TURN
from simprep.motion.self_contact import collision_model
from simprep.motion.targets import ORIENTED, Targets

_ANY = 2**20  # a collision bit that all geoms get


@dataclass(frozen=True)
class RobotIkSettings:
    """What mink is told, beside the weights of `RetargetSettings`.

    Attributes:
        iterations: largest number of steps of a frame, and first_iterations: of the first one.
        tolerance: a step that turns no joint by more than this is the last [rad].
        largest_step: a step that turns anything by more is shortened: it would leave what its equations know [rad].
        damping: on all velocities, lest a step through a contact turns a light wrist half around.
        smooth_cost: pull of every joint to where it was in the frame before [1/rad].
        clearance: distance that the body keeps from itself, and push_out: how far a step moves what is nearer [m].
        lift_out: how far a step lifts, at most, what is in the floor [m].
        near: distance within which mink looks at a pair of geoms, and near_floor: at the floor [m].
    """

    iterations: int = 20
    first_iterations: int = 40
    tolerance: float = 0.003
    largest_step: float = 0.2
    damping: float = 0.01
    smooth_cost: float = 0.02
    clearance: float = 0.002
    push_out: float = 0.002
    lift_out: float = 0.005
    near: float = 0.04
    near_floor: float = 0.06


def solve_robot(
    targets: Targets,
    standing: BoolArray,
    character: Character,
    weights: RetargetSettings | None = None,
    settings: RobotIkSettings | None = None,
) -> Solution:
    """Poses that follow the targets, one after the other.

    Args:
        targets: where the joints should be: the source's bones with the robot's lengths.
        standing: (T, 2) whether each foot's target is a foothold to be met closely.
        character: the robot.
        weights: of positions, orientations and the pull to the closed form.
        settings: further ones.

    Raises:
        MissingExtraError: mink is not installed.
    """
    weights = weights or RetargetSettings()
    start = closed_form(targets, character)
    solver = _Solver(targets, Weights(character, weights, targets, standing), character, settings or RobotIkSettings())
    out, unsettled = np.empty_like(start), np.zeros(len(start), dtype=bool)
    for frame, rest in enumerate(start):
        out[frame], step = solver.frame(frame, rest, out[frame - 1] if frame else None)
        unsettled[frame] = step > weights.tolerance
    return Solution(out, unsettled)


def at_full_speed(qpos: FloatArray, fps: float, character: Character) -> list[str]:
    """Joints that turn as fast as an import lets them in some frame of poses (T, nq), by name."""
    if not character.velocity_limits:
        return []
    share = np.abs(np.diff(qpos[:, 7:], axis=0)) * fps / np.array(character.velocity_limits)
    return [name for name, most in zip(character.joints, share.max(axis=0, initial=0.0)) if most > SPEED_SHARE - 1e-6]


class _Solver:
    """Mink's tasks and limits of a clip.

    Args:
        targets: where the joints should be.
        weights: of their rows.
        character: the robot.
        settings: what mink is told.
    """

    def __init__(self, targets: Targets, weights: Weights, character: Character, settings: RobotIkSettings) -> None:
        try:
            import mink
        except ImportError:
            raise MissingExtraError(f"moving a motion onto {character.name!r}", "robots") from None
        self._mink, self._targets, self._weights, self._settings = mink, targets, weights, settings
        scene = collision_model(character)
        model = copy(scene.model)
        geoms = np.flatnonzero((model.geom_bodyid > 0) & (model.geom_contype > 0)).tolist()
        model.geom_contype[geoms] |= _ANY  # mink leaves out pairs that would not collide in a simulation
        model.geom_conaffinity[geoms] |= _ANY
        self._configuration = mink.Configuration(model)
        self._frames = []  # role's number, body, task, and which orientation tells it
        for number, role in enumerate(ROLES):
            if character.has(role):
                told = ORIENTED.index(number) if number in ORIENTED else None
                if told is not None and not targets.oriented[told]:
                    told = None
                body = model.body(character.roles[role]).id
                self._frames.append((number, body, mink.FrameTask(body, "body", 0.0, 0.0), told))
        self._posture = mink.PostureTask(model, np.concatenate([np.zeros(6), np.sqrt(weights.pull[6:])]))
        self._before = mink.PostureTask(model, settings.smooth_cost)
        self._range = mink.ConfigurationLimit(model, gain=1.0)
        self._low, self._high = self._range.lower.copy(), self._range.upper.copy()
        most = np.array(character.velocity_limits) if character.velocity_limits else np.full(model.nv - 6, np.inf)
        self._most = SPEED_SHARE * most / targets.fps
        pairs = [([one], [other]) for one, other in scene.pairs]
        floor = [(np.flatnonzero(model.geom_bodyid == 0).tolist(), geoms)]
        itself = mink.CollisionAvoidanceLimit(
            model, pairs, 0.85, settings.clearance, settings.near, bound_relaxation=-settings.push_out
        )
        # for mink, what is below the floor stays; so it allows some depth, of which every step must undo as much
        depth = settings.lift_out
        over = mink.CollisionAvoidanceLimit(model, floor, 1.0, -depth, settings.near_floor, bound_relaxation=-depth)
        self._limits = [_Active(over), _Active(itself)]

    def frame(self, frame: int, rest: FloatArray, before: FloatArray | None) -> tuple[FloatArray, float]:
        """A frame's pose (nq,) and the largest turn of its last step [rad].

        Args:
            frame: which.
            rest: (nq,) its closed form, which it is pulled to a little.
            before: (nq,) the pose before it, from which it starts; None for the first, which starts from its closed form.
        """
        settings, configuration = self._settings, self._configuration
        cost = self._weights.rows(np.array([frame]))[0]
        for number, _, task, told in self._frames:
            task.set_position_cost(cost[PLACE[ROLES[number]]])
            if told is not None:
                task.set_orientation_cost(cost[TURN[ROLES[number]]])
        self._posture.set_target(rest)
        tasks = [*(task for _, _, task, _ in self._frames), self._posture]
        steps = settings.first_iterations
        if before is None:
            configuration.update(rest)
        else:
            steps = settings.iterations
            self._before.set_target(before)
            tasks.append(self._before)
            # the joint's speed, as a range about where it was: a frame has several steps
            self._range.lower[7:] = np.maximum(self._low[7:], before[7:] - self._most)
            self._range.upper[7:] = np.minimum(self._high[7:], before[7:] + self._most)
        step = 0.0
        for _ in range(steps):
            self._aim(frame)
            change = self._step(tasks)
            step = float(np.abs(change[3:]).max())
            configuration.integrate_inplace(change * min(1.0, settings.largest_step / max(step, 1e-12)), 1.0)
            if step < settings.tolerance:
                break
        return configuration.q, step

    def _aim(self, frame: int) -> None:
        """Set the targets of a frame; where the source tells no orientation, it is the present one."""
        mink, targets, data = self._mink, self._targets, self._configuration.data
        for number, body, task, told in self._frames:
            turn = (
                mink.SO3(data.xquat[body].copy())
                if told is None
                else mink.SO3.from_matrix(targets.orientations[frame, told])
            )
            task.set_target(mink.SE3.from_rotation_and_translation(turn, targets.positions[frame, number]))

    def _step(self, tasks: Sequence[Any]) -> FloatArray:
        """Change of the pose (nv,); of limits that cannot all be kept, first the body's own contacts give way."""
        mink = self._mink
        for kept in (2, 1, 0):
            limits = [self._range, *self._limits[:kept]]
            try:
                # a step lasts 1: mink's limits of collisions are right for that only
                return np.asarray(
                    mink.solve_ik(self._configuration, tasks, 1.0, "daqp", self._settings.damping, limits=limits)
                )
            except mink.NoSolutionFound:
                continue
        return np.zeros(self._configuration.nv)


class _Active:
    """A limit of mink's without the rows that bound nothing: of some hundred pairs a few are near.

    Args:
        limit: mink's.
    """

    def __init__(self, limit: Any) -> None:
        self._limit = limit

    def compute_qp_inequalities(self, configuration: Any, dt: float) -> Any:
        """As mink asks for it."""
        rows = self._limit.compute_qp_inequalities(configuration, dt)
        active = np.isfinite(rows.h)
        return type(rows)(rows.G[active], rows.h[active]) if active.any() else type(rows)()
