"""A sparse law from noisy runs: weak form, sequentially thresholded least squares (`pysindy`), an ensemble over runs.

The weak form (Messenger and Bortz 2021; Reinbold et al. 2020) multiplies the law by a bump that vanishes at the ends of a
window and integrates. The derivative moves onto the bump, so noisy data is never differentiated. `pysindy` draws its windows
from numpy's global generator; here they lie evenly, so the same data gives the same law. The ensemble (Fasel et al. 2022) draws
whole runs with replacement, as samples of one run are not independent. It gives the intervals too.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray, IntArray
from simprep.errors import SettingError

WINDOW_S = 0.3
"""Width of a window: it averages like a Gaussian of 45 ms."""
OVERLAP = 4
"""Windows begin this often per width."""
THRESHOLD = 0.05
"""A term is dropped if it explains less than about this share of the response's spread."""
RESAMPLES, HELD_OUT_RESAMPLES = 200, 10
HELD_OUT_R2 = 0.8
"""A law that explains less of runs that it has not seen is not reported."""
_POWER = 4  # of the bump
_NOTHING = 1e-9
_MOST_OFTEN = 0.5  # a term is in the law if this share of the ensemble has it


@dataclass(frozen=True)
class Samples:
    """What one run says, at even times.

    Attributes:
        state: (n,) whose rate the law gives.
        terms: (n, k) candidate terms.
        known: (n,) part of the rate that is known, such as a push.
        dt: spacing [s].
    """

    state: FloatArray
    terms: FloatArray
    known: FloatArray
    dt: float


