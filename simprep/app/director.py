"""Who decides what the simulated bodies do next: the one place where the page's modes differ."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

from simprep.character import Character
from simprep.motion.motion import Motion
from simprep.physics.tracker import ASK_S, Tracker
from simprep.physics.tracker_state import TrackerState

Point = tuple[float, float]
"""(x, y) on the floor [m]."""
Place = tuple[float, float, float]
"""(x, y, z) in the world [m]."""


@dataclass(frozen=True)
class Caption:
    """What is to be said about a moment.

    Attributes:
        level: level of preparation, 0 to 1; NaN where there is none.
        doing: what each body is doing.
        chances: probabilities behind the present choice, by words, largest first.
        goal: (x, y) where the user's character goes [m]; None: nowhere.
    """

    level: float = float("nan")
    doing: tuple[str, ...] = ()
    chances: tuple[tuple[str, float], ...] = ()
    goal: Point | None = None


class Director(Protocol):
    """Leads the simulated bodies, as long as the simulation goes on.

    Attributes:
        characters: the bodies.
        longest_s: after so long everything begins anew [s].
    """

    characters: tuple[Character, ...]
    longest_s: float

    def begin(self, tracker: Tracker) -> None:
        """Give the bodies what they follow first."""
        ...

    def advance(self, until_s: float) -> None:
        """Simulate on until a time [s], and decide what is to be done meanwhile."""
        ...

    def caption(self, time: float) -> Caption:
        """What is to be said about a moment that is past or present [s]."""
        ...


class PieceDirector(ABC):
    """A `Director` that gives the reference of each body in pieces, and is asked for more when one runs out."""

    characters: tuple[Character, ...]
    longest_s = math.inf

    @abstractmethod
    def first(self) -> tuple[Motion, ...]:
        """The first piece of each body."""

    @abstractmethod
    def more(self, state: TrackerState) -> tuple[Motion | None, ...] | None:
        """The next piece of each body, which begins where its last one ended.

        None where nobody gets one: bodies whose pieces have ended stand.
        """

    @abstractmethod
    def caption(self, time: float) -> Caption:
        """See `Director.caption`."""

    def begin(self, tracker: Tracker) -> None:
        """See `Director.begin`."""
        self._tracker = tracker
        tracker.extend(*self.first())

    def advance(self, until_s: float) -> None:
        """See `Director.advance`; it asks for more once."""
        tracker = self._tracker
        state = tracker.state
        if min(state.ahead_s) < ASK_S and not state.fallen:
            more = self.more(state)
            if more is not None:
                tracker.extend(*more)
        for _ in range(round(until_s / tracker.timestep) - round(state.time / tracker.timestep)):
            if not tracker.end:
                tracker.step()
