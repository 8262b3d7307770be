"""`mpc`: servo targets corrected by receding-horizon sampling in a batch of simulations.

Every `replan` seconds the offsets of the next `horizon` seconds are improved by a few cross-entropy iterations: sample
offsets around the last solution, simulate each sample with MuJoCo from the current state, score it against the
reference, and move to the weighted mean of the best. The servos see target = feed-forward + offset; nothing else acts on
the body. Samples are simulated with `mujoco.batch`, which gives the same bits at any thread count.
"""

from dataclasses import asdict, dataclass, field
from time import perf_counter
from typing import Any

import mujoco
import numpy as np
from mujoco.batch import Batch
from numpy.typing import NDArray

from simprep.errors import SettingError
from simprep.humanoid import HINGES
from simprep.physics.controller import feedforward_targets
from simprep.physics.inverse_dynamics import needed_torques
from simprep.physics.planner import build_planner
from simprep.physics.reference import Reference
from simprep.physics.tracking_cost import CostWeights, TrackingCost
from simprep.scene import SceneSettings


@dataclass(frozen=True)
class MpcSettings:
    """Configuration of the sampling controller.

    Attributes:
        timestep: step of the planner's simulations [s], rounded to a multiple of the simulated world's; the world itself may be
            finer, since it costs one simulation, not hundreds.
        horizon: look-ahead [s].
        replan: time between two plans [s].
        knot_spacing: time between two knots of the offset curve [s]; linear in between.
        samples: simulations per iteration.
        iterations: cross-entropy iterations per plan.
        elites: samples that enter the weighted mean.
        keep: best samples that enter the next plan's first iteration, moved on in time.
        shrink: factor on the noise from one iteration to the next.
        temperature: softness of the weights, in standard deviations of the elites' costs.
        noise_scale: factor on the standard deviations below.
        noise: standard deviation of the sampled offset [rad] by joint, matched by the end of the hinge name;
            joints that match none are not sampled.
        scales: the samples are split among these multiples of the noise.
        weights: cost weights.
        torque_share: share of the reference's inverse-dynamics torques that the servo targets lead by.
        threads: simulation threads; 0 for all cores. Does not change the result.

    Raises:
        SettingError: times that are not positive, or fewer samples than the plan, zero and the kept ones need.
    """

    timestep: float = 1 / 120
    horizon: float = 0.5
    replan: float = 1 / 30
    knot_spacing: float = 0.1
    samples: int = 28
    iterations: int = 2
    elites: int = 10
    keep: int = 4
    shrink: float = 0.7
    temperature: float = 0.5
    noise_scale: float = 0.8
    noise: tuple[tuple[str, float], ...] = (
        ("hip_flexion", 0.15),
        ("hip_abduction", 0.15),
        ("hip_rotation", 0.15),
        ("knee_flexion", 0.15),
        ("ankle_dorsiflexion", 0.2),
        ("ankle_inversion", 0.2),
        ("lumbar_flexion", 0.12),
        ("lumbar_bending", 0.12),
        ("lumbar_rotation", 0.12),
        ("shoulder_flexion", 0.05),
        ("shoulder_abduction", 0.05),
    )
    scales: tuple[float, ...] = (0.25, 0.5, 1.0)
    weights: CostWeights = field(default_factory=CostWeights)
    torque_share: float = 0.7
    threads: int = 0

    def __post_init__(self) -> None:
        for name in ("timestep", "horizon", "replan", "knot_spacing"):
            if not getattr(self, name) > 0:
                raise SettingError(f"mpc: {name} {getattr(self, name)} s; valid: above 0")
        if self.samples < self.keep + 2:
            raise SettingError(f"mpc: {self.samples} samples; valid: at least {self.keep + 2} (2 more than keep)")
        if not 1 <= self.elites <= self.samples or self.iterations < 1:
            raise SettingError(
                f"mpc: {self.elites} elites, {self.iterations} iterations; valid: 1 to samples, 1 or more"
            )


