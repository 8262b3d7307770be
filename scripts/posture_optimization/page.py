"""The study as a page: the answer, its tables and pictures, and a few arms side by side."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.table import Table
from rich.text import Text

from posture_optimization.compared import LABELS, Comparison
from posture_optimization.report import QUESTION
from simprep.report.page import Page, Picture
from simprep.report.replay.actor import Replay
from simprep.study.plan import ARM_LABELS


def posture_page(
    content: Mapping[str, Any], whole: Sequence[Comparison], figures: Sequence[Path], replays: Sequence[Replay]
) -> Page:
    """The study, as far as it is.

    Args:
        content: of summary.json.
        whole: comparisons over all cases of a controller and a disturbance.
        figures: what was drawn.
        replays: cases to look at.
    """
    first, *rest = (part.replace("`", "") for part in re.split(r"(?<=\.) (?=[A-Z`])", content["answer"], maxsplit=1))
    about = {
        key: content[key]
        for key in ("command", "created_utc", "versions", "platform", "preset", "seeds")
        if key in content
    }
    return Page(
        title=QUESTION,
        headline=first,
        replays=replays,
        tables=[_arms(content["arms"]), _effects(whole)],
        pictures=[Picture(path.stem, path) for path in figures],
        details={
            **about,
            "cases": f"{content['n_cases']} of {content['n_planned']}, {content['n_simulated']} simulated",
            "answer": " ".join(rest),
        },
    )


def _arms(rows: Sequence[Mapping[str, Any]]) -> Table:
    table = Table(title=Text("What was simulated"), title_justify="left")
    for heading in ("controller", "disturbance", "arm"):
        table.add_column(heading)
    for heading in ("cases", "success", "median survived [s]"):
        table.add_column(Text(heading), justify="right")
    for row in rows:
        table.add_row(
            row["controller"], row["disturbance"].replace("_", " "), ARM_LABELS[row["arm"]], str(row["n"]),
            f"{row['n_success']} ({100 * row['n_success'] / row['n']:.0f} %)", f"{row['median_survived_s']:.2f}",
        )  # fmt: skip
    return table


def _effects(comparisons: Sequence[Comparison]) -> Table:
    table = Table(title=Text("Effect, with minus without posture optimisation"), title_justify="left")
    for heading in ("controller", "disturbance", "metric"):
        table.add_column(heading)
    for heading in ("effect", "95 % interval", "pairs"):
        table.add_column(heading, justify="right")
    table.add_column("says")
    for one in comparisons:
        effect = one.effect
        if effect.estimate is None:
            continue
        interval = "–" if effect.low is None or effect.high is None else f"{effect.low:+.3g} to {effect.high:+.3g}"
        names = (one.controller, one.disturbance.replace("_", " "), LABELS[one.outcome.name])
        numbers = (f"{effect.estimate:+.3g}", interval, str(effect.n), one.says)
        table.add_row(*map(Text, (*names, *numbers)))
    return table
