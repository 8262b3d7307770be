"""Search for the velocity of a root to start with, together with the first plan.

A motion's frames tell its first velocity to some cm/s only: they are a thirtieth of a second apart, nothing is known of
what came before, and noise counts for most at an end. A body that starts with a velocity it could not have had falls out
of step at once, and takes seconds to come back. So the first plan may change the root's velocity a little, at a price.
"""

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.physics.sampling import OffsetSearch

PRICE = 0.1
"""Cost of a change by one standard deviation in each of its six entries; a body well on its way costs about as much."""


class StartSearch:
    """Offsets at knots and changes of roots' velocities, searched together; it leaves its plan to the search of later ones.

    Args:
        later: the search that goes on from the first plan.
        bodies: whose velocities may change.
        std: (6,) standard deviations of the change of a root's velocity, world frame [m/s], and spin, own frame [rad/s];
            an entry of 0 is not changed.
    """

    def __init__(self, later: OffsetSearch, bodies: int, std: FloatArray) -> None:
        self._later, self._bodies = later, bodies
        self._free = np.flatnonzero(np.tile(std, bodies))
        self._std = np.tile(std, bodies)[self._free]
        everything = np.concatenate([np.tile(later.std, len(later.plan)), self._std])
        self._search = OffsetSearch(1, everything, later.settings)

    def begin(self) -> None:
        """Start another round."""
        self._search.begin()

    def sample(self, rng: np.random.Generator, iteration: int) -> tuple[FloatArray, FloatArray]:
        """Offsets (samples, knots, sampled) [rad] and changes of velocities (samples, bodies, 6) [m/s, rad/s] to try.

        Args:
            rng: random generator.
            iteration: of this round, from 0.
        """
        return self._split(self._search.sample(rng, iteration))

    def update(
        self, theta: FloatArray, change: FloatArray, residuals: FloatArray, failed: BoolArray, final: bool = False
    ) -> bool:
        """Improve both by what was simulated; False if nothing was usable.

        Args:
            theta: offsets, as sampled.
            change: changes of velocities, as sampled.
            residuals: (samples, R) of each.
            failed: (samples,) which do not count.
            final: nothing more is sampled in this round.
        """
        free = change.reshape(len(change), -1)[:, self._free]
        price = free / self._std * np.sqrt(PRICE / 6)
        tried = np.concatenate([theta.reshape(len(theta), -1), free], axis=1)[:, None]
        return self._search.update(tried, np.concatenate([residuals, price], axis=1), failed, final)

    def finish(self) -> FloatArray:
        """Leave the plan to the later search; the change of each root's velocity (bodies, 6) [m/s, rad/s]."""
        plan, change = self._split(self._search.plan[None])
        self._later.go_on_from(plan[0], self._split(self._search.kept)[0])
        return np.asarray(change[0])

    def _split(self, tried: FloatArray) -> tuple[FloatArray, FloatArray]:
        count, offsets = len(tried), self._later.plan.size
        change = np.zeros((count, 6 * self._bodies))
        change[:, self._free] = tried[:, 0, offsets:]
        return tried[:, 0, :offsets].reshape(count, *self._later.plan.shape), change.reshape(count, self._bodies, 6)
