"""Smooth paths that bring the COM nearer to a support centre that jumps."""

import numpy as np
import pytest
from scipy.optimize import minimize

from simprep.preparation.com_path import displacement_path, displacement_repair, smooth_path_in_discs


def objective(x: np.ndarray, wanted: np.ndarray, tau: float) -> float:
    return float(((x - wanted) ** 2).sum() + tau**4 * (np.diff(x, n=2, axis=0) ** 2).sum())


def walking_pull(frames: int = 240) -> np.ndarray:
    """From the COM to the support centre: it drifts back at walking speed and jumps on every half second, left and right."""
    phase = np.arange(frames) % 30
    side = np.where(np.arange(frames) // 30 % 2, 1.0, -1.0)
    single = phase >= 8
    return np.stack([0.3 * (9 - phase) / 30 + np.where(single, 0.12, 0.0), side * np.where(single, 0.09, 0.0)], axis=1)


def test_without_discs_it_is_the_low_pass_filter_of_the_least_squares_problem():
    rng = np.random.default_rng(0)
    wanted, tau = rng.normal(size=(40, 2)), 3.0
    free = smooth_path_in_discs(wanted, np.zeros((40, 2)), np.full(40, np.inf), tau)
    second = np.diff(np.eye(40), n=2, axis=0)
    np.testing.assert_allclose(free, np.linalg.solve(np.eye(40) + tau**4 * second.T @ second, wanted), atol=1e-10)


def test_agrees_with_a_general_solver_where_discs_matter():
    frames, tau = 24, 2.0
    centre = np.array([[0.1 if i < 12 else -0.08, 0.05] for i in range(frames)])
    radius = np.linalg.norm(centre, axis=1) * 0.9
    wanted = centre * 0.8
    found = smooth_path_in_discs(wanted, centre, radius, tau)
    exact = minimize(
        lambda x: objective(x.reshape(-1, 2), wanted, tau),
        wanted.ravel(),
        constraints={"type": "ineq", "fun": lambda x: radius**2 - ((x.reshape(-1, 2) - centre) ** 2).sum(axis=1)},
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-12},
    )
    assert exact.success
    np.testing.assert_allclose(found, exact.x.reshape(-1, 2), atol=1e-3)
    assert objective(found, wanted, tau) == pytest.approx(exact.fun, rel=0.02)


def test_comes_nearer_to_a_jumping_centre_and_stays_smooth():
    pull = walking_pull()
    path = displacement_path(pull, reach=0.08, tau=9.0)
    before, after = np.linalg.norm(pull, axis=1), np.linalg.norm(pull - path, axis=1)
    assert (after <= before + 0.001).all()
    assert (after < before).mean() > 0.95
    assert after.mean() < 0.9 * before.mean()
    assert np.abs(np.diff(path, n=2, axis=0)).max() < 0.02 * np.abs(np.diff(pull, n=2, axis=0)).max()


def test_repair_leads_back_into_the_discs_and_leaves_alone_what_lies_inside():
    pull = walking_pull()
    rng = np.random.default_rng(1)
    moved = displacement_path(pull, reach=0.08, tau=9.0)
    moved[100:120] += rng.normal(0, 0.001, (20, 2))
    share = np.ones(len(pull))
    push = displacement_repair(moved, pull, share, tau=2.0)
    before = np.linalg.norm(pull, axis=1)
    assert (np.linalg.norm(pull - moved - push, axis=1) < before).all()
    inside = displacement_repair(0.3 * pull, pull, share, tau=2.0)
    np.testing.assert_allclose(inside, 0, atol=1e-12)
    assert (displacement_repair(-0.1 * pull, pull, 0 * share, tau=2.0) == 0).all()


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_short_motions_flight_and_a_centred_com(frames):
    pull = np.full((frames, 2), 0.05)
    np.testing.assert_allclose(displacement_path(pull, 1.0, 5.0), pull, atol=1e-3)
    np.testing.assert_allclose(displacement_path(0 * pull, 1.0, 5.0), 0, atol=1e-12)
    np.testing.assert_allclose(displacement_path(pull * np.nan, 1.0, 5.0), 0, atol=1e-12)
    assert np.linalg.norm(displacement_path(pull, 0.03, 5.0), axis=1) == pytest.approx(0.03)
