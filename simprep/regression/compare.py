"""Compare numbers with a baseline: what moved, by more than its tolerance and by more than chance allows."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean
from typing import Any

from simprep.display import SelfShowing, data_frame
from simprep.metrics.paired import SURVIVAL
from simprep.regression.baseline import Baseline
from simprep.regression.chance import FEW_SEEDS, half_width, outside_of_all, share_chance, spread
from simprep.regression.environment import differences
from simprep.regression.measured import Case, Measured
from simprep.regression.tolerance import better_sign, own_name, tolerance_of

SAME, BETTER, WORSE, MOVED, GONE, NEW = "same", "better", "worse", "moved", "gone", "new"
REGRESSIONS = (WORSE, MOVED, GONE)
"""Verdicts that fail a check. `moved`: no direction is known to be the better one; `gone`: there is no number any more."""
SUCCESS = "success"
LEAST_SUCCESSES = 2
LEAST_VALUES = 2


@dataclass(frozen=True)
class Row:
    """One metric of one case.

    Attributes:
        case: its name.
        metric: its name.
        before: mean over the baseline's seeds; None where there is none.
        now: mean over the new seeds.
        low, high: the mean may lie between these; None where nothing is judged.
        verdict: `same`, `better`, `worse`, `moved`, `gone` or `new`.
        seeds: how many values there were before and now.
        chance: whether low and high come from the ensembles, not from the tolerance.
    """

    case: str
    metric: str
    before: float | None
    now: float | None
    low: float | None
    high: float | None
    verdict: str
    seeds: tuple[int, int]
    chance: bool = False

    @property
    def regression(self) -> bool:
        """Whether it fails a check."""
        return self.verdict in REGRESSIONS


@dataclass(frozen=True)
class Comparison(SelfShowing):
    """All metrics of all cases, and in what baseline and new numbers differ besides.

    Attributes:
        rows: in the baseline's order, then what is new.
        differences: versions, processor and seeds that differ, in words.
        notes: what the numbers cannot say.
        strict: whether a change for the better fails too.
    """

    rows: tuple[Row, ...]
    differences: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    strict: bool = False

    @property
    def failures(self) -> tuple[Row, ...]:
        """Rows that fail the check."""
        return tuple(row for row in self.rows if row.regression or (self.strict and row.verdict == BETTER))

    @property
    def changes(self) -> tuple[Row, ...]:
        """Rows that are not the same."""
        return tuple(row for row in self.rows if row.verdict != SAME)

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(comparison)` and Jupyter show."""
        counts = Counter(row.verdict for row in self.rows)
        return "failed" if self.failures else "passed", {"numbers": len(self.rows), **counts}

    def to_dataframe(self) -> Any:
        """The rows as a pandas DataFrame, one for each metric of a case; MissingExtraError where pandas is not installed."""
        return data_frame([asdict(row) for row in self.rows])


@dataclass(frozen=True)
class _Pair:
    """Values of a metric on both sides, without those that do not exist, and how many runs could have had one."""

    case: str
    metric: str
    before: tuple[float, ...]
    now: tuple[float, ...]
    runs: tuple[int, int]

    @property
    def sometimes(self) -> bool:
        """Whether only some of the baseline's runs have it, such as the margin of a step that not every seed makes."""
        return len(self.before) < self.runs[0]

    def missing_by_chance(self, chance: float) -> bool:
        """Whether other seeds alone explain how few runs have it now, or it has too few values to tell."""
        having = [
            (1.0,) * len(one) + (0.0,) * (runs - len(one)) for one, runs in zip((self.before, self.now), self.runs)
        ]
        return self.sometimes and (not having[1] or share_chance(having[0], having[1]) >= chance)

    @property
    def is_share(self) -> bool:
        return own_name(self.metric) == SUCCESS

    @property
    def by_chance(self) -> bool:
        return bool(self.before and self.now) and spread(self.before, self.now) > 0.0


def compare(measured: Measured, baseline: Baseline, strict: bool = False) -> Comparison:
    """Compare numbers with a baseline.

    A metric moved if the difference of the means exceeds its tolerance and, where values vary over seeds, also what
    chance explains: Student's t of two samples at the rate `false_alarm`, shared equally among all varying metrics of
    all cases. `success` has half of the rate for itself, by Boschloo's exact test, whose one side that gets worse counts. Where a case has `success`, other
    metrics but those of survival are compared over runs that succeeded, if both sides have two of them.

    Args:
        measured: the new numbers.
        baseline: what they are compared with.
        strict: a change for the better fails the check too.
    """
    old = baseline.measured.cases
    pairs = list(_pairs(measured.cases, {name: case for name, case in old.items() if name in measured.cases}))
    shares = sum(pair.by_chance and pair.is_share for pair in pairs)
    varying = sum(pair.by_chance and not pair.is_share for pair in pairs)
    part = baseline.false_alarm * (0.5 if shares and varying else 1.0)
    each = {True: part / max(1, shares) / (2 if strict else 1), False: part / max(1, varying)}
    rows = [_judged(pair, baseline, each[pair.is_share]) for pair in pairs]
    rows += [_whole(name, case, GONE) for name, case in old.items() if name not in measured.cases]
    known = {(row.case, row.metric) for row in rows}
    for name, case in measured.cases.items():
        if name not in old:
            rows.append(_whole(name, case, NEW))
        for metric in case.metrics if name in old else ():
            if (name, metric) not in known and (values := _known(case, metric)):
                rows.append(Row(name, metric, None, _mean(values), None, None, NEW, (0, len(values))))
    return Comparison(tuple(rows), differences(baseline.measured, measured), _notes(pairs), strict)


