"""Who is who in a scene: which states, bodies, geoms and actuators belong to which humanoid."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.humanoid import BODIES, HINGES, N_QPOS

WORLD = -1
"""Owner of geoms that belong to no humanoid."""

IntArray = NDArray[np.intp]


@dataclass(frozen=True)
class Fighter:
    """Where one humanoid's quantities are in the arrays of a model.

    Attributes:
        number: 0 or 1, the position among the scene's bodies.
        qpos: its entries of qpos.
        qvel: its entries of qvel.
        controls: its actuators.
        bodies: its 17 model bodies, in the order of `simprep.humanoid.BODIES`.
    """

    number: int
    qpos: slice
    qvel: slice
    controls: slice
    bodies: slice


def fighter_of_scene(number: int, hinges: int = len(HINGES)) -> Fighter:
    """Layout of one humanoid of a scene made by `simprep.scene.build_scene`.

    Args:
        number: 0, or 1 for the second of two.
        hinges: hinges, and actuators, of each humanoid; fewer than all in a reduced model.
    """
    n_qpos, n_qvel, n_bodies = 7 + hinges, 6 + hinges, len(BODIES)
    return Fighter(
        number,
        slice(number * n_qpos, (number + 1) * n_qpos),
        slice(number * n_qvel, (number + 1) * n_qvel),
        slice(number * hinges, (number + 1) * hinges),
        slice(1 + number * n_bodies, 1 + (number + 1) * n_bodies),
    )


def geom_owners(model: Any) -> tuple[IntArray, IntArray]:
    """Owner and segment of every geom of a scene with one or two humanoids.

    Args:
        model: mujoco.MjModel.

    Returns:
        owner: (ngeom,) 0, 1 or `WORLD`.
        segment: (ngeom,) index in `simprep.humanoid.BODIES`, or `WORLD`.
    """
    owner, segment = np.divmod(np.asarray(model.geom_bodyid, dtype=np.intp) - 1, len(BODIES))
    world = np.asarray(model.geom_bodyid) == 0
    return np.where(world, WORLD, owner), np.where(world, WORLD, segment)


def between_fighters(contact_geoms: NDArray[Any], owner: IntArray) -> NDArray[np.bool_]:
    """Which contacts are between the two fighters.

    Args:
        contact_geoms: (ncon, 2) `data.contact.geom`.
        owner: (ngeom,) of `geom_owners`.

    Returns:
        (ncon,).
    """
    owners = owner[contact_geoms]
    return np.asarray((owners[:, 0] != owners[:, 1]) & (owners >= 0).all(axis=1))


def fighter_overlap(data: Any, owner: IntArray) -> float:
    """Depth of the deepest overlap between the fighters among the present contacts [m], 0 or more.

    Args:
        data: mujoco.MjData after collision detection.
        owner: (ngeom,) of `geom_owners`.
    """
    if not data.ncon:
        return 0.0
    distance = data.contact.dist[between_fighters(data.contact.geom, owner)]
    return max(0.0, -float(distance.min())) if len(distance) else 0.0


def place(model: Any, data: Any, qpos_a: NDArray[np.float64], qpos_b: NDArray[np.float64]) -> None:
    """Put both fighters into poses and find their contacts; velocities and forces are left alone.

    Args:
        model: mujoco.MjModel of a scene with two humanoids.
        data: its mujoco.MjData.
        qpos_a: (44,).
        qpos_b: (44,).
    """
    data.qpos[:N_QPOS], data.qpos[N_QPOS:] = qpos_a, qpos_b
    mujoco.mj_kinematics(model, data)
    mujoco.mj_collision(model, data)
