"""Which action a fighter does next: P(a1' | a1, a2), learned from a coupled graph.

Source: the 2008 paper, sections 4 and 5.1.1. P(a1' | a1, a2) is proportional to P(l1' | l1, l2) P(n1, n2, n1' | l1')
(Eq. 6); with a wanted position c the second factor is P(n1, n2, n1', c | l1') (Eq. 13). The example of greatest density
stands for its label (Eq. 12); among labels the next is drawn by Eq. 6.
"""

from dataclasses import dataclass, field

import numpy as np

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.duel.model.action_features import (
    POSE_COMPONENTS,
    ActionFeatures,
    PairTracks,
    PoseBasis,
    action_features,
    fit_pose_basis,
)
from simprep.duel.model.estimates import LabelEstimate, fit_label_model
from simprep.duel.model.label_model import LabelTriples
from simprep.duel.model.semi_tied import ClassGaussians, CovarianceModel, SemiTied
from simprep.duel.model.structures import PLAYERS, CoupledGraph, Transitions
from simprep.duel.stream.stream import PLAYERS as NAMES
from simprep.errors import MotionError, SettingError


@dataclass(frozen=True)
class Candidates:
    """What may come next, weighed.

    Attributes:
        log_weight: (K,) by Eq. 6 or 13 for each candidate label, up to a common constant [nats].
        example: (K,) action in B that stands for each label (Eq. 12).
    """

    log_weight: FloatArray
    example: IntArray

    def probabilities(self, allowed: BoolArray | None = None) -> FloatArray:
        """Distribution (K,) over the allowed candidates.

        Raises:
            SettingError: none is allowed.
        """
        logs = self.log_weight if allowed is None else np.where(allowed, self.log_weight, -np.inf)
        if np.isneginf(logs).all():
            raise SettingError("no candidate action is allowed")
        weight = np.exp(logs - logs.max())
        return np.asarray(weight / weight.sum())


@dataclass(frozen=True)
class TransitionModel:
    """P(a1' | a1, a2) of one player. Immutable.

    Attributes:
        player: 0 or 1, the player that chooses.
        labels: P(l1' | l1, l2). Candidate k is node k of the player's graph.
        gaussians: P(n1, n2, n1' | l1').
        goal_gaussians: P(n1, n2, n1', c | l1'), None where no clip is long enough to see a goal reached.
        examples: (S,) actions in B that may be chosen, by ascending candidate.
        candidate: (S,) candidate of each example.
        parameters: (S, P) n of each example in the frame in which it began.

    Raises:
        MotionError: parts that do not belong together.
    """

    player: int
    labels: LabelEstimate
    gaussians: ClassGaussians
    goal_gaussians: ClassGaussians | None
    examples: IntArray
    candidate: IntArray
    parameters: FloatArray
    _selector: "_Selector" = field(init=False, repr=False, compare=False)
    _goal_selector: "_Selector | None" = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        k, size = len(self.labels.candidates), self.parameters.shape[1]
        if not np.array_equal(np.unique(self.candidate), np.arange(k)) or np.any(np.diff(self.candidate) < 0):
            raise MotionError("transition model: every candidate label needs an example, in ascending order")
        for gaussians, wanted in ((self.gaussians, 3 * size), (self.goal_gaussians, 3 * size + 2)):
            if gaussians is not None and gaussians.dimension != wanted:
                raise MotionError(f"transition model: densities of {gaussians.dimension} parameters; valid: {wanted}")
        goal = self.goal_gaussians
        object.__setattr__(self, "_selector", _Selector(self, self.gaussians))
        object.__setattr__(self, "_goal_selector", None if goal is None else _Selector(self, goal))

    def candidates(
        self,
        own_label: int,
        opponent_label: int,
        own: FloatArray,
        opponent: FloatArray,
        goal: FloatArray | None = None,
        bonus: FloatArray | None = None,
    ) -> Candidates:
        """Weigh every label's best example.

        Args:
            own_label: code of the own action that ends.
            opponent_label: code of what the opponent is doing.
            own: (P,) n1 in the frame of this moment (`action_features.floor_frame`, `action_parameters`).
            opponent: (P,) n2 in the same frame (`opponent=True`).
            goal: (2,) wanted root position 0.5 s from now in the same frame [m], or None.
            bonus: (S,) log of a further factor on the density of each of `examples`; None: none.

        Raises:
            SettingError: parameters of the wrong length or not finite, a goal where the model has learned none.
        """
        given = np.concatenate([own, opponent] if goal is None else [own, opponent, goal])
        size = self.parameters.shape[1]
        if given.shape != (2 * size + (0 if goal is None else 2),) or not np.isfinite(given).all():
            raise SettingError(f"a choice needs {size} finite parameters of each player, and 2 of the goal if any")
        selector = self._selector if goal is None else self._goal_selector
        if selector is None:
            raise SettingError("this model has not learned to reach positions: its clips were too short")
        with np.errstate(divide="ignore"):
            log_label = np.log(self.labels.distribution(own_label, opponent_label))
        log_density, best = selector.best(given, bonus)
        return Candidates(log_label + log_density, self.examples[best])

    def sample(
        self,
        rng: np.random.Generator,
        own_label: int,
        opponent_label: int,
        own: FloatArray,
        opponent: FloatArray,
        goal: FloatArray | None = None,
        allowed: BoolArray | None = None,
        bonus: FloatArray | None = None,
    ) -> int:
        """Draw the next action: its index in B.

        Arguments as of `candidates`; `allowed` (K,) says which candidates may be chosen (action table R), None: all.

        Raises:
            SettingError: as `candidates`, or none is allowed.
        """
        found = self.candidates(own_label, opponent_label, own, opponent, goal, bonus)
        cumulative = np.cumsum(found.probabilities(allowed))
        # scaled: rounding in the last sum must not lead past the end or onto a forbidden candidate
        choice = np.searchsorted(cumulative, rng.random() * cumulative[-1], side="right")
        return int(found.example[choice])