def _whole(name: str, case: Case, verdict: str) -> Row:
    """A case that only one side has, in one row."""
    metric = f"all {len(case.metrics)} numbers"
    seeds = (len(case.seeds), 0) if verdict == GONE else (0, len(case.seeds))
    return Row(name, metric, None, None, None, None, verdict, seeds)


def _pairs(now: Mapping[str, Case], before: Mapping[str, Case]) -> Iterator[_Pair]:
    for name, case in before.items():
        other = now[name]
        judged = _successes(case), _successes(other)
        of_successes = all(sum(one) >= LEAST_SUCCESSES for one in judged)
        for metric in case.metrics:
            chosen = of_successes and own_name(metric) not in SURVIVAL
            values = [_known(one, metric, keep if chosen else ()) for one, keep in zip((case, other), judged)]
            if values[0]:
                runs = [
                    sum(keep) if chosen else len(one.metrics.get(metric, ()))
                    for one, keep in zip((case, other), judged)
                ]
                yield _Pair(name, metric, values[0], values[1], (runs[0], runs[1] or len(other.seeds)))


def _successes(case: Case) -> tuple[bool, ...]:
    return tuple(bool(value) for value in case.metrics.get(SUCCESS, ()))


def _known(case: Case, metric: str, keep: Sequence[bool] = ()) -> tuple[float, ...]:
    values = case.metrics.get(metric, ())
    kept = keep or (True,) * len(values)
    return tuple(value for value, wanted in zip(values, kept) if wanted and value is not None)


def _judged(pair: _Pair, baseline: Baseline, chance: float) -> Row:
    before = _mean(pair.before)
    seeds = len(pair.before), len(pair.now)
    if not pair.now:
        verdict = SAME if pair.missing_by_chance(chance) else GONE
        return Row(pair.case, pair.metric, before, None, None, None, verdict, seeds)
    now = _mean(pair.now)
    if pair.sometimes and min(seeds) < LEAST_VALUES:  # one value of many runs has no spread to be judged by
        return Row(pair.case, pair.metric, before, now, None, None, SAME, seeds)
    allowed = tolerance_of(pair.case, pair.metric, baseline.tolerances).allowed(before)
    if pair.is_share and pair.by_chance:
        moved = abs(now - before) > allowed and share_chance(pair.before, pair.now) < chance
        low, high = _share_band(pair, allowed, chance)
        return Row(pair.case, pair.metric, before, now, low, high, _verdict(pair, moved), seeds, True)
    width = half_width(pair.before, pair.now, chance) if pair.by_chance else 0.0
    reach = max(allowed, width)
    moved = abs(now - before) > reach
    if width and min(seeds) < FEW_SEEDS:
        moved = moved and outside_of_all(pair.before, pair.now)
    return Row(
        pair.case, pair.metric, before, now, before - reach, before + reach, _verdict(pair, moved), seeds, width > allowed
    )  # fmt: skip


def _share_band(pair: _Pair, allowed: float, chance: float) -> tuple[float, float]:
    """Shares of successes among the new seeds that would be no alarm: the least and the largest."""
    count, before = len(pair.now), _mean(pair.before)
    shares = [yes / count for yes in range(count + 1)]
    fine = [
        share
        for yes, share in enumerate(shares)
        if abs(share - before) <= allowed or share_chance(pair.before, (1.0,) * yes + (0.0,) * (count - yes)) >= chance
    ]
    return (min(fine), max(fine)) if fine else (before, before)


def _verdict(pair: _Pair, moved: bool) -> str:
    if not moved:
        return SAME
    sign = better_sign(pair.metric)
    if sign == 0:
        return MOVED
    return BETTER if sign * (_mean(pair.now) - _mean(pair.before)) > 0 else WORSE


def _mean(values: Sequence[float]) -> float:
    return fmean(values)


def _notes(pairs: Sequence[_Pair]) -> tuple[str, ...]:
    few = [min(len(pair.before), len(pair.now)) for pair in pairs if pair.by_chance]
    if few and min(few) < FEW_SEEDS:
        return (
            f"some metrics vary and have fewer than {FEW_SEEDS} values on a side: only a value far outside of the "
            "baseline's range is told from chance; more seeds see smaller changes",
        )
    return ()
