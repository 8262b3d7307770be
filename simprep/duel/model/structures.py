"""The coupled motion transition graph: action list B, graphs G1 and G2, cross edges C and action table R.

Source: the 2008 paper, section 3.3. Players are numbered 0 and 1; "own" is the one that chooses its next action (the
paper's player 1), whichever it is, and "opponent" the other.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simprep.arrays import BoolArray, IntArray
from simprep.duel.labels.labels import ATTACKING_QUALIFIERS, CODES, KICKS, PUNCHES, QUALIFIERS, decode
from simprep.errors import MotionError, UnknownNameError

PLAYERS = (0, 1)
NONE = -1
"""Link of an action that has no next or no concurrent action."""

REQUESTS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "punch": PUNCHES,
        "kick": KICKS,
        **{aspect.replace("_", " "): (aspect,) for aspect in (*PUNCHES, *KICKS)},
        "jump": ("jump",),
    }
)
"""Kinds of attack that a user may ask for, or a jump, and the aspects that answer (section 5.2)."""

ANSWERING_QUALIFIERS: Mapping[str, tuple[str, ...]] = MappingProxyType({**ATTACKING_QUALIFIERS, "jump": ("up",)})
"""Qualifiers that answer a request, by aspect."""


@dataclass(frozen=True)
class ActionList:
    """B: the actions of both players, doubly linked. Sorted by player, then by first frame. Read-only.

    Attributes:
        player: (A,) 0 or 1.
        start: (A,) first frame of the action in the stream.
        end: (A,) the frame at which the next action begins, one past the last.
        label: (A,) label code (`simprep.duel.labels.labels`).
        clip: (A,) number of its clip.
        next: (A,) the same player's next action, -1 at the end of a clip or before a gap.
        concurrent: (A,) what the other player is doing in the action's last frame, -1 where unknown. Where both change
            at the same frame this is the other's old action: neither knows what the other is about to choose.
    """

    player: IntArray
    start: IntArray
    end: IntArray
    label: IntArray
    clip: IntArray
    next: IntArray
    concurrent: IntArray

    def __len__(self) -> int:
        return len(self.player)

    def of(self, player: int) -> IntArray:
        """Actions of one player, in order of time."""
        return np.flatnonzero(self.player == player)

    def transitions(self, player: int) -> "Transitions":
        """The training set of a player (section 4.2, D1 or D2): changes of action whose surroundings are known."""
        actions = self.of(player)
        actions = actions[(self.next[actions] != NONE) & (self.concurrent[actions] != NONE)]
        return Transitions(actions, self.concurrent[actions], self.next[actions])


@dataclass(frozen=True)
class Transitions:
    """Changes of action of one player, as indices of actions in B.

    Attributes:
        current: (N,) the own action that ends.
        opponent: (N,) what the opponent is doing then.
        next: (N,) the own action that begins.
    """

    current: IntArray
    opponent: IntArray
    next: IntArray

    def __len__(self) -> int:
        return len(self.current)

    def subset(self, rows: NDArray[np.integer]) -> "Transitions":
        """The transitions in the given rows."""
        return Transitions(self.current[rows], self.opponent[rows], self.next[rows])


@dataclass(frozen=True)
class TransitionGraph:
    """G1 or G2: the complete directed graph over a player's groups of equally labelled actions.

    Attributes:
        player: 0 or 1.
        labels: (K,) label code of each node, ascending.
        node: (A,) node of each action in B, -1 for the other player's actions.
        counts: (K, K) how often the stream learned from goes from node to node.
    """

    player: int
    labels: IntArray
    node: IntArray
    counts: IntArray

    def __len__(self) -> int:
        return len(self.labels)

    def members(self, node: int) -> IntArray:
        """Actions in B that belong to a node."""
        return np.flatnonzero(self.node == node)


@dataclass(frozen=True)
class ActionTable:
    """R: from every valid (player, aspect, qualifier) to the ascending numbers of the nodes that carry it."""

    nodes: Mapping[tuple[int, str, str], IntArray]

    def answering(self, player: int, request: str) -> IntArray:
        """Nodes that answer a request such as "kick" or "left punch": the limb goes to the opponent; or "jump": up.

        Raises:
            UnknownNameError: not one of `REQUESTS`.
        """
        if request not in REQUESTS:
            raise UnknownNameError("requested action", request, REQUESTS)
        found = [
            self.nodes[player, aspect, qualifier]
            for aspect in REQUESTS[request]
            for qualifier in ANSWERING_QUALIFIERS[aspect]
        ]
        return np.unique(np.concatenate(found))


@dataclass(frozen=True)
class CoupledGraph:
    """The coupled motion transition graph (B, G1, G2, C, R).

    Attributes:
        actions: B.
        graphs: (G1, G2).
        cross_counts: C. Entry p is (nodes of the opponent, nodes of player p): how often player p begins an action of
            the second node while the opponent is in the first.
        table: R.
    """

    actions: ActionList
    graphs: tuple[TransitionGraph, TransitionGraph]
    cross_counts: tuple[IntArray, IntArray]
    table: ActionTable


def link_actions(player: ArrayLike, start: ArrayLike, end: ArrayLike, label: ArrayLike, clip: ArrayLike) -> ActionList:
    """Make B from labelled segments given in any order.

    Args:
        player: (A,) 0 or 1.
        start: (A,) first frame of each segment, counted over the whole stream.
        end: (A,) one past its last frame; the start of the same player's next segment, unless there is a gap.
        label: (A,) label codes.
        clip: (A,) clip numbers. No link crosses from one clip into another.

    Raises:
        MotionError: arrays of unequal length, unknown players or codes, empty, overlapping or disordered segments,
            or a player without any.
    """
    columns = [np.atleast_1d(np.asarray(column)) for column in (player, start, end, label, clip)]
    if len({column.shape for column in columns}) != 1 or columns[0].ndim != 1:
        raise MotionError(f"segments: columns of shapes {[column.shape for column in columns]}; valid: equal lengths")
    if any(not np.issubdtype(column.dtype, np.integer) for column in columns):
        raise MotionError("segments: players, frames, label codes and clips must be integers")
    player, start, end, label, clip = (column.astype(np.int64) for column in columns)
    for who in PLAYERS:
        if not np.any(player == who):
            raise MotionError(f"segments: none of player {who}; valid: actions of both players")
    _refuse(~np.isin(player, PLAYERS), player, start, "unknown player")
    _refuse((start < 0) | (end <= start), player, start, "it must end after it begins, at frame 0 or later")
    _refuse((label < 0) | (label >= CODES), player, start, f"label codes must lie in 0 ... {CODES - 1}")

    order = np.lexsort((start, player))
    player, start, end, label, clip = (column[order] for column in (player, start, end, label, clip))
    same = player[1:] == player[:-1]
    _refuse(np.append(same & (end[:-1] > start[1:]), False), player, start, "it overlaps the player's next")
    # each frame belongs to one clip, so clip numbers rise within a player
    _refuse(np.append(same & (clip[1:] < clip[:-1]), False), player, start, "clip numbers fall after it")

    following = np.full(len(player), NONE)
    joined = np.flatnonzero(same & (end[:-1] == start[1:]) & (clip[:-1] == clip[1:]))
    following[joined] = joined + 1

    concurrent = np.full(len(player), NONE)
    for who in PLAYERS:
        own, other = np.flatnonzero(player == who), np.flatnonzero(player != who)
        last = end[own] - 1
        candidate = other[np.maximum(np.searchsorted(start[other], last, side="right") - 1, 0)]
        covers = (start[candidate] <= last) & (last < end[candidate]) & (clip[candidate] == clip[own])
        concurrent[own[covers]] = candidate[covers]
    for column in (player, start, end, label, clip, following, concurrent):
        column.setflags(write=False)
    return ActionList(player, start, end, label, clip, following, concurrent)


def couple(actions: ActionList) -> CoupledGraph:
    """Make G1, G2, C and R from B."""
    labels = [np.unique(actions.label[actions.of(player)]) for player in PLAYERS]
    nodes = [
        np.where(actions.player == player, np.searchsorted(labels[player], actions.label), NONE) for player in PLAYERS
    ]
    graphs, crossing = [], []
    for player in PLAYERS:
        step = actions.transitions(player)
        begun = nodes[player][step.next]
        counts = np.zeros((len(labels[player]),) * 2, dtype=np.int64)
        np.add.at(counts, (nodes[player][step.current], begun), 1)
        cross = np.zeros((len(labels[1 - player]), len(labels[player])), dtype=np.int64)
        np.add.at(cross, (nodes[1 - player][step.opponent], begun), 1)
        graphs.append(TransitionGraph(player, labels[player], nodes[player], counts))
        crossing.append(cross)

    table = {}
    for player in PLAYERS:
        indices = decode(labels[player])
        for column, (aspect, qualifiers) in enumerate(QUALIFIERS.items()):
            for index, qualifier in enumerate(qualifiers):
                table[player, aspect, qualifier] = np.flatnonzero(indices[:, column] == index)
    return CoupledGraph(
        actions, (graphs[0], graphs[1]), (crossing[0], crossing[1]), ActionTable(MappingProxyType(table))
    )


def _refuse(bad: BoolArray, player: IntArray, start: IntArray, why: str) -> None:
    if bad.any():
        first = int(np.argmax(bad))
        raise MotionError(f"segment of player {player[first]} that begins at frame {start[first]}: {why}")
