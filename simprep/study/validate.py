"""Run a validation study: build every scenario, simulate every case, measure both."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from simprep.display import SelfShowing, data_frame
from simprep.metrics.evaluate import evaluate_motion
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion
from simprep.physics.settings import SimulationSettings
from simprep.preparation import scenario as make_scenario
from simprep.study.plan import Case, Condition, StudyPlan
from simprep.study.simulated import Job, Outcome, outcomes

_Key = tuple[bytes, float, str, int]
"""What makes a simulation different from others: poses, frame rate, controller, seed."""


@dataclass(frozen=True)
class CaseResult:
    """One simulation: its case, its metrics (`simprep.study.simulated.Outcome`) and the simulated motion, for the first seed only."""

    case: Case
    metrics: Mapping[str, Any]
    simulated: Motion | None = None


@dataclass
class Study(SelfShowing):
    """A validation study, finished or cut short.

    Attributes:
        plan: what was to be run.
        conditions: the motions built so far.
        kinematic: metrics of each of them before physics, see `simprep.metrics.evaluate.evaluate_motion`.
        results: finished cases, in order.
        complete: every case of the plan is finished.
        wall_s: computing time [s].
        files: motions saved so far.
        yardstick_s: processor time of the yardstick (`simprep.physics.yardstick`), where it was measured [s].
    """

    plan: StudyPlan
    conditions: dict[Condition, Motion] = field(default_factory=dict)
    kinematic: dict[Condition, Mapping[str, Any]] = field(default_factory=dict)
    results: list[CaseResult] = field(default_factory=list)
    complete: bool = False
    wall_s: float = 0.0
    files: list[Path] = field(default_factory=list)
    yardstick_s: float | None = None

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(study)` and Jupyter show."""
        plan, done = self.plan, [result.metrics for result in self.results]
        return f"{plan.locomotion.name} to {', '.join(target.name for target in plan.targets)}", {
            "cases": f"{len(done)} of {len(plan.cases())}",
            "succeeded": sum(bool(metrics["success"]) for metrics in done),
            "arms": ", ".join(plan.arms),
            "levels": ", ".join(f"{alpha:g}" for alpha in plan.alphas),
            "controllers": ", ".join(plan.controllers),
            "seeds": len(plan.seeds),
            "computing time [s]": round(self.wall_s, 1),
        }

    def to_dataframe(self) -> Any:
        """The finished cases as a pandas DataFrame, one row each; MissingExtraError where pandas is not installed."""
        from simprep.study.compare import case_rows

        return data_frame(case_rows(self))


def run_study(
    plan: StudyPlan,
    on_progress: Callable[[str, float], None] | None = None,
    motions_folder: Path | None = None,
    settings: SimulationSettings | None = None,
    processes: int = 1,
) -> Study:
    """Run every case of a plan. Ctrl-C ends the study early, keeps the finished cases and leaves `complete` False.

    Arms that come out as the same motion (no preparation, at every level) are simulated once and reported for each.

    Args:
        plan: what to run.
        on_progress: called with what is being done and the number of cases finished, in fractions.
        motions_folder: where scenario motions, and simulated ones of the first seed, are saved; None to save none.
        settings: of the simulation and the controllers; None for the defaults.
        processes: how many cases are simulated at a time, each in a process of its own; 1: in this process. The results
            are the same.

    Raises:
        SimprepError: a process died: killed, or out of memory.
    """
    study = Study(plan)
    tell = on_progress or (lambda what, done: None)
    begin = perf_counter()
    keys: dict[Case, _Key] = {}
    found: dict[_Key, Outcome] = {}
    try:
        for condition in plan.conditions():
            tell(f"building {condition.slug}", 0.0)
            _build(study, condition, motions_folder)
        keys = {case: _key(study, case) for case in plan.cases()}
        jobs = _jobs(study, keys, settings)
        share = len(keys) / len(jobs)  # some jobs are several cases
        order = list(jobs)
        for number, one in outcomes(list(jobs.values()), processes, lambda what, done: tell(what, share * done)):
            found[order[number]] = one
        study.complete = True
    except KeyboardInterrupt:
        study.complete = False
    _keep(study, keys, found, motions_folder)
    study.wall_s = perf_counter() - begin
    tell("done", len(study.results))
    return study


def launch_s(motion: Motion) -> float | None:
    """Time at which the target movement is launched [s]; None where the motion does not say."""
    return motion.events["launch"] / motion.fps if "launch" in motion.events else None


def _build(study: Study, condition: Condition, folder: Path | None) -> None:
    plan = study.plan
    target = next(target for target in plan.targets if target.name == condition.target)
    motion = make_scenario(plan.locomotion, target, replace(plan.profile, level=condition.alpha), condition.arm)
    study.kinematic[condition] = evaluate_motion(motion)
    study.conditions[condition] = motion
    if folder is not None:
        study.files.append(save_motion(motion, folder / f"{condition.slug}.npz"))


def _key(study: Study, case: Case) -> _Key:
    motion = study.conditions[case.condition]
    return motion.qpos.tobytes(), motion.fps, case.controller, case.seed


def _jobs(study: Study, keys: Mapping[Case, _Key], settings: SimulationSettings | None) -> dict[_Key, Job]:
    """What is to be simulated, by what makes it different; cases with equal motions share a job."""
    jobs: dict[_Key, Job] = {}
    for case, key in keys.items():
        if key not in jobs:
            label = f"{case.controller} {case.condition.slug} seed {case.seed}"
            motion, keep = study.conditions[case.condition], case.seed == study.plan.seeds[0]
            jobs[key] = Job(label, motion, case.controller, case.seed, settings, study.plan.dose, keep)
    return jobs


def _keep(study: Study, keys: Mapping[Case, _Key], found: Mapping[_Key, Outcome], folder: Path | None) -> None:
    """Take what was found as results, in the order of the plan; of cases with one motion, the first one's is saved."""
    saved: set[_Key] = set()
    for case, key in keys.items():
        if key not in found:
            continue
        one = found[key]
        study.results.append(CaseResult(case, one.metrics, one.simulated))
        if one.simulated is not None and folder is not None and key not in saved:
            saved.add(key)
            name = f"{case.condition.slug}_{case.controller}.npz"
            study.files.append(save_motion(one.simulated, folder / name))
