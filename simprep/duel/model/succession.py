"""Which labels can follow at all, by what the two ruled aspects mean (2008 paper, section 3.2).

`react` says what the opponent attacks with when the action begins; `move` begins on the foot on which the own last
action ended. Both follow from the two labels given, whatever the fighters choose.
"""

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import BoolArray
from simprep.duel.labels.labels import ASPECTS, ATTACKING_QUALIFIERS, KICKS, QUALIFIERS, decode

ENDINGS = 3
"""`move` counts first foot times last foot: L, R, F."""


def may_follow(own: ArrayLike, opponent: ArrayLike, candidates: ArrayLike) -> BoolArray:
    """Whether candidates agree with what `react` and `move` mean after the codes (...) of both labels: (..., K)."""
    mine, theirs, following = decode(own), decode(opponent), decode(candidates)
    kick = np.zeros(theirs.shape[:-1], dtype=bool)
    punch = kick.copy()
    for aspect, names in ATTACKING_QUALIFIERS.items():
        attacks = np.isin(theirs[..., ASPECTS.index(aspect)], [QUALIFIERS[aspect].index(name) for name in names])
        if aspect in KICKS:
            kick |= attacks
        else:
            punch |= attacks
    choices = QUALIFIERS["react"]
    react = np.where(kick, choices.index("kick"), np.where(punch, choices.index("punch"), choices.index("others")))
    move = ASPECTS.index("move")
    same_foot = following[:, move] // ENDINGS == mine[..., None, move] % ENDINGS
    return np.asarray((following[:, ASPECTS.index("react")] == react[..., None]) & same_foot)
