"""The report page of a study: its arms side by side in a replay, its tables and its plots."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from simprep.report.figures import COLOURS
from simprep.report.page import Page, Picture
from simprep.report.replay.actor import Actor, Replay, event_marks, side_by_side
from simprep.study.compare import WITH, WITHOUT, median_of, paired_before_physics, paired_by_controller
from simprep.study.pictures import drawn_targets, simulated_of
from simprep.study.plan import ARM_LABELS, Condition
from simprep.study.tables import study_tables
from simprep.study.validate import Study

REPLAY_LIMIT = 6
"""Most targets with a replay, so that the page stays small."""


def study_page(study: Study, files: Sequence[Path], details: Mapping[str, Any], warnings: Sequence[str] = ()) -> Page:
    """A study, finished or cut short.

    Args:
        study: with results.
        files: what was drawn; plots among them are shown, film strips are not, since the replay shows more.
        details: how it was made.
        warnings: what was said about it.
    """
    plan = study.plan
    plots = [path for path in files if path.suffix == ".png" and not path.name.startswith("strip")]
    plots.sort(key=lambda path: path.stem == "blending_curves")  # the same for every study: last
    arms = ", ".join(ARM_LABELS[arm] for arm in plan.arms)
    return Page(
        title=f"{plan.locomotion.name} to {', '.join(target.name for target in plan.targets)}",
        headline=study_headline(study),
        replays=study_replays(study),
        tables=list(study_tables(study)),
        pictures=[Picture(path.stem.replace("_", " "), path) for path in plots],
        details={**details, "arms, from the left": arms, "cases": len(study.results), "wall_s": round(study.wall_s, 1)},
        warnings=[*warnings, *(() if study.complete else ("The study was cut short; cases are missing.",))],
    )


def study_replays(study: Study) -> list[Replay]:
    """Of each target one replay with the arms side by side, at the highest level, simulated with the last controller."""
    controller = study.plan.controllers[-1]
    replays = []
    for target, alpha in list(drawn_targets(study))[:REPLAY_LIMIT]:
        actors = []
        for arm, colour in zip(study.plan.arms, COLOURS):
            condition = Condition(target, alpha, arm)
            motion, label = study.conditions[condition], ARM_LABELS[arm]
            runs = simulated_of(study, condition, controller)
            for simulated, note in runs:
                fell = note if note.startswith("fell") else ""
                actors.append(Actor(label, simulated, motion, colour, end_note=fell))
            if not runs:
                actors.append(Actor(f"{label}, not simulated", motion, colour=colour))
        last = study.conditions[Condition(target, alpha, study.plan.arms[-1])]
        marks = tuple(mark for mark in event_marks(last) if mark[0] in ("rise", "launch", "impact"))
        title = f"{target}, α {alpha:g}, {controller}"
        replays.append(Replay(title, side_by_side(actors), marks=marks))
    return replays


def study_headline(study: Study) -> str:
    """Successes, accelerations at the launch, and what posture optimisation changes, in a few sentences."""
    controller, arms = study.plan.controllers[-1], study.plan.arms
    of_arm = {
        arm: [
            result.metrics
            for result in study.results
            if (result.case.controller, result.case.condition.arm) == (controller, arm)
        ]
        for arm in arms
    }
    counts = [
        f"{sum(bool(case['success']) for case in cases)} of {len(cases)} ({ARM_LABELS[arm]})"
        for arm, cases in of_arm.items()
        if cases
    ]
    if not counts:
        return f"No case of {controller} was finished."
    sentences = [f"Simulated with {controller}, this many cases succeed: {', '.join(counts)}."]
    if "none" in arms and WITH in arms:
        peaks = [median_of(case.get("peak_acceleration_rad_s2") for case in of_arm[arm]) for arm in ("none", WITH)]
        if None not in peaks:
            sentences.append(
                f"Median peak joint acceleration at the launch: {peaks[0]:.0f} rad/s² unprepared, {peaks[1]:.0f} prepared."
            )
    if WITH in arms and WITHOUT in arms:
        before = _effect(paired_before_physics(study).get("prepared_com_cos_mm"))
        after = _effect(paired_by_controller(study).get(controller, {}).get("prepared_com_cos_mm"))
        if before and after:
            sentences.append(
                f"Posture optimisation changes the prepared distance from COM to centre of support by {before} in the motion "
                f"and {after} in simulation."
            )
    return " ".join(sentences)


def _effect(summary: Mapping[str, Any] | None) -> str:
    if summary is None or summary["median"] is None:
        return ""
    text, n = f"{summary['median']:+.1f} mm", f"n = {summary['n']}"
    return (
        f"{text} ({n})" if summary["low"] is None else f"{text} ({summary['low']:+.1f} to {summary['high']:+.1f}, {n})"
    )
