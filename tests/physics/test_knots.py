"""Knots of the offset curve: a plan that nobody changes stays the same curve in time."""

import numpy as np
import pytest

from simprep.physics.knots import Knots, linear_basis
from simprep.physics.sampling import OffsetSearch, SearchSettings

WORLD_DT = 1 / 480
SETTINGS = SearchSettings(samples=10, refined=5, keep=2, shrink=0.7, scales=(1.0,), damping=(1.0,))


@pytest.mark.parametrize(("every", "spacing"), [(14, 0.1), (24, 0.1), (14, 0.05), (96, 0.05), (7, 1 / 30)])
def test_an_unchanged_plan_stays_where_it_is_in_time(every: int, spacing: float) -> None:
    knots = Knots(spacing, 38, 1 / 96, every, WORLD_DT)
    search = OffsetSearch(knots.count, np.array([0.1]), SETTINGS)
    curve = np.random.default_rng(0).standard_normal((knots.count, 1))
    search.go_on_from(curve, np.stack([curve, 2 * curve]))

    def expected(times: np.ndarray) -> np.ndarray:
        return linear_basis(times / spacing, len(curve)) @ curve

    now = 0.0
    for _ in range(40):
        np.testing.assert_allclose(knots.plan @ search.plan, expected(now + np.arange(len(knots.plan)) / 96), atol=1e-6)
        np.testing.assert_allclose(knots.world @ search.plan, expected(now + np.arange(every) * WORLD_DT), atol=1e-6)
        search.begin(knots.go_on(every))
        np.testing.assert_allclose(search.kept, np.stack([search.plan, 2 * search.plan]))
        now += every * WORLD_DT


def test_every_instant_of_a_plan_lies_between_two_knots() -> None:
    knots = Knots(0.1, 40, 1 / 96, 14, WORLD_DT)
    for _ in range(50):
        np.testing.assert_allclose(knots.plan.sum(axis=1), 1.0)
        assert knots.plan[-1] @ np.arange(knots.count) <= knots.count - 1 - 1e-9  # never beyond the last one
        knots.go_on(14)


def test_a_new_plan_takes_over_from_what_was_sent_without_a_jump() -> None:
    """The simulated and the sent offsets go from the ones before to the plan in the same straight line."""
    at_once, gentle = (Knots(0.1, 40, 1 / 96, 14, WORLD_DT, fade_in) for fade_in in (0.0, 0.02))
    curve = np.random.default_rng(1).standard_normal(at_once.count)
    np.testing.assert_array_equal(gentle.plan, at_once.plan)  # the first plan has nothing before it
    assert not gentle.plan_before.any()
    assert not gentle.world_before.any()
    for knots in (at_once, gentle):
        knots.go_on(14)
    assert not at_once.plan_before.any()
    before = 0.7
    sent = gentle.world @ curve + gentle.world_before * before
    planned = at_once.world @ curve
    times = (1 + np.arange(14)) * WORLD_DT
    share = np.clip(times / 0.02, 0, 1)
    np.testing.assert_allclose(sent, planned + (1 - share) * (before - planned[0]), atol=1e-12)
    simulated = gentle.plan @ curve + gentle.plan_before * before
    late = (np.arange(40) + 0.5) / 96 > 0.02
    np.testing.assert_allclose(simulated[late], (at_once.plan @ curve)[late])
    # a plan that begins with what was sent is not changed by taking over from it
    start = float(at_once.plan[0] @ curve)
    np.testing.assert_allclose(gentle.plan @ curve + gentle.plan_before * start, at_once.plan @ curve, atol=1e-12)
