"""Which action follows: P(next own label | own label, opponent's label), and scores of it.

Source: the 2008 paper, section 4.2. `own` is the label of the player about to choose (the paper's l1), `opponent` that
of the other (l2), `next` the own label chosen (l1'). Each player has its own model. Estimates:
`simprep.duel.model.estimates`.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simprep.arrays import FloatArray, IntArray
from simprep.errors import SettingError


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
        """Log probability (...) of the next label; -inf where it is no candidate."""
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
class Tabulated:
    """A distribution known outright, such as the model that generated a synthetic stream.

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
        """Log probability (...) of the next label; -inf where it is no candidate."""
        return log_prob_from(self.candidates, self.distribution(own, opponent), next_label)


def total_variation(model: LabelModel, truth: LabelModel, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
    """Total-variation distance (...) of two models, 0 (equal) to 1 (disjoint), given label codes (...)."""
    union = np.union1d(model.candidates, truth.candidates)
    difference = np.zeros((*np.shape(own), len(union)))
    difference[..., np.searchsorted(union, model.candidates)] += model.distribution(own, opponent)
    difference[..., np.searchsorted(union, truth.candidates)] -= truth.distribution(own, opponent)
    return np.asarray(0.5 * np.abs(difference).sum(axis=-1))


def log_prob_from(candidates: IntArray, distribution: FloatArray, next_label: ArrayLike) -> FloatArray:
    """Log probability of one label in each distribution (..., K) over the candidates."""
    column = row_of(candidates, next_label)
    padded = np.concatenate([distribution, np.zeros((*distribution.shape[:-1], 1))], axis=-1)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.take_along_axis(padded, column[..., None], axis=-1)[..., 0]))


def row_of(known: IntArray, codes: ArrayLike) -> IntArray:
    """Position of each code among ascending known ones; their number for an unknown one."""
    codes = np.asarray(codes, dtype=np.int64)
    if len(known) == 0:
        return np.zeros(codes.shape, dtype=np.int64)
    row = np.minimum(np.searchsorted(known, codes), len(known) - 1)
    return np.where(known[row] == codes, row, len(known)).astype(np.int64)
