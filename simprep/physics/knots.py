"""Knots of a curve of offsets that is planned again and again.

The knots stay where they are in time. If they moved on with every plan, the last plan would have to be read anew between
its knots, and each time it would be blurred a little: over a look-ahead by more than the distance of two knots.

A new plan takes over from the last one within a short time, not at once: a jump of the servos' targets with every plan
shakes the body. What is simulated for a plan takes over in the same way.
"""

import numpy as np

from simprep.arrays import FloatArray


class Knots:
    """Where the present and the next plan lie among the knots; its state is the time since the first plan.

    Args:
        spacing: time between two knots [s].
        steps: of the planner's simulations in a plan, and dt: the length of one [s].
        every: steps of the world from plan to plan, and world_dt: the length of one [s].
        fade_in: time within which a plan takes over from the offsets that were sent before it [s]; the first one is
            there at once.

    Attributes:
        count: knots of a curve. The first one is not in the future.
        plan: (steps of the planner, count) weights of the knots along a plan.
        plan_before: (steps of the planner,) weight of the offsets that were sent last.
        world: (every, count) weights of the knots in the steps of the world until the next plan.
        world_before: (every,) weight of the offsets that were sent last.
    """

    def __init__(
        self, spacing: float, steps: int, dt: float, every: int, world_dt: float, fade_in: float = 0.0
    ) -> None:
        self.count = int(np.ceil(steps * dt / spacing - 1e-9)) + 2  # whatever part of the first gap is past
        self._step = world_dt / spacing
        self._steps = steps
        # the steps of the planner, then those of the world
        self._along = np.concatenate([np.arange(steps) * (dt / spacing), np.arange(every) * self._step])
        # a step of the planner is judged by its middle, one of the world by its end
        times = np.concatenate([(np.arange(steps) + 0.5) * dt, (np.arange(every) + 1.0) * world_dt])
        self._fade = np.clip(1 - times / fade_in, 0, 1) if fade_in else np.zeros(len(times))
        self._clock = 0
        self.go_on(0)

    def go_on(self, steps: int) -> int:
        """Let so many steps of the world pass; how many knots have become past."""
        past = int(self._clock * self._step + 1e-9)
        self._clock += steps
        position = self._clock * self._step + 1e-9
        passed, first = int(position) - past, position - int(position)
        basis, before = linear_basis(first + self._along, self.count), self._fade * (self._clock > 0)
        basis -= before[:, None] * basis[0]  # both start now
        self.plan, self.world = basis[: self._steps], basis[self._steps :]
        self.plan_before, self.world_before = before[: self._steps], before[self._steps :]
        return passed


def linear_basis(position: FloatArray, knots: int) -> FloatArray:
    """Weights (n, knots) of linear interpolation between knots, held at the ends, at positions (n,) in knots from 0."""
    # how far each gap between two knots is past, which the knot at its start loses to the one at its end
    passed = np.minimum(np.maximum(position[:, None] - np.arange(knots - 1), 0.0), 1.0)
    basis = np.zeros((len(position), knots))
    basis[:, 0] = 1.0
    basis[:, 1:] = passed
    basis[:, :-1] -= passed
    return basis