@dataclass(frozen=True)
class DuelModel:
    """Everything learned from a stream.

    Attributes:
        fps: frame rate of the stream [1/s]; frame numbers in the graph count these.
        goal_delay: time after an action begins at which a goal is reached [s].
        graph: B, G1, G2, C, R.
        basis: principal components of the local poses.
        parameters: (A, P) of every action in the frame in which it began.
        players: a transition model for each.
    """

    fps: float
    goal_delay: float
    graph: CoupledGraph
    basis: PoseBasis
    parameters: FloatArray
    players: tuple[TransitionModel, TransitionModel]


@dataclass(frozen=True)
class TrainingSettings:
    """How to learn a model.

    Attributes:
        label_model: estimate of P(l1' | l1, l2): eq9 (the paper's), eq7, eq8, log_linear or rules.
        covariance: of the Gaussians: `SemiTied` (the paper's), `FullCovariance` or `DiagonalCovariance`.
        pose_components: principal components of the local pose.
        goal_delay: time after an action begins at which a goal is reached [s].
    """

    label_model: str = "eq9"
    covariance: CovarianceModel = field(default_factory=SemiTied)
    pose_components: int = POSE_COMPONENTS
    goal_delay: float = 0.5


def train(graph: CoupledGraph, tracks: PairTracks, settings: TrainingSettings | None = None) -> DuelModel:
    """Learn both players' models from a labelled stream, without settings as in the paper.

    Raises:
        MotionError: too few transitions for the densities, or tracks that do not fit the graph.
    """
    settings = settings or TrainingSettings()
    basis = fit_pose_basis(tracks.joints, settings.pose_components)
    features = action_features(tracks, graph.actions, basis, settings.goal_delay)
    first, second = (
        train_player(graph, features, graph.actions.transitions(player), player, settings) for player in PLAYERS
    )
    return DuelModel(tracks.fps, settings.goal_delay, graph, basis, features.parameters, (first, second))


