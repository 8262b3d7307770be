"""Stability by dose: how much of each disturbance a tracked motion takes before it is no longer completed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from simprep.display import SelfShowing, data_frame
from simprep.motion.motion import Motion
from simprep.physics.run import DONE, Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track
from simprep.study.bisection import DoseLimit, first_failure
from simprep.study.doses import DOSES, LAUNCH, PUSH_LEVELS_N, STANCE, StabilitySettings, measures_of
from simprep.study.plan import DETERMINISTIC
from simprep.study.push_limits import PushTrial

Search = tuple[str, float | None]
"""A measure, and of a push its direction [degrees]."""
OnRun = Callable[[Search, int, float, Run, bool], None]
"""Is called with a search, the seed, the dose, its run, and whether more of the dose is harder."""


def number_of(limit: DoseLimit) -> float:
    """The hardest dose survived; no disturbance at all where the motion is not completed undisturbed."""
    return limit.levels[0] if limit.survived is None else limit.survived


@dataclass(frozen=True)
class MeasureLimits:
    """The limits of one measure.

    Attributes:
        name: of the measure.
        seeds: that were run.
        limits: of each direction (of one entry where there are none), of each seed.
        directions_deg: of the pushes; empty for other measures.
        at_s: when the pushes begin [s].
        watched_s: what is simulated after them [s].
    """

    name: str
    seeds: tuple[int, ...]
    limits: tuple[tuple[DoseLimit, ...], ...]
    directions_deg: tuple[float, ...] = ()
    at_s: float | None = None
    watched_s: float | None = None

    @property
    def all_limits(self) -> tuple[DoseLimit, ...]:
        """Of every direction and seed."""
        return tuple(limit for row in self.limits for limit in row)

    def dose(self) -> dict[str, float]:
        """The limit by the key of results: median over the seeds; of pushes the mean over the directions, and the least.

        A motion that is not completed undisturbed counts as one that takes no disturbance at all.
        """
        by_seed = np.array([[number_of(limit) for limit in row] for row in self.limits])  # (directions, seeds)
        if not self.directions_deg:
            return {DOSES[self.name].key: float(np.median(by_seed))}
        return {
            f"dose_{self.name}_n": float(np.median(by_seed.mean(axis=0))),
            f"dose_{self.name}_least_n": float(np.median(by_seed.min(axis=0))),
        }


@dataclass(frozen=True)
class Stability(SelfShowing):
    """The result of `stability`.

    Attributes:
        measured: limits by measure, in order.
        left_out: measures that the motion does not have, and why.
        assist_n: largest external force of any run [N].
        runs: how many were simulated.
    """

    measured: tuple[MeasureLimits, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)
    assist_n: float = 0.0
    runs: int = 0

    def doses(self) -> dict[str, float]:
        """Every limit by the key of results (`MeasureLimits.dose`)."""
        return {key: value for one in self.measured for key, value in one.dose().items()}

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(result)` and Jupyter show."""
        return "largest disturbances survived", {**self.doses(), "runs": self.runs}

    def to_dataframe(self) -> Any:
        """Every seed's limit as a pandas DataFrame: measure, direction, seed, dose survived, dose not survived.

        Raises:
            MissingExtraError: pandas is not installed.
        """
        rows = [
            {
                "measure": one.name, "direction_deg": direction, "seed": seed, "survived": limit.survived,
                "failed": limit.failed, "monotone": limit.monotone,
            }
            for one in self.measured
            for direction, limits in zip(one.directions_deg or (None,), one.limits)
            for seed, limit in zip(one.seeds, limits)
        ]  # fmt: skip
        return data_frame(rows)

    @property
    def falls_undisturbed(self) -> bool:
        """Whether a whole run, or a part that is pushed, is not completed even without a disturbance, with any seed."""
        return any(not limit.completed[0] for one in self.measured for limit in one.all_limits)


