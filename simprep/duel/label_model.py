"""Which action follows: P(next own label | own label, opponent's label), three ways behind one interface.

Source: the 2008 paper, section 4.2 and appendix A.1. In every function here `own` is the label of the player that is
about to choose (the paper's l1), `opponent` that of the other (l2), `next` the own label chosen (l1'). Each player has
its own model, with candidates from its own actions. All probabilities come from counts with a Dirichlet(1) prior,
P(x) = (N(x) + 1) / sum over y of (N(y) + 1).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simprep.duel.labels import SHAPE, decode
from simprep.errors import SettingError, UnknownNameError

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class LabelModel(Protocol):
    """P(next | own, opponent) over a player's candidate labels."""

    @property
    def candidates(self) -> IntArray:
        """(K,) codes of the labels that may come next, ascending."""
        ...

    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates, given label codes (...)."""
        ...

    def log_prob(self, own: ArrayLike, opponent: ArrayLike, next_label: ArrayLike) -> FloatArray:
        """Natural logarithm (...) of the probability of the next label; -inf where it is no candidate."""
        ...


@dataclass(frozen=True)
class LabelTriples:
    """Observed transitions as label codes.

    Attributes:
        own: (N,) own label before.
        opponent: (N,) what the opponent was doing at the change.
        next: (N,) own label after.
    """

    own: IntArray
    opponent: IntArray
    next: IntArray

    def __len__(self) -> int:
        return len(self.own)

    def subset(self, rows: NDArray[np.integer]) -> "LabelTriples":
        """The triples in the given rows."""
        return LabelTriples(self.own[rows], self.opponent[rows], self.next[rows])


@dataclass(frozen=True)
class _Counted(ABC):
    """What the three estimates share: the counts are made once, rows of probabilities on demand.

    Attributes:
        triples: observed transitions.
        candidates: (K,) codes that may come next, ascending: the labels of the player in the example stream.
        opponent_labels: (K2,) codes of the opponent in the example stream, ascending.
    """

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
        """Natural logarithm (...) of the probability of the next label; -inf where it is no candidate."""
        return log_prob_from(self.candidates, self.distribution(own, opponent), next_label)


@dataclass(frozen=True)
class FirstOrderProduct(_Counted):
    """Eq. 9, the paper's choice: P(next | own) times P(next | opponent), normalised.

    Attributes:
        own_table: (K + 1, K) P(next | own), Eq. 10: the probabilities on the edges of the player's graph; the last row
            is for an own label that was never seen.
        opponent_table: (K2 + 1, K) P(next | opponent), Eq. 11: those on the cross edges.
    """

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
            # An observation whose given label is unknown fills the spare row, which must stay the prior alone.
            counts[-1] = 0
            object.__setattr__(self, name, _smoothed(counts))

    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates; a label never seen says nothing (a uniform factor)."""
        product = (
            self.own_table[row_of(self.candidates, own)] * self.opponent_table[row_of(self.opponent_labels, opponent)]
        )
        return np.asarray(product / product.sum(axis=-1, keepdims=True))


@dataclass(frozen=True)
class Trigram(_Counted):
    """Eq. 7: counts of the whole triple. Rejected by the paper: most triples are never seen.

    Attributes:
        contexts: (U,) own and opponent label seen together, as one number, ascending.
        table: (U + 1, K) P(next | own, opponent); the last row (uniform) is for a pair never seen.
    """

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
        """Probabilities (..., K) of the candidates, uniform for a pair of labels never seen together."""
        return np.asarray(self.table[row_of(self.contexts, _pair(own, opponent))])


@dataclass(frozen=True)
class FullyFactored(_Counted):
    """Eq. 8: product over all pairs of aspects. Rejected by the paper: overconfident, possible actions get almost none.

    Attributes:
        own_score: (7, max qualifiers, K) sum over the next label's aspects k of log P(next_k | own_m), by aspect m and
            its qualifier.
        opponent_score: the same, given the opponent's aspects.
    """

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
        weight = np.exp(score - score.max(axis=-1, keepdims=True))
        return np.asarray(weight / weight.sum(axis=-1, keepdims=True))


