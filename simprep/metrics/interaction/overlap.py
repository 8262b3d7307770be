"""Where fighters overlap, and which overlaps an attack intended: from poses, without physics."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.character import SIDES, Character
from simprep.duel.fight.hits import ARMS, striking_aspect
from simprep.duel.labels.labels import ATTACKING_QUALIFIERS, attacking, decode
from simprep.metrics.interaction.reactions import check_table
from simprep.motion.contacts import stances
from simprep.motion.motion import Motion
from simprep.physics.bodies import geom_owners, scene_bodies
from simprep.physics.contacts import BodyContact
from simprep.physics.overlap import between_bodies, place
from simprep.scene import SceneSettings, build_scene

T = TypeVar("T", bound=np.generic)

GROUPS = ("trunk", "left arm", "right arm", "left leg", "right leg")
"""Parts of a body that count as one when contacts are counted."""
GAP_S = 0.1
"""Contacts of the same parts less than this apart are one [s]."""


@dataclass(frozen=True)
class Overlaps:
    """Which segments of which fighters overlap when; one row per pair of segments and frame.

    Attributes:
        frames: number of frames looked at.
        frame: (N,) rising.
        bodies: (N, 2) numbers of the two fighters, the lower one first.
        segments: (N, 2) of these two, indices into their characters' `segments`.
        depth: (N,) of the deepest pair of their geoms, above 0 [m].
    """

    frames: int
    frame: IntArray
    bodies: IntArray
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


def overlaps(players: Sequence[Motion]) -> Overlaps:
    """All overlaps of fighters' geoms that collide in simulation (`simprep.physics.overlap`), by segment.

    Args:
        players: motions of the fighters at the same times.
    """
    characters, frames = tuple(motion.character for motion in players), len(players[0])
    model = build_scene(SceneSettings(characters))
    layout = scene_bodies(model, characters)
    owner, segment = geom_owners(model, layout)
    data = mujoco.MjData(model)
    shape = (frames, len(players), len(players), *[max(len(one.segments) for one in characters)] * 2)
    keys, depths = [], []
    for frame in range(frames):
        place(model, data, layout, [motion.qpos[frame] for motion in players])
        if not data.ncon:
            continue
        found = between_bodies(data.contact.geom, owner) & (data.contact.dist < 0)
        if not found.any():
            continue
        geoms = data.contact.geom[found]
        swapped = owner[geoms[:, 0]] > owner[geoms[:, 1]]
        geoms = np.where(swapped[:, None], geoms[:, ::-1], geoms)
        at = (np.full(len(geoms), frame), *owner[geoms].T, *segment[geoms].T)
        keys.append(np.ravel_multi_index(at, shape))
        depths.append(-data.contact.dist[found])
    if not keys:
        none = np.empty((0, 2), np.int64)
        return Overlaps(frames, none[:, 0], none, none, np.empty(0))
    rows, where = np.unique(np.concatenate(keys), return_inverse=True)
    depth = np.zeros(len(rows))
    np.maximum.at(depth, where, np.concatenate(depths))
    at_frame, *rest = np.unravel_index(rows, shape)
    return Overlaps(frames, at_frame, np.stack(rest[:2], axis=1), np.stack(rest[2:], axis=1), depth)


def recorded_contacts(
    contacts: Sequence[BodyContact], characters: Sequence[Character], frames: int, fps: float
) -> Overlaps:
    """Contacts that a simulation recorded, on the frames of a fight; a short contact is on one frame at least.

    Args:
        contacts: of the run.
        characters: the fighters.
        frames: of the fight, as far as it was simulated.
        fps: of the fight [1/s].
    """
    rows = []
    for one in contacts:
        first, last = (min(int(fps * time), frames - 1) for time in (one.start_s, one.start_s + one.duration_s))
        pair = (characters[body].segments.index(part) for body, part in zip(one.bodies, one.parts, strict=True))
        found = (*one.bodies, *pair, one.depth)
        rows += [(frame, *found) for frame in range(first, last + 1)]
    table = np.array(sorted(rows), dtype=np.float64).reshape(-1, 6)
    whole = table[:, :5].astype(np.int64)
    return Overlaps(frames, whole[:, 0], whole[:, 1:3], whole[:, 3:5], table[:, 5])


def count_hits(
    found: Overlaps,
    characters: Sequence[Character],
    fps: float,
    bounds: NDArray[np.integer],
    table: IntArray,
    codes: IntArray,
    grace_s: float = 0.0,
) -> Hits:
    """Hits, by attacks: of poses (`overlaps`), where nothing stops a limb, or of a simulation (`recorded_contacts`).

    Striking segments are those of `simprep.duel.fight.hits`: hand and forearm, foot and shank. An attack *lands*, once,
    if one touches an opponent, which is every other fighter, between its first frame and that in which the attacker's
    next action begins: `intended` on trunk, head or legs, `blocked` on arms alone. Contacts are counted by pairs of trunk,
    arms and legs, and are one if less than 0.1 s apart. Contacts without a frame that an attack meant are `unintended`.

    Args:
        found: what touches.
        characters: the fighters.
        fps: of the frames [1/s].
        bounds: (clips, 2) first frame of every clip and the frame after its last.
        table: (S, 4) player, first frame, frame after the last, clip.
        codes: (S,) label codes.
        grace_s: an attack may land this much after its end [s]; `hits.GRACE_S` for simulated limbs, which come late.

    Raises:
        MotionError: not the table of these fighters and clips.
    """
    table = np.asarray(table, dtype=np.int64)
    check_table(table, codes, bounds, len(characters))
    intended = blocked = unintended = 0
    meant = np.zeros(len(found.frame), dtype=bool)
    is_arm = _by_segment([np.isin(one.parts, ARMS) for one in characters])
    qualifiers = decode(codes)
    for aspect in ATTACKING_QUALIFIERS:
        striking = _by_segment(
            [np.array([striking_aspect(part) == aspect for part in one.parts]) for one in characters]
        )
        for player, start, end, clip in table[attacking(qualifiers, (aspect,))]:
            last = min(end + round(grace_s * fps), bounds[clip, 1] - 1)
            rows = slice(*np.searchsorted(found.frame, [start, last + 1]))
            bodies, segments = found.bodies[rows], found.segments[rows]
            own = bodies == player
            strikes = (own & striking[bodies, segments]).any(axis=1)
            arms = (~own & is_arm[bodies, segments]).any(axis=1)
            intended += bool((strikes & ~arms).any())
            blocked += bool(strikes.any() and arms[strikes].all())
            meant[rows] |= strikes
    gap = round(GAP_S * fps)
    groups = _by_segment([_groups(one) for one in characters])[found.bodies, found.segments]
    touched = np.concatenate([found.bodies, groups], axis=1)
    for pair in np.unique(touched, axis=0):
        own = (touched == pair).all(axis=1)
        touching, wanted = np.zeros((2, found.frames), dtype=bool)
        touching[found.frame[own]] = True
        wanted[found.frame[own & meant]] = True
        for first, after in bounds:
            unintended += _contacts(touching[first:after], wanted[first:after], gap)
    return Hits(intended, unintended, blocked)


def _by_segment(values: Sequence[NDArray[T]]) -> NDArray[T]:
    """What is known of the segments of each fighter in one array (fighters, most segments), 0 where one has fewer."""
    out = np.zeros((len(values), max(len(one) for one in values)), dtype=values[0].dtype)
    for row, one in zip(out, values):
        row[: len(one)] = one
    return out


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
