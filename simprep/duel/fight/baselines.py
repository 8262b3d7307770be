"""What the transition model is compared with: fighters who do not look at each other, and a random walk.

They differ from the automatic mode in the choice of actions alone.
"""

from dataclasses import dataclass, field

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.fight.choice import Choice, Situation
from simprep.duel.fight.drawing import ConditionalDensities, DrawSettings, begins_where, shares
from simprep.duel.fight.masks import narrowed
from simprep.duel.model.action_features import PLACEMENT
from simprep.duel.model.label_model import row_of
from simprep.duel.model.semi_tied import ClassGaussians, SemiTied
from simprep.duel.model.transition_model import DuelModel, TransitionModel
from simprep.motion.turns import turned


def own_motion(parameters: FloatArray) -> FloatArray:
    """The part of parameters n (..., 2 (3 + k)) that does not depend on where the opponent is.

    Returns:
        (..., 2 k + 3): pose, velocity in the axes of the own heading, turning rate, change of the pose.
    """
    half = parameters.shape[-1] // 2
    velocity = turned(parameters[..., half : half + 2], -parameters[..., 2])
    return np.concatenate([parameters[..., PLACEMENT:half], velocity, parameters[..., half + 2 :]], axis=-1)


@dataclass(frozen=True)
class IndependentChooser:
    """A single-player graph: labels by P(l1' | l1) P(u1 | l1')^w, examples by P(u1 | u1', l1')^w.

    `drawing.DrawingChooser` for one fighter alone, u being the own motion (`own_motion`): learned from the same
    examples, with the same weights and the rule for `move`.

    Attributes:
        model: of this player.
        gaussians: P(u1, u1' | l1').
        settings: weights and rules.
    """

    model: TransitionModel
    gaussians: ClassGaussians
    settings: DrawSettings = field(default_factory=DrawSettings)
    _table: FloatArray = field(init=False, repr=False, compare=False)
    _densities: ConditionalDensities = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        model = self.model
        triples, candidates = model.labels.triples, model.labels.candidates
        counts = np.ones((len(candidates) + 1, len(candidates)))  # Dirichlet(1); the last row: own label never seen
        rows = row_of(candidates, triples.own)
        np.add.at(counts, (rows, np.searchsorted(candidates, triples.next)), 1)
        counts[-1] = 1
        densities = ConditionalDensities(self.gaussians, candidates, model.candidate, own_motion(model.parameters))
        object.__setattr__(self, "_table", np.log(counts / counts.sum(axis=1, keepdims=True)))
        object.__setattr__(self, "_densities", densities)

    @classmethod
    def of(cls, model: DuelModel, player: int, settings: DrawSettings | None = None) -> "IndependentChooser":
        """Learn from the transitions that the model of player 0 or 1 has learned from."""
        own = model.players[player]
        steps = model.graph.actions.transitions(player)
        steps = steps.subset(np.flatnonzero(np.isin(steps.current, own.examples) & np.isin(steps.next, own.examples)))
        motion = own_motion(model.parameters)
        samples = np.concatenate([motion[steps.current], motion[steps.next]], axis=1)
        gaussians = SemiTied().fit(samples, model.graph.actions.label[steps.next])
        return cls(own, gaussians, settings or DrawSettings())

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        model, now = self.model, own_motion(situation.own)
        candidates = model.labels.candidates
        logs = self._table[int(row_of(candidates, situation.own_label))]
        logs = logs + self.settings.label_weight * self._densities.given_labels(now)
        if self.settings.rules:
            possible = narrowed(np.ones(len(candidates), dtype=bool), begins_where(candidates, situation.own_label))
            logs = np.where(possible, logs, -np.inf)
        label = int(rng.choice(len(candidates), p=shares(logs)))
        own = np.flatnonzero(model.candidate == label)
        fits = self.settings.example_weight * self._densities.given_examples(now, label, own)
        return Choice(int(model.examples[rng.choice(own, p=shares(fits))]))


@dataclass(frozen=True)
class RandomChooser:
    """A random walk: all labels of the player's model are equally likely, and all examples of each."""

    model: TransitionModel

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        label = int(rng.integers(len(self.model.labels.candidates)))
        return Choice(int(rng.choice(self.model.examples[self.model.candidate == label])))
