"""Gaussians of many classes with few samples each: semi-tied, full and diagonal covariances.

Source: the 2008 paper, section 4.2 and appendix A.2; Gales, "Semi-tied covariance matrices for hidden Markov models",
IEEE Transactions on Speech and Audio Processing 7 (1999). Semi-tied: Sigma_m = H diag_m H^T with one H for all classes.

A class of N samples has a scatter of rank N - 1; where that is below the dimension, maximum likelihood has no answer.
So each class gets, beside its N - 1 own deviations, `prior_count` pseudo-deviations with the covariance pooled over all
classes: the continuous counterpart of the Dirichlet(1) prior on labels. A class of one sample thereby has the pooled
covariance, and large classes hardly notice. A class without samples has the mean and covariance of all samples.
`prior_count=0` is plain (restricted) maximum likelihood.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg.lapack import dposv

from simprep.arrays import FloatArray, IntArray
from simprep.errors import MotionError, SettingError

_LANES = 64  # rows of whole vector registers: every sum has the same bits wherever it stands

PRIOR_COUNT = 10.0
"""Default pseudo-deviations per class: 10 to 30 explain held-out bouts of 20 to 120 labels with 36 parameters best."""


@dataclass(frozen=True)
class ClassGaussians:
    """One Gaussian per class, plus one for any class never seen.

    Attributes:
        classes: (M,) class numbers, ascending.
        mean: (M + 1, D); the last row is for an unseen class, here and below.
        covariance: (M + 1, D, D).

    Raises:
        MotionError: shapes that do not belong together.
    """

    classes: IntArray
    mean: FloatArray
    covariance: FloatArray

    def __post_init__(self) -> None:
        if self.mean.ndim != 2 or len(self.mean) != len(self.classes) + 1:
            raise MotionError(f"{len(self.classes)} classes with means of shape {self.mean.shape}")
        if self.covariance.shape != (*self.mean.shape, self.mean.shape[1]):
            raise MotionError(f"means of shape {self.mean.shape} with covariances of shape {self.covariance.shape}")

    @property
    def dimension(self) -> int:
        """Number of parameters D."""
        return int(self.mean.shape[1])

    def row(self, classes: ArrayLike) -> IntArray:
        """Row of each class in `mean` and `covariance`."""
        classes = np.asarray(classes, dtype=np.int64)
        row = np.minimum(np.searchsorted(self.classes, classes), len(self.classes) - 1)
        return np.where(self.classes[row] == classes, row, len(self.classes)).astype(np.int64)

    def log_density(self, samples: FloatArray, classes: ArrayLike) -> FloatArray:
        """Log density (N,) of samples (N, D) of classes (N,) [nats]; only its differences do not depend on units."""
        row = self.row(classes)
        lower = np.linalg.cholesky(self.covariance)
        result = np.empty(len(samples))
        for m in np.unique(row):
            mine = row == m
            white = np.linalg.solve(lower[m], (samples[mine] - self.mean[m]).T)
            result[mine] = -0.5 * np.sum(white**2, axis=0) - np.log(np.diag(lower[m])).sum()
        return np.asarray(result - 0.5 * self.dimension * np.log(2 * np.pi))


class CovarianceModel(Protocol):
    """A way to estimate the covariances of many classes."""

    def fit(self, samples: FloatArray, classes: ArrayLike) -> ClassGaussians:
        """Gaussians of samples (N, D) of classes (N,)."""
        ...


@dataclass(frozen=True)
class ClassStatistics:
    """Sufficient statistics of samples of several classes, prior included.

    Attributes:
        classes: (M,) class numbers, ascending.
        count: (M,) free deviations N - 1 plus pseudo-deviations.
        mean: (M, D).
        scatter: (M, D, D) mean outer product of these deviations.
        all_mean: (D,) of all samples.
        all_covariance: (D, D) of all samples.
    """

    classes: IntArray
    count: FloatArray
    mean: FloatArray
    scatter: FloatArray
    all_mean: FloatArray
    all_covariance: FloatArray

    def gaussians(self, covariance: FloatArray) -> ClassGaussians:
        """Gaussians with these means, given the classes' covariances (M, D, D)."""
        return ClassGaussians(
            self.classes,
            np.concatenate([self.mean, self.all_mean[None]]),
            np.concatenate([covariance, self.all_covariance[None]]),
        )


