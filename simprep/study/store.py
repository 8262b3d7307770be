"""The study as JSON: what `simprep validate` writes and prints."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from simprep.report.results import provenance, save_json
from simprep.study.compare import (
    OTHER_OPTIMISER,
    WITH,
    WITHOUT,
    case_rows,
    largest_assist,
    motion_rows,
    paired_before_physics,
    paired_by_controller,
)
from simprep.study.plan import DETERMINISTIC, StudyPlan
from simprep.study.validate import Study

SCHEMA = "simprep.validate/1"


def study_content(study: Study) -> dict[str, Any]:
    """The study's numbers: `complete`, `wall_s`, `yardstick_s`, `cases`, `paired`, `paired_before_physics`, `motions`, `assist`.

    With the arm `dynamic`, also `paired_dynamic` and `paired_dynamic_before_physics`: that arm minus `blended`. `motions` are measured before physics; `assist` is the largest over all cases.
    """
    cases = case_rows(study)
    force_n, torque_nm = largest_assist(cases)
    other = {}
    if OTHER_OPTIMISER in study.plan.arms:
        other = {
            "paired_dynamic": paired_by_controller(study, OTHER_OPTIMISER),
            "paired_dynamic_before_physics": paired_before_physics(study, OTHER_OPTIMISER),
        }
    return {
        "complete": study.complete,
        "wall_s": round(study.wall_s, 2),
        "yardstick_s": study.yardstick_s,
        "cases": cases,
        "paired": paired_by_controller(study),
        "paired_before_physics": paired_before_physics(study),
        **other,
        "motions": motion_rows(study),
        "assist": {"force_n": force_n, "torque_nm": torque_nm},
    }


def plan_content(plan: StudyPlan, arguments: Sequence[str]) -> dict[str, Any]:
    """What was to be run, with the command line after `simprep` and all else that repeats it."""
    return {
        "schema": SCHEMA,
        **provenance(arguments),
        "locomotion": {"name": plan.locomotion.name, "source": plan.locomotion.source},
        "targets": [{"name": target.name, "source": target.source} for target in plan.targets],
        "alphas": plan.alphas,
        "arms": plan.arms,
        "controllers": plan.controllers,
        "seeds": plan.seeds,
        "profile": {"lead_s": plan.profile.lead, "rise_s": plan.profile.rise, "hold_s": plan.profile.hold},
        "dose": None if plan.dose is None else asdict(plan.dose),
        "deterministic_controllers": [name for name in plan.controllers if name in DETERMINISTIC],
        "paired_is": f"{WITH} minus {WITHOUT}, same target, level and seed; 95 % bootstrap interval of the median",
    }


def mark_unfinished(plan: StudyPlan, folder: Path, arguments: Sequence[str]) -> Path:
    """Write a metrics.json that says the study is not complete, so that an old one is not taken for its result."""
    return save_json(folder / "metrics.json", {**plan_content(plan, arguments), "complete": False, "cases": []})


def save_study(
    study: Study, folder: Path, arguments: Sequence[str], files: Sequence[Path], warnings: Sequence[str] = ()
) -> Path:
    """Write metrics.json, last of all files, since it says whether the study is complete.

    Args:
        study: finished, or cut short.
        folder: where results go.
        arguments: the command line after `simprep`.
        files: what else was written there.
        warnings: what was said about the motions and pictures.
    """
    record = {**plan_content(study.plan, arguments), **study_content(study)}
    record["warnings"] = list(warnings)
    record["files"] = sorted(str(path.relative_to(folder)) for path in files)
    return save_json(folder / "metrics.json", record)
