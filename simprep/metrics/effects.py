"""Effects over pairs that are not independent: cluster bootstrap, Wilcoxon over clusters, Holm, and what they say.

Cases that share a target motion are alike, so many of them say less than their number. Targets are therefore drawn whole in the
bootstrap (Davison and Hinkley 1997, section 3.8), and tested by one number each.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import permutation_test, rankdata, wilcoxon

from simprep.arrays import FloatArray
from simprep.metrics.paired import Pair, difference

MEDIAN, MEAN = "median", "mean"
HELPS, HARMS, NO_EFFECT, UNDECIDED = "helps", "harmful", "no effect", "undecided"
EXACT = 13
"""Up to so many values p is exact though there are ties."""
POWER_FACTOR = 1.96 + 0.84
"""An effect of so many standard errors is found in 80 % of studies, at the level 0.05 on both sides."""


@dataclass(frozen=True)
class Outcome:
    """What is compared.

    Attributes:
        name: of the metric.
        better: 1 if more is better, -1 if less is.
        smallest: the smallest effect that matters, in the metric's unit.
        statistic: `median`, or `mean` for metrics that mostly agree, such as success.
    """

    name: str
    better: int
    smallest: float
    statistic: str = MEDIAN


@dataclass(frozen=True)
class Effect:
    """With minus without, over pairs in clusters; None where a number does not exist.

    Attributes:
        n: pairs; clusters: those that they come from.
        estimate: median or mean of the differences.
        low, high: 95 % interval, of the cluster bootstrap.
        p: Wilcoxon's signed-rank test of one median (or mean) for each cluster.
        p_holm: the same, corrected for the tests that belong together (`with_holm`); `p` until then.
        rank_biserial: effect size, -1 to 1: by how much rank sums of positive differences outweigh negative ones (Kerby 2014).
        better, worse: share of pairs that got better, and worse.
        detectable: an effect so large would be found in 80 % of such studies.
        n_failed_with, n_failed_without: pairs in which the one failed, and the other.
    """

    n: int
    clusters: int
    estimate: float | None = None
    low: float | None = None
    high: float | None = None
    p: float | None = None
    p_holm: float | None = None
    rank_biserial: float | None = None
    better: float | None = None
    worse: float | None = None
    detectable: float | None = None
    n_failed_with: int = 0
    n_failed_without: int = 0


def effect_of(
    outcome: Outcome, pairs: Sequence[Pair], cluster: str, generator: np.random.Generator, resamples: int = 2000
) -> Effect:
    """The effect on one metric.

    Args:
        outcome: the metric.
        pairs: of cases (`simprep.metrics.paired.matched_pairs`).
        cluster: key of the cases by which they belong together.
        generator: of the bootstrap.
        resamples: bootstrap samples.
    """
    found = [(value, pair[0][cluster]) for pair in pairs if (value := difference(outcome.name, pair)) is not None]
    differences = np.array([value for value, _ in found], dtype=np.float64)
    clusters: list[Hashable] = [name for _, name in found]
    groups = sorted(set(clusters), key=str)
    effect = Effect(
        len(found), len(groups),
        n_failed_with=sum(not first["success"] for first, _ in pairs),
        n_failed_without=sum(not second["success"] for _, second in pairs),
    )  # fmt: skip
    if not found:
        return effect
    statistic = np.median if outcome.statistic == MEDIAN else np.mean
    gains = outcome.better * differences
    effect = replace(
        effect,
        estimate=float(statistic(differences)),
        rank_biserial=rank_biserial(differences),
        better=float((gains > 0).mean()),
        worse=float((gains < 0).mean()),
    )
    if len(groups) < 2:
        return effect
    index = np.array([groups.index(name) for name in clusters])
    drawn = cluster_bootstrap(differences, index, generator, outcome.statistic, resamples)
    low, high = np.percentile(drawn, [2.5, 97.5])
    p = signed_rank(np.array([statistic(differences[index == group]) for group in range(len(groups))]))
    detectable = POWER_FACTOR * float(drawn.std())
    return replace(effect, low=float(low), high=float(high), p=p, p_holm=p, detectable=detectable)


def cluster_bootstrap(
    values: FloatArray,
    clusters: np.ndarray,
    generator: np.random.Generator,
    statistic: str = MEDIAN,
    resamples: int = 2000,
) -> FloatArray:
    """Median or mean of samples in which whole clusters are drawn with replacement, (resamples,).

    Args:
        values: (N,).
        clusters: (N,) number of each one's cluster, from 0.
        generator: source of randomness.
        statistic: `median` or `mean`.
        resamples: how many.
    """
    order = np.argsort(values, kind="stable")
    values, clusters = values[order], clusters[order]
    groups = int(clusters.max()) + 1
    counts = generator.multinomial(groups, np.full(groups, 1 / groups), resamples)
    times = counts[:, clusters]  # how often each value is drawn, (resamples, N)
    if statistic == MEAN:
        return np.asarray((times * values).sum(axis=1) / times.sum(axis=1))
    until = np.cumsum(times, axis=1)
    total = until[:, -1:]
    middles = [values[(until > place).argmax(axis=1)] for place in ((total - 1) // 2, total // 2)]
    return np.asarray((middles[0] + middles[1]) / 2)


def signed_rank(values: FloatArray) -> float:
    """p of Wilcoxon's signed-rank test, two-sided; 1 where all are 0."""
    moved = values[values != 0]
    if not len(moved):
        return 1.0
    if len(moved) > EXACT or len(np.unique(np.abs(moved))) == len(moved):
        return float(wilcoxon(moved).pvalue)
    # the same test with ties, by all changes of sign; scipy's own way takes seconds
    signed = np.sign(moved) * rankdata(np.abs(moved))
    exact = permutation_test((signed,), np.sum, permutation_type="samples", n_resamples=2**EXACT, vectorized=True)
    return float(exact.pvalue)