def class_statistics(samples: FloatArray, classes: ArrayLike, prior_count: float) -> ClassStatistics:
    """Sufficient statistics of samples (N, D) of classes (N,).

    Raises:
        MotionError: no more samples than parameters, or a parameter that never varies: no covariance exists.
        SettingError: negative `prior_count`, or none while a class has one sample.
    """
    samples = np.asarray(samples, dtype=np.float64)
    n, dimension = samples.shape
    if prior_count < 0:
        raise SettingError(f"prior count {prior_count}; valid: 0 or more")
    if n <= dimension:
        raise MotionError(f"{n} samples of {dimension} parameters; a covariance needs more samples than parameters")
    centred = samples - samples.mean(axis=0)
    all_covariance = np.asarray(centred.T @ centred / n, dtype=np.float64)
    spread = np.sqrt(np.diag(all_covariance))
    if np.any(spread == 0):
        raise MotionError(f"parameter {int(np.argmin(spread))} of {dimension} never varies: it has no density")
    correlation = all_covariance / np.outer(spread, spread)
    if np.linalg.eigvalsh(correlation)[0] < 1e-12:
        raise MotionError(f"the {dimension} parameters depend on each other linearly: they have no joint density")

    names, row, own = np.unique(np.asarray(classes, dtype=np.int64), return_inverse=True, return_counts=True)
    mean = np.zeros((len(names), dimension))
    np.add.at(mean, row, samples)
    mean /= own[:, None]
    count = np.asarray(own - 1 + prior_count, dtype=np.float64)
    if np.any(count <= 0):
        raise SettingError(f"class {names[np.argmin(count)]} has one sample; valid: a prior count above 0")
    deviation = samples - mean[row]
    order = np.argsort(row, kind="stable")
    parts = np.split(deviation[order], np.cumsum(own)[:-1])
    outer = np.stack([part.T @ part for part in parts])
    # pooled within the classes; one sample's worth of the whole spread keeps it regular when nearly all have one sample
    pooled = (outer.sum(axis=0) + all_covariance) / (n - len(names) + 1)
    scatter = (outer + prior_count * pooled) / count[:, None, None]
    return ClassStatistics(names.astype(np.int64), count, mean, scatter, samples.mean(axis=0), all_covariance)


@dataclass(frozen=True)
class SemiTiedEstimate:
    """What the EM found.

    Attributes:
        transform: (D, D) H, the shared transform.
        variance: (M, D) diagonal of each class's diag_m.
        log_likelihood: one entry per sweep, of all deviations and pseudo-deviations [nats]; never falls.
    """

    transform: FloatArray
    variance: FloatArray
    log_likelihood: FloatArray

    @property
    def covariance(self) -> FloatArray:
        """(M, D, D) H diag_m H^T."""
        return np.asarray((self.transform * self.variance[:, None, :]) @ self.transform.T)


