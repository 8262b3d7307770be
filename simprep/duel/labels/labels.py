"""Action labels: one qualifier for each of seven aspects, and integer codes for arrays.

Source: the 2008 paper, section 3.2 and Table 1. Qualifier indices and label codes are positions in `QUALIFIERS`, so
saved files depend on the order of its entries.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import BoolArray, IntArray
from simprep.errors import SettingError, UnknownNameError

_PUNCH = ("fwd", "bwd", "bwdfwd", "fwdbwd", "others")
_KICK = ("up", "down", "downup", "others")

QUALIFIERS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "left_punch": _PUNCH,
        "right_punch": _PUNCH,
        "left_kick": _KICK,
        "right_kick": _KICK,
        "jump": ("up", "down", "others"),
        "react": ("kick", "punch", "others"),
        "move": ("L-L", "L-R", "L-F", "R-L", "R-R", "R-F", "F-L", "F-R", "F-F"),
    }
)
"""Valid qualifiers of each aspect. `move` is the first and last supporting foot, L, R or F (none: flight)."""

ASPECTS: tuple[str, ...] = tuple(QUALIFIERS)
"""The seven aspects, in the order of the label vector."""

PUNCHES = ("left_punch", "right_punch")
KICKS = ("left_kick", "right_kick")
LEARNED_ASPECTS = (*PUNCHES, *KICKS, "jump")
"""Aspects that a classifier learns from annotations; `react` and `move` follow from rules."""

ATTACKING_QUALIFIERS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {**dict.fromkeys(PUNCHES, ("fwd", "bwdfwd", "fwdbwd")), **dict.fromkeys(KICKS, ("up", "downup"))}
)
"""Qualifiers that bring a fist or foot towards the opponent, by aspect (section 3.2.2)."""

OTHERS = "others"
SHAPE: tuple[int, ...] = tuple(len(choices) for choices in QUALIFIERS.values())
CODES: int = int(np.prod(SHAPE))
"""Number of conceivable labels; codes are 0 ... CODES - 1."""


@dataclass(frozen=True, kw_only=True)
class Label:
    """What an action is: one qualifier for each of the seven aspects.

    Attributes:
        left_punch: phase of a punch with the left fist.
        right_punch: phase of a punch with the right fist.
        left_kick: phase of a kick with the left leg.
        right_kick: phase of a kick with the right leg.
        jump: take-off, landing or neither.
        react: what the opponent attacks with meanwhile.
        move: first and last supporting foot, e.g. "L-R".

    Raises:
        UnknownNameError: a qualifier is not one of the aspect's.
    """

    left_punch: str = OTHERS
    right_punch: str = OTHERS
    left_kick: str = OTHERS
    right_kick: str = OTHERS
    jump: str = OTHERS
    react: str = OTHERS
    move: str

    def __post_init__(self) -> None:
        for aspect in ASPECTS:
            check_qualifier(aspect, getattr(self, aspect))

    @property
    def indices(self) -> tuple[int, ...]:
        """Index of each aspect's qualifier in `QUALIFIERS`, seven of them."""
        return tuple(QUALIFIERS[aspect].index(getattr(self, aspect)) for aspect in ASPECTS)

    @property
    def code(self) -> int:
        """The label as one integer, 0 ... CODES - 1."""
        return int(np.ravel_multi_index(self.indices, SHAPE))

    @property
    def attacks(self) -> bool:
        """Whether a fist or foot moves towards the opponent."""
        return any(getattr(self, aspect) in names for aspect, names in ATTACKING_QUALIFIERS.items())

    @classmethod
    def from_code(cls, code: int) -> "Label":
        """The label of a code.

        Raises:
            SettingError: no such code.
        """
        return cls.from_indices(decode([code])[0])

    @classmethod
    def from_indices(cls, indices: Iterable[int]) -> "Label":
        """The label whose qualifiers have these seven indices."""
        return cls(**{aspect: QUALIFIERS[aspect][int(index)] for aspect, index in zip(ASPECTS, indices, strict=True)})

    @classmethod
    def parse(cls, text: str) -> "Label":
        """Read what `str(label)` writes: `aspect=qualifier` words in any order; aspects left out are `others`.

        Raises:
            UnknownNameError: unknown aspect or qualifier.
            SettingError: a word without `=`, an aspect twice, or no `move`.
        """
        chosen: dict[str, Any] = {}
        for word in text.split():
            aspect, equals, qualifier = word.partition("=")
            if not equals:
                raise SettingError(f"label {text!r}: {word!r} is not of the form aspect=qualifier")
            check_qualifier(aspect, qualifier)
            if aspect in chosen:
                raise SettingError(f"label {text!r}: aspect {aspect!r} given twice")
            chosen[aspect] = qualifier
        if "move" not in chosen:
            raise SettingError(f"label {text!r}: no 'move'; valid: {', '.join(QUALIFIERS['move'])}")
        return cls(**chosen)

    def __str__(self) -> str:
        """Shortest text that `parse` reads back: `others` is left out."""
        pairs = ((aspect, getattr(self, aspect)) for aspect in ASPECTS)
        return " ".join(f"{aspect}={qualifier}" for aspect, qualifier in pairs if qualifier != OTHERS)


