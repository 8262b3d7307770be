"""The model that generates a synthetic stream: P(next label | own label, opponent's label), known outright.

A fighter whose action ends sees what the opponent is doing, chooses a kind of action by one table and the foot on which
it ends by another. `react` and the first foot follow from the labels, so each probability is a product of two entries.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import FloatArray, IntArray
from simprep.duel.labels.labels import ASPECTS, LEARNED_ASPECTS, decode
from simprep.duel.model.label_model import Tabulated, log_prob_from
from simprep.duel.synthetic.kinds import CONTEXTS, KIND_NAMES, KIND_OF, KINDS, SIDES, context_of, label_of
from simprep.errors import SettingError

FOOT_LETTERS = ("L", "R", "F")
_REACT = {"kick": "kick", "punch": "punch"}
FREE = ("neutral", "bwd", "fwdbwd", "down", "jump_down")
"""Ends of the names of kinds after which a fighter chooses freely."""


def is_free(kind: str) -> bool:
    """Whether anything may follow a kind."""
    return kind.endswith(FREE) and not kind.endswith("bwdfwd")


@dataclass(frozen=True)
class Temper:
    """How one fighter fights. Weights are relative to that of a neutral action (footwork, defence), which is 1.

    Attributes:
        start: weight of every kind that may be begun, when the opponent does nothing.
        contexts: factors on kicks and on punches, by what the opponent is doing.
        again: factor on attacks straight after an own attack.
        double_punch: probability that the same hand punches again.
        other_hand: probability that the other hand follows while the first returns.
        double_kick: probability that the same leg kicks again.
        hurried: factor on the three above while the opponent attacks.
    """

    start: Mapping[str, float]
    contexts: Mapping[str, tuple[float, float]]
    again: float = 0.7
    double_punch: float = 0.16
    other_hand: float = 0.3
    double_kick: float = 0.15
    hurried: float = 0.6


def kind_table(temper: Temper) -> FloatArray:
    """P(kind | own kind, context) as (own kind, context, kind).

    Raises:
        SettingError: an unknown kind among the weights.
    """
    unknown = [kind for kind in temper.start if kind not in KINDS]
    if unknown:
        raise SettingError(f"unknown kind of action {unknown[0]!r}; valid: {', '.join(KIND_NAMES)}")
    table = np.zeros((len(KIND_NAMES), len(CONTEXTS), len(KIND_NAMES)))
    for row, own in enumerate(KIND_NAMES):
        for column, context in enumerate(CONTEXTS):
            weights = _free(temper, own, context) if is_free(own) else _followed(temper, own, context)
            for kind, weight in weights.items():
                table[row, column, KIND_NAMES.index(kind)] += weight
    return np.asarray(table / table.sum(axis=-1, keepdims=True))


def _free(temper: Temper, own: str, context: str) -> dict[str, float]:
    kick, punch = temper.contexts[context]
    weights = {"neutral": 1.0}
    for kind, weight in temper.start.items():
        factor = kick if kind.endswith("_up") else punch
        if context_of(own) != "neutral":
            factor *= temper.again
        weights[kind] = weight * factor
    return weights


def _followed(temper: Temper, own: str, context: str) -> dict[str, float]:
    hurry = temper.hurried if context in ("kick", "punch") else 1.0
    if own.endswith("jump_up"):
        return {own.replace("jump_up", "jump_down"): 1.0}
    if own.endswith(("_up", "_downup")):
        side, double = own.partition("_")[0], temper.double_kick * hurry * (0.5 if own.endswith("downup") else 1.0)
        return {f"{side}_downup": double, f"{side}_down": 1 - double}
    side = own.rpartition("_")[2] if "_to_" in own else own.partition("_")[0]
    other = SIDES[1 - SIDES.index(side)]
    double, change = temper.double_punch * hurry, temper.other_hand * hurry
    if "_to_" in own or own.endswith("bwdfwd"):
        double, change = 0.7 * double, 0.7 * change
    return {f"{side}_bwdfwd": double, f"{side}_to_{other}": change, f"{side}_bwd": 1 - double - change}


@dataclass(frozen=True)
class Footing:
    """On which foot actions end: `change` is the probability of another one, by the longest fitting end of the kind."""

    change: Mapping[str, float]

    def ends(self, kind: str, start: str) -> dict[str, float]:
        """Probabilities of the last foot of a kind that begins on a foot."""
        side = kind.partition("_")[0]
        support = {"left": "R", "right": "L"}.get(side, "L")
        if kind.endswith("jump_up"):
            return {"F": 1.0}
        if kind.endswith(("_up", "_downup")):
            return {support: 1.0}
        share = self.change[max((end for end in self.change if kind.endswith(end)), key=len)]
        if start == "F":  # landing: mostly on the leg that did not kick
            return {"L": 0.5, "R": 0.5} if kind == "jump_down" else {support: 1 - share, _other(support): share}
        return {start: 1 - share, _other(start): share}


def _other(foot: str) -> str:
    return "R" if foot == "L" else "L"


@dataclass(frozen=True)
class GeneratingModel:
    """P(next | own, opponent) of one fighter, a `label_model.LabelModel`.

    Attributes:
        kinds: (kinds, contexts, kinds) P(kind | own kind, what the opponent is doing).
        footing: last foot by kind and first foot.
    """

    kinds: FloatArray
    footing: Footing
    _codes: dict[tuple[int, str, int], int] = field(default_factory=dict, repr=False, compare=False)

    def __post_init__(self) -> None:
        shape = (len(KIND_NAMES), len(CONTEXTS), len(KIND_NAMES))
        if self.kinds.shape != shape or np.any(self.kinds < 0) or not np.allclose(self.kinds.sum(axis=-1), 1):
            raise SettingError(f"table of kinds of shape {self.kinds.shape}; valid: {shape}, rows of probabilities")

    @cached_property
    def candidates(self) -> IntArray:
        """(K,) codes of all labels that can occur, ascending."""
        reached = {("neutral", "L"), ("neutral", "R")}
        found = {label_of("neutral", react, f"{a}-{b}").code for react in ("kick", "punch", "others") for a in "LR" for b in "LR"}  # fmt: skip
        while True:
            new = set()
            for kind, start in reached:
                own = KIND_NAMES.index(kind)
                for number in np.flatnonzero(self.kinds[own].sum(axis=0)):
                    following = KIND_NAMES[number]
                    for end in self.footing.ends(following, start):
                        new.add((following, end))
                        found |= {
                            label_of(following, react, f"{start}-{end}").code for react in ("kick", "punch", "others")
                        }
            if new <= reached:
                return np.array(sorted(found), dtype=np.int64)
            reached |= new

    @cached_property
    def _parts(self) -> tuple[IntArray, IntArray, IntArray, IntArray]:
        """Of the candidates: indices of kind, react, first and last foot."""
        return _split(self.candidates)

    @cached_property
    def _feet(self) -> FloatArray:
        """(K,) probability of each candidate's last foot."""
        kind, _, first, last = self._parts
        return np.array(
            [
                self.footing.ends(KIND_NAMES[k], FOOT_LETTERS[a]).get(FOOT_LETTERS[b], 0.0)
                for k, a, b in zip(kind, first, last)
            ]
        )

    def distribution(self, own: ArrayLike, opponent: ArrayLike) -> FloatArray:
        """Probabilities (..., K) of the candidates, given label codes (...).

        Raises:
            SettingError: a label that the model never produces.
        """
        own, opponent = np.broadcast_arrays(np.asarray(own, np.int64), np.asarray(opponent, np.int64))
        kind, _, _, foot = _split(own.ravel())
        theirs = _split(opponent.ravel())[0]
        context = np.array([CONTEXTS.index(context_of(KIND_NAMES[k])) for k in theirs], dtype=np.int64)
        react = np.array([("kick", "punch", "others").index(_REACT.get(CONTEXTS[c], "others")) for c in context])
        next_kind, next_react, next_first, _ = self._parts
        out = self.kinds[kind[:, None], context[:, None], next_kind] * self._feet
        out = out * (next_react == react[:, None]) * (next_first == foot[:, None])
        return np.asarray(out.reshape(*own.shape, -1))

    def log_prob(self, own: ArrayLike, opponent: ArrayLike, next_label: ArrayLike) -> FloatArray:
        """Log probability (...) of the next label; -inf where it cannot follow."""
        return log_prob_from(self.candidates, self.distribution(own, opponent), next_label)

    def tabulated(self, opponent: "GeneratingModel") -> Tabulated:
        """The whole table over all labels of both fighters."""
        own, other = np.meshgrid(self.candidates, opponent.candidates, indexing="ij")
        return Tabulated(self.candidates, opponent.candidates, self.distribution(own, other))

    def as_dict(self) -> dict[str, Any]:
        """The model, ready for JSON; `from_dict` reads it."""
        return {
            "kind_names": list(KIND_NAMES),
            "contexts": list(CONTEXTS),
            "kinds": self.kinds.tolist(),
            "changes_foot": dict(self.footing.change),
        }

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> "GeneratingModel":
        """The model that `as_dict` described.

        Raises:
            SettingError: other kinds of action than this version's.
        """
        if tuple(content["kind_names"]) != KIND_NAMES or tuple(content["contexts"]) != CONTEXTS:
            raise SettingError("a generating model over other kinds of action than this version's")
        return cls(np.array(content["kinds"], dtype=np.float64), Footing(dict(content["changes_foot"])))


def _split(codes: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Indices of kind, react, first and last foot of label codes.

    Raises:
        SettingError: a label that is of no kind.
    """
    if not len(codes):
        return (np.zeros(0, dtype=np.int64),) * 4
    unique, back = np.unique(codes, return_inverse=True)
    parts = decode(unique)
    learned = [tuple(int(index) for index in row[: len(LEARNED_ASPECTS)]) for row in parts]
    odd = [row for row in learned if row not in KIND_OF]
    if odd:
        raise SettingError(f"label with learned qualifiers {odd[0]}: the generating model has no such kind of action")
    kind = np.array([KIND_NAMES.index(KIND_OF[row]) for row in learned], dtype=np.int64)
    move = parts[:, ASPECTS.index("move")]
    return kind[back], parts[:, ASPECTS.index("react")][back], (move // 3)[back], (move % 3)[back]
