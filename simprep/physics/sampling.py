"""Search for a curve of servo-target offsets by samples: Gauss-Newton steps without derivatives.

The cost of a sample is the sum of its squared residuals. Differences between samples show how the residuals respond to
the offsets, in as many directions as there are samples. Where this response is linear, the best combination of these
directions is a least-squares problem. Its answers, damped more and less, are simulated next, and the best one counts.
A sample thus tells as much as all its residuals; the cross-entropy method reads one number from it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dposv

from simprep.arrays import BoolArray, FloatArray, IndexArray

_SAME = 1e-6  # distance of two samples that count as one, in standard deviations of the noise
_TINY = 1e-12


@dataclass(frozen=True)
class SearchSettings:
    """How a plan is improved; the entries are those of `simprep.physics.mpc_settings.MpcSettings`."""

    samples: int
    refined: int
    keep: int
    shrink: float
    scales: tuple[float, ...]
    damping: tuple[float, ...]


class OffsetSearch:
    """A plan of offsets at knots and its improvement by samples.

    Its state is the plan, the least cost that was simulated for it, and the best samples (`kept`).

    Args:
        knots: of a curve.
        std: (sampled,) standard deviation of each sampled offset [rad].
        settings: numbers of samples, noise, damping.
    """

    def __init__(self, knots: int, std: FloatArray, settings: SearchSettings) -> None:
        self.settings = settings
        self.std = std
        self._stds = np.tile(std, knots)  # of a flat curve
        self.plan = np.zeros((knots, len(std)))
        self.cost = 0.0
        self.kept = np.zeros((0, *self.plan.shape))

    def go_on_from(self, plan: FloatArray, kept: FloatArray) -> None:
        """Take a plan (knots, sampled) and good samples (n, knots, sampled) that were found otherwise [rad]."""
        self.plan, self.kept = plan, kept

    def begin(self, passed: int = 0) -> None:
        """Start a new plan from the last one and its best samples.

        Args:
            passed: knots that have become past since then; as many like the last one are added.
        """
        self.kept, self.plan = _without_first(self.kept, passed), _without_first(self.plan, passed)
        self._pool, self._costs = np.zeros((0, *self.plan.shape)), np.zeros(0)
        self._residuals, self._products = np.zeros((0, 0)), np.zeros((0, 0))
        self._steps = np.zeros((0, *self.plan.shape))
        self._first_step = 0

    def sample(self, rng: np.random.Generator, iteration: int) -> FloatArray:
        """Offsets to try (samples, knots, sampled) [rad].

        The first iteration tries the plan, zero, the best of the last plan, and noise about the plan; later ones the
        steps found by the last one, and noise about the middle one of them.

        Args:
            rng: random generator.
            iteration: of this plan, from 0.
        """
        s = self.settings
        if iteration == 0:
            centre, given = self.plan, np.concatenate([self.plan[None], np.zeros((1, *self.plan.shape)), self.kept])
        else:
            centre, given = self._steps[len(self._steps) // 2], self._steps
        self._first_step = len(self._pool)
        count = (s.refined if iteration else s.samples) - len(given)
        noise = rng.standard_normal((count, self.plan.size))
        noise *= self._stds
        noise *= s.shrink**iteration
        for number, scale in enumerate(s.scales):
            noise[number :: len(s.scales)] *= scale
        noise += centre.ravel()
        return np.concatenate([given, noise.reshape(count, *self.plan.shape)])

    def update(self, theta: FloatArray, residuals: FloatArray, failed: BoolArray, final: bool = False) -> bool:
        """Improve the plan by what was simulated so far; False if nothing was usable and the plan stays.

        Args:
            theta: as sampled.
            residuals: (samples, R) of each.
            failed: (samples,) which do not count.
            final: nothing more is sampled for this plan, so of its steps only the best guess is worked out.
        """
        s = self.settings
        # all iterations of a plan begin in the same state, so earlier samples still count
        before = len(self._products)
        if before:
            self._pool = np.concatenate([self._pool, theta])
            self._residuals = np.concatenate([self._residuals, residuals])
        else:
            self._pool, self._residuals = theta, residuals.copy()
        among = residuals @ self._residuals.T
        products = np.empty((len(self._pool), len(self._pool)))
        products[:before, :before] = self._products  # of earlier ones
        products[before:], products[:before, before:] = among, among[:, :before].T
        self._products = products
        self._costs = np.concatenate([self._costs, np.where(failed, np.inf, np.diagonal(among, before))])
        order = np.argsort(self._costs, kind="stable")
        order = order[np.isfinite(self._costs[order])]
        if len(order) == 0:
            return False
        self.cost = float(self._costs[order[0]])
        self.kept = self._pool[order[: s.keep]]
        # the damping whose step was the best is the best guess for the next step
        tried = self._costs[self._first_step : self._first_step + len(self._steps)]
        guess = len(s.damping) // 2 if len(tried) == 0 else int(np.argmin(tried))
        self._steps = self._gauss_newton(order, s.damping[guess : guess + 1] if final else s.damping)
        self.plan = self._steps[0 if final else guess]
        return True

    def _gauss_newton(self, order: IndexArray, dampings: tuple[float, ...]) -> FloatArray:
        """(dampings, knots, sampled) the best combinations of samples, ordered from the best, if residuals are linear."""
        pool, products = self._pool.reshape(len(self._pool), -1), self._products
        best, others = order[0], order[1:]
        directions = pool[others]
        directions -= pool[best]
        squares = directions / self._stds
        squares *= squares
        length = np.sqrt(squares.sum(axis=1) / self._stds.size)
        usable = length > _SAME
        if not usable.any():
            return np.repeat(self._pool[best][None], len(dampings), axis=0)
        if not usable.all():
            others, directions, length = others[usable], directions[usable], length[usable]
        # all directions equally long: a far sample says no more than a near one
        directions /= length[:, None]
        to_best, at_best = products[others, best], products[best, best]
        gram = products.take(others, axis=0).take(others, axis=1)
        gram -= to_best
        gram -= to_best[:, None]
        gram += at_best
        gram /= length * length[:, None]
        slope = (at_best - to_best) / length
        unit = gram.trace() / len(gram) + _TINY
        combined = np.zeros((len(dampings), len(slope)))
        for damping, row in zip(dampings, combined):
            damped = gram.copy()
            damped.reshape(-1)[:: len(gram) + 1] += damping * unit
            _, solution, failed = dposv(damped, slope)
            if not failed:
                row[:] = solution
        found = np.einsum("dn,nk->dk", combined, directions)
        found += pool[best]
        return np.asarray(found.reshape(-1, *self.plan.shape))


def _without_first(curves: FloatArray, count: int) -> FloatArray:
    """Curves (..., knots, sampled) whose first knots are gone, and whose last one is there as often more."""
    if count == 0:
        return curves
    knots = curves.shape[-2]
    return curves[..., np.minimum(np.arange(knots) + count, knots - 1), :]