@dataclass(frozen=True)
class Tabulated:
    """A distribution known outright, such as the policy that generated a synthetic stream.

    Attributes:
        candidates: (K,) codes that may come next, ascending.
        opponent_labels: (K2,) opponent's codes, ascending.
        table: (K, K2, K) P(next | own, opponent); each last axis sums to 1.

    Raises:
        SettingError: codes not ascending, wrong shapes or rows that are no distributions.
    """

    candidates: IntArray
    opponent_labels: IntArray
    table: FloatArray

    def __post_init__(self) -> None:
        shape = (len(self.candidates), len(self.opponent_labels), len(self.candidates))
        if any(np.any(np.diff(codes) <= 0) for codes in (self.candidates, self.opponent_labels)):
            raise SettingError("label codes of a table must ascend")
        if self.table.shape != shape or np.any(self.table < 0) or not np.allclose(self.table.sum(axis=-1), 1):
            raise SettingError(f"table of shape {self.table.shape}; valid: {shape}, rows of probabilities")

    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates.

        Raises:
            SettingError: a label outside the table.
        """
        rows, columns = row_of(self.candidates, own), row_of(self.opponent_labels, opponent)
        if np.any(rows == len(self.candidates)) or np.any(columns == len(self.opponent_labels)):
            raise SettingError("the table does not cover every label asked for")
        return np.asarray(self.table[rows, columns])

    def log_prob(self, own: ArrayLike, opponent: ArrayLike, next_label: ArrayLike) -> FloatArray:
        """Natural logarithm (...) of the probability of the next label; -inf where it is no candidate."""
        return log_prob_from(self.candidates, self.distribution(own, opponent), next_label)


LABEL_MODELS: dict[str, type[FirstOrderProduct] | type[Trigram] | type[FullyFactored]] = {
    "eq9": FirstOrderProduct,
    "eq7": Trigram,
    "eq8": FullyFactored,
}
"""The estimates by the number of their equation; the first is the default."""


def fit_label_model(
    triples: LabelTriples, candidates: IntArray, opponent_labels: IntArray, kind: str = "eq9"
) -> FirstOrderProduct | Trigram | FullyFactored:
    """Estimate P(next | own, opponent).

    Args:
        triples: observed transitions.
        candidates: codes of the player's labels in the whole example stream.
        opponent_labels: codes of the opponent's labels there.
        kind: one of `LABEL_MODELS`.

    Raises:
        UnknownNameError: another kind.
    """
    if kind not in LABEL_MODELS:
        raise UnknownNameError("label model", kind, LABEL_MODELS)
    return LABEL_MODELS[kind](triples, candidates, opponent_labels)


def average_log_prob(model: LabelModel, triples: LabelTriples) -> float:
    """Mean log P(next | own, opponent) [nats]; higher is better. Hides which transitions are badly explained."""
    return float(np.mean(model.log_prob(triples.own, triples.opponent, triples.next)))


def total_variation(model: LabelModel, truth: LabelModel, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
    """Total-variation distance between two models' distributions, 0 (equal) to 1 (disjoint).

    Args:
        model: one of them.
        truth: the other; its candidates may differ.
        own: (...) own label codes.
        opponent: (...) opponent's label codes.

    Returns:
        (...) half the sum of absolute differences over the labels of either.
    """
    union = np.union1d(model.candidates, truth.candidates)
    difference = np.zeros((*np.shape(own), len(union)))
    difference[..., np.searchsorted(union, model.candidates)] += model.distribution(own, opponent)
    difference[..., np.searchsorted(union, truth.candidates)] -= truth.distribution(own, opponent)
    return np.asarray(0.5 * np.abs(difference).sum(axis=-1))


def log_prob_from(candidates: IntArray, distribution: FloatArray, next_label: ArrayLike) -> FloatArray:
    """Pick the logarithm of one label's probability out of distributions (..., K) over the candidates."""
    column = row_of(candidates, next_label)
    padded = np.concatenate([distribution, np.zeros((*distribution.shape[:-1], 1))], axis=-1)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.take_along_axis(padded, column[..., None], axis=-1)[..., 0]))


def row_of(known: IntArray, codes: ArrayLike) -> IntArray:
    """Position of each code among ascending known ones; their number where it is not among them."""
    codes = np.asarray(codes, dtype=np.int64)
    if len(known) == 0:
        return np.zeros(codes.shape, dtype=np.int64)
    row = np.minimum(np.searchsorted(known, codes), len(known) - 1)
    return np.where(known[row] == codes, row, len(known)).astype(np.int64)


def _smoothed(counts: FloatArray) -> FloatArray:
    """Rows of conditional probabilities from joint counts with the Dirichlet(1) prior."""
    return np.asarray((counts + 1) / (counts + 1).sum(axis=-1, keepdims=True))


def _pair(own: ArrayLike, opponent: ArrayLike) -> IntArray:
    return np.asarray(own, dtype=np.int64) * np.int64(2**31) + np.asarray(opponent, dtype=np.int64)
