"""Paired comparison of two arms of a study over matched cases, with bootstrap intervals."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

MATCHED_ON = ("target", "alpha", "seed", "controller")
SURVIVAL = ("success", "completed_share", "survived_s")
"""Metrics that mean something for a fall too: compared over all pairs, others only where both arms succeeded."""

Summary = dict[str, float | int | None]
Pair = tuple[Mapping[str, Any], Mapping[str, Any]]
"""Two cases that differ in the arm only."""


def bootstrap_median(
    differences: Sequence[float], generator: np.random.Generator, confidence: float = 0.95, resamples: int = 2000
) -> tuple[float | None, float | None, float | None]:
    """Median and percentile bootstrap interval (Efron 1979): median, low, high; None where one does not exist.

    Captures the spread over cases. The interval is too narrow for under about 6 values, and for many seeds of few
    targets, as cases that share a target are not independent. One value has no interval.

    Args:
        differences: the values.
        generator: source of randomness.
        confidence: of the interval.
        resamples: bootstrap samples.
    """
    values = np.asarray(differences, dtype=np.float64)
    if len(values) == 0:
        return None, None, None
    median = float(np.median(values))
    if len(values) == 1:
        return median, None, None
    drawn = values[generator.integers(0, len(values), (resamples, len(values)))]
    tail = 50 * (1 - confidence)
    low, high = np.percentile(np.median(drawn, axis=1), [tail, 100 - tail])
    return median, float(low), float(high)


def paired_differences(
    cases: Iterable[Mapping[str, Any]],
    with_arm: str,
    without_arm: str,
    generator: np.random.Generator,
    metrics: Sequence[str] | None = None,
    resamples: int = 2000,
) -> dict[str, dict[str, Summary]]:
    """`with_arm` minus `without_arm` over cases that agree in target, alpha, seed and controller.

    A pair in which either arm failed counts in `SURVIVAL`, `n_failed_with` and `n_failed_without`, but in no other
    metric. So an arm that fails the hardest cases looks better in the other medians than it is; read them with the
    counts. Returns {controller: {metric: {n, median, low, high, n_failed_with, n_failed_without}}}.

    Args:
        cases: mappings with `target`, `alpha`, `arm`, `controller`, `seed`, `success`, and metrics; None and NaN are
            missing values.
        with_arm: name of one arm.
        without_arm: name of the other.
        generator: for the bootstrap; used in sorted order of controller and metric, so a seed reproduces the result.
        metrics: which to compare; None for every numeric key that both arms have.
        resamples: bootstrap samples.
    """
    matched = matched_pairs(cases, with_arm, without_arm)
    result: dict[str, dict[str, Summary]] = {}
    for controller in sorted({str(first["controller"]) for first, _ in matched}):
        pairs = [pair for pair in matched if pair[0]["controller"] == controller]
        names = sorted(_numeric_keys(pairs)) if metrics is None else list(metrics)
        result[controller] = {name: _compare(name, pairs, generator, resamples) for name in names}
    return result


def matched_pairs(
    cases: Iterable[Mapping[str, Any]], with_arm: str, without_arm: str, on: Sequence[str] = MATCHED_ON
) -> list[Pair]:
    """Cases of one arm with those of another that agree in everything else, in a fixed order.

    Args:
        cases: as of `paired_differences`.
        with_arm: name of the arm whose cases come first.
        without_arm: name of the other.
        on: keys in which the two of a pair agree.
    """
    arms: dict[str, dict[tuple[Any, ...], Mapping[str, Any]]] = {with_arm: {}, without_arm: {}}
    for case in cases:
        if case["arm"] in arms:
            arms[case["arm"]][tuple(case[key] for key in on)] = case
    matched = sorted((key for key in arms[with_arm] if key in arms[without_arm]), key=str)
    return [(arms[with_arm][key], arms[without_arm][key]) for key in matched]


def difference(name: str, pair: Pair) -> float | None:
    """A metric of the first of a pair minus that of the second.

    None where one lacks it, or where one failed and the metric is not one of `SURVIVAL`.
    """
    first, second = pair
    a, b = _number(first.get(name)), _number(second.get(name))
    both_succeeded = bool(first["success"]) and bool(second["success"])
    return a - b if a is not None and b is not None and (both_succeeded or name in SURVIVAL) else None


def _compare(name: str, pairs: list[Pair], generator: np.random.Generator, resamples: int) -> Summary:
    differences = [value for pair in pairs if (value := difference(name, pair)) is not None]
    median, low, high = bootstrap_median(differences, generator, resamples=resamples)
    return {
        "n": len(differences),
        "median": median,
        "low": low,
        "high": high,
        "n_failed_with": sum(not first["success"] for first, _ in pairs),
        "n_failed_without": sum(not second["success"] for _, second in pairs),
    }


def _numeric_keys(pairs: list[Pair]) -> set[str]:
    names: set[str] = set()
    for first, second in pairs:
        names |= {key for key in first if _number(first[key]) is not None and key in second}
    return names - set(MATCHED_ON)


def _number(value: Any) -> float | None:
    if isinstance(value, bool | int | float | np.number | np.bool_) and np.isfinite(value):
        return float(value)
    return None
