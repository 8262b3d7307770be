"""`mpc`: servo targets corrected by receding-horizon sampling in a batch of simulations.

Every `replan` seconds, a few iterations improve the offsets of the next `horizon` seconds; the first plan starts from
nothing and gets more. Each samples offsets around the last solution, simulates every sample from the current state, and
combines the samples so that the errors against the reference get least (`simprep.physics.sampling`). Servo targets are
feed-forward + offset. `mujoco.batch` gives the same bits at any thread count. Several bodies are sampled in the same
simulations, in which they touch each other.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from time import perf_counter
from typing import Any

import mujoco
import numpy as np

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.physics.controller import ControlTask
from simprep.physics.feedforward import Feedforward
from simprep.physics.knots import Knots
from simprep.physics.mpc_settings import MpcSettings
from simprep.physics.planner import build_planner
from simprep.physics.reference import Reference
from simprep.physics.rollouts import Record, Rollouts, record_of
from simprep.physics.sampling import OffsetSearch
from simprep.physics.start_search import StartSearch
from simprep.physics.tracking_cost import TrackingCost
from simprep.threads import blas_on_one_thread


class MpcController:
    """Receding-horizon sampling of servo-target offsets; its state is the current plan and the random generator."""

    name = "mpc"

    def __init__(self, task: ControlTask, settings: MpcSettings | None = None) -> None:
        self._settings = s = settings or MpcSettings()
        self._task, model = task, task.model
        world_dt = float(model.opt.timestep)
        self._ratio = max(1, round(s.timestep / world_dt))
        dt = self._ratio * world_dt
        self._planner = planner = build_planner(model, task.scene, dt)
        self._steps = max(1, round(s.horizon / dt))
        self._every = max(1, round(s.replan / world_dt))  # in steps of the world
        self._rng = np.random.default_rng(task.seed)
        self._knots = Knots(s.knot_spacing, self._steps, dt, self._every, world_dt, s.fade_in)
        std = [
            np.array([_noise_of(body.character.movement(name), s.noise) for name in body.joint_names]) * s.noise_scale
            for body in planner.bodies
        ]
        sampled = [np.flatnonzero(one) for one in std]
        self._widths = [len(one) for one in sampled]
        everybody = range(len(planner.bodies))
        together = [tuple(everybody)] if s.common_search else [(number,) for number in everybody]
        self._searches = [
            _Search(
                members,
                np.concatenate([planner.bodies[member].controls.start + sampled[member] for member in members]),
                OffsetSearch(
                    self._knots.count,
                    np.concatenate([std[member][sampled[member]] for member in members]),
                    s.searches[0],
                ),
            )
            for members in together
        ]
        self._rollouts: dict[int, Rollouts] = {}  # by their number of samples, made when needed
        self._efforts = s.searches
        self._plans = [0] * len(self._efforts)  # how many of each
        self._offsets = np.zeros((self._every, model.nu))
        self._offset = np.zeros(model.nu)  # sent last
        self._planned_at = -1
        self._start_change = np.zeros((len(planner.bodies), 6))
        self._sent: deque[FloatArray] = deque(maxlen=task.delay)
        self._present = mujoco.MjData(model)
        self.total_s = 0.0
        self.rejected = 0
        self._feedforward = Feedforward(task, s.torque_share)
        self.follow(task.references, 0)

    def follow(self, references: Sequence[Reference], shift: int) -> None:
        """Track other references from now on (see `Controller`); the plan stays."""
        s, task, planner = self._settings, self._task, self._planner
        self._planned_at += shift if self._planned_at >= 0 else 0
        self._feedforward.follow(references, max(0, self._planned_at))  # what was before is not sent again
        self._last = len(references[0].qpos) - 1
        dt = float(task.model.opt.timestep)
        self._costs = [
            TrackingCost(reference, self._ratio, dt, self._steps, dofs, body.feet, s.weights)
            for reference, dofs, body in zip(references, planner.dofs, planner.bodies)
        ]

    @property
    def simulation_s(self) -> float:
        """Computing time spent inside MuJoCo so far [s]."""
        return sum(rollouts.simulation_s for rollouts in self._rollouts.values())

    def start(self, data: mujoco.MjData) -> FloatArray:
        """Velocities (nv,) to start with [m/s, rad/s]: the roots' may change a little, searched with the first plan.

        Args:
            data: the bodies on their references; read only.
        """
        begin = perf_counter()
        with blas_on_one_thread():
            self._start_change = self._searched_start(data)
        qvel = data.qvel.copy()
        for body, own in zip(self._task.bodies, self._start_change):
            qvel[body.qvel.start : body.qvel.start + 6] += own
        self.total_s += perf_counter() - begin
        return np.asarray(qvel)

    def _searched_start(self, data: mujoco.MjData) -> FloatArray:
        """Changes (bodies, 6) of the roots' velocities; the plan found with them stays for the first one."""
        s = self._settings
        std = np.repeat([s.start_speed, s.start_spin], 3)
        before = self._before_offsets(0)
        starts = [StartSearch(one.search, len(one.members), std) for one in self._searches]
        for _ in range(s.first_rounds):
            for one in starts:
                one.begin()
            for iteration in range(s.iterations):
                tried = [one.sample(self._rng, iteration) for one in starts]
                change = np.concatenate([of_members for _, of_members in tried], axis=1)
                residuals, failed = self._simulate(0, data, before, [theta for theta, _ in tried], change)
                for one, (theta, own), errors in zip(starts, tried, residuals):
                    one.update(theta, own, errors, failed, final=iteration == s.iterations - 1)
        return np.concatenate([one.finish() for one in starts])

    def target(self, step: int, data: mujoco.MjData) -> FloatArray:
        """Servo targets for the coming step (see `Controller.target`); plans anew when due."""
        if self._planned_at < 0 or step - self._planned_at >= self._every:
            begin = perf_counter()
            with blas_on_one_thread():
                self._replan(step, self._predicted(data))
            self._planned_at = step
            self.total_s += perf_counter() - begin
        self._offset = self._offsets[step - self._planned_at].copy()
        targets = np.asarray(self._feedforward.targets[step] + self._offset)
        self._sent.append(targets)
        return targets

    def _predicted(self, data: mujoco.MjData) -> mujoco.MjData:
        """The present state, simulated from an old one by the targets that were sent since."""
        if not self._sent:
            return data
        present = self._present
        present.qpos[:], present.qvel[:], present.time = data.qpos, data.qvel, data.time
        for targets in self._sent:
            present.ctrl[:] = targets
            mujoco.mj_step(self._task.model, present)
        mujoco.mj_kinematics(self._task.model, present)
        return present

    def settings(self) -> dict[str, Any]:
        """Configuration, for the record."""
        record = {**asdict(self._settings), "rejected_samples": self.rejected}
        record["plans_by_effort"] = list(self._plans)
        record["start_change_mps_radps"] = self._start_change.tolist()
        if len(self._costs) == 1:
            del record["common_search"]  # means nothing for one body
        return record

    def _replan(self, step: int, data: mujoco.MjData) -> None:
        passed = self._knots.go_on(step - self._planned_at if self._planned_at >= 0 else 0)
        cost = max(one.search.cost for one in self._searches)  # of the last plan
        level = sum(cost > least for least, _, _ in self._settings.harder)
        self._plans[level] += 1
        for one in self._searches:
            one.search.settings = self._efforts[level]
            one.search.begin(passed)
        before = self._before_offsets(step)
        for iteration in range(self._settings.iterations):
            tried = [one.search.sample(self._rng, iteration) for one in self._searches]
            residuals, failed = self._simulate(step, data, before, tried)
            improved = [
                one.search.update(theta, errors, failed, final=iteration == self._settings.iterations - 1)
                for one, theta, errors in zip(self._searches, tried, residuals)
            ]
            if not all(improved):
                break  # every sample diverged: keep the plan
        self._offsets[:] = self._knots.world_before[:, None] * self._offset
        for one in self._searches:
            self._offsets[:, self._planner.controls[one.controls]] += self._knots.world @ one.search.plan

    def _before_offsets(self, step: int) -> FloatArray:
        """Servo targets (steps, planned controls) of a plan from a step on, but for what it changes [rad]."""
        frames = np.minimum(step + self._ratio * np.arange(1, self._steps + 1) - 1, self._last)
        self._feedforward.lead(int(frames[-1]))
        controls = self._planner.controls
        fading = self._knots.plan_before[:, None] * self._offset[controls]
        return np.asarray(self._feedforward.targets[frames[:, None], controls] + fading)

    def _simulate(
        self,
        step: int,
        data: mujoco.MjData,
        before: FloatArray,
        tried: list[FloatArray],
        change: FloatArray | None = None,
    ) -> tuple[list[FloatArray], BoolArray]:
        """Errors (samples, R) of the offsets that each search tries, and which samples (samples,) failed."""
        offsets = np.zeros((len(tried[0]), self._knots.count, len(self._planner.controls)))
        for one, theta in zip(self._searches, tried):
            offsets[:, :, one.controls] = theta
        control = self._knots.plan @ offsets
        control += before
        record, failed = self._rollouts_of(len(control)).run(data, control, change)
        residuals = [self._residuals(step, one, record, theta) for one, theta in zip(self._searches, tried)]
        for errors in residuals:
            failed |= ~np.isfinite(errors.sum(axis=1))  # finite if all are
        self.rejected += int(np.count_nonzero(failed))
        return residuals, failed

    def _rollouts_of(self, samples: int) -> Rollouts:
        if samples not in self._rollouts:
            s = self._settings
            self._rollouts[samples] = Rollouts(
                self._planner, samples, self._steps, s.threads, s.weights.foot_orientation > 0
            )
        return self._rollouts[samples]

    def _residuals(self, step: int, one: "_Search", record: Record, theta: FloatArray) -> FloatArray:
        parts, first = [], 0
        for member in one.members:
            own = theta[:, :, first : first + self._widths[member]]
            first += self._widths[member]
            parts.append(self._costs[member].residuals(step, record_of(record, self._planner.bodies[member]), own))
        return np.concatenate(parts, axis=1) if len(parts) > 1 else parts[0]


@dataclass(frozen=True)
class _Search:
    """Offsets that are judged together.

    Attributes:
        members: bodies whose errors count together.
        controls: (sampled,) the planner's actuators that the offsets belong to.
        search: the search itself.
    """

    members: tuple[int, ...]
    controls: IndexArray
    search: OffsetSearch


def _noise_of(movement: str, noise: tuple[tuple[str, float], ...]) -> float:
    return next((value for ending, value in noise if movement.endswith(ending)), 0.0)
