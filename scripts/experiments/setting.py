"""The task of an experiment, as it is drawn from a seed: what to do, where, among which things."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from simprep.controller.runtime.task import Task
from simprep.scene import Obstacle


@dataclass(frozen=True)
class Gate:
    """A gate to go through with a target.

    Attributes:
        name: of the gate; its bar is called `NAME_bar`.
        x: of its bar [m].
        ahead: how far the bar should be before the root at the launch of the target [m].
    """

    name: str
    x: float
    ahead: float


@dataclass(frozen=True)
class Setting:
    """One task drawn from a seed.

    Attributes:
        tasks: what to do.
        place: (x, y [m], heading [rad]) at the beginning.
        frame: of the walk to begin with.
        things: what stands around; those with a mass move when they are hit.
        drawn: the numbers drawn, for the record.
        strikes: of a task by its number, the segment that shall strike and the name of the thing that it shall strike.
        gates: of each task, the gate that it leads through.
        blows: of a task by its number, the hand that shall strike and the number of the person.
    """

    tasks: tuple[Task, ...]
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    frame: int = 0
    things: tuple[Obstacle, ...] = ()
    drawn: Mapping[str, Any] = field(default_factory=dict)
    strikes: Mapping[int, tuple[str, str]] = field(default_factory=dict)
    gates: tuple[Gate, ...] = ()
    blows: Mapping[int, tuple[str, int]] = field(default_factory=dict)

    def struck(self, number: int) -> tuple[str, Obstacle] | None:
        """The segment that shall strike in a task, and the thing; None where nothing shall be struck."""
        if number not in self.strikes:
            return None
        segment, name = self.strikes[number]
        return segment, as_thing(self.things, name)


def as_thing(things: Sequence[Obstacle], name: str) -> Obstacle:
    """The thing of a name."""
    return next(thing for thing in things if thing.name == name)
