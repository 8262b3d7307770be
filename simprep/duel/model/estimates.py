"""Estimates of P(next own label | own label, opponent's label) from observed transitions.

Source: the 2008 paper, section 4.2, Eq. 7 to 11, and appendix A.1: probabilities from counts with a Dirichlet(1) prior,
P(x) = (N(x) + 1) / sum over y of (N(y) + 1). `LogLinear` and `Ruled` are ours.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import FloatArray, IntArray
from simprep.duel.labels.labels import SHAPE, decode
from simprep.duel.model.label_model import LabelTriples, log_prob_from, row_of
from simprep.duel.model.succession import may_follow
from simprep.errors import SettingError, UnknownNameError

AGAINST_RULES = 0.01
"""What `Ruled` leaves to labels against the rules, which misplaced cuts or contacts make."""
SLOPE_LEFT = 0.01
"""Norm of the slope at which `fit_log_linear` stops: at most half its square, 5e-5 nats, above the least."""


@dataclass(frozen=True)
class LabelEstimate(ABC):
    """An estimate made from observed transitions.

    Attributes:
        triples: observed transitions.
        candidates: (K,) codes that may come next, ascending: the player's labels in the stream learned from.
        opponent_labels: (K2,) codes of the opponent in the stream learned from, ascending.
    """

    kind: ClassVar[str]
    triples: LabelTriples
    candidates: IntArray
    opponent_labels: IntArray

    def __post_init__(self) -> None:
        if len(self.candidates) == 0:
            raise SettingError("a label model needs at least one candidate label")
        for name in ("candidates", "opponent_labels"):
            object.__setattr__(self, name, np.unique(np.asarray(getattr(self, name), dtype=np.int64)))
        unknown = ~np.isin(self.triples.next, self.candidates)
        if unknown.any():
            raise SettingError(f"label {int(self.triples.next[unknown][0])} follows in the data but is no candidate")

    @abstractmethod
    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates."""

    def log_prob(self, own: ArrayLike, opponent: ArrayLike, next_label: ArrayLike) -> FloatArray:
        """Log probability (...) of the next label; -inf where it is no candidate."""
        return log_prob_from(self.candidates, self.distribution(own, opponent), next_label)


@dataclass(frozen=True)
class FirstOrderProduct(LabelEstimate):
    """Eq. 9, the paper's choice: P(next | own) times P(next | opponent), normalised.

    Attributes:
        own_table: (K + 1, K) P(next | own), Eq. 10, the edges of the player's graph; last row: own label never seen.
        opponent_table: (K2 + 1, K) P(next | opponent), Eq. 11, the cross edges; last row likewise.
    """

    kind: ClassVar[str] = "eq9"
    own_table: FloatArray = field(init=False)
    opponent_table: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        column = np.searchsorted(self.candidates, self.triples.next)
        for name, given, rows in (
            ("own_table", self.triples.own, self.candidates),
            ("opponent_table", self.triples.opponent, self.opponent_labels),
        ):
            counts = np.zeros((len(rows) + 1, len(self.candidates)))
            np.add.at(counts, (row_of(rows, given), column), 1)
            # unknown given labels were counted into the spare row, which must stay the prior
            counts[-1] = 0
            object.__setattr__(self, name, _smoothed(counts))

    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates; a label never seen is a uniform factor."""
        product = (
            self.own_table[row_of(self.candidates, own)] * self.opponent_table[row_of(self.opponent_labels, opponent)]
        )
        return np.asarray(product / product.sum(axis=-1, keepdims=True))


@dataclass(frozen=True)
class Trigram(LabelEstimate):
    """Eq. 7: counts of the whole triple. Rejected by the paper: most triples are never seen.

    Attributes:
        contexts: (U,) own and opponent label seen together, as one number, ascending.
        table: (U + 1, K) P(next | own, opponent); the last row (uniform) is for a pair never seen.
    """

    kind: ClassVar[str] = "eq7"
    contexts: IntArray = field(init=False)
    table: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        pairs = _pair(self.triples.own, self.triples.opponent)
        contexts, row = np.unique(pairs, return_inverse=True)
        counts = np.zeros((len(contexts) + 1, len(self.candidates)))
        np.add.at(counts, (row, np.searchsorted(self.candidates, self.triples.next)), 1)
        object.__setattr__(self, "contexts", contexts)
        object.__setattr__(self, "table", _smoothed(counts))

    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates; uniform for a pair never seen together."""
        return np.asarray(self.table[row_of(self.contexts, _pair(own, opponent))])