def check_qualifier(aspect: str, qualifier: str) -> None:
    """Refuse an unknown aspect or qualifier.

    Raises:
        UnknownNameError: names the valid ones.
    """
    if aspect not in QUALIFIERS:
        raise UnknownNameError("motion aspect", aspect, ASPECTS)
    if qualifier not in QUALIFIERS[aspect]:
        raise UnknownNameError(f"qualifier of {aspect}", qualifier, QUALIFIERS[aspect])


def encode(indices: ArrayLike) -> IntArray:
    """Label codes (...) of qualifier indices (..., 7), one per aspect.

    Raises:
        SettingError: an index is out of range.
    """
    array = np.asarray(indices, dtype=np.int64)
    if array.shape[-1:] != (len(SHAPE),) or np.any(array < 0) or np.any(array >= SHAPE):
        raise SettingError(f"qualifier indices must be (..., {len(SHAPE)}) with entries below {SHAPE}")
    return np.asarray(np.ravel_multi_index(tuple(np.moveaxis(array, -1, 0)), SHAPE), dtype=np.int64)


def decode(codes: ArrayLike) -> IntArray:
    """Qualifier indices (..., 7), one per aspect, of label codes (...).

    Raises:
        SettingError: a code is out of range.
    """
    array = np.asarray(codes, dtype=np.int64)
    if np.any(array < 0) or np.any(array >= CODES):
        raise SettingError(f"label codes must lie in 0 ... {CODES - 1}")
    return np.stack(np.unravel_index(array, SHAPE), axis=-1).astype(np.int64)


def attacking(qualifiers: IntArray, aspects: Iterable[str] = (*PUNCHES, *KICKS)) -> BoolArray:
    """Whether actions bring the limb of one of some aspects towards the opponent (S,).

    Args:
        qualifiers: (S, 5 or 7) indices, one per aspect; of label codes by `decode`.
        aspects: of `PUNCHES` and `KICKS`.
    """
    limbs = [
        np.isin(qualifiers[:, ASPECTS.index(aspect)], [QUALIFIERS[aspect].index(name) for name in names])
        for aspect, names in ((aspect, ATTACKING_QUALIFIERS[aspect]) for aspect in aspects)
    ]
    return np.asarray(np.any(limbs, axis=0))


def neutral(qualifiers: IntArray) -> BoolArray:
    """Whether actions of indices (S, 5 or 7) are guard, steps or defence (S,): no punch, kick, jump, nor its way back."""
    nothing = [QUALIFIERS[aspect].index(OTHERS) for aspect in LEARNED_ASPECTS]
    return np.asarray((qualifiers[:, : len(nothing)] == nothing).all(axis=1))
