"""Where two fighters overlap, and which overlaps an attack intended: from poses, without physics."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.character import SIDES, Character
from simprep.duel.fight.hits import ARMS, striking_aspect
from simprep.duel.labels.labels import ATTACKING_QUALIFIERS, attacking, decode
from simprep.duel.stream.stream import DuelStream
from simprep.metrics.interaction.reactions import check_table
from simprep.motion.contacts import stances
from simprep.physics.bodies import geom_owners, scene_bodies
from simprep.physics.contacts import BodyContact
from simprep.physics.overlap import between_bodies, place
from simprep.scene import SceneSettings, build_scene

GROUPS = ("trunk", "left arm", "right arm", "left leg", "right leg")
"""Parts of a body that count as one when contacts are counted."""
GAP_S = 0.1
"""Contacts of the same parts less than this apart are one [s]."""


@dataclass(frozen=True)
class Overlaps:
    """Which segments of A and B overlap when; one row per pair of segments and frame.

    Attributes:
        frames: number of frames looked at.
        frame: (N,) rising.
        segments: (N, 2) of A and of B, indices into their characters' `segments`.
        depth: (N,) of the deepest pair of their geoms, above 0 [m].
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
    """Attacks that land on trunk, head or legs, contacts that no attack meant, attacks that land on arms alone."""

    intended: int
    unintended: int
    blocked: int


def overlaps(stream: DuelStream) -> Overlaps:
    """All overlaps of two people's geoms that collide in simulation (`simprep.physics.overlap`), by segment."""
    a, b = stream.players
    model = build_scene(SceneSettings((a.character, b.character)))
    bodies = scene_bodies(model, (a.character, b.character))
    owner, segment = geom_owners(model, bodies)
    data = mujoco.MjData(model)
    count_a, count_b = len(a.character.segments), len(b.character.segments)
    keys, depths = [], []
    for frame in range(len(stream)):
        place(model, data, bodies, (a.qpos[frame], b.qpos[frame]))
        if not data.ncon:
            continue
        found = between_bodies(data.contact.geom, owner) & (data.contact.dist < 0)
        if not found.any():
            continue
        geoms = data.contact.geom[found]
        swapped = owner[geoms[:, 0]] == 1
        pairs = segment[np.where(swapped[:, None], geoms[:, ::-1], geoms)]
        keys.append((frame * count_a + pairs[:, 0]) * count_b + pairs[:, 1])
        depths.append(-data.contact.dist[found])
    if not keys:
        return Overlaps(len(stream), np.empty(0, np.int64), np.empty((0, 2), np.int64), np.empty(0))
    rows, where = np.unique(np.concatenate(keys), return_inverse=True)
    depth = np.zeros(len(rows))
    np.maximum.at(depth, where, np.concatenate(depths))
    frames, rest = np.divmod(rows.astype(np.int64), count_a * count_b)
    return Overlaps(len(stream), frames, np.stack(np.divmod(rest, count_b), axis=1), depth)


def recorded_contacts(contacts: Sequence[BodyContact], stream: DuelStream) -> Overlaps:
    """Contacts that a simulation recorded, on the frames of a fight; a short contact is on one frame at least.

    Args:
        contacts: of the run.
        stream: both fighters, as far as they were simulated.
    """
    rows, frames, fps = [], len(stream), stream.fps
    names_a, names_b = (motion.character.segments for motion in stream.players)
    for one in contacts:
        first, last = (min(int(fps * time), frames - 1) for time in (one.start_s, one.start_s + one.duration_s))
        pair = names_a.index(one.parts[0]), names_b.index(one.parts[1])
        rows += [(frame, *pair, one.depth) for frame in range(first, last + 1)]
    table = np.array(sorted(rows), dtype=np.float64).reshape(-1, 4)
    return Overlaps(frames, table[:, 0].astype(np.int64), table[:, 1:3].astype(np.int64), table[:, 3])


def count_hits(found: Overlaps, stream: DuelStream, table: IntArray, codes: IntArray, grace_s: float = 0.0) -> Hits:
    """Hits, by attacks: of poses (`overlaps`), where nothing stops a limb, or of a simulation (`recorded_contacts`).

    Striking segments are those of `simprep.duel.fight.hits`: hand and forearm, foot and shank. An attack *lands*, once,
    if one touches the opponent between its first frame and that in which the attacker's next action begins: `intended`
    on trunk, head or legs, `blocked` on arms alone. Contacts are counted by pairs of trunk, arms and legs, and are one
    if less than 0.1 s apart. Contacts without a frame that an attack meant are `unintended`.

    Args:
        found: what touches.
        stream: two people.
        table: (S, 4) player, first frame, frame after the last, clip.
        codes: (S,) label codes.
        grace_s: an attack may land this much after its end [s]; `hits.GRACE_S` for simulated limbs, which come late.

    Raises:
        MotionError: not the table of this stream.
    """
    table = np.asarray(table, dtype=np.int64)
    check_table(table, codes, stream.bounds)
    intended = blocked = unintended = 0
    meant = np.zeros(len(found.frame), dtype=bool)
    characters = [motion.character for motion in stream.players]
    is_arm = [np.isin(one.parts, ARMS) for one in characters]
    qualifiers = decode(codes)
    for aspect in ATTACKING_QUALIFIERS:
        striking = [np.array([striking_aspect(part) == aspect for part in one.parts]) for one in characters]
        for player, start, end, clip in table[attacking(qualifiers, (aspect,))]:
            last = min(end + round(grace_s * stream.fps), stream.bounds[clip, 1] - 1)
            rows = slice(*np.searchsorted(found.frame, [start, last + 1]))
            strikes = striking[player][found.segments[rows, player]]
            arms = is_arm[1 - player][found.segments[rows, 1 - player]]
            intended += bool((strikes & ~arms).any())
            blocked += bool(strikes.any() and arms[strikes].all())
            meant[rows] |= strikes
    gap = round(GAP_S * stream.fps)
    groups = np.stack([_groups(one)[found.segments[:, player]] for player, one in enumerate(characters)], axis=1)
    for pair in np.unique(groups, axis=0):
        own = (groups == pair).all(axis=1)
        touching, wanted = np.zeros((2, found.frames), dtype=bool)
        touching[found.frame[own]] = True
        wanted[found.frame[own & meant]] = True
        for first, after in stream.bounds:
            unintended += _contacts(touching[first:after], wanted[first:after], gap)
    return Hits(intended, unintended, blocked)


def _groups(character: Character) -> IntArray:
    """Index (segments,) into `GROUPS` of each segment."""
    limbs = {
        **dict.fromkeys(("upper_arm", "forearm", "hand"), "arm"),
        **dict.fromkeys(("thigh", "shank", "foot"), "leg"),
    }
    group = {f"{side}_{part}": GROUPS.index(f"{side} {limb}") for side in SIDES for part, limb in limbs.items()}
    return np.array([group.get(part, 0) for part in character.parts], dtype=np.int64)


def _contacts(touching: BoolArray, meant: BoolArray, gap: int) -> int:
    """Number of contacts without a frame in which an attack meant them."""
    runs: list[tuple[int, int]] = []
    for first, after in stances(touching):
        if runs and first - runs[-1][1] < gap:
            runs[-1] = (runs[-1][0], after)
        else:
            runs.append((first, after))
    return sum(not meant[first:after].any() for first, after in runs)
