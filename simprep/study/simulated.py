"""The simulations of a validation study, one after the other or in several processes: the same results, bit for bit."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from time import process_time
from typing import Any

from simprep.errors import SimprepError
from simprep.metrics.evaluate import evaluate_run
from simprep.motion.motion import Motion
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track
from simprep.study.doses import StabilitySettings, measures_of
from simprep.study.processes import Died, each_in_processes, threads_of
from simprep.study.stability import stability

Tell = Callable[[str, float], None]


@dataclass(frozen=True)
class Job:
    """One simulation.

    Attributes:
        label: what it is called.
        motion: what is tracked.
        controller: by which controller.
        seed: of its random generator.
        settings: of the simulation; None for the defaults.
        dose: how much of each disturbance it takes is measured too; None for not at all.
        keep: whether the simulated motion is wanted.
    """

    label: str
    motion: Motion
    controller: str
    seed: int
    settings: SimulationSettings | None
    dose: StabilitySettings | None
    keep: bool


@dataclass(frozen=True)
class Outcome:
    """What came of a job: its metrics (`evaluate_run`, processor time, doses), and the simulated motion where that is wanted."""

    metrics: Mapping[str, Any]
    simulated: Motion | None


def outcome(job: Job, tell: Tell = lambda what, share: None) -> Outcome:
    """Simulate and measure; `tell` is called with what is being done and the share of it that is done."""
    begin = process_time()
    run = track(job.motion, job.controller, job.seed, job.settings, progress=lambda share: tell(job.label, share))
    cost = {"cpu_s_per_s": (process_time() - begin) / run.end_s if run.end_s > 0 else None}
    metrics = {**evaluate_run(run), **cost, **_doses(job, tell)}  # finds rise and launch in the reference's events
    return Outcome(metrics, run.simulated_motion() if job.keep else None)


def outcomes(jobs: Sequence[Job], processes: int, tell: Tell) -> Iterator[tuple[int, Outcome]]:
    """What comes of each job, with its number, as they finish.

    Args:
        jobs: what to simulate.
        processes: how many jobs at a time; 1: in this process.
        tell: called with what is being done and the number of jobs done, in fractions.

    Raises:
        SimprepError: a process died: killed, or out of memory.
    """
    if processes == 1:
        for number, job in enumerate(jobs):
            yield number, outcome(job, partial(_tell, tell, number))
        return
    shared = [(number, _sharing(job, processes)) for number, job in enumerate(jobs)]
    with closing(each_in_processes(_numbered, shared, processes)) as finished:
        for done, ((number, job), one) in enumerate(finished, 1):
            if isinstance(one, Died):
                raise SimprepError(
                    f"the process that simulated {job.label} died: killed, or out of memory; valid: --processes with "
                    "fewer of them"
                )
            tell(job.label, done)
            yield number, one


def _numbered(numbered: tuple[int, Job]) -> Outcome:
    return outcome(numbered[1])


def _tell(tell: Tell, number: int, what: str, share: float) -> None:
    tell(what, number + share)


def _sharing(job: Job, processes: int) -> Job:
    """The same job with its share of the cores, which changes no result."""
    settings = job.settings or SimulationSettings()
    if settings.mpc.threads:
        return job
    return replace(job, settings=replace(settings, mpc=replace(settings.mpc, threads=threads_of(processes))))


def _doses(job: Job, tell: Tell) -> dict[str, Any]:
    """How much of each disturbance a job takes (`Stability.doses`); nothing where that was not asked for."""
    if job.dose is None:
        return {}
    measures = tuple(name for name in measures_of(job.controller) if name in job.dose.measures or not job.dose.measures)
    if not measures:
        return {}
    wish = replace(job.dose, measures=measures, seeds=(job.seed,))
    result = stability(
        job.motion, wish, job.controller, job.settings, lambda what, *_: tell(f"{job.label}: {what}", 0.0)
    )
    return {**result.doses(), "dose_falls_undisturbed": result.falls_undisturbed, "dose_assist_n": result.assist_n}
