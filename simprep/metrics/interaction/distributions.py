"""How similar a fight is to the stream its model learned from: distances of distributions of actions and places."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import jensenshannon

from simprep.arrays import FloatArray, IntArray
from simprep.duel.labels.labels import ASPECTS, CODES, decode, encode
from simprep.duel.model.structures import couple, link_actions
from simprep.duel.stream.stream import DuelStream, facing_error, root_distance
from simprep.errors import MotionError, SettingError

DISTANCE_EDGES_M = np.append(np.arange(0.0, 3.0 + 1e-9, 0.1), np.inf)
"""Bins of the root distance: 0.1 m up to 3 m, and one beyond [m]."""
FACING_EDGES_DEG = np.arange(-180.0, 180.0 + 1e-9, 10.0)
"""Bins of the facing error, positive with the other to the left [deg]."""
KINDS = ("bigram", "cross_bigram", "kind_bigram", "kind_cross_bigram", "distance", "facing")
"""What is compared, in the order of reports."""
MOST_CHUNKS = 20


@dataclass(frozen=True)
class Counts:
    """How often each thing was seen: things as rising integers (K,), and how often or for how long (K,), above 0."""

    keys: IntArray
    numbers: FloatArray

    @property
    def total(self) -> float:
        """Sum of the numbers."""
        return float(self.numbers.sum())


@dataclass(frozen=True)
class Distributions:
    """What is compared of a stream or of several fights. Those of players A and B are kept apart.

    Attributes:
        bigram: (player, label, the same player's next label): the edges of G1 and G2 that were walked.
        cross_bigram: (player, the opponent's label in the last frame before, the label that the player begins then):
            the cross edges C. Fighters that ignore each other have the right bigrams and the wrong cross bigrams.
        kind_bigram: `bigram` of labels without supporting feet (`move`): some forty labels instead of hundreds, so that
            a few minutes suffice.
        kind_cross_bigram: `cross_bigram` of these.
        distance: root distance in `DISTANCE_EDGES_M` [s in each bin].
        facing: facing errors in `FACING_EDGES_DEG` [s in each bin].
    """

    bigram: Counts
    cross_bigram: Counts
    kind_bigram: Counts
    kind_cross_bigram: Counts
    distance: Counts
    facing: Counts


def distributions(stream: DuelStream, table: IntArray, codes: IntArray) -> Distributions:
    """Count a stream of two or a synthesised fight of two: labels' bigrams are those of the model, which is of pairs.

    MotionError for more than two people, actions that overlap, or none of a player.

    Args:
        stream: two people.
        table: (S, 4) player, first frame, frame after the last, clip.
        codes: (S,) label codes.
    """
    stream.check_pair()
    table = np.asarray(table, dtype=np.int64)
    graph = couple(link_actions(table[:, 0], table[:, 1], table[:, 2], codes, table[:, 3]))
    labels = graph.actions.label
    kinds = decode(labels)
    kinds[:, ASPECTS.index("move")] = 0
    steps = [graph.actions.transitions(player) for player in (0, 1)]
    bigrams = [
        _count(
            np.concatenate(
                [_key(player, kept[getattr(step, given)], kept[step.next]) for player, step in enumerate(steps)]
            )
        )
        for kept in (labels, encode(kinds))
        for given in ("current", "opponent")
    ]
    distance = np.digitize(root_distance(stream), DISTANCE_EDGES_M) - 1
    angle = np.degrees(facing_error(stream))
    facing = np.clip(np.digitize(angle, FACING_EDGES_DEG) - 1, 0, len(FACING_EDGES_DEG) - 2)
    both = facing + np.array([0, len(FACING_EDGES_DEG)])
    found = [*bigrams, _count(distance, 1 / stream.fps), _count(both.ravel(), 1 / stream.fps)]
    return Distributions(**dict(zip(KINDS, found, strict=True)))


def pooled(parts: Sequence[Distributions]) -> Distributions:
    """Counts of several fights together; SettingError without any."""
    if not parts:
        raise SettingError("no fights to count together; valid: at least one")

    def total(name: str) -> Counts:
        counts = [getattr(part, name) for part in parts]
        keys, where = np.unique(np.concatenate([one.keys for one in counts]), return_inverse=True)
        numbers = np.bincount(where, np.concatenate([one.numbers for one in counts]), len(keys))
        return Counts(keys, numbers.astype(np.float64))

    return Distributions(**{name: total(name) for name in KINDS})


def js_distance(first: Counts, second: Counts) -> float:
    """Jensen-Shannon distance (root of the divergence to base 2): 0 for equal, 1 for disjoint, NaN for empty counts.

    Args:
        first: counts of one.
        second: counts of the other.
    """
    if not first.total or not second.total:
        return float("nan")
    keys = np.union1d(first.keys, second.keys)
    shares = np.zeros((2, len(keys)))
    for row, counts in zip(shares, (first, second)):
        row[np.searchsorted(keys, counts.keys)] = counts.numbers
    # rounding may leave equal distributions below zero
    return float(np.nan_to_num(jensenshannon(shares[0], shares[1], base=2)))


def js_distances(fight: Distributions, recorded: Distributions) -> dict[str, float]:
    """Jensen-Shannon distances of a fight to a recorded stream, by `KINDS`.

    A finite sample differs from its distribution, most of all where there are many possible outcomes, such as pairs of
    labels. Compare only samples of equal size, or with `js_floor`.

    Args:
        fight: of one fight, or `pooled` from several.
        recorded: of the recorded stream.
    """
    return {name: js_distance(getattr(fight, name), getattr(recorded, name)) for name in KINDS}


def js_floor(stream: DuelStream, table: IntArray, codes: IntArray, seconds: float | None = None) -> dict[str, float]:
    """Distances by `KINDS` between two samples of a recorded stream: the score of a perfect imitation of this size.

    Args:
        stream: the recorded one.
        table: (S, 4) player, first frame, frame after the last, clip.
        codes: (S,) label codes.
        seconds: length of a fight [s]: mean over at most 20 pieces of this length, each against the rest of the stream.
            None: its two halves against each other.

    Raises:
        SettingError: pieces longer than half of the stream.
        MotionError: a piece without any whole action.
    """
    frames = len(stream)
    length = frames // 2 if seconds is None else round(seconds * stream.fps)
    if not 0 < length <= frames // 2:
        raise SettingError(
            f"pieces of {seconds:g} s; valid: above 0, up to half of the stream's {stream.duration:.0f} s"
        )
    starts = np.arange(0, frames - length + 1, length)
    if seconds is None:
        starts = starts[:1]
    elif len(starts) > MOST_CHUNKS:
        starts = starts[np.linspace(0, len(starts) - 1, MOST_CHUNKS).round().astype(int)]
    found = []
    for first in starts:
        inside, before, behind = (
            _span(stream, table, codes, *edges)
            for edges in ((first, first + length), (0, first), (first + length, frames))
        )
        rest = [part for part in (before, behind) if part is not None]
        if inside is None or not rest:
            raise MotionError(f"{stream.name}: no whole actions of both in frames {first} to {first + length - 1}")
        found.append(js_distances(inside, pooled(rest)))
    return {name: float(np.mean([one[name] for one in found])) for name in KINDS}


def _span(stream: DuelStream, table: IntArray, codes: IntArray, first: int, after: int) -> Distributions | None:
    """Counts of a part of a stream with the actions wholly in it; None where one player has none there."""
    rows = (table[:, 1] >= first) & (table[:, 2] <= after)
    if after - first < 2 or len(np.unique(table[rows, 0])) < 2:
        return None
    moved = table[rows] - np.array([0, first, first, 0])
    return distributions(stream.part(int(first), int(after)), moved, codes[rows])


def _key(player: int, first: IntArray, second: IntArray) -> IntArray:
    return np.asarray((player * CODES + first) * CODES + second)


def _count(keys: IntArray, each: float = 1.0) -> Counts:
    found, numbers = np.unique(keys, return_counts=True)
    return Counts(found.astype(np.int64), np.asarray(numbers * each, dtype=np.float64))
