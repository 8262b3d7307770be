"""Knots of a curve of offsets that is planned again and again.

The knots stay where they are in time. If they moved on with every plan, the last plan would have to be read anew between
its knots, and each time it would be blurred a little: over a look-ahead by more than the distance of two knots.
"""

import numpy as np

from simprep.arrays import FloatArray


class Knots:
    """Where the present and the next plan lie among the knots; its state is the time since the first plan.

    Args:
        spacing: time between two knots [s].
        steps: of the planner's simulations in a plan, and dt: the length of one [s].
        every: steps of the world from plan to plan, and world_dt: the length of one [s].

    Attributes:
        count: knots of a curve. The first one is not in the future.
        plan: (steps of the planner, count) weights of the knots along a plan.
        world: (every, count) weights of the knots in the steps of the world until the next plan.
    """

    def __init__(self, spacing: float, steps: int, dt: float, every: int, world_dt: float) -> None:
        self.count = int(np.ceil(steps * dt / spacing - 1e-9)) + 2  # whatever part of the first gap is past
        self._step = world_dt / spacing
        self._along = np.arange(steps, dtype=np.float64) * (dt / spacing)
        self._until_next = np.arange(every, dtype=np.float64) * self._step
        self._clock = 0
        self.go_on(0)

    def go_on(self, steps: int) -> int:
        """Let so many steps of the world pass; how many knots have become past."""
        before = int(self._clock * self._step + 1e-9)
        self._clock += steps
        position = self._clock * self._step + 1e-9
        passed, first = int(position) - before, position - int(position)
        self.plan = linear_basis(first + self._along, self.count)
        self.world = linear_basis(first + self._until_next, self.count)
        return passed


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