class MpcController:
    """Receding-horizon sampling of servo-target offsets; state is the current plan and the random generator."""

    name = "mpc"

    def __init__(
        self, reference: Reference, model: Any, scene: SceneSettings, seed: int, settings: MpcSettings | None = None
    ) -> None:
        self._settings = settings or MpcSettings()
        s = self._settings
        world_dt = float(model.opt.timestep)
        self._ratio = max(1, round(s.timestep / world_dt))
        dt = self._ratio * world_dt
        self._planner = planner = build_planner(scene, dt)
        self._steps = max(1, round(s.horizon / dt))
        self._every = max(1, round(s.replan / world_dt))  # in steps of the world
        self._rng = np.random.default_rng(seed)
        self._feedforward = feedforward_targets(reference, model)
        if s.torque_share > 0:
            torque = np.clip(needed_torques(reference), *model.actuator_forcerange.T)
            self._feedforward = self._feedforward + s.torque_share * torque / model.actuator_gainprm[:, 0]
        self._last = len(reference.qpos) - 1
        std = np.array([_noise_of(HINGES[hinge], s.noise) for hinge in planner.hinges]) * s.noise_scale
        self._sampled = np.flatnonzero(std)
        self._std = std[self._sampled]
        self._knots = int(np.ceil(s.horizon / s.knot_spacing - 1e-9)) + 1
        self._basis = _linear_basis(np.arange(self._steps, dtype=np.float64) * dt / s.knot_spacing, self._knots)
        until_replan = np.arange(self._every, dtype=np.float64) * world_dt
        self._world_basis = _linear_basis(until_replan / s.knot_spacing, self._knots)
        shift_position = np.arange(self._knots) + self._every * world_dt / s.knot_spacing
        self._shift = _linear_basis(np.minimum(shift_position, self._knots - 1), self._knots)
        self._plan = np.zeros((self._knots, len(self._sampled)))
        self._kept = np.zeros((0, *self._plan.shape))
        self._cost = TrackingCost(reference, self._ratio, world_dt, self._steps, planner.qvel, s.weights)
        self._batch = Batch(planner.model, s.samples, nthread=s.threads)
        self._body_quat = self._batch.expand("body_quat")
        self._qpos = self._batch.bind("qpos")
        self._qvel = self._batch.bind("qvel")
        self._warmstart = self._batch.bind("qacc_warmstart")
        self._time = self._batch.bind("time")
        self._scale = np.resize(np.array(s.scales), s.samples)
        self._offsets = np.zeros((self._every, len(HINGES)))
        self._planned_at = -1
        self.simulation_s = 0.0
        self.total_s = 0.0
        self.rejected = 0

    def target(self, step: int, data: Any) -> NDArray[np.float64]:
        """Servo targets for the coming step (see `Controller.target`); replans when due."""
        if self._planned_at < 0 or step - self._planned_at >= self._every:
            begin = perf_counter()
            self._replan(step, data)
            self._planned_at = step
            self.total_s += perf_counter() - begin
        return np.asarray(self._feedforward[step] + self._offsets[step - self._planned_at])

    def settings(self) -> dict[str, Any]:
        """Configuration, for the record."""
        return {**asdict(self._settings), "rejected_samples": self.rejected}

    def _replan(self, step: int, data: Any) -> None:
        s = self._settings
        carried = np.einsum("kl,nlj->nkj", self._shift, self._kept)
        mean = self._shift @ self._plan
        frames = np.minimum(step + self._ratio * np.arange(1, self._steps + 1) - 1, self._last)
        feedforward = self._feedforward[frames][:, self._planner.hinges]  # (steps, planned hinges)
        pool, costs = np.zeros((0, *mean.shape)), np.zeros(0)
        for iteration in range(s.iterations):
            noise = self._rng.standard_normal((s.samples, *mean.shape)) * self._std * s.shrink**iteration
            theta = mean + self._scale[:, None, None] * noise  # (samples, knots, sampled)
            theta[0] = mean
            if iteration == 0:
                theta[1] = 0.0
                theta[2 : 2 + len(carried)] = carried
            control = np.repeat(feedforward[None], s.samples, axis=0)
            control[:, :, self._sampled] += np.einsum("tk,nkj->ntj", self._basis, theta)
            # the state is the same for all iterations of a plan, so earlier samples stay in the competition
            pool = np.concatenate([pool, theta])
            costs = np.concatenate([costs, self._evaluate(step, data, control, theta)])
            order = np.argsort(costs, kind="stable")[: s.elites]
            order = order[np.isfinite(costs[order])]
            if len(order) == 0:
                break  # every sample diverged: keep the plan and let the simulation show what happens
            best = costs[order]
            weight = np.exp(-(best - best[0]) / (s.temperature * (np.std(best) + 1e-12)))
            mean = np.einsum("n,nkj->kj", weight / weight.sum(), pool[order])
            self._kept = pool[order[: s.keep]]
        self._plan = mean
        self._offsets[:] = 0.0
        self._offsets[:, self._planner.hinges[self._sampled]] = self._world_basis @ mean

    def _evaluate(
        self, step: int, data: Any, control: NDArray[np.float64], theta: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        self._qpos[:] = data.qpos[self._planner.qpos]
        self._qvel[:] = data.qvel[self._planner.qvel]
        self._warmstart[:] = data.qacc_warmstart[self._planner.qvel]
        for body, quat in self._planner.fused_orientations(data):
            self._body_quat[:, body] = quat
        self._time[:] = data.time
        warned = self._batch.warning[:, :, 1].sum(axis=1)
        begin = perf_counter()
        record = self._batch.rollout(
            self._steps,
            control=control,
            control_spec=mujoco.mjtState.mjSTATE_CTRL,
            record=("qpos", "qvel", "xpos", "subtree_com"),
        )
        self.simulation_s += perf_counter() - begin
        cost = self._cost.evaluate(step, record, theta)
        # MuJoCo resets a diverged state by itself, so finite numbers alone prove nothing
        failed = (self._batch.warning[:, :, 1].sum(axis=1) > warned) | ~np.isfinite(cost)
        self.rejected += int(failed.sum())
        return np.where(failed, np.inf, cost)


def _noise_of(hinge: str, noise: tuple[tuple[str, float], ...]) -> float:
    return next((value for ending, value in noise if hinge.endswith(ending)), 0.0)


def _linear_basis(position: NDArray[np.float64], knots: int) -> NDArray[np.float64]:
    """Weights of linear interpolation between knots 0..knots-1 at positions (in knots), held at the ends."""
    position = np.clip(position, 0, knots - 1)
    low = np.minimum(position.astype(int), knots - 2)
    weight = position - low
    basis = np.zeros((len(position), knots))
    rows = np.arange(len(position))
    basis[rows, low] = 1 - weight
    basis[rows, low + 1] += weight
    return basis
