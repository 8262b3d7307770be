"""How far strikes miss, and who reacts to a blow."""

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.arrays import FloatArray, IndexArray, IntArray
from simprep.duel.fight.falls import BLOW_NS, Blow
from simprep.duel.fight.fight import Fight
from simprep.duel.fight.hits import GRACE_S
from simprep.duel.fight.strikes import striking_segments, struck_segments
from simprep.duel.labels.labels import ASPECTS, QUALIFIERS, attacking, decode
from simprep.motion.motion import Motion
from simprep.physics.bodies import geom_owners, scene_bodies
from simprep.physics.overlap import place
from simprep.scene import SceneSettings, build_scene

FAR_M = 1.0
"""Larger distances are not told apart [m]."""
ANSWER_S = 0.5
"""Who is struck reacts within this time of the first touch [s]."""
_REACT = ASPECTS.index("react")
_OTHERS = QUALIFIERS["react"].index("others")


def strike_misses(
    players: Sequence[Motion], bounds: NDArray[np.integer], table: IntArray, codes: IntArray
) -> FloatArray:
    """(N,) by how much each attack misses [m]: 0 where it touches.

    It is the least distance, from the attack's first frame until 0.1 s after its last, between what strikes (hand and
    forearm, foot and shank) and the head, trunk and legs of the opponents, all other fighters. Attacks that meet an arm alone are left out: they
    are blocked. Captures range and timing; hides where on the body a strike lands.

    Args:
        players: motions of the fighters at the same times.
        bounds: (clips, 2) first frame of every clip and the frame after its last.
        table: (S, 4) player, first frame, frame after the last, clip.
        codes: (S,) label codes.
    """
    characters = tuple(motion.character for motion in players)
    model = build_scene(SceneSettings(characters))
    bodies = scene_bodies(model, characters)
    owner, segment = geom_owners(model, bodies)
    solid = model.geom_contype > 0
    data = mujoco.MjData(model)
    meant = np.zeros(len(owner), dtype=bool)
    for number, one in enumerate(characters):
        meant |= (owner == number) & np.isin(segment, struck_segments(one))
    rows = []
    for (player, start, end, clip), code in zip(table, codes, strict=True):
        if not attacking(decode([code]))[0]:
            continue
        limbs = striking_segments(characters[player], int(code))
        own = np.flatnonzero(solid & (owner == player) & np.isin(segment, limbs))
        theirs = solid & (owner >= 0) & (owner != player)
        aims, arms = np.flatnonzero(theirs & meant), np.flatnonzero(theirs & ~meant)
        last = min(end + round(GRACE_S * players[0].fps), int(bounds[clip, 1]))
        nearest, block = FAR_M, FAR_M
        for frame in range(start, last):
            place(model, data, bodies, [motion.qpos[frame] for motion in players])
            nearest = min(nearest, _least(model, data, own, aims, nearest))
            block = min(block, _least(model, data, own, arms, block))
        if nearest <= 0 or block > 0:
            rows.append(max(nearest, 0.0))
    return np.array(rows, dtype=np.float64)


def _least(model: mujoco.MjModel, data: mujoco.MjData, own: IndexArray, others: IndexArray, below: float) -> float:
    """Least distance between two sets of geoms, if below a bound; else about the bound [m]."""
    least = below
    size = model.geom_rbound
    for one in own:
        near = np.linalg.norm(data.geom_xpos[others] - data.geom_xpos[one], axis=1) - size[others] - size[one] < least
        for other in others[near]:
            least = min(least, mujoco.mj_geomDistance(model, data, int(one), int(other), max(least, 1e-3), None))
    return least


def reacted_share(found: Sequence[Blow], fight: Fight) -> tuple[float, int]:
    """Share of the blows of 5 N s or more whose receiver reacts, and how many there are; NaN without any.

    A reaction is an action that begins within 0.5 s of the first touch, attacks nobody, and is labelled as one to a
    punch or a kick, or chosen because of the blow (`FightAction.note`).
    """
    hard = [one for one in found if one.impulse_ns >= BLOW_NS]
    reacting = []
    for blow in hard:
        answers = [
            one
            for one in fight.of(blow.player)
            if 0 <= one.start / fight.stream.fps - blow.start_s <= ANSWER_S and _reacts(one.label, one.note)
        ]
        reacting.append(bool(answers))
    return (float(np.mean(reacting)) if reacting else float("nan")), len(hard)


def _reacts(label: int, note: str) -> bool:
    qualifiers = decode([label])
    return note == "reacts" or bool(qualifiers[0, _REACT] != _OTHERS and not attacking(qualifiers)[0])
