"""Which of a player's candidate labels attack, react or answer a request, as masks.

Source: the 2008 paper, sections 3.2 and 3.3 (the action table R). Masks go by label codes, so they also fit models that
have learned from a part of the stream, with fewer candidates than the graph has nodes.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import BoolArray, IntArray
from simprep.duel.labels.labels import ASPECTS, KICKS, PUNCHES, QUALIFIERS, SHAPE, attacking, decode, neutral
from simprep.duel.model.structures import CoupledGraph
from simprep.duel.model.transition_model import TransitionModel

_REACT = ASPECTS.index("react")
_RULES = int(np.prod(SHAPE[_REACT:]))
KICK, PUNCH, OTHERS = (QUALIFIERS["react"].index(name) for name in ("kick", "punch", "others"))


def kind_of(codes: ArrayLike) -> IntArray:
    """The five learned aspects of label codes (...) as one number: codes that differ by `react` and `move` share it."""
    return np.asarray(codes, dtype=np.int64) // _RULES


@cache
def reaction_to(code: int) -> int:
    """Index of the qualifier of `react` of an action begun while the opponent does this."""
    qualifiers = decode([code])
    if attacking(qualifiers, KICKS)[0]:
        return KICK
    return PUNCH if attacking(qualifiers, PUNCHES)[0] else OTHERS


@dataclass(frozen=True)
class LabelMasks:
    """What a player's candidate labels (K,) are.

    Attributes:
        codes: label codes.
        attacks: whether a fist or foot goes to the opponent.
        neutral: see `labels.neutral`.
        react: index of the qualifier of `react`.
    """

    codes: IntArray
    attacks: BoolArray
    neutral: BoolArray
    react: IntArray

    @classmethod
    def of(cls, model: TransitionModel) -> "LabelMasks":
        """Masks of a player's model."""
        codes = model.labels.candidates
        qualifiers = decode(codes)
        return cls(codes, attacking(qualifiers), neutral(qualifiers), qualifiers[:, _REACT])


def narrowed(*masks: BoolArray) -> BoolArray:
    """The first mask, and each of the following that leaves a candidate."""
    result = masks[0]
    for mask in masks[1:]:
        if (result & mask).any():
            result = result & mask
    return result


def seen_successions(graph: CoupledGraph, player: int) -> frozenset[tuple[int, int]]:
    """Which kind of action (`kind_of`) follows which in a player's examples."""
    steps = graph.actions.transitions(player)
    kinds = kind_of(graph.actions.label)
    return frozenset(zip(kinds[steps.current].tolist(), kinds[steps.next].tolist()))
