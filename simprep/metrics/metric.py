"""What a metric is, and what a set of them is: values by name, which also print as a table.

A metric of your own is any function of a run (or of a motion) that gives one value:

    def lowest_root_m(run: simprep.Run) -> float:
        return float(run.qpos[:, 2].min())

    print(simprep.evaluate_run(run, own={"lowest_root_m": lowest_root_m}).table())
"""

import math
from collections.abc import Mapping
from typing import Any, Protocol, TypeVar

import numpy as np

from simprep.display import data_frame, fact_table, table_html
from simprep.errors import SettingError

Value = float | bool | str | None
Subject = TypeVar("Subject", contravariant=True)


class Metric(Protocol[Subject]):
    """Measures a `Run` or a `Motion`: a function, or an object that can be called. The caller chooses its name.

    It must not change what it measures, and gives the same value for the same subject.
    """

    def __call__(self, subject: Subject, /) -> Value:
        """Measure the run or the motion.

        The value is a number in the unit that the metric's name ends with (`_m`, `_mm`, `_s`, `_n`, `_nm`), a truth
        value or text. None, NaN and infinity stand for a value that does not exist.
        """
        ...


class Metrics(dict[str, Value]):
    """Metrics by name, units in the names; None where one does not exist. Ready for JSON or a data frame.

    rich prints them as a table, and Jupyter displays one.
    """

    def __rich__(self) -> Any:
        return fact_table("", self, ("metric", "value"))

    def _repr_html_(self) -> str:
        return table_html(fact_table("", self, ("metric", "value")))

    def to_dataframe(self) -> Any:
        """One row of a pandas DataFrame; MissingExtraError where pandas is not installed."""
        return data_frame([self])

    def table(self) -> str:
        """The metrics as text, one a line."""
        return metrics_table({"value": self})


def metrics_table(columns: Mapping[str, Mapping[str, Value]]) -> str:
    """Metrics side by side as text, one metric a line; `-` where a column lacks it.

    Args:
        columns: heading of a column to its metrics.
    """
    names = list(dict.fromkeys(name for column in columns.values() for name in column))
    rows = [["metric", *columns], *([name, *(_text(one.get(name)) for one in columns.values())] for name in names)]
    widths = [max(map(len, cells)) for cells in zip(*rows, strict=True)]
    lines = (
        "  ".join([f"{row[0]:{widths[0]}}", *(f"{cell:>{width}}" for cell, width in zip(row[1:], widths[1:]))])
        for row in rows
    )
    return "\n".join(lines)


def collect(ours: dict[str, Any], own: Mapping[str, Metric[Subject]] | None, subject: Subject | None) -> Metrics:
    """Metrics of simprep and of the user together.

    Args:
        ours: values by name.
        own: metrics by name.
        subject: what `own` measure; None: their values are None.

    Raises:
        SettingError: a name that is in both, or a value that is neither number, truth value, text nor None.
    """
    own = own or {}
    if taken := [name for name in own if name in ours]:
        raise SettingError(f"metric {taken[0]!r} is one of simprep's; valid: any other name")
    theirs = {name: None if subject is None else metric(subject) for name, metric in own.items()}
    return Metrics({name: _plain(name, value) for name, value in (ours | theirs).items()})


def _plain(name: str, value: object) -> Value:
    """The value in JSON's types: None for numbers that are not finite."""
    plain = value.item() if isinstance(value, np.generic) else value
    if isinstance(plain, float):
        return plain if math.isfinite(plain) else None
    if plain is None or isinstance(plain, bool | str | int):
        return plain
    raise SettingError(f"metric {name!r} gave a {type(value).__name__}; valid: a number, True or False, text, None")


def _text(value: Value) -> str:
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
