"""Configuration of the controller `mpc`, and the presets that a user chooses among."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from simprep.errors import SettingError
from simprep.physics.sampling import SearchSettings
from simprep.physics.tracking_cost import CostWeights


@dataclass(frozen=True)
class MpcSettings:
    """Configuration of the sampling controller.

    Attributes:
        timestep: step of the planner's simulations [s], rounded to a multiple of the world's. The world may have finer
            steps, as it is one simulation, not hundreds.
        horizon: look-ahead [s].
        replan: time between two plans [s].
        knot_spacing: time between two knots of the offset curve [s], which stay where they are in time; linear in between.
        fade_in: time within which a plan takes over from the last one [s]; 0 for at once, which shakes the body.
        samples: simulations in a plan's first iteration.
        refined: simulations in every later one, which tries what the one before found.
        iterations: iterations per plan.
        harder: (cost, samples, refined), costs ascending: a plan that cost more is followed by one with so many simulations
            in the first iteration and in later ones. What is lost in a hard moment is not won back by average effort.
        first_rounds: how often the first plan of all is improved by so many iterations; it starts from nothing.
        start_speed: standard deviation by which the motion tells the first velocity of the root [m/s], and start_spin: the
            same of its angular velocity [rad/s]. So much, about, it may be changed by the first plan; 0 for not at all.
        keep: best samples that enter the next plan's first iteration, moved on in time.
        shrink: factor on the noise from one iteration to the next.
        damping: of the steps that an iteration finds and the next one tries, as shares of the samples' mean effect.
        noise_scale: factor on the standard deviations below.
        noise: standard deviation of the sampled offset [rad] by joint, matched by the end of its anatomical name (see
            `simprep.character.Character.movement`); joints that match none are not sampled.
        scales: the samples are split among these multiples of the noise.
        weights: cost weights.
        torque_share: share of the reference's inverse-dynamics torques that the servo targets lead by.
        common_search: judge samples of several bodies by all their errors together, not each body's part by its own.
        threads: simulation threads; 0 for all cores. Does not change the result.

    Raises:
        SettingError: a number out of its range; the message names it and says what is valid.
    """

    timestep: float = 1 / 96
    horizon: float = 5 / 12
    replan: float = 1 / 35
    knot_spacing: float = 0.1
    fade_in: float = 0.02
    samples: int = 20
    refined: int = 10
    iterations: int = 2
    harder: tuple[tuple[float, int, int], ...] = ((0.5, 40, 20), (2.0, 60, 20), (5.0, 140, 40))
    first_rounds: int = 10
    start_speed: float = 0.1
    start_spin: float = 0.3
    keep: int = 4
    shrink: float = 0.7
    damping: tuple[float, ...] = (0.03, 0.1, 0.3, 1.0, 3.0)
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
    torque_share: float = 1.0
    common_search: bool = False
    threads: int = 0

    def __post_init__(self) -> None:
        units = {
            "timestep": " s",
            "horizon": " s",
            "replan": " s",
            "knot_spacing": " s",
            "noise_scale": "",
            "shrink": "",
        }
        for name, unit in units.items():
            if not 0 < getattr(self, name) < np.inf:
                raise SettingError(f"mpc: {name} {getattr(self, name)}{unit}; valid: above 0")
        if not 1.5 * self.timestep <= self.weights.instants <= self.horizon:
            raise SettingError(
                f"mpc: weights.instants {self.weights.instants:g} s; valid: 1.5 timesteps to the horizon, "
                f"{1.5 * self.timestep:.3g} to {self.horizon:g} s"
            )
        if not self.damping or min(self.damping) <= 0:
            raise SettingError(f"mpc: damping {self.damping}; valid: one or more numbers above 0")
        least_of = {
            "iterations": 1, "fade_in": 0, "first_rounds": 0, "start_speed": 0, "start_spin": 0, "keep": 0, "threads": 0, "samples": self.keep + 3,
            "refined": len(self.damping),
        }  # fmt: skip
        for name, least in least_of.items():
            if not least <= getattr(self, name) < np.inf:
                raise SettingError(f"mpc: {name} {getattr(self, name)}; valid: at least {least}")
        for name in ("samples", "refined", "iterations", "first_rounds", "keep", "threads"):
            if not isinstance(getattr(self, name), int | np.integer):
                raise SettingError(f"mpc: {name} {getattr(self, name)}; valid: a whole number")
        if not np.isfinite(self.torque_share):
            raise SettingError(f"mpc: torque_share {self.torque_share}; valid: a number")
        if not self.scales or not min(self.scales) > 0:
            raise SettingError(f"mpc: scales {self.scales}; valid: one or more numbers above 0")
        if not self.noise or not all(value > 0 for _, value in self.noise):
            raise SettingError(f"mpc: noise {self.noise}; valid: (name, rad above 0), one or more")
        costs = [0.0, *(cost for cost, _, _ in self.harder)]
        if any(after <= before for before, after in pairwise(costs)) or any(
            samples < least_of["samples"] or refined < least_of["refined"] for _, samples, refined in self.harder
        ):
            raise SettingError(
                f"mpc: harder {self.harder}; valid: (cost, samples, refined) with ascending costs above 0, "
                f"at least {least_of['samples']} samples and {least_of['refined']} refined"
            )

    @property
    def searches(self) -> tuple[SearchSettings, ...]:
        """The settings of the sampling: as always, and after plans that cost more and more."""
        counts = ((self.samples, self.refined), *((samples, refined) for _, samples, refined in self.harder))
        return tuple(
            SearchSettings(samples, refined, self.keep, self.shrink, self.scales, self.damping)
            for samples, refined in counts
        )


MPC_PRESETS = {
    "live": MpcSettings(
        replan=1 / 20, samples=22, refined=8, first_rounds=8, harder=((0.6, 32, 12), (2.0, 60, 20)), noise_scale=1.0
    ),
    "default": MpcSettings(),
    "bake": MpcSettings(
        horizon=0.5,
        knot_spacing=0.05,
        fade_in=0.01,
        samples=56,
        refined=25,
        iterations=6,
        harder=((0.5, 100, 40),),
        weights=CostWeights(relative=500.0, joint_velocity=0.005, foot_orientation=0.0),
    ),
}
"""How much to compute: least for what must keep up with the clock, most for what is made once (docs/tracking.md)."""