def train_player(
    graph: CoupledGraph, features: ActionFeatures, transitions: Transitions, player: int, settings: TrainingSettings
) -> TransitionModel:
    """Learn one player's model from some of its transitions.

    Raises:
        MotionError: no more transitions than parameters.
    """
    label = graph.actions.label[transitions.next]
    samples = features.samples(transitions)
    if len(samples) <= samples.shape[1]:
        raise MotionError(
            f"player {NAMES[player]} changes its action {len(samples)} times; a model needs more than {samples.shape[1]} "
            "changes (a longer stream)"
        )
    goal = features.goal[transitions.next]
    seen = np.isfinite(goal).all(axis=1)
    labels = fit_label_model(
        label_triples(graph, transitions),
        graph.graphs[player].labels,
        graph.graphs[1 - player].labels,
        settings.label_model,
    )
    gaussians = settings.covariance.fit(samples, label)
    goal_gaussians = None
    if seen.sum() > samples.shape[1] + 2:
        goal_gaussians = settings.covariance.fit(np.concatenate([samples, goal], axis=1)[seen], label[seen])
    return player_model(graph, features.parameters, player, labels, gaussians, goal_gaussians)


def label_triples(graph: CoupledGraph, transitions: Transitions) -> LabelTriples:
    """Labels of transitions."""
    label = graph.actions.label
    return LabelTriples(label[transitions.current], label[transitions.opponent], label[transitions.next])


def player_model(
    graph: CoupledGraph,
    parameters: FloatArray,
    player: int,
    labels: LabelEstimate,
    gaussians: ClassGaussians,
    goal_gaussians: ClassGaussians | None,
) -> TransitionModel:
    """One player's model from its learned parts (see `TransitionModel`) and the parameters (A, P) of all actions.

    Its examples are all the player's actions, by node.
    """
    node = graph.graphs[player].node
    own = graph.actions.of(player)
    examples = own[np.argsort(node[own], kind="stable")]
    return TransitionModel(
        player, labels, gaussians, goal_gaussians, examples, node[examples], np.asarray(parameters[examples])
    )


class _Selector:
    """Eq. 12 for one situation, fast.

    The Cholesky factor splits a joint density into that of the given parameters and that of the example's given these.
    The latter has only P dimensions, and the example's part of it is known beforehand.
    """

    def __init__(self, model: TransitionModel, gaussians: ClassGaussians) -> None:
        size = model.parameters.shape[1]
        dimension = gaussians.dimension
        following = np.arange(2 * size, 3 * size)
        given = np.setdiff1d(np.arange(dimension), following)
        order = np.concatenate([given, following])
        row = gaussians.row(model.labels.candidates)
        covariance = gaussians.covariance[row][:, order][:, :, order]
        white = np.linalg.inv(np.linalg.cholesky(covariance))
        mean = gaussians.mean[row][:, order]
        self._given = len(given)
        # whitened deviation of the given parameters g: self._matrix @ g - self._offset, (K, D) after reshaping
        self._matrix = np.ascontiguousarray(white[:, :, : len(given)]).reshape(-1, len(given))
        self._offset = np.einsum("kij,kj->ki", white[:, :, : len(given)], mean[:, : len(given)]).reshape(-1)
        self._shape = (len(row), dimension)
        deviation = model.parameters - mean[model.candidate][:, len(given) :]
        self._examples = np.einsum("sij,sj->si", white[model.candidate][:, len(given) :, len(given) :], deviation)
        self._candidate = model.candidate
        self._first = np.searchsorted(model.candidate, np.arange(len(row)))
        self._norm = np.log(np.diagonal(white, axis1=1, axis2=2)).sum(axis=1) - 0.5 * dimension * np.log(2 * np.pi)

    def best(self, given: FloatArray, bonus: FloatArray | None = None) -> tuple[FloatArray, IntArray]:
        """Greatest log density (K,) of each candidate's examples, bonus included, and the example (K,) that has it."""
        white = (self._matrix @ given - self._offset).reshape(self._shape)
        residual = self._examples + white[self._candidate, self._given :]
        square = np.einsum("si,si->s", residual, residual)
        if bonus is not None:
            square -= 2 * bonus
        least = np.minimum.reduceat(square, self._first)
        at_least = np.flatnonzero(square == least[self._candidate])
        best = at_least[np.searchsorted(self._candidate[at_least], np.arange(self._shape[0]))]
        marginal = white[:, : self._given]
        return self._norm - 0.5 * (np.einsum("ki,ki->k", marginal, marginal) + least), best
