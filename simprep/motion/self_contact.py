"""A body that is in itself: which geoms may not overlap, and by how much they do."""

from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.scene import SceneSettings, scene_spec

NEIGHBOURS = 2
"""Segments at most so many joints apart may overlap: their shapes do at every bent joint."""
_SELF_BIT = 2**20


@dataclass(frozen=True)
class CollisionModel:
    """A body over the floor whose geoms collide with each other.

    Attributes:
        model: the compiled scene.
        ignored: pairs of geoms whose contact means nothing.
        pairs: pairs of the body's geoms that may not overlap, each in ascending order.
    """

    model: mujoco.MjModel
    ignored: frozenset[tuple[int, int]]
    pairs: tuple[tuple[int, int], ...]

    def is_floor(self, geom: int) -> bool:
        """Whether a geom is no part of the body."""
        return int(self.model.geom_bodyid[geom]) == 0

    def own_contacts(self, data: mujoco.MjData) -> list[int]:
        """Contacts of the body with itself that mean something, after collision detection."""
        return [
            number
            for number, (first, second) in enumerate(data.contact.geom[: data.ncon].tolist())
            if not (self.is_floor(first) or self.is_floor(second)) and (first, second) not in self.ignored
        ]


@lru_cache(maxsize=4)
def collision_model(character: Character) -> CollisionModel:
    """The body over a floor, and what of it may not overlap.

    A model that lists the pairs that collide knows best. In any other, all geoms collide but those of segments that are
    at most two joints apart, and those that overlap in the reference pose.
    """
    spec = scene_spec(SceneSettings((character,)))
    listed = len(spec.pairs) > 0
    if not listed:
        for geom in spec.geoms:
            if geom.contype and geom.parent.name != "world":
                geom.contype, geom.conaffinity = geom.contype | _SELF_BIT, geom.conaffinity | _SELF_BIT
    model = spec.compile()
    own = [] if listed else np.flatnonzero((model.geom_bodyid > 0) & (model.geom_contype > 0)).tolist()
    near = {(a, b) for a in own for b in own if _joints_apart(model, a, b) <= NEIGHBOURS}
    data = mujoco.MjData(model)
    data.qpos[:] = character.standing_qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
    overlapping = {(int(a), int(b)) for a, b in data.contact.geom[: data.ncon]}
    ignored = frozenset(near | overlapping)
    apart = (
        [sorted(pair) for pair in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist())]
        if listed
        else [[a, b] for a in own for b in own if a < b]
    )
    pairs = tuple((a, b) for a, b in apart if model.geom_bodyid[a] and not {(a, b), (b, a)} & ignored)
    return CollisionModel(model, ignored, pairs)


def own_overlap(qpos: FloatArray, character: Character) -> FloatArray:
    """Deepest overlap (T,) of a body with itself in poses (T, nq) [m]."""
    scene = collision_model(character)
    data = mujoco.MjData(scene.model)
    depth = np.zeros(len(qpos))
    for frame, pose in enumerate(qpos):
        data.qpos[:] = pose
        mujoco.mj_kinematics(scene.model, data)
        mujoco.mj_collision(scene.model, data)
        depth[frame] = max((-float(data.contact.dist[number]) for number in scene.own_contacts(data)), default=0.0)
    return depth.clip(0.0)


def _way_up(model: mujoco.MjModel, body: int) -> list[int]:
    """Ids of a body and of those that carry it, without the world."""
    way = []
    while body > 0:
        way.append(body)
        body = int(model.body_parentid[body])
    return way


def _joints_apart(model: mujoco.MjModel, first: int, second: int) -> int:
    """Number of segments on the way from one geom to another, up to the common one and down again."""
    ways = [_way_up(model, int(model.geom_bodyid[geom])) for geom in (first, second)]
    return len(set(ways[0]) ^ set(ways[1]))