def launch_of(motion: Motion) -> float | None:
    """When the target movement begins: event `launch`, else `target` [s]; None where the motion has neither."""
    frame = motion.events.get("launch", motion.events.get("target"))
    return None if frame is None else frame / motion.fps


def mid_stance_of(motion: Motion, before_s: float | None = None) -> float | None:
    """Middle of the last stance on one leg that ends before a time, else of the one nearest to the motion's middle [s].

    Args:
        motion: with its foot contacts.
        before_s: the time, such as the launch [s]; None if there is none.

    Returns:
        The time; None if the motion never stands on one leg for a tenth of a second.
    """
    single = np.concatenate([[False], motion.contacts.sum(axis=1) == 1, [False]])
    edges = np.flatnonzero(np.diff(single.astype(int)))
    spans = [(first, after) for first, after in zip(edges[::2], edges[1::2]) if after - first >= 0.1 * motion.fps]
    middles = [(first + after - 1) / 2 / motion.fps for first, after in spans]
    if before_s is not None:
        earlier = [middle for middle, (_, after) in zip(middles, spans) if after / motion.fps <= before_s + 0.1]
        if earlier:
            return float(earlier[-1])
    return float(min(middles, key=lambda at: abs(at - motion.duration / 2))) if middles else None


def stability(
    motion: Motion,
    settings: StabilitySettings | None = None,
    controller: str = "mpc",
    simulation: SimulationSettings | None = None,
    on_progress: Callable[[str, int, int], None] | None = None,
    on_run: OnRun | None = None,
) -> Stability:
    """Measure how much of each disturbance a tracked motion takes.

    A dose is survived if the run is completed: neither a fall nor divergence. Pushes simulate the part of the motion around them
    (`PushTrial`), other doses the whole of it. All levels of a fixed scan are tried with each seed, and the first failure
    is narrowed down by bisection (`first_failure`).

    Args:
        motion: what to track; of a loop one cycle (see `simprep.motion.edit.repeat`).
        settings: what is measured. An UnknownNameError says so if the controller lacks a measure.
        controller: `pd`, `balance` or `mpc`.
        simulation: as of `simprep.track`; its own disturbances stay, and are where a scan begins.
        on_progress: called before every simulation with what is tried, how many searches are finished, and how many there are.
        on_run: called with every run but those without a push, where pushes are searched for.
    """
    settings, simulation = settings or StabilitySettings(), simulation or SimulationSettings()
    names = measures_of(controller, settings.measures)
    moments, left_out = _moments(motion, settings, names)
    plan = {name: _seeds(name, controller, settings) for name in names if name not in left_out}
    total = sum(len(seeds) * (len(settings.directions_deg) if name in moments else 1) for name, seeds in plan.items())
    search = _Search(motion, controller, simulation, settings, total, on_progress, on_run)
    measured = tuple(
        search.pushes(name, moments[name], seeds) if name in moments else search.whole(name, seeds)
        for name, seeds in plan.items()
    )
    return Stability(measured, left_out, search.assist_n, search.runs)


