"""Cross-entropy search for a curve of servo-target offsets: what is sampled, and how the best samples move the plan."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class SearchSettings:
    """How a plan is improved.

    Attributes:
        samples: simulations per iteration.
        elites: samples that enter the weighted mean.
        keep: best samples that enter the next plan's first iteration, moved on in time.
        shrink: factor on the noise from one iteration to the next.
        temperature: softness of the weights, in standard deviations of the elites' costs.
        scales: the samples are split among these multiples of the noise.
    """

    samples: int
    elites: int
    keep: int
    shrink: float
    temperature: float
    scales: tuple[float, ...]


class OffsetSearch:
    """A plan of offsets at knots and its improvement by samples; state is the plan and the best samples.

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
        """Offsets to try: the plan itself, zero and the best of the last plan among them.

        Args:
            rng: source of chance.
            iteration: of this plan, from 0.

        Returns:
            (samples, knots, sampled) [rad].
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
        """Move the plan to the weighted mean of the best samples so far.

        Args:
            theta: as sampled.
            costs: (samples,) of each; infinite for samples that count as failed.

        Returns:
            Whether any sample of this plan was usable; if none was, the plan stays as it is.
        """
        s = self._settings
        # the state is the same for all iterations of a plan, so earlier samples stay in the competition
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
    """Weights of linear interpolation between knots 0..knots-1, held at the ends.

    Args:
        position: (n,) where to interpolate, in knots.
        knots: how many.

    Returns:
        (n, knots).
    """
    position = np.clip(position, 0, knots - 1)
    low = np.minimum(position.astype(int), knots - 2)
    weight = position - low
    basis = np.zeros((len(position), knots))
    rows = np.arange(len(position))
    basis[rows, low] = 1 - weight
    basis[rows, low + 1] += weight
    return basis
