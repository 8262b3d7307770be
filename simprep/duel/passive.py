"""Passive mode: one fighter performs what was recorded, action after action, and the other only reacts.

Source: the 2008 paper, section 6: the attacks and the reactions to them are not learned from (`simprep.duel.held_out`), and the
passive fighter may not attack.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from simprep.duel.choice import Choice, Situation
from simprep.duel.label_masks import LabelMasks, narrowed, reaction_to
from simprep.duel.transition_model import TransitionModel
from simprep.errors import SettingError


class RecordedChooser:
    """Performs given actions in their order; after the last one the first again.

    Args:
        actions: numbers of actions in B, all of one player.

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
    """Draws by the transition model among what a fighter may do who only reacts.

    The first restriction leaves out attacks. The second keeps to labels whose `react` is what the rule gives an action that
    begins now (section 3.2.2): Eq. 9 alone gives labels that react to something else a small probability each,
    together a large one. Where a restriction would leave nothing, it is dropped.

    Attributes:
        model: of this player.
        attacks: may attack too.
        by_rule: second restriction.
        neutral: third one: none of a punch, kick or jump, not even its return.
    """

    model: TransitionModel
    attacks: bool = False
    by_rule: bool = True
    neutral: bool = True
    _masks: LabelMasks = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_masks", LabelMasks.of(self.model))

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        s, masks = situation, self._masks
        allowed = np.ones(len(masks.codes), dtype=bool)
        if not self.attacks:
            allowed = narrowed(allowed, ~masks.attacks)
        if self.by_rule:
            allowed = narrowed(allowed, masks.react == reaction_to(s.opponent_label))
        if self.neutral and not self.attacks:
            allowed = narrowed(allowed, masks.neutral)
        return Choice(self.model.sample(rng, s.own_label, s.opponent_label, s.own, s.opponent, allowed=allowed))
