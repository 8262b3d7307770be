"""Passive mode: one fighter performs what was recorded, and the other only reacts, without attacks; so does who is struck.

Source: the 2008 paper, section 6: attacks and reactions are not learned from (`simprep.duel.model.held_out`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from simprep.duel.fight.choice import Choice, Chooser, Situation
from simprep.duel.fight.drawing import DrawingChooser, DrawSettings
from simprep.duel.fight.masks import LabelMasks, narrowed
from simprep.duel.model.transition_model import TransitionModel
from simprep.errors import SettingError


class RecordedChooser:
    """Performs actions of one player (numbers in B) in their order, over and over.

    Raises:
        SettingError: no actions.
    """

    def __init__(self, actions: Sequence[int]) -> None:
        if not len(actions):
            raise SettingError("no recorded actions to perform; valid: at least one")
        self.actions = tuple(int(one) for one in actions)
        self._next = 0

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        example = self.actions[self._next % len(self.actions)]
        self._next += 1
        return Choice(example)


@dataclass(frozen=True)
class ReactingChooser:
    """Draws by a player's transition model among labels that do not attack.

    Attributes:
        model: of this player.
        neutral: guard, steps and defence alone: not even the return of a limb, which only follows an own attack.
        settings: of drawing.
    """

    model: TransitionModel
    neutral: bool = True
    settings: DrawSettings = field(default_factory=DrawSettings)
    _masks: LabelMasks = field(init=False, repr=False, compare=False)
    _drawing: DrawingChooser = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_masks", LabelMasks.of(self.model))
        object.__setattr__(self, "_drawing", DrawingChooser(self.model, self.settings))

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        masks = self._masks
        anything = np.ones(len(masks.codes), dtype=bool)
        allowed = narrowed(anything, ~masks.attacks, *((masks.neutral,) if self.neutral else ()))
        return Choice(self._drawing.draw(situation, rng, allowed))


class StruckChooser:
    """Chooses as another does; after a blow, once, among what reacts.

    Args:
        chooser: the other.
        reacting: chooses after a blow.

    Attributes:
        struck: note of the next action (`FightAction.note`), which is then a reaction; empty: nobody was struck.
    """

    def __init__(self, chooser: Chooser, reacting: ReactingChooser) -> None:
        self.chooser, self._reacting, self.struck = chooser, reacting, ""

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        if not self.struck:
            return self.chooser.choose(situation, rng)
        note, self.struck = self.struck, ""
        return replace(self._reacting.choose(situation, rng), note=note)
