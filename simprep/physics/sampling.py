"""Cross-entropy search for a curve of servo-target offsets."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SearchSettings:
    """How a plan is improved; the entries are those of `simprep.physics.mpc.MpcSettings`."""

    samples: int
    elites: int
    keep: int
    shrink: float
    temperature: float
    scales: tuple[float, ...]


class OffsetSearch:
    """A plan of offsets at knots and its improvement by samples; its state is the plan and the best samples.

    Args:
        shift: (knots, knots) moves a curve on by the time between two plans.
        std: (sampled,) standard deviation of each sampled offset [rad].
        settings: numbers of samples and elites, noise over iterations.
    """

    def __init__(self, shift: FloatArray, std: FloatArray, settings: SearchSettings) -> None:
        self._settings = settings
        self._shift, self._std = shift, std
        self._scale = np.resize(np.array(settings.scales), settings.samples)
        self.plan = np.zeros((len(shift), len(std)))
        self._kept = np.zeros((0, *self.plan.shape))

    def begin(self) -> None:
        """Start a new plan: move the last one and its best samples on in time."""
        self._carried = np.einsum("kl,nlj->nkj", self._shift, self._kept)
        self.plan = self._shift @ self.plan
        self._pool, self._costs = np.zeros((0, *self.plan.shape)), np.zeros(0)

    def sample(self, rng: np.random.Generator, iteration: int) -> FloatArray:
        """Offsets to try (samples, knots, sampled), among them the plan, zero and the best of the last plan [rad].

        Args:
            rng: random generator.
            iteration: of this plan, from 0.
        """
        s = self._settings
        noise = rng.standard_normal((s.samples, *self.plan.shape)) * self._std * s.shrink**iteration
        theta = self.plan + self._scale[:, None, None] * noise
        theta[0] = self.plan
        if iteration == 0:
            theta[1] = 0.0
            theta[2 : 2 + len(self._carried)] = self._carried
        return np.asarray(theta)

    def update(self, theta: FloatArray, costs: FloatArray) -> bool:
        """Move the plan to the weighted mean of the best samples so far; False if none was usable and the plan stays.

        Args:
            theta: as sampled.
            costs: (samples,) of each; infinite for samples that count as failed.
        """
        s = self._settings
        # all iterations of a plan begin in the same state, so earlier samples still compete
        self._pool = np.concatenate([self._pool, theta])
        self._costs = np.concatenate([self._costs, costs])
        order = np.argsort(self._costs, kind="stable")[: s.elites]
        order = order[np.isfinite(self._costs[order])]
        if len(order) == 0:
            return False
        best = self._costs[order]
        weight = np.exp(-(best - best[0]) / (s.temperature * (np.std(best) + 1e-12)))
        self.plan = np.einsum("n,nkj->kj", weight / weight.sum(), self._pool[order])
        self._kept = self._pool[order[: s.keep]]
        return True


def linear_basis(position: FloatArray, knots: int) -> FloatArray:
    """Weights (n, knots) of linear interpolation between knots, held at the ends, at positions (n,) in knots from 0."""
    position = np.clip(position, 0, knots - 1)
    low = np.minimum(position.astype(int), knots - 2)
    weight = position - low
    basis = np.zeros((len(position), knots))
    rows = np.arange(len(position))
    basis[rows, low] = 1 - weight
    basis[rows, low + 1] += weight
    return basis
