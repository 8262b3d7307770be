"""A body that is in itself: which geoms may not overlap, and arms moved out of the body.

Foreign skeletons have thinner limbs, or none: an arm that brushes a person's side is in a robot's.
"""

from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import BoolArray, FloatArray
from simprep.character import SIDES, Character
from simprep.scene import SceneSettings, scene_spec

NEIGHBOURS = 2
"""Segments at most so many joints apart may overlap: their shapes do at every bent joint."""
_SELF_BIT = 2**20
ALLOWED_M = 0.002
"""Overlap that is left alone [m]."""
PASSES = 6
"""How often the arms are moved out and the change smoothed."""
STEPS = 8
"""Largest number of Gauss-Newton steps of a frame in a pass."""
SMOOTHING_S = 0.05
"""Standard deviation of the Gaussian over the change of angles [s]."""
DAMPING = 1e-4
LARGEST_STEP = 0.2
"""Largest turn of a joint in one step [rad]."""
_TINY = 1e-12


@dataclass(frozen=True)
class CollisionModel:
    """A body over the floor whose geoms collide with each other.

    Attributes:
        model: the compiled scene.
        ignored: pairs of geoms whose contact means nothing.
    """

    model: mujoco.MjModel
    ignored: frozenset[tuple[int, int]]

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
    return CollisionModel(model, frozenset(near | overlapping))


def arms_apart(
    qpos: FloatArray, fps: float, character: Character, cyclic: bool = False
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Poses (T, nq) whose arms are out of the rest of the body as far as can be, and the overlap (T,) before and after [m].

    Only joints of the arms move, as little as they must; the change is smooth in time. Legs that are in each other stay,
    as their feet stand where they are meant to.

    Args:
        qpos: (T, nq) poses.
        fps: frames per second [1/s].
        character: the body.
        cyclic: the last frame is followed by the first.
    """
    scene = collision_model(character)
    data = mujoco.MjData(scene.model)
    arms = _arm_joints(character)
    before = _overlap(scene, data, qpos)
    out, depth = qpos.copy(), before
    low, high = character.limits.T
    for _ in range(PASSES):
        if depth.max(initial=0.0) <= ALLOWED_M or not arms.any():
            break
        change = np.zeros((len(out), arms.sum()))
        for frame in np.flatnonzero(depth > ALLOWED_M):
            change[frame] = _apart(scene, data, out[frame], arms, character) - out[frame, 7:][arms]
        smooth = gaussian_filter1d(change, SMOOTHING_S * fps, axis=0, mode="wrap" if cyclic else "nearest")
        # smoothing lowers a peak: what it loses is given back, up to twice what is left; the next pass does the rest
        lost = np.abs(change).max(axis=0) / np.maximum(np.abs(smooth).max(axis=0), _TINY)
        angles = out[:, 7:][:, arms] + lost.clip(1.0, 2.0) * smooth
        out[:, 7 + np.flatnonzero(arms)] = np.clip(angles, low[arms], high[arms])
        depth = _overlap(scene, data, out)
    return out, before, depth


def _overlap(scene: CollisionModel, data: mujoco.MjData, qpos: FloatArray) -> FloatArray:
    """Deepest overlap (T,) of the body with itself [m]."""
    depth = np.zeros(len(qpos))
    for frame, pose in enumerate(qpos):
        data.qpos[:] = pose
        mujoco.mj_kinematics(scene.model, data)
        mujoco.mj_collision(scene.model, data)
        depth[frame] = max((-float(data.contact.dist[number]) for number in scene.own_contacts(data)), default=0.0)
    return depth.clip(0.0)


def _apart(
    scene: CollisionModel, data: mujoco.MjData, pose: FloatArray, arms: BoolArray, character: Character
) -> FloatArray:
    """Angles of the arms' joints that end the overlap of one pose, or lessen it [rad]."""
    model, columns = scene.model, 6 + np.flatnonzero(arms)
    pose, (low, high) = pose.copy(), character.limits[arms].T
    jacobian = np.zeros((2, 3, model.nv))
    for _ in range(STEPS):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_collision(model, data)
        rows, depths = [], []
        for number in scene.own_contacts(data):
            contact = data.contact[number]
            for geom, out in zip(contact.geom, jacobian):
                mujoco.mj_jac(model, data, out, None, contact.pos, int(model.geom_bodyid[geom]))
            row = contact.frame[:3] @ (jacobian[1] - jacobian[0])[:, columns]
            if -contact.dist > ALLOWED_M / 2 and np.abs(row).max() > 1e-3:
                rows.append(row)
                depths.append(-contact.dist)
        if not rows:
            break
        response = np.array(rows)
        step = response.T @ np.linalg.solve(response @ response.T + DAMPING * np.eye(len(rows)), depths)
        step *= min(1.0, LARGEST_STEP / np.abs(step).max())
        pose[1 + columns] = np.clip(pose[1 + columns] + step, low, high)
    return np.asarray(pose[7:][arms])


def _arm_joints(character: Character) -> BoolArray:
    """Which hinges (joints,) move one arm against the trunk: those between the arm's end and what carries both arms."""
    model = character.model
    ends = [
        next(
            character.segment(f"{side}_{role}")
            for role in ("hand", "forearm", "upper_arm")
            if character.has(f"{side}_{role}")
        )
        for side in SIDES
    ]
    left, right = (set(_way_up(model, 1 + end)) for end in ends)
    return np.isin(model.jnt_bodyid[1:], list(left ^ right))


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
