"""Steps that the reference does not have: a foot is put to where the body falls (the capture point of Pratt et al. 2006)."""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import BoolArray, FloatArray, IndexArray

_LEAST_POINTS = 2
"""A foot stands with so many points on the floor."""


@dataclass(frozen=True)
class ExtraStep:
    """A step that is under way.

    Attributes:
        side: 0 left, 1 right.
        begin: first step of the reference.
        end: the foot should be down again.
    """

    side: int
    begin: int
    end: int

    def lift(self, step: int, height: float) -> float:
        """How much higher than in the reference the foot should be [m]; it comes down a little early."""
        share = (step - self.begin) / (self.end - self.begin)
        return height * float(np.sin(np.pi * min(1.1 * share, 1.0)))


def lacking(astray: FloatArray, pressure: FloatArray, points: FloatArray) -> float:
    """By how much the extrapolated COM is out of the feet's reach [m]; negative if the feet can catch it.

    Args:
        astray: (2,) of the extrapolated COM from where it should be [m].
        pressure: (2,) centre of pressure that keeps it there [m].
        points: (P, 2) that bear load, at least one [m].
    """
    length = float(np.hypot(*astray))
    if length < 1e-3:
        return -np.inf
    return length - float(((points - pressure) @ (astray / length)).max())


def foot_to_move(astray: FloatArray, feet: FloatArray) -> int:
    """The foot (2, 2) that is behind in the direction of the fall: 0 left, 1 right."""
    return int(np.argmin(feet @ astray))


def both_stand(owner: IndexArray, feet: tuple[int, int], low: BoolArray, planned: BoolArray) -> bool:
    """Whether both feet stand, as the reference has it.

    Args:
        owner: (P,) segment of each contact point.
        feet: segments of the left and right foot.
        low: (P,) points on the floor.
        planned: (P,) points that the reference has on the floor.
    """
    of = [owner == foot for foot in feet]
    return all((planned & mine).any() and (low & mine).sum() >= _LEAST_POINTS for mine in of)
