"""The study as tables for people."""

from collections.abc import Iterator, Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

from simprep.study.compare import (
    OTHER_OPTIMISER,
    WITH,
    WITHOUT,
    case_rows,
    median_of,
    paired_before_physics,
    paired_by_controller,
)
from simprep.study.doses import DOSES
from simprep.study.plan import ARM_LABELS, BEFORE_PHYSICS
from simprep.study.validate import Study

Column = tuple[str, str, str]
"""Heading, metric, number format."""

RUN_COLUMNS: tuple[Column, ...] = (
    ("MPJPE [mm]", "mpjpe_mm", ".0f"),
    ("G-MPJPE [mm]", "g_mpjpe_mm", ".0f"),
    ("COM-COS [mm]", "com_cos_mm", ".0f"),
    ("MoS [mm]", "margin_of_stability_mm", ".0f"),
    ("COM inside", "com_inside_share", ".0%"),
    ("acc. [rad/s2]", "peak_acceleration_rad_s2", ".0f"),
    ("torque [N m]", "peak_torque_nm", ".0f"),
    ("cost", "yardsticks", ".2f"),
)
MOTION_COLUMNS: tuple[Column, ...] = (
    ("COM-COS [mm]", "com_cos_mm", ".0f"),
    ("prepared COM-COS [mm]", "prepared_com_cos_mm", ".0f"),
    ("MoS [mm]", "margin_of_stability_mm", ".0f"),
    ("COM inside", "com_inside_share", ".0%"),
    ("ZMP inside", "zmp_inside_share", ".0%"),
    ("residual force [N]", "residual_force_n", ".0f"),
    ("acc. [rad/s2]", "peak_acceleration_rad_s2", ".0f"),
)
PAIRED_ROWS: tuple[Column, ...] = (
    ("success [share]", "success", ".2f"),
    ("time survived [s]", "survived_s", ".2f"),
    ("MPJPE [mm]", "mpjpe_mm", ".1f"),
    ("COM-COS [mm]", "com_cos_mm", ".1f"),
    ("prepared COM-COS [mm]", "prepared_com_cos_mm", ".1f"),
    ("margin of stability [mm]", "margin_of_stability_mm", ".1f"),
    ("peak acceleration [rad/s2]", "peak_acceleration_rad_s2", ".1f"),
    ("peak torque [N m]", "peak_torque_nm", ".1f"),
)
DOSE_ROWS: tuple[Column, ...] = (
    ("push at launch [N]", "dose_push_launch_n", ".0f"),
    ("the same, weakest direction [N]", "dose_push_launch_least_n", ".0f"),
    ("push in mid-stance [N]", "dose_push_stance_n", ".0f"),
    ("the same, weakest direction [N]", "dose_push_stance_least_n", ".0f"),
    *((dose.words, dose.key, ".3f") for dose in DOSES.values()),
)
"""Only where doses were measured."""


def study_tables(study: Study) -> Iterator[Table]:
    """Tables of a study, finished or cut short: runs, motions before physics, effect of posture optimisation."""
    yield _runs(study)
    yield _motions(study)
    yield _paired(study, WITH)
    if OTHER_OPTIMISER in study.plan.arms:
        yield _paired(study, OTHER_OPTIMISER)


def _runs(study: Study) -> Table:
    cost = "" if study.yardstick_s is None else "; cost in yardsticks"
    table = Table(title=f"Simulated (medians over cases, each until its end{cost})", title_justify="left")
    for heading in ("controller", "arm", "success", "fell at [s]"):
        table.add_column(Text(heading), no_wrap=heading != "fell at [s]")
    rows = case_rows(study)
    columns = [column for column in RUN_COLUMNS if column[1] != "yardsticks" or study.yardstick_s is not None]
    for heading, *_ in columns:
        table.add_column(Text(heading), justify="right")  # Text: brackets in a str would be markup
    for controller in study.plan.controllers:
        for arm in study.plan.arms:
            cases = [row for row in rows if (row["controller"], row["arm"]) == (controller, arm)]
            if not cases:
                continue
            successes = sum(bool(case["success"]) for case in cases)
            table.add_row(
                controller,
                ARM_LABELS[arm],
                f"{successes}/{len(cases)}",
                _cell([case.get("fell_at_s") for case in cases], ".2f"),
                *(_cell([case.get(key) for case in cases], form) for _, key, form in columns),
            )
        table.add_section()
    return table


def _motions(study: Study) -> Table:
    table = Table(title="Motions before physics (medians over targets and levels)", title_justify="left")
    table.add_column("arm")
    for heading, *_ in MOTION_COLUMNS:
        table.add_column(Text(heading), justify="right")  # Text: brackets in a str would be markup
    for arm in study.plan.arms:
        metrics = [values for condition, values in study.kinematic.items() if condition.arm == arm]
        cells = (_cell([item.get(key) for item in metrics], form) for _, key, form in MOTION_COLUMNS)
        table.add_row(ARM_LABELS[arm], *cells)
    return table


def _paired(study: Study, with_arm: str) -> Table:
    title = f"{ARM_LABELS[with_arm]} minus {ARM_LABELS[WITHOUT]}: medians over pairs (95 % interval)"
    table = Table(title=Text(title), title_justify="left")
    table.add_column("metric")
    columns: Mapping[str, Any] = {
        BEFORE_PHYSICS: paired_before_physics(study, with_arm),
        **paired_by_controller(study, with_arm),
    }
    for name in columns:
        table.add_column(name if name == BEFORE_PHYSICS else f"simulated, {name}", justify="right")
    measured = [row for row in DOSE_ROWS if any(row[1] in paired for paired in columns.values())]
    for heading, key, form in (*PAIRED_ROWS, *measured):
        table.add_row(Text(heading), *(_interval(paired.get(key), form) for paired in columns.values()))
    return table


def _cell(values: list[Any], form: str) -> str:
    middle = median_of(values)
    return "-" if middle is None else format(middle, form)


def _interval(item: Mapping[str, Any] | None, form: str) -> str:
    if item is None or item["median"] is None:
        return "-"
    text = format(item["median"], "+" + form)
    if item["low"] is not None:
        text += f" ({format(item['low'], '+' + form)} to {format(item['high'], '+' + form)})"
    return f"{text} n={item['n']}"