@dataclass(frozen=True)
class SemiTied:
    """Semi-tied covariances Sigma_m = H diag_m H^T, by maximum likelihood (the paper's choice).

    Attributes:
        prior_count: pseudo-deviations per class.
        max_sweeps: most passes over the rows of the transform.
        tolerance: stop when a sweep gains less than this per sample [nats].
    """

    prior_count: float = PRIOR_COUNT
    max_sweeps: int = 200
    tolerance: float = 1e-3

    def fit(self, samples: FloatArray, classes: ArrayLike) -> ClassGaussians:
        """Gaussians of samples (N, D) of classes (N,); raises as `class_statistics`."""
        statistics = class_statistics(samples, classes, self.prior_count)
        return statistics.gaussians(self.estimate(statistics).covariance)

    def estimate(self, statistics: ClassStatistics) -> SemiTiedEstimate:
        """Ascend the likelihood row by row.

        With A = H^-1, only row a_i and the variances of component i meet in G_i = sum over m of N_m W_m / variance_mi.
        Given these, the best row is a_i = c_i G_i^-1 sqrt(N / (c_i G_i^-1 c_i^T)) with the cofactors c_i of the row
        (Gales 1999, Eq. 22); given the row, the best variances are a_i W_m a_i^T. Both are exact maxima, so the
        likelihood cannot fall. Cofactors enter up to a factor only: the i-th column of A^-1 serves.
        """
        dimension = statistics.scatter.shape[1]
        # scatters are symmetric, and sums over them are bound by memory: one triangle does
        upper = np.triu_indices(dimension)
        entries = np.zeros((dimension, dimension), dtype=np.intp)
        entries[upper] = entries.T[upper] = np.arange(len(upper[0]))
        # classes of one sample each have the pooled scatter: those of the same scatter count as one
        distinct, place = np.unique(statistics.scatter[:, *upper], axis=0, return_inverse=True)
        packed = np.zeros((len(distinct), -(-len(upper[0]) // _LANES) * _LANES))
        packed[:, : len(upper[0])] = distinct
        both = np.where(upper[0] == upper[1], 1.0, 2.0)
        product = np.zeros(packed.shape[1])
        count = np.bincount(place, statistics.count).astype(np.float64)
        total = count.sum()
        values, vectors = np.linalg.eigh((count / total @ packed)[entries])
        # begin by whitening the average: the answer if all classes share one covariance
        rows = (vectors / np.sqrt(values)).T
        variance = np.einsum("ij,mjk,ik->mi", rows, distinct[:, entries], rows, optimize=True)
        history = [_log_likelihood(rows, variance, count)]
        for _ in range(self.max_sweeps):
            inverse = np.linalg.inv(rows)
            for i in range(dimension):
                weighted = ((count / variance[:, i]) @ packed)[entries]
                direction = dposv(weighted, inverse[:, i])[1]
                row = direction * np.sqrt(total / (inverse[:, i] @ direction))
                # update of the inverse for the exchanged row (Sherman-Morrison)
                change = (row - rows[i]) @ inverse
                inverse -= inverse[:, i, None] * change / (1 + change[i])
                rows[i] = row
                product[: len(both)] = both * row[upper[0]] * row[upper[1]]
                variance[:, i] = packed @ product
            history.append(_log_likelihood(rows, variance, count))
            if history[-1] - history[-2] < self.tolerance * total:
                break
        return SemiTiedEstimate(np.linalg.inv(rows), variance[place], np.array(history))


@dataclass(frozen=True)
class FullCovariance:
    """A covariance of its own for every class (rejected by the paper: it overfits).

    Attributes:
        prior_count: as in `SemiTied`.
        eigenvalue_floor: of a covariance, with each parameter in units of its standard deviation over all samples.
    """

    prior_count: float = PRIOR_COUNT
    eigenvalue_floor: float = 1e-3

    def fit(self, samples: FloatArray, classes: ArrayLike) -> ClassGaussians:
        """Gaussians of samples (N, D) of classes (N,); raises as `class_statistics`."""
        statistics = class_statistics(samples, classes, self.prior_count)
        spread = np.sqrt(np.diag(statistics.all_covariance))
        values, vectors = np.linalg.eigh(statistics.scatter / np.outer(spread, spread))
        values = np.maximum(values, self.eigenvalue_floor)
        covariance = (vectors * values[:, None, :]) @ np.swapaxes(vectors, 1, 2)
        return statistics.gaussians(covariance * np.outer(spread, spread))


@dataclass(frozen=True)
class DiagonalCovariance:
    """Independent parameters (rejected by the paper: it underfits); `prior_count` as in `SemiTied`."""

    prior_count: float = PRIOR_COUNT

    def fit(self, samples: FloatArray, classes: ArrayLike) -> ClassGaussians:
        """Gaussians of samples (N, D) of classes (N,); raises as `class_statistics`."""
        statistics = class_statistics(samples, classes, self.prior_count)
        return statistics.gaussians(statistics.scatter * np.eye(statistics.scatter.shape[1]))


def _log_likelihood(rows: FloatArray, variance: FloatArray, count: FloatArray) -> float:
    """Of all deviations [nats], given maximum-likelihood variances."""
    dimension = rows.shape[0]
    per_class = np.log(variance).sum(axis=1) + dimension * (1 + np.log(2 * np.pi))
    return float(count.sum() * np.linalg.slogdet(rows)[1] - 0.5 * count @ per_class)
