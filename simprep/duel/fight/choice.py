"""Who decides what a fighter does next (2008 paper, section 5.1.1).

Synthesis asks a chooser whenever an action ends; modes and baselines differ only in their choosers.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.model.action_features import FloorFrame
from simprep.duel.model.transition_model import TransitionModel


@dataclass(frozen=True)
class Situation:
    """What a fighter knows when it must choose.

    Attributes:
        player: 0 or 1, who chooses.
        time: since the beginning of the fight [s].
        own_label: code of the own action that ends now.
        opponent_label: code of what the opponent is doing.
        own: (P,) parameters n1 of the own action in `frame`.
        opponent: (P,) parameters n2 of the opponent's in `frame`.
        frame: reference frame of this moment (Fig. 9).
        example: index in B of the own action that ends; -1 where it is none of the model's.
        position: (2,) own root on the floor of the world [m]; None: unknown.
        heading: own heading in the world [rad]; None: unknown.
        known_s: time until which it is known what a user asks for [s]; None: `time`. A fight that is simulated while it
            is drawn looks ahead.
    """

    player: int
    time: float
    own_label: int
    opponent_label: int
    own: FloatArray
    opponent: FloatArray
    frame: FloorFrame
    example: int
    position: FloatArray | None = None
    heading: float | None = None
    known_s: float | None = None


@dataclass(frozen=True)
class Choice:
    """What a fighter does next.

    Attributes:
        example: index in B of the action to perform.
        request: the user's request that it answers; empty for none.
        goal: (2,) where the root should be `goal_s` after the action begins, on the floor of the world [m]; the
            placement drifts there instead of to the original one. None: no such wish.
        goal_s: see there [s].
        note: as of `FightAction`.
    """

    example: int
    request: str = ""
    goal: FloatArray | None = None
    goal_s: float = 0.5
    note: str = ""


class Chooser(Protocol):
    """Chooses the next action of one fighter."""

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action; `rng` is the fight's only source of chance."""
        ...


@dataclass(frozen=True)
class ModelChooser:
    """Draws by a player's transition model to the letter of Eq. 6 and 12 (the automatic mode: `fight.drawing`)."""

    model: TransitionModel

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `Chooser`)."""
        s = situation
        return Choice(self.model.sample(rng, s.own_label, s.opponent_label, s.own, s.opponent))
