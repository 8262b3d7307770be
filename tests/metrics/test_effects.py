"""Paired effects over clusters, on data whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import wilcoxon

from simprep.metrics.effects import (
    HARMS,
    HELPS,
    MEAN,
    NO_EFFECT,
    UNDECIDED,
    Effect,
    Outcome,
    cluster_bootstrap,
    effect_of,
    holm,
    rank_biserial,
    signed_rank,
    verdict,
    with_holm,
)
from simprep.metrics.paired import matched_pairs

MARGIN = Outcome("margin_mm", 1, 5.0)


def cases(shift, rng, targets=12, each=8, between=1.0, within=1.0):
    """Pairs whose difference is a shift, plus something that the pairs of a target share, plus noise."""
    found = []
    for target in range(targets):
        own = rng.normal(0, between)
        for seed in range(each):
            value = rng.normal(50, 20)
            row = {"target": f"t{target}", "alpha": 1.0, "seed": seed, "controller": "mpc", "success": True}
            found.append({**row, "arm": "without", "margin_mm": value})
            found.append({**row, "arm": "with", "margin_mm": value + shift + own + rng.normal(0, within)})
    return found


def effect(rows, outcome=MARGIN, seed=0):
    pairs = matched_pairs(rows, "with", "without")
    return effect_of(outcome, pairs, "target", np.random.default_rng(seed), resamples=800)


@pytest.mark.parametrize(
    ("shift", "between", "expected"),
    [(8.0, 1.0, HELPS), (-8.0, 1.0, HARMS), (0.0, 1.0, NO_EFFECT), (1.0, 0.2, NO_EFFECT), (2.0, 15.0, UNDECIDED)],
)
def test_what_is_put_in_is_said(shift, between, expected):
    found = effect(cases(shift, np.random.default_rng(3), between=between))
    assert verdict(found, MARGIN) == expected
    assert found.low <= found.estimate <= found.high
    assert found.estimate == pytest.approx(shift, abs=2 * between)
    fewer_is_better = replace(MARGIN, better=-1)
    swapped = effect(cases(shift, np.random.default_rng(3), between=between), fewer_is_better)
    assert (swapped.better, swapped.worse) == (found.worse, found.better)
    if expected in (HELPS, HARMS):
        assert verdict(swapped, fewer_is_better) == (HARMS if expected == HELPS else HELPS)


def test_the_interval_covers_the_truth_though_cases_share_targets():
    """Eight cases of each target are not eight times the evidence: drawing cases instead of targets would cover far less."""
    rng = np.random.default_rng(5)
    covered = naive = 0
    for _ in range(150):
        rows = cases(0.0, rng, targets=15, between=2.0, within=0.5)
        found = effect(rows)
        covered += found.low <= 0.0 <= found.high
        differences = [b["margin_mm"] - a["margin_mm"] for a, b in zip(rows[::2], rows[1::2])]
        low, high = np.percentile(
            cluster_bootstrap(np.array(differences), np.arange(len(differences)), rng, resamples=300), [2.5, 97.5]
        )
        naive += low <= 0.0 <= high
    assert covered / 150 > 0.86
    assert naive / 150 < 0.7


def test_drawing_clusters_is_drawing_their_values():
    rng = np.random.default_rng(1)
    values, clusters = rng.normal(size=30), np.repeat(np.arange(6), 5)
    for statistic, function in (("median", np.median), ("mean", np.mean)):
        drawn = cluster_bootstrap(values, clusters, np.random.default_rng(2), statistic, 50)
        counts = np.random.default_rng(2).multinomial(6, np.full(6, 1 / 6), 50)
        for sample, count in zip(drawn, counts):
            assert sample == pytest.approx(
                function(np.concatenate([np.tile(values[clusters == k], n) for k, n in enumerate(count)]))
            )


def test_an_effect_that_is_as_large_as_detectable_is_found_in_four_of_five_studies():
    rng = np.random.default_rng(11)
    detectable = np.median([effect(cases(0.0, rng, between=3.0), seed=seed).detectable for seed in range(10)])
    found = [effect(cases(detectable, rng, between=3.0)) for _ in range(80)]
    assert 0.6 < np.mean([one.low > 0 for one in found]) < 0.97


def test_success_is_compared_by_its_mean_and_over_falls_too():
    rows = []
    for target in range(10):
        for arm, success in (("with", True), ("without", target % 2 == 0)):
            row = {"target": f"t{target}", "alpha": 1.0, "seed": 0, "controller": "pd", "arm": arm, "success": success}
            rows.append({**row, "margin_mm": 1.0 if success else None})
    found = effect(rows, Outcome("success", 1, 0.05, MEAN))
    assert (found.n, found.estimate, found.better, found.worse) == (10, 0.5, 0.5, 0.0)
    assert (found.n_failed_with, found.n_failed_without) == (0, 5)
    assert effect(rows).n == 5
    assert effect([]) == Effect(0, 0)
    assert effect(rows[:2]).low is None
    assert verdict(effect(rows[:2]), MARGIN) == UNDECIDED


def test_holm_and_ranks_agree_with_their_definitions():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.9, 0.8]) == [1.0, 1.0]
    effects = with_holm([Effect(3, 2, p=0.02), Effect(1, 1), Effect(3, 2, p=0.01)])
    assert [one.p_holm for one in effects] == [0.02, None, 0.02]
    values = np.array([1.0, -2.0, 3.0, 4.0, 0.0])
    assert signed_rank(values) == wilcoxon(values[:4]).pvalue
    tied = np.array([1.0, 1.0, -1.0, 2.0, 2.0, 3.0])
    assert signed_rank(tied) == pytest.approx(wilcoxon(tied).pvalue)
    many = np.random.default_rng(0).normal(0.3, 1.0, 16)
    assert signed_rank(many) == wilcoxon(many).pvalue
    assert signed_rank(np.zeros(3)) == 1.0
    assert rank_biserial(values) == pytest.approx((1 - 2 + 3 + 4) / 10)
    assert rank_biserial(np.zeros(3)) == 0.0
