import json

import numpy as np
import pytest

from simprep.metrics.paired import bootstrap_median, paired_differences


def case(arm, seed, value, success=True, controller="mpc", target="punch"):
    return {
        "target": target, "alpha": 0.5, "arm": arm, "controller": controller, "seed": seed, "success": success,
        "end": "done" if success else "fell", "com_cos_mm": value, "completed_share": 1.0 if success else 0.25,
    }  # fmt: skip


def test_differences_of_matched_cases_only():
    cases = [case("with", s, 10.0 + s) for s in range(5)] + [case("without", s, 20.0 + 3 * s) for s in range(4)]
    cases += [case("traditional", s, 1e6) for s in range(5)]
    result = paired_differences(reversed(cases), "with", "without", np.random.default_rng(0))
    assert list(result) == ["mpc"]
    found = result["mpc"]["com_cos_mm"]
    assert found["n"] == 4  # seed 4 has no partner
    assert found["median"] == np.median([-10, -12, -14, -16])
    assert -16 <= found["low"] <= found["median"] <= found["high"] <= -10
    assert result == paired_differences(cases, "with", "without", np.random.default_rng(0))
    assert "seed" not in result["mpc"]


def test_failures_are_counted_and_not_averaged():
    cases = [case("with", 0, 10.0), case("without", 0, 15.0)]
    cases += [case("with", 1, 0.0), case("without", 1, 99.0, success=False)]
    cases += [case("with", 2, 99.0, success=False), case("without", 2, 0.0)]
    cases += [case(arm, 0, 1.0, success=False, controller="pd") for arm in ("with", "without")]
    cases[0]["fell_at_s"] = cases[1]["com_to_edge_mm"] = None
    result = paired_differences(cases, "with", "without", np.random.default_rng(0))
    assert result["mpc"]["com_cos_mm"] == {
        "n": 1, "median": -5.0, "low": None, "high": None, "n_failed_with": 1, "n_failed_without": 1,
    }  # fmt: skip
    assert result["mpc"]["completed_share"]["n"] == result["mpc"]["success"]["n"] == 3
    assert result["pd"]["com_cos_mm"]["n"] == 0
    assert result["pd"]["com_cos_mm"]["median"] is None
    json.dumps(result, allow_nan=False)


def test_interval_covers_the_true_median_about_as_often_as_it_says():
    rng = np.random.default_rng(7)
    hits = 0
    for _ in range(300):
        _, low, high = bootstrap_median(rng.normal(2.0, 1.0, 25).tolist(), rng, resamples=400)
        assert low is not None
        assert high is not None
        hits += low <= 2.0 <= high
    assert 0.89 <= hits / 300 <= 0.99


def test_no_values_and_one_value():
    rng = np.random.default_rng(0)
    assert bootstrap_median([], rng) == (None, None, None)
    assert bootstrap_median([3.0], rng) == (3.0, None, None)
    assert bootstrap_median([3.0, 3.0], rng) == (3.0, 3.0, 3.0)
    assert bootstrap_median([1.0, 2.0, 4.0], rng)[0] == pytest.approx(2.0)
