"""How hard a push a tracked motion survives: the largest force by direction, found by bisection."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from simprep.display import SelfShowing, data_frame
from simprep.errors import SettingError, UnknownNameError
from simprep.motion.edit import cut, yaw
from simprep.motion.motion import Motion
from simprep.physics.controller import ControllerFactory
from simprep.physics.pushes import Push
from simprep.physics.run import DONE, Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track
from simprep.study.bisection import narrow

BEFORE_S, AFTER_S = 1.0, 3.0
"""What is simulated of a motion before a push begins and after it ends, as far as the motion has it [s]."""


@dataclass(frozen=True)
class PushSettings:
    """Which horizontal pushes are tried. A SettingError says what is out of range.

    Attributes:
        at_s: time in the motion at which the push begins [s].
        directions_deg: where the push points, against the motion's heading then: 0 forward, 90 left [degrees].
        duration_s: how long the force acts [s].
        segment: on which segment, at its COM.
        largest_n: the largest force that is tried [N].
        tolerance_n: how near the largest force survived and the least that is not must be [N].
        seeds: of the controller's random generator; the search is done for each.
    """

    at_s: float
    directions_deg: tuple[float, ...] = tuple(45.0 * k for k in range(8))
    duration_s: float = 0.2
    segment: str = "pelvis"
    largest_n: float = 1600.0
    tolerance_n: float = 20.0
    seeds: tuple[int, ...] = (0, 1, 2)

    def __post_init__(self) -> None:
        for what, values in (("directions", self.directions_deg), ("seeds", self.seeds)):
            if not values or len(set(values)) < len(values) or not np.isfinite(values).all():
                raise SettingError(f"push {what} {values}; valid: at least one, all different numbers")
        for what in ("duration_s", "largest_n", "tolerance_n"):
            if not 0 < getattr(self, what) < np.inf:
                raise SettingError(f"push {what} {getattr(self, what):g}; valid: above 0")


@dataclass(frozen=True)
class PushLimits(SelfShowing):
    """The largest pushes survived.

    Attributes:
        settings: what was tried.
        force_n: of each direction and each seed, the largest force that was tried and survived [N].
        fell_unpushed: of each seed, whether the motion fails without any push; its forces are 0.
        watched_s: what was simulated after the push [s].
        assist_n: largest external force of any run [N].
    """

    settings: PushSettings
    force_n: tuple[tuple[float, ...], ...]
    fell_unpushed: tuple[bool, ...]
    watched_s: float
    assist_n: float

    def by_direction(self) -> dict[str, list[Any]]:
        """Over the seeds: median, least and largest [N]; `at_least`: a seed survived the largest force of the settings."""
        return {
            "directions_deg": list(self.settings.directions_deg),
            "max_force_n": [float(np.median(forces)) for forces in self.force_n],
            "low_n": [min(forces) for forces in self.force_n],
            "high_n": [max(forces) for forces in self.force_n],
            "at_least": [max(forces) == self.settings.largest_n for forces in self.force_n],
        }

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(limits)` and Jupyter show."""
        rows = zip(*self.by_direction().values())
        shown = {f"{angle:g}° [N]": f"{m:.0f} ({low:.0f} to {high:.0f})" for angle, m, low, high, _ in rows}
        return "largest push survived", shown

    def to_dataframe(self) -> Any:
        """`by_direction` as a pandas DataFrame, one row a direction; MissingExtraError where pandas is not installed."""
        return data_frame(self.by_direction())


def largest_survived(survives: Callable[[float], bool], largest: float, tolerance: float) -> float:
    """Bisect for the largest force survived, given that 0 is. It was tried, or is 0.

    Unless it is `largest`, a force that is larger by the tolerance at most was not survived. Where survival is not
    monotone in the force, this is one of several limits.
    """
    halvings = max(0, int(np.ceil(np.log2(largest / tolerance) - 1e-9)))
    low, high = narrow(survives, 0.0, largest, halvings)
    return largest if high == largest and survives(largest) else low  # tried last: it seldom is needed