@dataclass(frozen=True)
class FullyFactored(LabelEstimate):
    """Eq. 8: product over all pairs of aspects. Rejected by the paper: possible actions get almost no probability.

    Attributes:
        own_score: (7, max qualifiers, K) sum over the next label's aspects k of log P(next_k | own_m), by aspect m and
            its qualifier.
        opponent_score: the same, given the opponent's aspects.
    """

    kind: ClassVar[str] = "eq8"
    own_score: FloatArray = field(init=False)
    opponent_score: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        following = decode(self.triples.next)
        candidates = decode(self.candidates)
        for name, given in (("own_score", decode(self.triples.own)), ("opponent_score", decode(self.triples.opponent))):
            score = np.zeros((len(SHAPE), max(SHAPE), len(self.candidates)))
            for m, size in enumerate(SHAPE):
                for k, size_next in enumerate(SHAPE):
                    counts = np.zeros((size, size_next))
                    np.add.at(counts, (given[:, m], following[:, k]), 1)
                    score[m, :size] += np.log(_smoothed(counts))[:, candidates[:, k]]
            object.__setattr__(self, name, score)

    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates."""
        aspect = np.arange(len(SHAPE))
        score = self.own_score[aspect, decode(own)].sum(axis=-2) + self.opponent_score[aspect, decode(opponent)].sum(
            axis=-2
        )
        return _softmax(score)


@dataclass(frozen=True)
class LogLinear(LabelEstimate):
    """The form of Eq. 9 with both tables fitted together, so that labels alike in an aspect learn from each other.

    log P(next | own, opponent) = own_score + opponent_score, normalised. Each score sums a weight for the pair of
    labels, one for each pair of their aspects' qualifiers, and one for each qualifier of the next label. All weights
    maximise the likelihood together under a Gaussian prior (`fit_log_linear`). Few examples thus teach what holds for
    whole aspects, such as that a kick comes down after it went up; Eq. 9 must see each pair of labels for it, and
    counts what is common anyway twice.

    Attributes:
        own_score: (K + 1, K) of next given own; the last row is for an own label never seen.
        opponent_score: (K2 + 1, K) of next given the opponent's.
    """

    kind: ClassVar[str] = "log_linear"
    own_score: FloatArray
    opponent_score: FloatArray

    def __post_init__(self) -> None:
        super().__post_init__()
        k = len(self.candidates)
        shapes = (k + 1, k), (len(self.opponent_labels) + 1, k)
        if (self.own_score.shape, self.opponent_score.shape) != shapes:
            raise SettingError(f"scores of shapes {self.own_score.shape}, {self.opponent_score.shape}; valid: {shapes}")

    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates."""
        return _softmax(
            self.own_score[row_of(self.candidates, own)] + self.opponent_score[row_of(self.opponent_labels, opponent)]
        )


def fit_log_linear(
    triples: LabelTriples,
    candidates: IntArray,
    opponent_labels: IntArray,
    aspect_penalty: float = 1.0,
    label_penalty: float = 10.0,
) -> LogLinear:
    """Fit `LogLinear` by Newton's method (conjugate gradients in a trust region); the problem is convex.

    Args:
        triples: observed transitions.
        candidates: codes of the player's labels in the whole stream learned from.
        opponent_labels: codes of the opponent's labels there.
        aspect_penalty: precision of the Gaussian prior on the weights of aspects, and on each label's own.
        label_penalty: the same of pairs of labels; a greater one asks for more evidence of exceptions.
    """
    # late: slow to import, and only this estimate needs them
    from scipy.optimize import minimize
    from scipy.sparse import csr_array

    labels = [np.unique(candidates), np.unique(opponent_labels)]
    k = len(labels[0])
    # what is equal for all triples of a pair of labels is worked out once
    _, first, context = np.unique(_pair(triples.own, triples.opponent), return_index=True, return_inverse=True)
    seen = np.zeros((len(first), k))
    np.add.at(seen, (context, row_of(labels[0], triples.next)), 1)
    count, order = seen.sum(axis=1, keepdims=True), np.arange(len(first))
    given = [row_of(names, codes[first]) for names, codes in zip(labels, (triples.own, triples.opponent), strict=True)]
    sums = [
        csr_array((np.ones(len(first)), (row, order)), shape=(len(names) + 1, len(first)))
        for names, row in zip(labels, given, strict=True)
    ]
    next_qualities = _qualities(labels[0])
    # the constant column bears the weights of the next label's qualifiers, all that an unseen label has
    unseen = np.append(np.zeros(sum(SHAPE)), 1.0)
    qualities = [np.vstack([np.column_stack([_qualities(names), np.ones(len(names))]), unseen]) for names in labels]
    shapes: list[tuple[int, ...]] = [(k,)]
    for names in labels:
        shapes += [(len(names) + 1, k), (len(unseen), sum(SHAPE))]
    sizes = [int(np.prod(shape)) for shape in shapes]
    ends = np.cumsum(sizes)
    # weights are searched in units of their prior's spread: the curvature is then at least 1 in every direction
    spread = np.repeat([aspect_penalty, label_penalty, aspect_penalty, label_penalty, aspect_penalty], sizes) ** -0.5

    def scores(flat: FloatArray) -> list[FloatArray]:
        bias, *weights = (part.reshape(shape) for part, shape in zip(np.split(flat * spread, ends[:-1]), shapes))
        pairs = list(zip(weights[::2], weights[1::2], qualities, strict=True))
        own, opponent = (whole + quality @ (aspects @ next_qualities.T) for whole, aspects, quality in pairs)
        return [bias + own, opponent]

    def by_context(flat: FloatArray) -> FloatArray:
        own, opponent = scores(flat)
        score = own[given[0]]
        score += opponent[given[1]]
        return score

    def to_weights(slope: FloatArray) -> FloatArray:
        """The transpose of `by_context`."""
        parts = [slope.sum(axis=0)]
        for summing, quality in zip(sums, qualities, strict=True):
            whole = summing @ slope
            parts += [whole, quality.T @ (whole @ next_qualities)]
        return np.concatenate([part.ravel() for part in parts]) * spread

    @lru_cache(maxsize=1)  # the solver asks for the curvature where it last asked for the slope
    def expected(flat: bytes) -> FloatArray:
        return np.asarray(count * _softmax(by_context(np.frombuffer(flat))))

    def objective(flat: FloatArray) -> tuple[float, FloatArray]:
        following = expected(flat.tobytes())
        # above zero even where the exponential underflows
        loss = -(seen * np.log(np.maximum(following / count, 1e-300))).sum()
        return float(loss + 0.5 * flat @ flat), to_weights(following - seen) + flat

    def curvature(flat: FloatArray, step: FloatArray) -> FloatArray:
        following, change = expected(flat.tobytes()), by_context(step)
        change -= np.einsum("nk,nk->n", following, change)[:, None] / count
        change *= following
        return to_weights(change) + step

    start = np.zeros(ends[-1])
    found = minimize(objective, start, jac=True, hessp=curvature, method="trust-ncg", options={"gtol": SLOPE_LEFT})
    return LogLinear(triples, labels[0], labels[1], *scores(found.x))


