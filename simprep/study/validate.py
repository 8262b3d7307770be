"""Run a validation study: build every scenario, simulate every case, measure both."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

from simprep.display import SelfShowing, data_frame
from simprep.metrics.evaluate import evaluate_motion, evaluate_run
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion
from simprep.physics.run import Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track
from simprep.preparation import scenario as make_scenario
from simprep.study.doses import measures_of
from simprep.study.plan import Case, Condition, StudyPlan
from simprep.study.stability import stability


@dataclass(frozen=True)
class CaseResult:
    """One simulation: its case, its metrics (`evaluate_run`) and the simulated motion, for the first seed only."""

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
    """

    plan: StudyPlan
    conditions: dict[Condition, Motion] = field(default_factory=dict)
    kinematic: dict[Condition, Mapping[str, Any]] = field(default_factory=dict)
    results: list[CaseResult] = field(default_factory=list)
    complete: bool = False
    wall_s: float = 0.0
    files: list[Path] = field(default_factory=list)

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
) -> Study:
    """Run every case of a plan. Ctrl-C ends the study early, keeps the finished cases and leaves `complete` False.

    Arms that come out as the same motion (no preparation, at every level) are simulated once and reported for each.

    Args:
        plan: what to run.
        on_progress: called with what is being done and the number of cases finished, in fractions.
        motions_folder: where scenario motions, and simulated ones of the first seed, are saved; None to save none.
        settings: of the simulation and the controllers; None for the defaults.
    """
    study = Study(plan)
    tell = on_progress or (lambda what, done: None)
    begin = perf_counter()
    try:
        for condition in plan.conditions():
            tell(f"building {condition.slug}", 0.0)
            _build(study, condition, motions_folder)
        known: dict[tuple[bytes, float, str, int], CaseResult] = {}
        for case in plan.cases():
            motion = study.conditions[case.condition]
            key = (motion.qpos.tobytes(), motion.fps, case.controller, case.seed)
            if key in known:
                study.results.append(CaseResult(case, known[key].metrics, known[key].simulated))
                continue
            label, done = f"{case.controller} {case.condition.slug} seed {case.seed}", len(study.results)
            tell(label, done)
            run = track(
                motion,
                case.controller,
                case.seed,
                settings,
                progress=lambda share, label=label, done=done: tell(label, done + share),  # type: ignore[misc]
            )
            doses = _doses(plan, case, motion, settings, partial(_tell_dose, tell, label, done))
            known[key] = _keep(study, case, run, doses, motions_folder)
        study.complete = True
    except KeyboardInterrupt:
        study.complete = False
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


def _tell_dose(tell: Callable[[str, float], None], label: str, done: int, what: str, *_: int) -> None:
    tell(f"{label}: {what}", done)


def _doses(
    plan: StudyPlan,
    case: Case,
    motion: Motion,
    settings: SimulationSettings | None,
    tell: Callable[[str, int, int], None],
) -> dict[str, Any]:
    """How much of each disturbance a case takes (`simprep.study.stability.Stability.doses`); nothing where that was not asked for."""
    if plan.dose is None:
        return {}
    measures = tuple(
        name for name in measures_of(case.controller) if name in plan.dose.measures or not plan.dose.measures
    )
    if not measures:
        return {}
    wish = replace(plan.dose, measures=measures, seeds=(case.seed,))
    result = stability(motion, wish, case.controller, settings, tell)
    return {**result.doses(), "dose_falls_undisturbed": result.falls_undisturbed, "dose_assist_n": result.assist_n}


def _keep(study: Study, case: Case, run: Run, doses: Mapping[str, Any], folder: Path | None) -> CaseResult:
    metrics = {**evaluate_run(run), **doses}  # finds rise and launch in the reference's events
    simulated = run.simulated_motion() if case.seed == study.plan.seeds[0] else None
    result = CaseResult(case, metrics, simulated)
    study.results.append(result)
    if simulated is not None and folder is not None:
        study.files.append(save_motion(simulated, folder / f"{case.condition.slug}_{case.controller}.npz"))
    return result