def rank_biserial(values: FloatArray) -> float:
    """Matched-pairs rank-biserial correlation, -1 to 1; 0 where all are 0 (Kerby 2014)."""
    moved = values[values != 0]
    if not len(moved):
        return 0.0
    ranks = rankdata(np.abs(moved))
    return float((ranks * np.sign(moved)).sum() / ranks.sum())


def holm(p_values: Sequence[float]) -> list[float]:
    """p values corrected for their number (Holm 1979), in the same order."""
    order = np.argsort(p_values, kind="stable")
    corrected, largest = [0.0] * len(p_values), 0.0
    for rank, place in enumerate(order):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[place]))
        corrected[place] = largest
    return corrected


def with_holm(effects: Sequence[Effect]) -> list[Effect]:
    """The same effects with p corrected for all tests among them."""
    tested = [effect.p for effect in effects if effect.p is not None]
    corrected = iter(holm(tested))
    return [effect if effect.p is None else replace(effect, p_holm=next(corrected)) for effect in effects]


def verdict(effect: Effect, outcome: Outcome, level: float = 0.05) -> str:
    """What an effect says: `helps`, `harmful`, `no effect` or `undecided`.

    It helps or harms if interval and corrected test both exclude 0, unless the whole interval is smaller than what matters. There
    is no effect if the whole interval is smaller than what matters. All else is undecided.

    Args:
        effect: after `with_holm`.
        outcome: the metric.
        level: of the test.
    """
    if effect.estimate is None or effect.low is None or effect.high is None or effect.p_holm is None:
        return UNDECIDED
    if max(abs(effect.low), abs(effect.high)) < outcome.smallest:
        return NO_EFFECT
    if (effect.low > 0 or effect.high < 0) and effect.p_holm < level:
        return HELPS if outcome.better * effect.estimate > 0 else HARMS
    return UNDECIDED
