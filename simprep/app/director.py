"""What the simulated bodies are to do next, asked piece by piece. A duel has its own way (`dueling`): it is chosen by what happens."""

from dataclasses import dataclass
from typing import Protocol

from simprep.character import Character
from simprep.motion.motion import Motion
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
    """Gives the reference of all bodies in pieces, as long as the simulation goes on."""

    characters: tuple[Character, ...]

    def begin(self) -> tuple[Motion, ...]:
        """The first piece of each body."""
        ...

    def more(self, state: TrackerState) -> tuple[Motion | None, ...] | None:
        """The next piece of each body, which begins where its last one ended; asked when one runs out.

        None where nobody gets one: bodies whose pieces have ended stand.
        """
        ...

    def caption(self, time: float) -> Caption:
        """What is to be said about a moment that is past or present [s]."""
        ...
