"""How deep two fighters are in each other: frame by frame, from poses alone."""

from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from simprep.errors import MotionError
from simprep.humanoid import N_QPOS, Body
from simprep.physics.fighters import fighter_overlap, geom_owners, place
from simprep.scene import SceneSettings, build_scene


def fighter_penetration(qpos_a: ArrayLike, qpos_b: ArrayLike, bodies: tuple[Body, Body]) -> NDArray[np.float64]:
    """Depth of the deepest overlap between a geom of A and a geom of B in every frame.

    The geoms are those that collide in simulation; the depth of two capsules is the sum of their radii less the distance
    of their axes.

    Args:
        qpos_a: (T, 44) poses of A.
        qpos_b: (T, 44) poses of B at the same times.
        bodies: statures and masses of A and B.

    Returns:
        (T,) [m], 0 where they do not overlap.

    Raises:
        MotionError: not the same number of frames, or not poses of the humanoid.
    """
    a, b = np.asarray(qpos_a, dtype=np.float64), np.asarray(qpos_b, dtype=np.float64)
    if a.shape != b.shape or a.ndim != 2 or a.shape[1] != N_QPOS:
        raise MotionError(f"poses of two fighters must both be (T, {N_QPOS}); these are {a.shape} and {b.shape}")
    model, owner = _scene(bodies)
    data = mujoco.MjData(model)
    depth = np.zeros(len(a))
    for frame in range(len(a)):
        place(model, data, a[frame], b[frame])
        depth[frame] = fighter_overlap(data, owner)
    return depth


@lru_cache(maxsize=4)
def _scene(bodies: tuple[Body, Body]) -> tuple[Any, NDArray[np.intp]]:
    model = build_scene(SceneSettings(bodies))
    return model, geom_owners(model)[0]
