"""The two aspects that follow from rules: what an action reacts to, and the feet on which it begins and ends.

Source: the 2008 paper, section 3.2.2.
"""

import numpy as np

from simprep.arrays import BoolArray, IntArray
from simprep.duel.labels.labels import KICKS, PUNCHES, QUALIFIERS, attacking
from simprep.errors import MotionError

LEFT, RIGHT, FLIGHT = 0, 1, 2
SYMBOLS = ("L", "R", "F")


def react_rule(table: IntArray, qualifiers: IntArray) -> IntArray:
    """Index (S,) into `QUALIFIERS["react"]` of each action: the opponent's attack under way when the action began.

    Under way is what the opponent does in the frame before (for a clip's first action: in its first frame), since an
    attack that begins at the same frame cannot have been reacted to. Kicks go before punches.

    Args:
        table: (S, 4) as from `Cuts.table`.
        qualifiers: (S, 5) indices of the learned aspects of the same actions.

    Raises:
        MotionError: the other player has no action at that time.
    """
    kick, punch, others = (QUALIFIERS["react"].index(name) for name in ("kick", "punch", "others"))
    kind_of = np.where(attacking(qualifiers, PUNCHES), punch, others)
    kind_of[attacking(qualifiers, KICKS)] = kick
    out = np.empty(len(table), dtype=np.int64)
    for player in range(2):
        own, other = np.flatnonzero(table[:, 0] == player), np.flatnonzero(table[:, 0] != player)
        if not len(other):
            raise MotionError("actions of one player only; reactions need both")
        frame = table[own, 1] - 1
        first = np.append(True, table[own[1:], 3] != table[own[:-1], 3])
        frame[first] += 1
        concurrent = other[np.maximum(np.searchsorted(table[other, 1], frame, side="right") - 1, 0)]
        wrong = (table[concurrent, 3] != table[own, 3]) | (table[concurrent, 2] <= frame)
        if wrong.any():
            raise MotionError(f"no action of the other player at frame {frame[int(np.argmax(wrong))]}")
        out[own] = kind_of[concurrent]
    return out


def stance_symbols(contacts: BoolArray, bounds: IntArray) -> IntArray:
    """Supporting foot (T,) from contacts (T, 2): `LEFT`, `RIGHT` or `FLIGHT`.

    Both feet count as the nearer single stance, or the earlier of two. A clip (row of `bounds`) without any: left.
    """
    symbols = np.where(contacts[:, 0], LEFT, np.where(contacts[:, 1], RIGHT, FLIGHT)).astype(np.int64)
    feet = contacts.sum(axis=1)
    double, single = feet == 2, feet == 1
    for first, after in bounds:
        known = np.flatnonzero(single[first:after]) + first
        asked = np.flatnonzero(double[first:after]) + first
        if not len(known) or not len(asked):
            continue
        place = np.searchsorted(known, asked)
        before, behind = known[np.maximum(place - 1, 0)], known[np.minimum(place, len(known) - 1)]
        symbols[asked] = np.where(np.abs(asked - before) <= np.abs(behind - asked), symbols[before], symbols[behind])
    return symbols


def move_rule(table: IntArray, contacts: tuple[BoolArray, BoolArray], bounds: IntArray) -> IntArray:
    """Index (S,) into `QUALIFIERS["move"]` of each action (S, 4) of `Cuts.table`: its first and last supporting foot.

    The last is taken in the frame in which the next action begins, so an action begins on the foot the one before ended
    on. `contacts` (T, 2) are of each player, `bounds` as of `Cuts`.
    """
    symbols = np.stack([stance_symbols(contact, bounds) for contact in contacts])
    player, start, end, clip = table.T
    last = np.minimum(end, bounds[clip, 1] - 1)
    of = {name: index for index, name in enumerate(QUALIFIERS["move"])}
    codes = np.array([[of[f"{a}-{b}"] for b in SYMBOLS] for a in SYMBOLS], dtype=np.int64)
    return np.asarray(codes[symbols[player, start], symbols[player, last]])