@dataclass(frozen=True)
class Ruled(LabelEstimate):
    """Another estimate, `base`, kept to labels that `react` and `move` allow (`model.succession`). Ours."""

    kind: ClassVar[str] = "rules"
    base: LabelEstimate

    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates; labels against the rules share 1 %, or all where nothing agrees."""
        given = self.base.distribution(own, opponent)
        kept = given * may_follow(own, opponent, self.candidates)
        total = kept.sum(axis=-1, keepdims=True)
        agreed = np.divide(kept, total, out=given.copy(), where=total > 0)
        return np.asarray((1 - AGAINST_RULES) * agreed + AGAINST_RULES * given)


def fit_ruled(triples: LabelTriples, candidates: IntArray, opponent_labels: IntArray) -> Ruled:
    """Fit `Ruled` over `LogLinear`, with a stronger prior (arguments of `fit_label_model`)."""
    base = fit_log_linear(triples, candidates, opponent_labels, aspect_penalty=3.0, label_penalty=100.0)
    return Ruled(triples, base.candidates, base.opponent_labels, base)


LABEL_MODELS: dict[str, Callable[[LabelTriples, IntArray, IntArray], LabelEstimate]] = {
    FirstOrderProduct.kind: FirstOrderProduct,
    Trigram.kind: Trigram,
    FullyFactored.kind: FullyFactored,
    LogLinear.kind: fit_log_linear,
    Ruled.kind: fit_ruled,
}
"""The estimates, the paper's by the number of their equation."""


def fit_label_model(
    triples: LabelTriples, candidates: IntArray, opponent_labels: IntArray, kind: str = "eq9"
) -> LabelEstimate:
    """Estimate P(next | own, opponent).

    Args:
        triples: observed transitions.
        candidates: codes of the player's labels in the whole stream learned from.
        opponent_labels: codes of the opponent's labels there.
        kind: one of `LABEL_MODELS`.

    Raises:
        UnknownNameError: another kind.
    """
    if kind not in LABEL_MODELS:
        raise UnknownNameError("label model", kind, LABEL_MODELS)
    return LABEL_MODELS[kind](triples, candidates, opponent_labels)


def _smoothed(counts: FloatArray) -> FloatArray:
    """Conditional probabilities by row, from joint counts with the Dirichlet(1) prior."""
    return np.asarray((counts + 1) / (counts + 1).sum(axis=-1, keepdims=True))


def _softmax(score: FloatArray) -> FloatArray:
    weight = np.exp(score - score.max(axis=-1, keepdims=True))
    return np.asarray(weight / weight.sum(axis=-1, keepdims=True))


def _qualities(codes: IntArray) -> FloatArray:
    """(n, all qualifiers) 1 where a label has the qualifier."""
    return np.concatenate([np.eye(size)[column] for size, column in zip(SHAPE, decode(codes).T)], axis=1)


def _pair(own: ArrayLike, opponent: ArrayLike) -> IntArray:
    return np.asarray(own, dtype=np.int64) * np.int64(2**31) + np.asarray(opponent, dtype=np.int64)
