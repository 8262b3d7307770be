"""How hard a push a tracked motion survives: the largest force by direction, found by bisection."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.motion.edit import cut, yaw
from simprep.motion.motion import Motion
from simprep.physics.controller import ControllerFactory
from simprep.physics.pushes import Push
from simprep.physics.run import DONE
from simprep.physics.simulate import SimulationSettings, track

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
    largest_n: float = 800.0
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
class PushLimits:
    """The largest pushes survived. Rows are directions, columns seeds.

    Attributes:
        settings: what was tried.
        force_n: the largest force that was tried and survived [N].
        at_least: it is the largest of the settings, so that the limit may lie above it.
        fell_unpushed: of each seed, whether the motion fails without any push; its forces are 0.
        heading_deg: the motion's heading at the push, against the world's x, counter-clockwise [degrees].
        watched_s: what was simulated after the push [s].
        assist_n: largest external force of any run [N].
        runs: number of simulations.
    """

    settings: PushSettings
    force_n: tuple[tuple[float, ...], ...]
    at_least: tuple[tuple[bool, ...], ...]
    fell_unpushed: tuple[bool, ...]
    heading_deg: float
    watched_s: float
    assist_n: float
    runs: int

    def by_direction(self) -> dict[str, list[Any]]:
        """Over the seeds: `max_force_n` the median, `low_n` the least, `high_n` the largest [N]; `at_least` for any."""
        return {
            "directions_deg": list(self.settings.directions_deg),
            "max_force_n": [float(np.median(row)) for row in self.force_n],
            "low_n": [min(row) for row in self.force_n],
            "high_n": [max(row) for row in self.force_n],
            "at_least": [any(row) for row in self.at_least],
        }


def largest_survived(survives: Callable[[float], bool], largest: float, tolerance: float) -> tuple[float, bool]:
    """Bisect for the largest force survived [N], given that 0 is; and whether it is `largest` itself.

    The force was tried, or is 0. Unless it is `largest`, one that is larger by the tolerance at most was not survived.
    Where survival is not monotone in the force, this is one of several limits.
    """
    low, high, bounded = 0.0, largest, False
    while high - low > tolerance:
        middle = (low + high) / 2
        if survives(middle):
            low = middle
        else:
            high, bounded = middle, True
    return (largest, True) if not bounded and survives(largest) else (low, False)  # tried last: it seldom is needed


def push_limits(
    motion: Motion,
    settings: PushSettings,
    controller: str | ControllerFactory = "mpc",
    simulation: SimulationSettings | None = None,
    on_progress: Callable[[str, float], None] | None = None,
) -> PushLimits:
    """Find the largest push that a tracked motion survives, by direction and seed.

    A push is survived if the run completes: neither a fall nor divergence. Only `BEFORE_S` before the push and `AFTER_S`
    after it are simulated, or what the motion has of them, beginning exactly on the motion. So what fails later counts as
    survived. Each seed is also run without a push; where that fails, every limit of the seed is 0.

    Args:
        motion: what to track; no loop (see `simprep.motion.edit.repeat`).
        settings: the pushes.
        controller: as of `simprep.track`.
        simulation: as of `simprep.track`; the push is added to its pushes.
        on_progress: called with what is being done and the number of searches finished.

    Raises:
        MotionError: a loop.
        SettingError: the push does not lie within the motion.
        UnknownNameError: the body has no such segment.
    """
    clip, start = _around_push(motion, settings)
    simulation = simulation or SimulationSettings()
    heading = float(yaw(motion.qpos[round(settings.at_s * motion.fps), 3:7]))
    assist: list[float] = []

    def completes(seed: int, angle: float, force: float) -> bool:
        push = Push(settings.segment, start, settings.duration_s, (force * np.cos(angle), force * np.sin(angle), 0.0))
        run = track(clip, controller, seed, replace(simulation, pushes=(*simulation.pushes, push)))
        assist.append(run.assist.force_n)
        return run.end == DONE

    columns, fell = [], []
    for seed in settings.seeds:
        fell.append(not completes(seed, 0.0, 0.0))
        column = []
        for direction in settings.directions_deg:
            if on_progress:
                done = len(columns) * len(settings.directions_deg) + len(column)
                on_progress(f"seed {seed}, {direction:g} degrees", done)
            survives = partial(completes, seed, heading + np.radians(direction))
            search = (survives, settings.largest_n, settings.tolerance_n)
            column.append((0.0, False) if fell[-1] else largest_survived(*search))
        columns.append(column)
    rows = list(zip(*columns))
    return PushLimits(
        settings=settings,
        force_n=tuple(tuple(force for force, _ in row) for row in rows),
        at_least=tuple(tuple(flag for _, flag in row) for row in rows),
        fell_unpushed=tuple(fell),
        heading_deg=float(np.degrees(heading)),
        watched_s=clip.duration - start - settings.duration_s,
        assist_n=max(assist),
        runs=len(assist),
    )


def _around_push(motion: Motion, settings: PushSettings) -> tuple[Motion, float]:
    """The part of a motion that is simulated, and the push's time in it [s]."""
    if motion.loop:
        raise MotionError(f"{motion.name} is a loop; repeat it first, as a push needs a motion that ends")
    if settings.segment not in motion.character.segments:
        raise UnknownNameError("segment", settings.segment, motion.character.segments)
    end = settings.at_s + settings.duration_s
    if not 0 <= settings.at_s < end < motion.duration:
        span = f"{settings.at_s:g} to {end:g} s"
        raise SettingError(f"push from {span}; valid: within {motion.name}, 0 to {motion.duration:g} s")
    first = max(0, int((settings.at_s - BEFORE_S) * motion.fps))
    after = min(len(motion), int(np.ceil((end + AFTER_S) * motion.fps)) + 1)
    return cut(motion, first, after), settings.at_s - first / motion.fps
