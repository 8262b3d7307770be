"""How deep bodies are in each other, by the contacts of a state or by poses alone."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.character import Character
from simprep.errors import MotionError
from simprep.physics.bodies import SceneBody, geom_owners, scene_bodies
from simprep.scene import SceneSettings, build_scene


def between_bodies(contact_geoms: NDArray[Any], owner: IndexArray) -> BoolArray:
    """Which contacts (ncon,) are between two different bodies.

    Args:
        contact_geoms: (ncon, 2) `data.contact.geom`.
        owner: (ngeom,) of `simprep.physics.bodies.geom_owners`.
    """
    owners = owner[contact_geoms]
    return np.asarray((owners[:, 0] != owners[:, 1]) & (owners >= 0).all(axis=1))


def deepest_overlap(data: mujoco.MjData, owner: IndexArray) -> float:
    """Depth of the deepest overlap between two bodies among the present contacts, 0 or more [m].

    Args:
        data: after collision detection.
        owner: (ngeom,) of `simprep.physics.bodies.geom_owners`.
    """
    if not data.ncon:
        return 0.0
    distance = data.contact.dist[between_bodies(data.contact.geom, owner)]
    return max(0.0, -float(distance.min())) if len(distance) else 0.0


def place(model: mujoco.MjModel, data: mujoco.MjData, bodies: Sequence[SceneBody], poses: Sequence[FloatArray]) -> None:
    """Put every body into a pose and find the contacts; `data` keeps its velocities and forces.

    Args:
        model: of the scene.
        data: of the model; changed.
        bodies: of the scene.
        poses: qpos of each.
    """
    for character, pose in zip(bodies, poses, strict=True):
        data.qpos[character.qpos] = pose
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)


def overlap_of_poses(poses: Sequence[ArrayLike], bodies: Sequence[Character]) -> FloatArray:
    """Depth (T,) of the deepest overlap between colliding geoms of two different bodies, 0 where none overlap [m].

    The depth of two capsules is the sum of their radii less the distance of their axes.

    Args:
        poses: (T, nq) of each body at the same times.
        bodies: who they are.

    Raises:
        MotionError: not the same number of frames for each body, or not poses of it.
    """
    each = [np.asarray(one, dtype=np.float64) for one in poses]
    model, layout, owner = _scene(tuple(bodies))
    widths = [character.qpos.stop - character.qpos.start for character in layout]
    if [one.shape for one in each] != [(len(each[0]), width) for width in widths]:
        valid = ", ".join(f"(T, {width})" for width in widths)
        raise MotionError(f"poses have shapes {', '.join(str(one.shape) for one in each)}; valid: {valid}")
    depth = np.zeros(len(each[0]))
    if len(each) == 1:
        return depth
    data = mujoco.MjData(model)
    for frame in range(len(depth)):
        place(model, data, layout, [one[frame] for one in each])
        depth[frame] = deepest_overlap(data, owner)
    return depth


@lru_cache(maxsize=4)
def _scene(bodies: tuple[Character, ...]) -> tuple[mujoco.MjModel, tuple[SceneBody, ...], IndexArray]:
    model = build_scene(SceneSettings(bodies))
    layout = scene_bodies(model, bodies)
    return model, layout, geom_owners(model, layout)[0]
