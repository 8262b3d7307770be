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
