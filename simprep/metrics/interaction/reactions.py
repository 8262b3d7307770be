"""Who attacks, and how much of it is answered, by the table of actions and their labels alone."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.duel.labels.labels import attacking, decode, neutral
from simprep.errors import MotionError
from simprep.metrics.balance import mean

ANSWER_S = 0.5
"""Time from the beginning of an attack within which an answer must begin [s]."""
SHIFTS = 40
"""Number of shifts in time that estimate the level of chance."""
LEAST_SHIFT_S = 2.0
"""A smaller shift might leave answers where they were [s]."""


@dataclass(frozen=True)
class Reactions:
    """Attacks and their answers; tuples have a number for each player.

    Attributes:
        attacks_per_min: attacks that each player begins per minute [1/min].
        attacks: number of attacks that count: those of which the time for an answer lies within the clip.
        answered_share: share of them that are answered; NaN without any.
        answered_by: share of the attacks of all others that a player answers; NaN without any.
        chance_share: share that would be answered by coincidence.
        delay_s: median time from the beginning of an answered attack to that of its answer [s]; NaN without any.
    """

    attacks_per_min: tuple[float, ...]
    attacks: int
    answered_share: float
    answered_by: tuple[float, ...]
    chance_share: float
    delay_s: float


def reactions(table: IntArray, codes: IntArray, bounds: NDArray[np.integer], fps: float, players: int) -> Reactions:
    """Attacks per minute, and the share that is answered by a fitting reaction within 0.5 s.

    An *attack* is an action whose label sends a fist or foot to an opponent; one that repeats at once is two. Labels do
    not say to whom, so all other players are its opponents. It is
    *answered* if one of them begins a *fitting* action in one of the frames start + 1 ... min(start + 0.5 s, end).
    start is the attack's first frame, where both choose at once; in frame end the attacker's next action begins.
    Fitting are neutral actions and attacks (`Truth.fitting` of the built-in examples), but not a limb on its way back,
    a landing or a jump. One action may answer two attacks.

    Labels cannot tell a block from footwork that happens to begin then, so random fighters score as well.
    `chance_share` says how much: the share answered when the others' actions are shifted in time around the clip,
    mean of 40 even shifts of at least 2 s. Who begins more actions has a higher level of chance, and so have more
    players; coupling adds the difference.

    Args:
        table: (S, 4) player, first frame, frame after the last, clip.
        codes: (S,) label codes.
        bounds: (clips, 2) first frame of every clip and the frame after its last.
        fps: frames per second [1/s].
        players: how many there are.

    Raises:
        MotionError: table and codes of different lengths, or not the table of these clips.
    """
    table, codes = np.asarray(table, dtype=np.int64), np.asarray(codes, dtype=np.int64)
    check_table(table, codes, bounds, players)
    qualifiers = decode(codes)
    attack = attacking(qualifiers)
    fitting = attack | neutral(qualifiers)
    minutes = float(np.sum(np.diff(bounds, axis=1) - 1)) / fps / 60
    per_minute = [float(np.sum(attack & (table[:, 0] == player)) / minutes) for player in range(players)]
    hits, chance, delays = [], [], []
    by: list[list[BoolArray]] = [[] for _ in range(players)]
    for clip, (first, after) in enumerate(bounds):
        inside = table[:, 3] == clip
        for player in range(players):
            rows = np.flatnonzero(inside & attack & (table[:, 0] == player))
            start = table[rows, 1]
            last = np.minimum(start + round(ANSWER_S * fps), table[rows, 2])
            start, last = start[last < after], last[last < after]
            # whoever begins with the clip does not answer
            may_answer = inside & fitting & (table[:, 0] != player) & (table[:, 1] > first)
            begun, answers = np.sort(table[may_answer, 1]), _answers(start, last)
            answered, delay = answers(begun)
            hits.append(answered)
            delays.append(delay / fps)
            for other in range(players):
                if other != player:
                    own = np.sort(table[may_answer & (table[:, 0] == other), 1])
                    by[other].append(answers(own)[0])
            chance.append(_chance(start, last, begun, int(first), int(after), fps))
    answered, known = np.concatenate(hits), np.concatenate(delays)
    return Reactions(
        tuple(per_minute),
        len(answered),
        mean(answered),
        tuple(mean(np.concatenate(one)) for one in by),
        mean(np.concatenate(chance)),
        float(np.median(known)) if len(known) else float("nan"),
    )


def check_table(table: IntArray, codes: IntArray, bounds: NDArray[np.integer], players: int) -> None:
    """Refuse a table of actions that is not one of these clips.

    Args:
        table: (S, 4) player, first frame, frame after the last, clip.
        codes: (S,) label codes.
        bounds: (clips, 2) first frame of every clip and the frame after its last.
        players: how many there are.

    Raises:
        MotionError: wrong shapes, players, clips, or actions beyond their clip.
    """
    if table.ndim != 2 or table.shape[1] != 4 or codes.shape != table.shape[:1]:
        raise MotionError(f"table of actions {table.shape} with {codes.shape} labels; valid: (S, 4) and (S,)")
    player, start, end, clip = table.T
    bad = (player < 0) | (player >= players) | (clip < 0) | (clip >= len(bounds)) | (end <= start)
    if not bad.any():
        bad = (start < bounds[clip, 0]) | (end > bounds[clip, 1])
    if bad.any():
        raise MotionError(
            f"action {[int(value) for value in table[int(np.argmax(bad))]]} is not one of {len(bounds)} clips"
        )


def _answers(start: IntArray, last: IntArray) -> Callable[[IntArray], tuple[BoolArray, IntArray]]:
    """Which attacks are answered by actions that begin at given rising frames, and after how many frames."""

    def found(begun: IntArray) -> tuple[BoolArray, IntArray]:
        if not len(begun):
            return np.zeros(len(start), dtype=bool), np.empty(0, dtype=np.int64)
        place = np.searchsorted(begun, start, side="right")
        frame = begun[np.minimum(place, len(begun) - 1)]
        answered = (place < len(begun)) & (frame <= last)
        return answered, (frame - start)[answered]

    return found


def _chance(start: IntArray, last: IntArray, begun: IntArray, first: int, after: int, fps: float) -> FloatArray:
    """Share of the shifts at which each attack is answered; empty where the clip is too short to shift."""
    length, least = after - first, round(LEAST_SHIFT_S * fps)
    if length < 3 * least:
        return np.empty(0)
    answers = _answers(start, last)
    total = np.zeros(len(start))
    for shift in np.linspace(least, length - least, SHIFTS).astype(np.int64):
        total += answers(np.sort(first + (begun - first + shift) % length))[0]
    return total / SHIFTS
