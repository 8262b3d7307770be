"""The report of a sweep: how its cases ended, by controller, disturbance and arm or clip, with a few of them to look at."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from simprep.report.figures import COLOURS, new_figure
from simprep.report.page import Page, figure_picture
from simprep.report.replay.actor import Replay
from simprep.study.plan import ARM_LABELS

ROWS = 60
"""Most groups in table and plot."""


@dataclass(frozen=True)
class Group:
    """Cases of one controller, disturbance and arm or clip.

    Attributes:
        controller: its name.
        disturbance: its name.
        what: arm in words, or clip.
        cases: how many.
        ends: how many ended how.
        success_share: of those that were simulated; NaN where none was.
        survived_s: median [s]; NaN as above.
        mpjpe_mm: median over the successful ones [mm]; NaN where there is none.
    """

    controller: str
    disturbance: str
    what: str
    cases: int
    ends: Mapping[str, int]
    success_share: float
    survived_s: float
    mpjpe_mm: float


def grouped(records: Sequence[Mapping[str, Any]]) -> list[Group]:
    """Records by controller, disturbance and arm or clip, in the order of their first."""
    found: dict[tuple[str, str, str], list[Mapping[str, Any]]] = {}
    for record in records:
        case = record["case"]
        what = ARM_LABELS[case["arm"]] if "arm" in case else case["clip"]
        found.setdefault((case["controller"], case["disturbance"], what), []).append(record)
    return [_group(name, some) for name, some in found.items()]


def sweep_page(
    name: str,
    records: Sequence[Mapping[str, Any]],
    replays: Sequence[Replay],
    details: Mapping[str, Any],
    warnings: Sequence[str] = (),
) -> Page:
    """A sweep, whole or as far as it is.

    Args:
        name: of the sweep.
        records: of its store.
        replays: cases to look at.
        details: how it was made.
        warnings: what was said about it.
    """
    groups = grouped(records)
    shown = groups[:ROWS]
    simulated = [group for group in shown if np.isfinite(group.success_share)]
    note = "" if replays else "Simulating cases again for a replay would take too long, or none can be run."
    return Page(
        title=f"Sweep {name}",
        headline=sweep_headline(records),
        replays=replays,
        tables=[_table(shown)] if shown else [],
        pictures=[figure_picture("successes, and errors of the successful cases", _plot(simulated))]
        if simulated
        else [],
        details={**details, "groups not shown": len(groups) - len(shown) or None, "replay": note},
        warnings=warnings,
    )


def sweep_headline(records: Sequence[Mapping[str, Any]]) -> str:
    """How cases ended, and how many succeed with each controller, in a sentence or two."""
    ends = Counter(record["end"] for record in records)
    told = ", ".join(f"{count} {end.replace('_', ' ')}" for end, count in ends.most_common())
    text = f"{len(records)} cases: {told}." if records else "No case is recorded."
    counts: dict[str, list[int]] = {}
    for record in records:
        if "success" in record["metrics"]:
            both = counts.setdefault(record["case"]["controller"], [0, 0])
            both[0] += bool(record["metrics"]["success"])
            both[1] += 1
    parts = [f"{yes} of {whole} with {controller}" for controller, (yes, whole) in counts.items()]
    return f"{text} Simulated cases that succeed: {', '.join(parts)}." if parts else text


def _group(name: tuple[str, str, str], records: Sequence[Mapping[str, Any]]) -> Group:
    metrics = [record["metrics"] for record in records if "success" in record["metrics"]]
    good = [one for one in metrics if one["success"]]
    return Group(
        *name,
        cases=len(records),
        ends=Counter(record["end"] for record in records),
        success_share=len(good) / len(metrics) if metrics else float("nan"),
        survived_s=_median(metrics, "survived_s"),
        mpjpe_mm=_median(good, "mpjpe_mm"),
    )


def _median(metrics: Sequence[Mapping[str, Any]], key: str) -> float:
    values = [one[key] for one in metrics if one.get(key) is not None]
    return float(np.median(values)) if values else float("nan")


def _table(groups: Sequence[Group]) -> Table:
    table = Table()
    for heading in ("controller", "disturbance", "arm or clip"):
        table.add_column(heading)
    for heading in ("cases", "ended", "success", "median survived [s]", "median MPJPE of successes [mm]"):
        table.add_column(Text(heading), justify="right")
    for one in groups:
        ends = ", ".join(f"{count} {end.replace('_', ' ')}" for end, count in one.ends.items())
        numbers = (
            _cell(100 * one.success_share, "{:.0f} %"), _cell(one.survived_s, "{:.2f}"), _cell(one.mpjpe_mm, "{:.0f}")
        )  # fmt: skip
        names = (one.controller, one.disturbance.replace("_", " "), one.what)
        table.add_row(*map(Text, (*names, str(one.cases), ends, *numbers)))
    return table


def _cell(value: float, form: str) -> str:
    return form.format(value) if np.isfinite(value) else "–"


def _plot(groups: Sequence[Group]) -> Any:
    figure = new_figure(9.5, 0.24 * len(groups) + 1.2)
    parts: tuple[tuple[str, str, Callable[[Group], float]], ...] = (
        ("success [%]", COLOURS[2], lambda one: 100 * one.success_share),
        ("median MPJPE of successes [mm]", COLOURS[1], lambda one: one.mpjpe_mm),
    )
    for number, (label, colour, value) in enumerate(parts):
        axes = figure.add_subplot(1, 2, number + 1)
        axes.barh(range(len(groups)), [value(one) for one in groups], color=colour, alpha=0.75, height=0.75)
        names = [f"{one.controller}, {one.disturbance.replace('_', ' ')}: {one.what}" for one in groups]
        axes.set_yticks(range(len(groups)), names if number == 0 else [], fontsize=7)
        axes.set_ylim(len(groups) - 0.5, -0.5)
        axes.set_xlabel(label, fontsize=8)
        axes.tick_params(axis="x", labelsize=7)
        axes.grid(axis="x", alpha=0.3)
    figure.axes[0].set_xlim(0, 100)
    return figure
