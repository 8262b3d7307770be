"""The tracker behind the page: it goes on for as long as somebody looks, and so keeps touches of late, but no record."""

from collections.abc import Sequence

from simprep.app.moments import HitReader
from simprep.character import Character
from simprep.physics.contacts import BodyContact, ContactReader, merge_touches
from simprep.physics.controller import ControllerFactory
from simprep.physics.settings import SimulationSettings
from simprep.physics.tracker import Tracker

KEPT_S = 3.0
"""How long touches between bodies are kept [s]; a fight asks for those of the last 1.5 s."""


class PageTracker(Tracker):
    """A `Tracker` without a record, so that its memory does not grow.

    Args:
        characters: the bodies.
        preset, seed, controller, settings: of `Tracker`.

    Attributes:
        hits: touches that are not of the floor, for drawing.
    """

    def __init__(
        self,
        characters: Sequence[Character],
        preset: str | None,
        seed: int,
        controller: str | ControllerFactory,
        settings: SimulationSettings,
    ) -> None:
        super().__init__(characters, preset, seed, controller, settings, records=False)
        self.hits = HitReader(self.model, self.bodies)
        self._reader = ContactReader(self.model, self.bodies)
        self._read = 0  # steps

    def step(self) -> None:
        """Simulate one step, and read what touches what (see `Tracker.step`)."""
        super().step()
        self.hits.step(self.data)
        if len(self.bodies) > 1:
            self._reader.step(self._read, self.data)
            self._forget()
        self._read += 1

    def contacts(self, since_s: float = 0.0) -> tuple[BodyContact, ...]:
        """Contacts between the bodies of late (see `Tracker.contacts`)."""
        first = round(since_s / self.timestep)
        return merge_touches([one for one in self._reader.touches if one.step >= first], self.timestep)

    @property
    def kept(self) -> int:
        """How many things are remembered."""
        reader = self._reader
        return len(reader.touches) + len(reader.overlap) + len(reader.unconverged) + len(self.hits.hits)

    def _forget(self) -> None:
        reader = self._reader
        if len(reader.overlap) > KEPT_S / self.timestep:
            reader.overlap.clear()
            reader.unconverged.clear()
            first = self._read - KEPT_S / self.timestep
            reader.touches = [one for one in reader.touches if one.step >= first]
