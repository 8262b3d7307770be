"""Semi-tied covariances: monotone likelihood, recovery of a known transform, agreement with brute force."""

import numpy as np
import pytest
from scipy.optimize import minimize

from simprep.duel.model.semi_tied import DiagonalCovariance, FullCovariance, SemiTied, class_statistics
from simprep.errors import MotionError


def draw(rng, dimension, counts):
    """Samples of classes that share one transform; returns samples, classes, true covariances."""
    transform = rng.normal(size=(dimension, dimension))
    variance = np.exp(rng.normal(size=(len(counts), dimension)))
    mean = rng.normal(size=(len(counts), dimension))
    classes = np.repeat(np.arange(len(counts)), counts)
    white = rng.normal(size=(len(classes), dimension))
    samples = mean[classes] + (np.sqrt(variance[classes]) * white) @ transform.T
    return samples, classes, (transform * variance[:, None]) @ transform.T


def kullback_leibler(true, estimate):
    """KL(N(0, true) || N(0, estimate)) per dimension [nats]."""
    ratio = np.linalg.solve(estimate, true)
    return 0.5 * (np.trace(ratio) - len(true) - np.linalg.slogdet(ratio)[1]) / len(true)


def mean_density(model, samples, classes, held_out, held_out_classes):
    return model.fit(samples, classes).log_density(held_out, held_out_classes).mean()


@pytest.mark.parametrize("prior_count", [0.0, 10.0])
def test_likelihood_never_falls_and_is_that_of_the_data(prior_count):
    rng = np.random.default_rng(1)
    samples, classes, _ = draw(rng, 8, [40, 60, 30, 200])
    statistics = class_statistics(samples, classes, prior_count)
    found = SemiTied(prior_count, max_sweeps=60, tolerance=0).estimate(statistics)
    steps = np.diff(found.log_likelihood)
    assert steps.min() > -1e-9 * abs(found.log_likelihood[-1])
    assert steps[0] > 1
    if prior_count == 0:
        density = statistics.gaussians(found.covariance).log_density(samples, classes)
        for_the_means = 0.5 * np.linalg.slogdet(2 * np.pi * found.covariance)[1].sum()
        assert density.sum() + for_the_means == pytest.approx(found.log_likelihood[-1], rel=1e-10)


def test_known_transform_is_recovered():
    rng = np.random.default_rng(2)
    samples, classes, true = draw(rng, 36, [2000] * 6)
    fitted = SemiTied().fit(samples, classes)
    worst = max(kullback_leibler(true[m], fitted.covariance[m]) for m in range(6))
    assert worst < 0.05
    # Sharing the transform is what does it: a full covariance of the same samples is further from the truth.
    full = FullCovariance().fit(samples, classes)
    assert worst < 0.5 * max(kullback_leibler(true[m], full.covariance[m]) for m in range(6))


def test_em_agrees_with_brute_force_in_four_dimensions():
    rng = np.random.default_rng(3)
    samples, classes, _ = draw(rng, 4, [60, 80, 100])
    statistics = class_statistics(samples, classes, 0.0)
    found = SemiTied(0.0, max_sweeps=2000, tolerance=1e-12).estimate(statistics)

    def negative(flat):
        rows = flat.reshape(4, 4)
        variance = np.einsum("ij,mjk,ik->mi", rows, statistics.scatter, rows)
        determinant = np.linalg.slogdet(rows)[1]
        return -statistics.count @ (determinant - 0.5 * np.log(variance).sum(axis=1)) / statistics.count.sum()

    best = min(
        (minimize(negative, rng.normal(size=16), method="BFGS", options={"gtol": 1e-9}) for _ in range(12)),
        key=lambda result: result.fun,
    )
    assert negative(np.linalg.inv(found.transform).ravel()) == pytest.approx(best.fun, abs=1e-7)
    rows = best.x.reshape(4, 4)
    variance = np.einsum("ij,mjk,ik->mi", rows, statistics.scatter, rows)
    brute = np.linalg.inv(rows) * variance[:, None] @ np.linalg.inv(rows).T
    np.testing.assert_allclose(found.covariance, brute, rtol=1e-3, atol=1e-3 * np.abs(brute).max())


def test_held_out_density_orders_the_kinds_where_the_transform_is_shared():
    rng = np.random.default_rng(4)
    counts = rng.integers(2, 40, size=30)
    samples, classes, _ = draw(rng, 12, counts)
    order = rng.permutation(len(samples))
    train, test = order[: 2 * len(order) // 3], order[2 * len(order) // 3 :]
    density = {
        kind: mean_density(model, samples[train], classes[train], samples[test], classes[test])
        for kind, model in {"semi": SemiTied(), "full": FullCovariance(), "diagonal": DiagonalCovariance()}.items()
    }
    assert density["semi"] > density["full"]
    assert density["semi"] > density["diagonal"]


@pytest.mark.parametrize("model", [SemiTied(), FullCovariance(), DiagonalCovariance()])
def test_singletons_fall_back_on_the_pooled_covariance_and_unseen_classes_on_all_samples(model):
    rng = np.random.default_rng(5)
    samples, classes, _ = draw(rng, 3, [200, 300, 1])
    fitted = model.fit(samples, classes)
    outer = sum(np.cov(samples[classes == m], rowvar=False, bias=True) * (classes == m).sum() for m in (0, 1))
    pooled = (outer + np.cov(samples, rowvar=False, bias=True)) / (501 - 3 + 1)
    tied = np.diag(np.diag(pooled)) if isinstance(model, DiagonalCovariance) else pooled
    # Semi-tied: the pooled covariance seen through H, which diagonalises it only as well as one H can.
    np.testing.assert_allclose(fitted.covariance[2], tied, atol=0.1 * pooled.max())
    np.testing.assert_allclose(fitted.covariance[fitted.row(99)], np.cov(samples, rowvar=False, bias=True))


def test_samples_without_a_density_are_refused():
    rng = np.random.default_rng(6)
    with pytest.raises(MotionError, match="3 samples of 4 parameters"):
        SemiTied().fit(rng.normal(size=(3, 4)), [0, 0, 1])
    constant = rng.normal(size=(20, 3))
    constant[:, 1] = 2
    with pytest.raises(MotionError, match="parameter 1 of 3 never varies"):
        SemiTied().fit(constant, np.zeros(20, int))
    constant[:, 1] = constant[:, 0] - constant[:, 2]
    with pytest.raises(MotionError, match="depend on each other"):
        DiagonalCovariance().fit(constant, np.zeros(20, int))
