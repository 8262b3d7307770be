"""What the transition model is compared with: fighters who do not look at each other, and a random walk.

They differ from the automatic mode in the choice of actions alone; everything else of synthesis is the same.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from simprep.duel.action_features import PLACEMENT, turned
from simprep.duel.choice import Choice, Situation
from simprep.duel.semi_tied import ClassGaussians, SemiTied
from simprep.duel.transition_model import DuelModel, TransitionModel

FloatArray = NDArray[np.float64]


def own_motion(parameters: FloatArray) -> FloatArray:
    """The part of parameters n that does not depend on where the opponent is.

    Args:
        parameters: (..., 2 (3 + k)) as from `action_features.action_parameters`.

    Returns:
        (..., 2 k + 3): pose, velocity in the axes of the own heading, turning rate, change of the pose.
    """
    half = parameters.shape[-1] // 2
    velocity = turned(parameters[..., half : half + 2], -parameters[..., 2])
    return np.concatenate([parameters[..., PLACEMENT:half], velocity, parameters[..., half + 2 :]], axis=-1)


@dataclass(frozen=True)
class IndependentChooser:
    """A single-player graph: P(l1' | l1) P(u1, u1' | l1'), with u the own motion (`own_motion`); the opponent is ignored.

    The counterpart of Eq. 6 and 12 for one fighter alone, learned from the same examples.

    Attributes:
        model: of this player.
        gaussians: P(u1, u1' | l1').
    """

    model: TransitionModel
    gaussians: ClassGaussians
    _table: FloatArray = field(init=False, repr=False, compare=False)
    _motion: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        triples, candidates = self.model.labels.triples, self.model.labels.candidates
        counts = np.ones((len(candidates) + 1, len(candidates)))  # Dirichlet(1); the last row: own label never seen
        seen = np.isin(triples.own, candidates)
        rows = np.searchsorted(candidates, triples.own[seen])
        np.add.at(counts, (rows, np.searchsorted(candidates, triples.next[seen])), 1)
        object.__setattr__(self, "_table", np.log(counts / counts.sum(axis=1, keepdims=True)))
        object.__setattr__(self, "_motion", own_motion(self.model.parameters))

    @classmethod
    def of(cls, model: DuelModel, player: int) -> "IndependentChooser":
        """Learn from the transitions that the player's model has learned from."""
        own = model.players[player]
        steps = model.graph.actions.transitions(player)
        steps = steps.subset(np.flatnonzero(np.isin(steps.current, own.examples) & np.isin(steps.next, own.examples)))
        motion = own_motion(model.parameters)
        samples = np.concatenate([motion[steps.current], motion[steps.next]], axis=1)
        return cls(own, SemiTied().fit(samples, model.graph.actions.label[steps.next]))

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        model, now = self.model, own_motion(situation.own)
        samples = np.column_stack([np.broadcast_to(now, self._motion.shape), self._motion])
        density = self.gaussians.log_density(samples, model.labels.candidates[model.candidate])
        first = np.searchsorted(model.candidate, np.arange(len(model.labels.candidates)))
        row = np.flatnonzero(model.labels.candidates == situation.own_label)
        logs = self._table[row[0] if len(row) else -1] + np.maximum.reduceat(density, first)
        weight = np.exp(logs - logs.max())
        label = int(rng.choice(len(weight), p=weight / weight.sum()))
        own = np.flatnonzero(model.candidate == label)
        return Choice(int(model.examples[own[np.argmax(density[own])]]))


@dataclass(frozen=True)
class RandomChooser:
    """A random walk: every label that the player has is as likely, and each of its examples.

    Attributes:
        model: of this player.
    """

    model: TransitionModel

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        label = int(rng.integers(len(self.model.labels.candidates)))
        return Choice(int(rng.choice(self.model.examples[self.model.candidate == label])))
