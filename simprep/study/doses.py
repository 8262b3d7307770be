"""The doses of `simprep stability`: what makes it harder for a motion to be completed, and by which levels."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from simprep.errors import SettingError, UnknownNameError
from simprep.physics.settings import SimulationSettings
from simprep.study.push_limits import PushSettings

PUSH_LEVELS_N = (0.0, 50.0, 100.0, 200.0, 400.0, 800.0, 1600.0)
"""Forces of the scan [N]."""
LAUNCH, STANCE = "push_launch", "push_stance"
"""Pushes at the launch of the target movement, and in the middle of a stance on one leg."""


@dataclass(frozen=True)
class Dose:
    """A disturbance of the whole motion.

    Attributes:
        key: of its limit in results, with its unit where it has one.
        words: what the limit is, for tables.
        levels: gives the scan for some simulation settings, from no disturbance to the hardest.
        change: gives simulation settings with a dose.
        random: whether it draws random numbers of its own, so that every controller's runs differ with the seed.
        whole: whether only whole numbers mean something.
        needs_mpc: whether only `mpc` has it.
    """

    key: str
    words: str
    levels: Callable[[SimulationSettings], tuple[float, ...]]
    change: Callable[[SimulationSettings, float], SimulationSettings]
    random: bool = False
    whole: bool = False
    needs_mpc: bool = False


def _friction(simulation: SimulationSettings, dose: float) -> SimulationSettings:
    return replace(simulation, mismatch=replace(simulation.mismatch, friction=dose))


def _strength(simulation: SimulationSettings, dose: float) -> SimulationSettings:
    return replace(simulation, mismatch=replace(simulation.mismatch, strength=dose))


def _noise(simulation: SimulationSettings, dose: float) -> SimulationSettings:
    return replace(simulation, mismatch=replace(simulation.mismatch, noise=dose))


def _horizon(simulation: SimulationSettings, dose: float) -> SimulationSettings:
    return replace(simulation, mpc=replace(simulation.mpc, horizon=dose))


def _samples(simulation: SimulationSettings, dose: float) -> SimulationSettings:
    mpc, count = simulation.mpc, round(dose)
    share, keep = count / mpc.samples, min(mpc.keep, count - 3)

    def fewer(samples: int, refined: int) -> tuple[int, int]:
        return max(keep + 3, round(share * samples)), max(len(mpc.damping), round(share * refined))

    harder = tuple((cost, *fewer(samples, refined)) for cost, samples, refined in mpc.harder)
    samples, refined = fewer(mpc.samples, mpc.refined)
    return replace(simulation, mpc=replace(mpc, samples=samples, keep=keep, refined=refined, harder=harder))


def _frictions(simulation: SimulationSettings) -> tuple[float, ...]:
    nominal = simulation.mismatch.friction or simulation.scene.friction
    return nominal, *(one for one in (0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.05) if one < nominal)


def _strengths(simulation: SimulationSettings) -> tuple[float, ...]:
    nominal = simulation.mismatch.strength
    return nominal, *(one for one in (0.85, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1) if one < nominal)


def _noises(simulation: SimulationSettings) -> tuple[float, ...]:
    nominal = simulation.mismatch.noise
    return nominal, *(one for one in (0.25, 0.5, 1.0, 2.0, 4.0, 8.0) if one > nominal)


def _horizons(simulation: SimulationSettings) -> tuple[float, ...]:
    return tuple(simulation.mpc.horizon * share for share in (1.0, 0.8, 0.6, 0.45, 0.3, 0.2, 0.12))


def _sample_counts(simulation: SimulationSettings) -> tuple[float, ...]:
    most = simulation.mpc.samples
    return most, *(one for one in (100.0, 60.0, 40.0, 28.0, 20.0, 16.0, 12.0, 9.0, 7.0, 5.0, 4.0) if one < most)


DOSES = {
    "friction": Dose("dose_friction", "lowest friction", _frictions, _friction),
    "strength": Dose("dose_strength", "smallest motor strength [share]", _strengths, _strength),
    "noise": Dose("dose_noise", "largest sensor noise [multiple]", _noises, _noise, random=True),
    "horizon": Dose("dose_horizon_s", "shortest look-ahead [s]", _horizons, _horizon, needs_mpc=True),
    "samples": Dose("dose_samples", "fewest samples", _sample_counts, _samples, whole=True, needs_mpc=True),
}
"""Disturbances of the whole motion by name; noise is that of `simprep.physics.mismatch.Mismatch`."""
MEASURES = (LAUNCH, STANCE, *DOSES)
"""What `simprep stability` measures, in its order."""


def measures_of(controller: str, names: tuple[str, ...] = ()) -> tuple[str, ...]:
    """The measures that a controller has, in their order.

    Args:
        controller: its name.
        names: those that are wanted; empty for all.

    Raises:
        UnknownNameError: no such measure, or the controller lacks it.
    """
    has = tuple(name for name in MEASURES if name not in DOSES or controller == "mpc" or not DOSES[name].needs_mpc)
    for name in names:
        if name not in has:
            raise UnknownNameError(f"measure of {controller}", name, has)
    return tuple(name for name in has if not names or name in names)


EIGHT_DEG = tuple(45.0 * k for k in range(8))


@dataclass(frozen=True)
class StabilitySettings:
    """What is measured, and how closely.

    Attributes:
        measures: names of `simprep.study.doses.MEASURES`; empty for all that the controller has.
        directions_deg: of the pushes, against the motion's heading: 0 forward, 90 left [degrees].
        duration_s: of a push [s].
        segment: that is pushed.
        halvings: of the interval between two levels of a scan.
        seeds: of the random generators; without random numbers only the first is run.

    Raises:
        SettingError: seeds or directions that are missing or repeated, or halvings out of range.
    """

    measures: tuple[str, ...] = ()
    directions_deg: tuple[float, ...] = EIGHT_DEG
    duration_s: float = 0.2
    segment: str = "pelvis"
    halvings: int = 3
    seeds: tuple[int, ...] = (0, 1, 2)

    def __post_init__(self) -> None:
        if not 0 <= self.halvings <= 20:
            raise SettingError(f"{self.halvings} halvings; valid: 0 to 20")
        self.push(0.0)

    def push(self, at_s: float) -> PushSettings:
        """The pushes of one moment."""
        return PushSettings(at_s, self.directions_deg, self.duration_s, self.segment, seeds=self.seeds)
