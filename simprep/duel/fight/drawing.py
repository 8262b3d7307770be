"""How the automatic mode draws the next action: Eq. 6 with three corrections that held-out labels ask for.

Source: the 2008 paper, section 5.1.1. Read literally (`choice.ModelChooser`), Eq. 6 with the best example of each label
(Eq. 12) predicts held-out labels far worse than the label model alone, and labels whose examples lie close together win
whatever happens: fights stand still. Here

- the label is drawn by P(l1' | l1, l2) P(n1, n2 | l1')^w: the next action's own parameters, not yet known, are
  integrated out, and the geometry counts with a weight w below 1, since it repeats much of what l1 and l2 already say;
- labels that contradict the rules for `react` and `move` (section 3.2.2) are left out;
- the example is drawn by P(n1, n2 | n1', l1')^w, as examples are samples of P(n1' | l1') already; the best one alone
  would lead to the middle of the label again and again.
"""

from dataclasses import dataclass, field

import numpy as np

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.duel.fight.choice import Choice, Situation
from simprep.duel.fight.masks import LabelMasks, narrowed, reaction_to
from simprep.duel.labels.labels import ASPECTS, QUALIFIERS, decode
from simprep.duel.model.semi_tied import ClassGaussians
from simprep.duel.model.transition_model import TransitionModel
from simprep.errors import SettingError

_MOVE = ASPECTS.index("move")


@dataclass(frozen=True)
class DrawSettings:
    """How to draw.

    Attributes:
        label_weight: w of the geometry among labels; 0: labels alone. 0.1 predicts held-out labels best.
        example_weight: w of the geometry among the examples of the label.
        rules: leave out labels that contradict the rules for `react` and `move`.

    Raises:
        SettingError: a weight outside 0 to 10.
    """

    label_weight: float = 0.1
    example_weight: float = 1.0
    rules: bool = True

    def __post_init__(self) -> None:
        if not (0 <= self.label_weight <= 10 and 0 <= self.example_weight <= 10):
            raise SettingError(f"weights {self.label_weight} and {self.example_weight}; valid: 0 to 10")


@dataclass(frozen=True)
class DrawingChooser:
    """Draws labels and examples by one player's model, as the module says; a `choice.Chooser`."""

    model: TransitionModel
    settings: DrawSettings = field(default_factory=DrawSettings)
    _masks: LabelMasks = field(init=False, repr=False, compare=False)
    _densities: "ConditionalDensities" = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_masks", LabelMasks.of(self.model))
        model = self.model
        densities = ConditionalDensities(model.gaussians, model.labels.candidates, model.candidate, model.parameters)
        object.__setattr__(self, "_densities", densities)

    def choose(self, situation: Situation, rng: np.random.Generator) -> Choice:
        """The next action (see `choice.Chooser`)."""
        return Choice(self.draw(situation, rng))

    def draw(self, situation: Situation, rng: np.random.Generator, allowed: BoolArray | None = None) -> int:
        """The next action's number in B; `allowed` (K,) candidates are drawn from, at least one; None: all."""
        chances = self.label_probabilities(situation, allowed)
        label = int(rng.choice(len(chances), p=chances))
        own = np.flatnonzero(self.model.candidate == label)
        given = np.concatenate([situation.own, situation.opponent])
        logs = self.settings.example_weight * self._densities.given_examples(given, label, own)
        return int(self.model.examples[rng.choice(own, p=shares(logs))])

    def label_probabilities(self, situation: Situation, allowed: BoolArray | None = None) -> FloatArray:
        """Probabilities (K,) of the candidates (see `draw`)."""
        s, masks = situation, self._masks
        possible = np.ones(len(masks.codes), dtype=bool) if allowed is None else allowed
        if self.settings.rules:
            possible = narrowed(
                possible, masks.react == reaction_to(s.opponent_label), begins_where(masks.codes, s.own_label)
            )
        with np.errstate(divide="ignore"):
            logs = np.log(self.model.labels.distribution(s.own_label, s.opponent_label))
        if self.settings.label_weight:
            given = np.concatenate([s.own, s.opponent])
            logs = logs + self.settings.label_weight * self._densities.given_labels(given)
        return shares(np.where(possible, logs, -np.inf))


def shares(logs: FloatArray) -> FloatArray:
    """Distribution from the logarithms of weights (N,), at least one finite."""
    weight = np.exp(logs - logs.max())
    return np.asarray(weight / weight.sum())


def begins_where(codes: IntArray, own_label: int) -> BoolArray:
    """(K,) whether labels begin on the foot that an own label ended on."""
    moves = QUALIFIERS["move"]
    last = moves[int(decode([own_label])[0, _MOVE])][-1]
    return np.array([move[0] == last for move in moves])[decode(codes)[:, _MOVE]]


class ConditionalDensities:
    """P(g | l) and P(g | f, l), fast, of joint Gaussians of given g and following f by label.

    Args:
        gaussians: P(g, f | l).
        labels: (K,) classes, the candidates.
        candidate: (S,) candidate of each example, ascending.
        following: (S, F) f of each example; g are the other, first parameters of the Gaussians.
    """

    def __init__(self, gaussians: ClassGaussians, labels: IntArray, candidate: IntArray, following: FloatArray) -> None:
        first = gaussians.dimension - following.shape[1]
        g, f = slice(0, first), slice(first, gaussians.dimension)
        row = gaussians.row(labels)
        mean, covariance = gaussians.mean[row], gaussians.covariance[row]
        self._mean = mean[:, g]
        self._white = np.linalg.inv(np.linalg.cholesky(covariance[:, g, g]))
        self._norm = np.log(np.diagonal(self._white, axis1=1, axis2=2)).sum(axis=1)
        gain = np.swapaxes(np.linalg.solve(covariance[:, f, f], covariance[:, f, g]), 1, 2)  # (K, G, F)
        self._left = np.linalg.inv(np.linalg.cholesky(covariance[:, g, g] - gain @ covariance[:, f, g]))
        deviation = following - mean[candidate][:, f]
        expected = self._mean[candidate] + np.einsum("sij,sj->si", gain[candidate], deviation)
        self._expected = np.einsum("sij,sj->si", self._left[candidate], expected)

    def given_labels(self, given: FloatArray) -> FloatArray:
        """(K,) log P(g | l), up to a common constant."""
        white = np.einsum("kij,kj->ki", self._white, given - self._mean)
        return np.asarray(self._norm - 0.5 * np.einsum("ki,ki->k", white, white))

    def given_examples(self, given: FloatArray, label: int, examples: IntArray) -> FloatArray:
        """Log P(g | f, l) for some examples of candidate `label`, counted among all, up to a common constant."""
        white = self._left[label] @ given - self._expected[examples]
        return np.asarray(-0.5 * np.einsum("si,si->s", white, white))
