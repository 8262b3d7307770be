"""Warping the time of an action so that its interaction moment coincides with the opponent's.

Source: the 2008 paper, section 5.1.2; interaction moments are peaks of the contact force. Only the time before the own
moment is stretched or shortened.
"""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import SettingError


@dataclass(frozen=True)
class WarpSettings:
    """How far time may be warped.

    Attributes:
        slowest: least speed of the action, 1 being the recorded one.
        fastest: greatest speed.
        settle: share of the time before the moment over which the speed returns to 1.

    Raises:
        SettingError: limits that do not enclose 1, or a share outside 0 to 1.
    """

    slowest: float = 0.8
    fastest: float = 1.25
    settle: float = 0.3

    def __post_init__(self) -> None:
        if not 0.1 <= self.slowest <= 1 <= self.fastest <= 10:
            raise SettingError(f"warp from {self.slowest} to {self.fastest}; valid: 0.1 to 1, and 1 to 10")
        if not 0 < self.settle < 1:
            raise SettingError(f"settling over {self.settle} of the time; valid: above 0, below 1")


DEFAULT_WARP = WarpSettings()


@dataclass(frozen=True)
class Warp:
    """Which time of the example is shown when.

    Attributes:
        moment: of the example, frames after its beginning.
        wanted: frame of the fight, counted from the action's beginning, that shows the moment.
        speed: until it begins to return to 1.
        settle: frames over which it returns, before the moment.
    """

    moment: float = 0.0
    wanted: float = 0.0
    speed: float = 1.0
    settle: float = 0.0

    def source(self, frames: FloatArray) -> FloatArray:
        """Times of the example shown at frames of the action [frames]; rises everywhere, with continuous speed."""
        before = self.wanted - self.settle
        late = np.clip(frames - before, 0.0, self.settle) if self.settle else np.zeros_like(frames)
        bend = 0.5 * (1 - self.speed) * late**2 / self.settle if self.settle else 0.0
        after = np.maximum(frames - self.wanted, 0.0)
        return np.asarray(self.speed * (frames - after) + bend + after)

    def length(self, frames: float) -> int:
        """Length of an action of so many frames, warped."""
        return max(2, round(frames + self.wanted - self.moment))


def fit_warp(moment: float, wanted: float, settings: WarpSettings = DEFAULT_WARP) -> Warp | None:
    """The warp that shows a moment at a wanted frame, both counted from the action's beginning.

    None where the speed would leave the limits, or where a moment is not ahead.
    """
    if moment < 1 or wanted < 1:
        return None
    settle = settings.settle * wanted
    speed = (moment - 0.5 * settle) / (wanted - 0.5 * settle)
    if not settings.slowest <= speed <= settings.fastest:
        return None
    return Warp(moment, wanted, speed, settle)
