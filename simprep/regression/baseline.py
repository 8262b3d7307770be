"""A baseline: numbers that were accepted, what may move, why it was last changed, and on which machine it was made."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from simprep.errors import MotionFileError, SettingError, SimprepError
from simprep.regression.measured import Case, Measured
from simprep.regression.tolerance import Tolerance
from simprep.report.results import save_json

SCHEMA = "simprep.baseline/1"
FALSE_ALARM = 0.001
"""Probability that a check of an unchanged program alarms by chance."""


@dataclass(frozen=True)
class Change:
    """Why a baseline was written: when (UTC), with which versions of packages, and the reason that was given."""

    date_utc: str
    reason: str
    versions: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Baseline:
    """What new numbers are compared with.

    Attributes:
        measured: numbers, versions and machine.
        tolerances: asked before the defaults (`simprep.regression.tolerance`).
        false_alarm: probability that a check of an unchanged program alarms by chance.
        history: every change, the last one last.

    Raises:
        SettingError: a probability that is not between 0 and 0.5.
    """

    measured: Measured
    tolerances: tuple[Tolerance, ...] = ()
    false_alarm: float = FALSE_ALARM
    history: tuple[Change, ...] = ()

    def __post_init__(self) -> None:
        if not 0 < self.false_alarm <= 0.5:
            raise SettingError(f"rate of false alarms {self.false_alarm:g}; valid: above 0, up to 0.5")


def new_baseline(
    measured: Measured,
    reason: str,
    former: Baseline | None = None,
    tolerances: Sequence[Tolerance] = (),
    false_alarm: float | None = None,
) -> Baseline:
    """A baseline of new numbers, with the tolerances and the history of a former one.

    Args:
        measured: the numbers to accept.
        reason: why; kept in the history.
        former: the baseline that it replaces.
        tolerances: asked before those of the former one; one for the same pattern replaces it.
        false_alarm: None for that of the former one, or the default.

    Raises:
        SettingError: no reason, or no numbers.
    """
    if not reason.strip():
        raise SettingError("a baseline is not changed without a reason; valid: --update --reason TEXT")
    if not measured.cases:
        raise SettingError("there are no numbers to make a baseline of")
    kept = former or Baseline(measured)
    patterns = {one.pattern for one in tolerances}
    return Baseline(
        measured,
        (*tolerances, *(one for one in kept.tolerances if one.pattern not in patterns)),
        kept.false_alarm if false_alarm is None else false_alarm,
        (*kept.history, Change(datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"), reason.strip(), measured.versions)),
    )


def save_baseline(baseline: Baseline, path: str | Path) -> Path:
    """Write a baseline as JSON, atomically."""
    measured = baseline.measured
    return save_json(
        path,
        {
            "schema": SCHEMA,
            "history": [asdict(change) for change in baseline.history],
            "versions": measured.versions,
            "platform": measured.platform,
            "false_alarm": baseline.false_alarm,
            "tolerances": [asdict(one) for one in baseline.tolerances],
            "cases": {
                name: {"seeds": case.seeds, "metrics": case.metrics} for name, case in measured.cases.items()
            },
        },
    )  # fmt: skip


def read_baseline(path: str | Path) -> Baseline:
    """Read what `save_baseline` wrote, or what was edited by hand since.

    Raises:
        MotionFileError: missing, no baseline, or contradictory.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise MotionFileError(path, "no such baseline; make one with --update --reason TEXT") from None
    except (OSError, ValueError) as error:
        raise MotionFileError(path, f"no readable baseline ({str(error)[:200]})") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        given = content.get("schema") if isinstance(content, dict) else type(content).__name__
        raise MotionFileError(path, f"schema {str(given)[:100]!r}; a baseline has {SCHEMA!r}")
    try:
        return Baseline(
            Measured(
                {name: _case(name, case) for name, case in content["cases"].items()},
                {str(name): str(version) for name, version in content["versions"].items()},
                dict(content["platform"]),
            ),
            tuple(Tolerance(**one) for one in content["tolerances"]),
            float(content["false_alarm"]),
            tuple(Change(**one) for one in content["history"]),
        )
    except SimprepError as error:
        raise MotionFileError(path, str(error)) from None
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise MotionFileError(path, f"a damaged baseline ({type(error).__name__}: {str(error)[:200]})") from None


def _case(name: str, content: Mapping[str, Any]) -> Case:
    seeds = tuple(int(seed) for seed in content["seeds"])
    metrics = {key: tuple(_value(one) for one in values) for key, values in content["metrics"].items()}
    if not seeds or len(set(seeds)) < len(seeds):
        raise SettingError(f"case {name!r}: seeds {seeds}; valid: at least one, all different")
    for key, values in metrics.items():
        if len(values) != len(seeds):
            raise SettingError(f"case {name!r}, {key}: {len(values)} values for {len(seeds)} seeds")
    return Case(seeds, metrics)


def _value(value: float | None) -> float | None:
    if value is None:
        return None
    if not math.isfinite(value):
        raise ValueError(f"{value} is no number")
    return float(value)
