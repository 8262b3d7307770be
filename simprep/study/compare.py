"""The study's cases as flat mappings, and the effect of posture optimisation over matched cases."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from simprep.metrics.paired import Summary, paired_differences
from simprep.physics.yardstick import yardsticks
from simprep.study.plan import BEFORE_PHYSICS
from simprep.study.validate import Study, launch_s

WITH, WITHOUT = "optimised", "blended"
OTHER_OPTIMISER = "dynamic"
BOOTSTRAP_SEED = 2013

Paired = dict[str, Summary]


def case_rows(study: Study) -> list[dict[str, Any]]:
    """One flat mapping per finished case: target, alpha, arm, controller, seed, its metrics, and its cost where a yardstick is known.

    `yardsticks` is that of `simprep.physics.yardstick.yardsticks`.
    """
    rows: list[dict[str, Any]] = [
        {
            **asdict(result.case.condition),
            "controller": result.case.controller,
            "seed": result.case.seed,
            **result.metrics,
        }
        for result in study.results
    ]
    if study.yardstick_s is not None:
        for row in rows:
            row["yardsticks"] = yardsticks(row["cpu_s_per_s"], study.yardstick_s)
    return rows


def motion_rows(study: Study) -> list[dict[str, Any]]:
    """One flat mapping per motion before physics: target, alpha, arm, launch, and its metrics."""
    return [
        {**asdict(condition), "launch_s": launch_s(study.conditions[condition]), **metrics}
        for condition, metrics in study.kinematic.items()
    ]


def paired_by_controller(study: Study, with_arm: str = WITH) -> dict[str, Paired]:
    """With minus without posture optimisation in physics, by controller (`paired_differences`)."""
    return paired_differences(case_rows(study), with_arm, WITHOUT, np.random.default_rng(BOOTSTRAP_SEED))


def paired_before_physics(study: Study, with_arm: str = WITH) -> Paired:
    """With minus without posture optimisation in the motions themselves, matched in target and level."""
    cases = [{**record, "controller": BEFORE_PHYSICS, "seed": 0, "success": True} for record in motion_rows(study)]
    paired = paired_differences(cases, with_arm, WITHOUT, np.random.default_rng(BOOTSTRAP_SEED))
    return {
        metric: {key: summary[key] for key in ("n", "median", "low", "high")}
        for metric, summary in paired.get(BEFORE_PHYSICS, {}).items()
        if metric not in ("success", "launch_s")
    }


def median_of(values: Iterable[Any]) -> float | None:
    """Median of the values that are finite numbers; None without any."""
    known = [float(value) for value in values if isinstance(value, (int, float)) and np.isfinite(value)]
    return float(np.median(known)) if known else None


def largest_assist(cases: Iterable[Mapping[str, Any]]) -> tuple[float, float]:
    """Largest external force [N] and torque [N m] of any case."""
    force, torque = 0.0, 0.0
    for case in cases:
        force, torque = max(force, case["assist_n"]), max(torque, case["assist_nm"])
    return force, torque
