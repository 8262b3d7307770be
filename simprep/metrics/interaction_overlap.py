"""Where two fighters are inside each other, and which of it an attack meant: from poses, without physics."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.duel.labels import ATTACKING_QUALIFIERS
from simprep.duel.stream import DuelStream
from simprep.humanoid import BODIES, SIDES
from simprep.metrics.interaction_reactions import check_table, limb_attacks
from simprep.motion.contacts import stances
from simprep.physics.fighters import between_fighters, geom_owners, place
from simprep.scene import SceneSettings, build_scene

GROUPS = ("trunk", "left arm", "right arm", "left leg", "right leg")
"""Parts of a body that count as one when contacts are counted."""
GAP_S = 0.1
"""Contacts of the same parts this near in time are one [s]."""

IntArray = NDArray[np.int64]
FloatArray = NDArray[np.float64]


def _group(segment: str) -> int:
    side, _, part = segment.partition("_")
    if side not in SIDES:
        return 0
    limb = "arm" if part in ("upper_arm", "forearm", "hand") else "leg"
    return GROUPS.index(f"{side} {limb}")


GROUP_OF = np.array([_group(name) for name in BODIES])
"""(17,) group of each segment."""
STRIKING = {
    f"{side}_{aspect}": tuple(BODIES.index(f"{side}_{part}") for part in parts)
    for aspect, parts in (("punch", ("hand", "forearm")), ("kick", ("foot", "shank")))
    for side in SIDES
}
"""Segments that an attack is meant to land with, by aspect."""


@dataclass(frozen=True)
class Overlaps:
    """Which segments of A and B overlap when; one row per pair of segments and frame.

    Attributes:
        frames: number of frames looked at.
        frame: (N,) rising.
        segments: (N, 2) of A and of B, indices into `BODIES`.
        depth: (N,) of the deepest pair of geoms of these segments, above 0 [m].
    """

    frames: int
    frame: IntArray
    segments: IntArray
    depth: FloatArray

    @property
    def deepest(self) -> FloatArray:
        """(T,) deepest overlap of every frame, 0 where there is none [m]."""
        out = np.zeros(self.frames)
        np.maximum.at(out, self.frame, self.depth)
        return out


@dataclass(frozen=True)
class Hits:
    """Contacts between fighters by what was meant.

    Attributes:
        intended: attacks that land on trunk, head or legs.
        blocked: attacks that land on nothing but arms.
        unintended: other contacts.
    """

    intended: int
    unintended: int
    blocked: int


def overlaps(stream: DuelStream) -> Overlaps:
    """Find all overlaps of the geoms that collide in simulation (`simprep.physics.pair_penetration`, by segment).

    Args:
        stream: two people.
    """
    a, b = stream.players
    model = build_scene(SceneSettings((a.body, b.body)))
    owner, segment = geom_owners(model)
    data = mujoco.MjData(model)
    keys, depths = [], []
    for frame in range(len(stream)):
        place(model, data, a.qpos[frame], b.qpos[frame])
        if not data.ncon:
            continue
        found = between_fighters(data.contact.geom, owner) & (data.contact.dist < 0)
        if not found.any():
            continue
        geoms = data.contact.geom[found]
        swapped = owner[geoms[:, 0]] == 1
        pairs = segment[np.where(swapped[:, None], geoms[:, ::-1], geoms)]
        keys.append((frame * len(BODIES) + pairs[:, 0]) * len(BODIES) + pairs[:, 1])
        depths.append(-data.contact.dist[found])
    if not keys:
        return Overlaps(len(stream), np.empty(0, np.int64), np.empty((0, 2), np.int64), np.empty(0))
    rows, where = np.unique(np.concatenate(keys), return_inverse=True)
    depth = np.zeros(len(rows))
    np.maximum.at(depth, where, np.concatenate(depths))
    frames, rest = np.divmod(rows.astype(np.int64), len(BODIES) ** 2)
    return Overlaps(len(stream), frames, np.stack(np.divmod(rest, len(BODIES)), axis=1), depth)


def kinematic_hits(found: Overlaps, stream: DuelStream, table: IntArray, codes: IntArray) -> Hits:
    """Hits as poses show them, where nothing stops a limb.

    An attack *lands* if, between its first frame and that in which the attacker's next action begins, the hand or forearm
    of the punching arm, or the foot or shank of the kicking leg, overlaps the opponent: `intended` on trunk, head or a
    leg, `blocked` on arms alone. An attack lands once; a double strike is one or two attacks, as it was labelled.
    Every other contact is `unintended`: contacts are counted by pairs of trunk, arms and legs, those less than
    0.1 s apart as one, and a contact during which either of its limbs attacks in any frame belongs to that attack.

    Args:
        found: from `overlaps`.
        stream: two people.
        table: (S, 4) player, first frame, frame after the last, clip.
        codes: (S,) label codes.

    Raises:
        MotionError: not the table of this stream.
    """
    table = np.asarray(table, dtype=np.int64)
    check_table(table, codes, stream.bounds)
    groups = GROUP_OF[found.segments]
    landed = {"intended": 0, "blocked": 0}
    limb_in_attack = np.zeros((found.frames, 2, len(GROUPS)), dtype=bool)
    for aspect in ATTACKING_QUALIFIERS:
        segments = STRIKING[aspect]
        for player, start, end, clip in table[limb_attacks(codes, aspect)]:
            last = min(end, stream.bounds[clip, 1] - 1)
            limb_in_attack[start : last + 1, player, GROUP_OF[segments[0]]] = True
            rows = slice(*np.searchsorted(found.frame, [start, last + 1]))
            touched = groups[rows, 1 - player][np.isin(found.segments[rows, player], segments)]
            if len(touched):
                arms = np.isin(touched, (GROUPS.index("left arm"), GROUPS.index("right arm")))
                landed["blocked" if arms.all() else "intended"] += 1
    gap, unintended = round(GAP_S * stream.fps), 0
    for own in range(len(GROUPS)):
        for theirs in range(len(GROUPS)):
            touching = np.zeros(found.frames, dtype=bool)
            touching[found.frame[(groups == (own, theirs)).all(axis=1)]] = True
            if not touching.any():
                continue
            meant = limb_in_attack[:, 0, own] | limb_in_attack[:, 1, theirs]
            for first, after in stream.bounds:
                unintended += _contacts(touching[first:after], meant[first:after], gap)
    return Hits(landed["intended"], unintended, landed["blocked"])


def _contacts(touching: NDArray[np.bool_], meant: NDArray[np.bool_], gap: int) -> int:
    """Number of contacts without a frame in which an attack meant them."""
    runs: list[tuple[int, int]] = []
    for first, after in stances(touching):
        if runs and first - runs[-1][1] < gap:
            runs[-1] = (runs[-1][0], after)
        else:
            runs.append((first, after))
    return sum(not meant[first:after].any() for first, after in runs)