class _Search:
    """Runs the searches of one motion, and counts them."""

    def __init__(
        self,
        motion: Motion,
        controller: str,
        simulation: SimulationSettings,
        settings: StabilitySettings,
        total: int,
        on_progress: Callable[[str, int, int], None] | None,
        on_run: OnRun | None,
    ) -> None:
        self._motion, self._controller, self._simulation, self._settings = motion, controller, simulation, settings
        self._total, self._tell, self._finished = total, on_progress, 0
        self._on_run = on_run
        self._undisturbed: dict[int, Run] = {}
        self.assist_n, self.runs = 0.0, 0

    def pushes(self, name: str, at_s: float, seeds: tuple[int, ...]) -> MeasureLimits:
        settings = self._settings

        def on_push(direction: float, seed: int, force: float, run: Run) -> None:
            if self._on_run:
                self._on_run((name, direction), seed, force, run, True)

        trial = PushTrial(self._motion, settings.push(at_s), self._controller, self._simulation, on_push)
        known: dict[tuple[int, float, float], bool] = {}

        def survives(seed: int, direction: float, force: float) -> bool:
            key = (seed, direction if force else 0.0, force)  # no push has no direction
            if key not in known:
                self._report(f"{name}, {direction:g} degrees, seed {seed}: {force:g} N")
                self.runs += 1
                known[key] = trial.completes(*key)
            return known[key]

        rows = []
        for direction in settings.directions_deg:
            row = []
            for seed in seeds:
                row.append(first_failure(partial(survives, seed, direction), PUSH_LEVELS_N, settings.halvings))
                self._finished += 1
            rows.append(tuple(row))
        self.assist_n = max(self.assist_n, trial.assist_n)
        return MeasureLimits(name, seeds, tuple(rows), settings.directions_deg, at_s, trial.watched_s)

    def whole(self, name: str, seeds: tuple[int, ...]) -> MeasureLimits:
        dose, limits = DOSES[name], []
        levels = dose.levels(self._simulation)
        for seed in seeds:
            known: dict[float, bool] = {}
            survives = partial(self._survives, name, seed, known, levels)
            limits.append(_whole_numbers(first_failure(survives, levels, self._settings.halvings), dose.whole))
            self._finished += 1
        return MeasureLimits(name, seeds, (tuple(limits),))

    def _survives(
        self, name: str, seed: int, known: dict[float, bool], levels: tuple[float, ...], value: float
    ) -> bool:
        dose = DOSES[name]
        exact = float(round(value)) if dose.whole else value
        if exact not in known:
            self._report(f"{name}, seed {seed}: {exact:g}")
            run = (
                self._run_undisturbed(seed)
                if value == levels[0]
                else self._run(seed, dose.change(self._simulation, exact))
            )
            known[exact] = run.end == DONE
            if self._on_run:
                self._on_run((name, None), seed, exact, run, levels[-1] > levels[0])
        return known[exact]

    def _run_undisturbed(self, seed: int) -> Run:
        """The same for every measure, so it is run once."""
        if seed not in self._undisturbed:
            self._undisturbed[seed] = self._run(seed, self._simulation)
        return self._undisturbed[seed]

    def _run(self, seed: int, simulation: SimulationSettings) -> Run:
        self.runs += 1
        run = track(self._motion, self._controller, seed, simulation)
        self.assist_n = max(self.assist_n, run.assist.force_n)
        return run

    def _report(self, what: str) -> None:
        if self._tell:
            self._tell(what, self._finished, self._total)


def _whole_numbers(limit: DoseLimit, whole: bool) -> DoseLimit:
    if not whole:
        return limit
    ends = [None if one is None else float(round(one)) for one in (limit.survived, limit.failed)]
    return DoseLimit(limit.levels, limit.completed, *ends)


def _seeds(name: str, controller: str, settings: StabilitySettings) -> tuple[int, ...]:
    """Without random numbers every seed gives the same run."""
    random = controller not in DETERMINISTIC or (name in DOSES and DOSES[name].random)
    return settings.seeds if random else settings.seeds[:1]


def _moments(
    motion: Motion, settings: StabilitySettings, names: tuple[str, ...]
) -> tuple[dict[str, float], dict[str, str]]:
    """When the pushes begin [s], and which of them the motion does not have."""
    launch = launch_of(motion)
    found = {LAUNCH: launch, STANCE: mid_stance_of(motion, launch)}
    reasons = {LAUNCH: "no event `launch` or `target`", STANCE: "no stance on one leg"}
    moments, left_out = {}, {}
    for name, at in found.items():
        if name not in names:
            continue
        if at is None:
            left_out[name] = reasons[name]
        elif at + settings.duration_s >= motion.duration - 1 / motion.fps:
            left_out[name] = f"the motion ends before the push does, which begins at {at:.2f} s"
        else:
            moments[name] = at
    return moments, left_out