@dataclass(frozen=True)
class SparseLaw:
    """d state / dt = known + sum of coefficient * term.

    Attributes:
        names: (k,) of the candidate terms.
        units: (k,) of their coefficients.
        coefficients: (k,) medians of the ensemble; 0 where dropped.
        low: (k,) 2.5th percentiles, high: (k,) 97.5th.
        share: (k,) how much of the ensemble has the term.
        ensemble: (resamples, k) coefficients of every resample.
        held_out_r2: pooled over the runs, each predicted by a law of the others.
        least_squares_r2: the same of plain least squares on all terms, on the differentiated state.
        baseline_r2: the same of the fixed coefficients that were given; NaN without.
        run_count: runs used.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    coefficients: FloatArray
    low: FloatArray
    high: FloatArray
    share: FloatArray
    ensemble: FloatArray
    held_out_r2: float
    least_squares_r2: float
    baseline_r2: float
    run_count: int

    @property
    def reported(self) -> bool:
        """Whether it explains enough of runs that it has not seen."""
        return self.held_out_r2 >= HELD_OUT_R2

    def of(self, name: str) -> float:
        """Coefficient of a term."""
        return float(self.coefficients[self.names.index(name)])


def fit_sparse_law(
    runs: Sequence[Samples],
    names: Sequence[str],
    units: Sequence[str],
    generator: np.random.Generator,
    baseline: FloatArray | None = None,
    window_s: float = WINDOW_S,
    threshold: float = THRESHOLD,
    resamples: int = RESAMPLES,
) -> SparseLaw:
    """Fit a sparse law to several runs, and judge it on runs held out.

    Captures which of the candidates the rate needs. Hides what no candidate says. Held out means left out one by one; all three
    models are judged by the rate averaged over windows, as the weak form sees it.

    Args:
        runs: at least three, each longer than a window.
        names: (k,) of the candidate terms.
        units: (k,) of their coefficients.
        generator: of the ensemble.
        baseline: (k,) fixed coefficients to compare with.
        window_s: width of the windows [s].
        threshold: see `THRESHOLD`.
        resamples: size of the ensemble.

    Raises:
        SettingError: too few or too short runs.
    """
    if len(runs) < 3:
        raise SettingError(f"{len(runs)} runs; valid: 3 or more, as each is held out once")
    weak = [weak_form(run, window_s) for run in runs]
    held = np.arange(len(runs))
    sparse, plain, fixed, spread = 0.0, 0.0, 0.0, 0.0
    for out in held:
        others = held[held != out]
        terms, rate = weak[out]
        law = _ensemble(weak, others, generator, threshold, HELD_OUT_RESAMPLES)
        sparse += _squares(rate - terms @ _median(law))
        plain += _squares(rate - terms @ _least_squares([runs[i] for i in others]))
        if baseline is not None:
            fixed += _squares(rate - terms @ baseline)
        spread += _squares(rate - rate.mean())
    ensemble = _ensemble(weak, held, generator, threshold, resamples)
    low, high = np.percentile(ensemble, [2.5, 97.5], axis=0)
    return SparseLaw(
        names=tuple(names),
        units=tuple(units),
        coefficients=_median(ensemble),
        low=low,
        high=high,
        share=np.asarray((ensemble != 0).mean(axis=0)),
        ensemble=ensemble,
        held_out_r2=1 - sparse / spread,
        least_squares_r2=1 - plain / spread,
        baseline_r2=float("nan") if baseline is None else 1 - fixed / spread,
        run_count=len(runs),
    )


def weak_form(run: Samples, window_s: float = WINDOW_S) -> tuple[FloatArray, FloatArray]:
    """Terms (w, k) and unknown part of the rate (w,), each averaged over windows by the bump (1 - x^2)^4.

    Raises:
        SettingError: the run is shorter than a window.
    """
    half = max(2, round(window_s / 2 / run.dt))
    width = 2 * half + 1
    if len(run.state) < width:
        raise SettingError(f"a run of {len(run.state) * run.dt:.2f} s; valid: at least a window of {window_s:g} s")
    x = np.arange(-half, half + 1) / half
    bump = (1 - x**2) ** _POWER
    # summed by parts: its differences are exact for what is summed, so a constant state has no rate
    slope = np.gradient(bump) / run.dt
    total = bump.sum()
    starts = np.arange(0, len(run.state) - width + 1, max(1, width // OVERLAP))
    rows = starts[:, None] + np.arange(width)
    terms = np.einsum("w,rwk->rk", bump, run.terms[rows]) / total
    rate = (-(run.state[rows] @ slope) - run.known[rows] @ bump) / total
    return terms, rate


def _ensemble(
    weak: list[tuple[FloatArray, FloatArray]],
    runs: IntArray,
    generator: np.random.Generator,
    threshold: float,
    resamples: int,
) -> FloatArray:
    """Coefficients (resamples, k) of laws of runs drawn with replacement."""
    drawn = generator.choice(runs, (resamples, len(runs)))
    return np.array(
        [
            _sparse(np.concatenate([weak[i][0] for i in some]), np.concatenate([weak[i][1] for i in some]), threshold)
            for some in drawn
        ]
    )


def _median(ensemble: FloatArray) -> FloatArray:
    kept = (ensemble != 0).mean(axis=0) >= _MOST_OFTEN
    middle = np.array([np.median(column[column != 0]) if keep else 0.0 for column, keep in zip(ensemble.T, kept)])
    return middle


def _sparse(terms: FloatArray, rate: FloatArray, threshold: float) -> FloatArray:
    from pysindy import STLSQ  # 3 s to import

    size = np.sqrt((terms**2).mean(axis=0))
    size = np.where(size > _NOTHING, size, np.inf)  # a term that is only rounding
    spread = float(rate.std()) or 1.0
    optimiser = STLSQ(threshold=threshold, alpha=1e-9)
    optimiser.fit(terms / size, (rate / spread)[:, None])
    return np.asarray(optimiser.coef_[0] * spread / size)


def _least_squares(runs: list[Samples]) -> FloatArray:
    terms = np.concatenate([run.terms for run in runs])
    rate = np.concatenate([np.gradient(run.state, run.dt) - run.known for run in runs])
    return np.asarray(np.linalg.lstsq(terms, rate, rcond=None)[0])


def _squares(values: FloatArray) -> float:
    return float((values**2).sum())
