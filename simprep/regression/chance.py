"""Could two ensembles over seeds differ so much by chance? A band for means, an exact test for shares.

Both keep a stated rate of false alarms over many comparisons by Bonferroni's rule: each gets an equal part of it.
"""

import math
from collections.abc import Sequence
from statistics import fmean

from scipy import special

FEW_SEEDS = 5
"""With fewer seeds on a side, Student's t does not hold for skewed numbers."""


def spread(before: Sequence[float], now: Sequence[float]) -> float:
    """Standard deviation within both ensembles together; 0 where neither has two values.

    Pooled, because one outlier among the new values then widens the band instead of breaking it.
    """
    free = len(before) + len(now) - 2
    if free < 1:
        return 0.0
    squares = 0.0
    for values in (before, now):
        centre = fmean(values)
        squares += math.fsum((value - centre) ** 2 for value in values)
    return math.sqrt(squares / free)


def half_width(before: Sequence[float], now: Sequence[float], chance: float) -> float:
    """How far two means may be apart by chance: Student's t for two samples, two-sided.

    The level holds for skewed, heavy-tailed and coarse numbers too if both ensembles have about as many seeds; with a
    quarter as many on one side it is up to eight times too often for strongly skewed ones (tests/regression has the
    simulation).

    Args:
        before: values of the baseline.
        now: values to compare.
        chance: probability of a larger difference where nothing has changed.
    """
    free = len(before) + len(now) - 2
    deviation = spread(before, now)
    if deviation == 0.0:
        return 0.0
    quantile = -float(special.stdtrit(free, chance / 2))  # as scipy.stats.t.isf, without its overhead
    return quantile * deviation * math.sqrt(1 / len(before) + 1 / len(now))


def outside_of_all(before: Sequence[float], now: Sequence[float]) -> bool:
    """Whether every new value is farther from the baseline's range than that range is wide.

    What is asked besides the band where an ensemble has fewer than `FEW_SEEDS` values.
    """
    low, high = min(before), max(before)
    width = high - low
    return min(now) > high + width or max(now) < low - width


def share_chance(before: Sequence[float], now: Sequence[float]) -> float:
    """Probability that a share becomes so much smaller, or so much larger, by chance: Boschloo's exact test, one-sided.

    Args:
        before: values 0 or 1.
        now: values 0 or 1.
    """
    from scipy.stats import boschloo_exact  # slow to import, seldom needed

    yes, new_yes = round(sum(before)), round(sum(now))
    table = [[yes, new_yes], [len(before) - yes, len(now) - new_yes]]
    if yes * len(now) == new_yes * len(before):
        return 1.0
    less = yes * len(now) < new_yes * len(before)
    return float(boschloo_exact(table, alternative="less" if less else "greater").pvalue)