class PushTrial:
    """Runs a motion with pushes of any size and direction at one moment: `BEFORE_S` before it, `AFTER_S` after it, or what there is.

    Args:
        motion: what to track.
        settings: moment, duration and segment.
        controller: as of `simprep.track`.
        simulation: as of `simprep.track`; the push is added to its pushes.
        on_run: called with the direction [degrees], the seed, the force [N] and the run of every push tried.

    Attributes:
        watched_s: what is simulated after the push [s].
        assist_n: largest external force of any run [N].

    Raises:
        SettingError: the push is not within the motion.
        UnknownNameError: the body has no such segment.
    """

    def __init__(
        self,
        motion: Motion,
        settings: PushSettings,
        controller: str | ControllerFactory,
        simulation: SimulationSettings,
        on_run: Callable[[float, int, float, Run], None] | None = None,
    ) -> None:
        if settings.segment not in motion.character.segments:
            raise UnknownNameError("segment", settings.segment, motion.character.segments)
        end, duration = settings.at_s + settings.duration_s, (len(motion) - 1) / motion.fps
        if not 0 <= settings.at_s < end < duration:
            raise SettingError(
                f"push from {settings.at_s:g} to {end:g} s; valid: within {motion.name}, 0 to {duration:g} s"
            )
        first = max(0, int((settings.at_s - BEFORE_S) * motion.fps))
        self._clip = cut(motion, first, min(len(motion), int(np.ceil((end + AFTER_S) * motion.fps)) + 1))
        self._start = settings.at_s - first / motion.fps
        self._heading = float(yaw(motion.qpos[round(settings.at_s * motion.fps), 3:7]))
        self._settings, self._controller, self._simulation = settings, controller, simulation
        self._on_run = on_run
        self.watched_s = (len(self._clip) - 1) / self._clip.fps - self._start - settings.duration_s
        self.assist_n = 0.0

    def completes(self, seed: int, direction_deg: float, force_n: float) -> bool:
        """Whether a push is survived: neither a fall nor divergence.

        Args:
            seed: of the controller's random generator.
            direction_deg: against the motion's heading [degrees].
            force_n: how hard [N].
        """
        angle, s = self._heading + np.radians(direction_deg), self._settings
        force = (float(force_n * np.cos(angle)), float(force_n * np.sin(angle)), 0.0)
        pushes = (*self._simulation.pushes, Push(s.segment, self._start, s.duration_s, force))
        run = track(self._clip, self._controller, seed, replace(self._simulation, pushes=pushes))
        self.assist_n = max(self.assist_n, run.assist.force_n)
        if self._on_run and force_n > 0:
            self._on_run(direction_deg, seed, force_n, run)
        return run.end == DONE


def push_limits(
    motion: Motion,
    settings: PushSettings,
    controller: str | ControllerFactory = "mpc",
    simulation: SimulationSettings | None = None,
    on_progress: Callable[[str, float], None] | None = None,
    on_run: Callable[[float, int, float, Run], None] | None = None,
) -> PushLimits:
    """Find the largest push that a tracked motion survives, by direction and seed.

    A push is survived if the run completes: neither a fall nor divergence. Only `BEFORE_S` before the push and `AFTER_S`
    after it are simulated, or what the motion has of them, beginning exactly on the motion. So what fails later counts as
    survived. Each seed is also run without a push; where that fails, every limit of the seed is 0.

    Args:
        motion: what to track; of a loop one cycle (see `simprep.motion.edit.repeat`).
        settings: the pushes. A SettingError says so if they are not within the motion, an UnknownNameError if the body
            has no such segment.
        controller: as of `simprep.track`.
        simulation: as of `simprep.track`; the push is added to its pushes.
        on_progress: called with what is being done and the number of searches finished.
        on_run: called with the direction [degrees], the seed, the force [N] and the run of every push tried.
    """
    trial = PushTrial(motion, settings, controller, simulation or SimulationSettings(), on_run)
    fell = tuple(not trial.completes(seed, 0.0, 0.0) for seed in settings.seeds)
    force_n: list[tuple[float, ...]] = []
    for direction in settings.directions_deg:
        row: list[float] = []
        for seed, falls in zip(settings.seeds, fell):
            if on_progress:
                on_progress(f"{direction:g} degrees, seed {seed}", len(force_n) * len(fell) + len(row))
            survives = partial(trial.completes, seed, direction)
            row.append(0.0 if falls else largest_survived(survives, settings.largest_n, settings.tolerance_n))
        force_n.append(tuple(row))
    return PushLimits(settings, tuple(force_n), fell, trial.watched_s, trial.assist_n)
