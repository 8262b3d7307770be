"""False alarms and power of the comparison, on numbers whose truth is known."""

import numpy as np
import pytest
from scipy import stats

from simprep.regression.baseline import Baseline
from simprep.regression.chance import half_width, share_chance
from simprep.regression.compare import WORSE, compare
from simprep.regression.measured import Case, Measured

METRICS, CHECKS = 30, 80
DRAWS = {
    "normal": lambda rng, size: rng.normal(size=size),
    "skewed": lambda rng, size: np.exp(0.5 * rng.normal(size=size)),
    "heavy tails": lambda rng, size: rng.standard_t(3, size=size),
    "outliers": lambda rng, size: rng.normal(size=size) + 12 * (rng.random(size) < 0.1),
    "coarse": lambda rng, size: np.round(0.7 * rng.normal(size=size)),
}


def ensemble(values, first=0):
    """Values (metrics, seeds) as one case."""
    names = [f"m{index}" for index in range(len(values))]
    seeds = tuple(range(first, first + values.shape[1]))
    return Measured({"case": Case(seeds, {name: tuple(map(float, row)) for name, row in zip(names, values)})})


@pytest.mark.parametrize("draw", DRAWS)
@pytest.mark.parametrize(("before", "now"), [(10, 10), (10, 5)])
def test_false_alarms_are_as_rare_as_stated(draw, before, now):
    """Of checks that nothing happened to, at most the stated share alarms (within what so many tell)."""
    rng, wanted = np.random.default_rng(4), 0.05
    alarms = 0
    for _ in range(CHECKS):
        baseline = Baseline(ensemble(DRAWS[draw](rng, (METRICS, before))), false_alarm=wanted)
        alarms += bool(compare(ensemble(DRAWS[draw](rng, (METRICS, now)), 100), baseline).failures)
    assert alarms <= stats.binom.ppf(0.995, CHECKS, wanted)


def test_a_shift_of_three_deviations_is_found_among_thirty_metrics():
    rng, found = np.random.default_rng(5), 0
    for _ in range(40):
        values = rng.normal(size=(METRICS, 10))
        values[7] += 3.0
        baseline = Baseline(ensemble(rng.normal(size=(METRICS, 10))))
        failures = compare(ensemble(values, 100), baseline).failures
        found += [row.metric for row in failures] == ["m7"]
    assert found >= 30


def test_the_band_is_that_of_students_test():
    rng = np.random.default_rng(6)
    one, other = rng.normal(size=8), rng.normal(size=5) + 1.5
    chance = float(stats.ttest_ind(one, other).pvalue)
    assert half_width(one, other, chance) == pytest.approx(abs(one.mean() - other.mean()))
    assert half_width(one, other, chance / 2) > half_width(one, other, chance)
    assert half_width([2.0] * 5, [2.0] * 5, 0.01) == 0
    assert half_width([2.0], [3.0], 0.01) == 0


@pytest.mark.parametrize(("yes", "new_yes", "alarm"), [(10, 10, False), (10, 8, False), (10, 2, True), (0, 9, True)])
def test_shares_of_ten_seeds(yes, new_yes, alarm):
    values = [[1.0] * count + [0.0] * (10 - count) for count in (yes, new_yes)]
    assert (share_chance(*values) < 0.001) == alarm
    assert share_chance(*values) == pytest.approx(share_chance(*values[::-1]))


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_false_alarms_of_shares_are_rarer_than_stated(share):
    counts = stats.binom.pmf(np.arange(7), 6, share)
    values = [(1.0,) * count + (0.0,) * (6 - count) for count in range(7)]
    alarm = np.array([[share_chance(one, other) < 0.01 for other in values] for one in values])
    assert counts @ alarm @ counts < 0.01


def test_success_is_judged_as_a_share_and_other_metrics_over_successes():
    seeds = tuple(range(8))
    good = {"success": (1.0,) * 7 + (0.0,), "mpjpe_mm": (20.0, 21.0, 19.5, 20.5, 20.2, 19.9, 20.7, 300.0)}
    bad = {"success": (0.0,) + (1.0,) * 7, "mpjpe_mm": (400.0, 26.0, 27.1, 26.5, 25.9, 26.3, 26.8, 27.0)}
    lost = {"success": (0.0,) * 8, "mpjpe_mm": (300.0,) * 8}
    baseline = Baseline(Measured({"case": Case(seeds, good)}))
    rows = {row.metric: row for row in compare(Measured({"case": Case(seeds, bad)}), baseline).rows}
    assert rows["success"].verdict == "same"
    assert rows["mpjpe_mm"].verdict == WORSE  # the falls, which would hide it, are no part of it
    assert rows["mpjpe_mm"].seeds == (7, 7)
    rows = {row.metric: row for row in compare(Measured({"case": Case(seeds, lost)}), baseline).rows}
    assert rows["success"].verdict == WORSE
    assert 0 < rows["success"].low < 0.875 <= rows["success"].high == 1
