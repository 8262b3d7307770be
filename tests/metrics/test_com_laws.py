"""Laws of the COM: found again where they are known, judged on runs held out, and the push that they predict."""

import numpy as np
import pytest

from simprep.errors import SettingError
from simprep.metrics.com_laws import LOOP_TERMS, PLANT_TERMS, ComSignals, fit_com_laws, loop_eigenvalues, loop_matrix
from simprep.metrics.push_prediction import REACH_M, STEP_S, capture_push, closed_loop_push, within
from simprep.metrics.sparse_law import Samples, fit_sparse_law, weak_form

OMEGA2, DT = 9.81 / 0.95, 1 / 120
STIFF, DAMP = -28.0, -6.0
SQUARE = np.array([[-0.06, -0.12], [0.12, -0.12], [0.12, 0.12], [-0.06, 0.12]])


def pendulum_runs(noise: float, count: int = 3) -> list[ComSignals]:
    """Pendulums whose pressure brings the error back by a known law, after random pushes; noise as share of each signal's spread."""
    runs = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        steps, fine = round(6 / DT), 10
        push = np.zeros((steps, 2))
        for start in range(30, steps - 60, 80):
            push[start : start + 12] = rng.uniform(-2, 2, 2)
        error, rate, rows = np.zeros(2), np.zeros(2), []
        for k in range(steps):
            rows.append([*error, *rate, *(error - (STIFF * error + DAMP * rate) / OMEGA2)])
            for _ in range(fine):
                acceleration = STIFF * error + DAMP * rate
                rate = rate + DT / fine * (acceleration + push[k])
                error = error + DT / fine * rate
        push = (push + np.roll(push, 1, axis=0)) / 2  # of the interval about each sample
        data = np.array(rows)
        data += noise * data.std(axis=0) * rng.standard_normal(data.shape)
        com, rate, pressure = data[:, :2], data[:, 2:4], data[:, 4:]
        still = np.zeros(steps)
        runs.append(ComSignals(DT, com, rate, com, rate, pressure, still, still + 0.95, np.zeros((steps, 2)), push))
    return runs


def test_the_weak_form_of_a_known_function():
    time = np.arange(0, 2, DT)
    terms, rate = weak_form(Samples(np.sin(3 * time), 3 * np.cos(3 * time)[:, None], 0 * time, DT))
    assert rate == pytest.approx(terms[:, 0], rel=1e-3, abs=1e-3)
    constant = weak_form(Samples(np.full(240, 7.0), np.ones((240, 1)), np.zeros(240), DT))
    assert np.abs(constant[1]).max() < 1e-12
    assert constant[0] == pytest.approx(np.ones_like(constant[0]))
    with pytest.raises(SettingError, match="at least a window"):
        weak_form(Samples(np.zeros(10), np.zeros((10, 1)), np.zeros(10), DT))


@pytest.fixture(scope="module")
def noisy_laws():
    return fit_com_laws(pendulum_runs(0.01), np.random.default_rng(0), resamples=20)


def test_omega_squared_within_one_per_cent_at_one_per_cent_noise(noisy_laws):
    for law in noisy_laws.plant:
        assert law.of("lever") == pytest.approx(OMEGA2, rel=0.01)
        dropped = [name for name in PLANT_TERMS if name != "lever" and law.of(name) != 0]
        assert not dropped
        assert law.held_out_r2 > 0.98
        assert law.baseline_r2 == pytest.approx(law.held_out_r2, abs=0.01)  # the truth is the pendulum


def test_the_closed_loop_and_its_eigenvalues(noisy_laws):
    for law in noisy_laws.loop:
        assert law.of("error") == pytest.approx(STIFF, rel=0.03)
        assert law.of("error_rate") == pytest.approx(DAMP, rel=0.03)
        assert [name for name in LOOP_TERMS if law.of(name)] == ["error", "error_rate"]
    truth = np.roots([1.0, -DAMP, -STIFF])
    for value in loop_eigenvalues(noisy_laws):
        assert value.real == pytest.approx(truth[0].real, rel=0.03)
        assert abs(value.imaginary) == pytest.approx(abs(truth[0].imag), rel=0.03)
        assert value.real_interval[0] <= value.real <= value.real_interval[1]
        assert value.real_interval[1] - value.real_interval[0] < 0.5


def test_noise_without_a_law_is_not_reported():
    rng = np.random.default_rng(5)
    runs = [Samples(rng.standard_normal(400), rng.standard_normal((400, 2)), np.zeros(400), DT) for _ in range(3)]
    law = fit_sparse_law(runs, ("a", "b"), ("1", "1"), rng, resamples=20)
    assert not law.reported
    with pytest.raises(SettingError, match="2 runs; valid: 3 or more"):
        fit_sparse_law(runs[:2], ("a", "b"), ("1", "1"), rng)


def test_the_largest_push_of_a_pendulum():
    forward, mass, duration = np.array([1.0, 0.0]), 75.0, 0.2
    force = capture_push(SQUARE, np.zeros(2), forward, OMEGA2, mass, duration)
    omega, dt = np.sqrt(OMEGA2), 1e-4
    for share, inside in ((0.99, True), (1.01, False)):  # simulated with the pressure at the edge
        com, rate = 0.0, 0.0
        for _ in range(round(duration / dt)):
            rate += dt * (OMEGA2 * (com - 0.12) + share * force / mass)
            com += dt * rate
        assert (com + rate / omega < 0.12) == inside
    # for a short push, the momentum is mass omega times the margin
    short = capture_push(SQUARE, np.zeros(2), forward, OMEGA2, mass, 0.01) * 0.01
    assert short == pytest.approx(mass * omega * 0.12, rel=0.03)
    stepping = capture_push(SQUARE, np.zeros(2), forward, OMEGA2, mass, 0.01, steps=True) * 0.01
    assert stepping - short == pytest.approx(mass * omega * REACH_M / np.expm1(omega * STEP_S), rel=0.03)
    assert capture_push(SQUARE, np.array([0.5, 0.0]), forward, OMEGA2, mass, duration) == 0.0


def test_a_closed_loop_bears_at_most_what_its_feet_can():
    loop = np.array([0.0, STIFF, DAMP, 0.0, 0.0])
    matrix = loop_matrix(loop, loop)
    for direction in (np.array([1.0, 0.0]), np.array([-1.0, 0.0]), np.array([0.0, 1.0])):
        bound = capture_push(SQUARE, np.zeros(2), direction, OMEGA2, 75.0, 0.2)
        force = closed_loop_push(matrix, SQUARE, direction, (OMEGA2, OMEGA2), 75.0, 0.2)
        assert 0.5 * bound < force <= bound * 1.02
    runaway = loop_matrix(np.array([0.0, 5.0, 0.0, 0.0, 0.0]), loop)
    assert closed_loop_push(runaway, SQUARE, np.array([1.0, 0.0]), (OMEGA2, OMEGA2), 75.0, 0.2) < 5
    assert within(SQUARE, np.array([0.24, 0.0])) == pytest.approx([0.12, 0.0])
    assert within(SQUARE, np.array([0.05, -0.05])) == pytest.approx([0.05, -0.05])
