"""Body positions, COM and foot points of whole motions, computed by MuJoCo frame by frame."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.character import Character
from simprep.humanoid import humanoid
from simprep.motion.rotations import rotation_matrix


@dataclass(frozen=True)
class Kinematics:
    """Positions of a motion in the world frame.

    Attributes:
        xpos: (T, segments, 3) origins of the segments (their proximal joints), in the order of `Character.segments` [m].
        xquat: (T, segments, 4) orientations of the bodies, wxyz.
        xipos: (T, segments, 3) centres of mass of the bodies [m].
        com: (T, 3) whole-body centre of mass [m].
        foot_points: (T, 2, soles, 3) lowest points of the foot spheres: left, right x heel, medial and lateral ball, toe [m].
    """

    xpos: NDArray[np.float64]
    xquat: NDArray[np.float64]
    xipos: NDArray[np.float64]
    com: NDArray[np.float64]
    foot_points: NDArray[np.float64]


def foot_geom_ids(character: Character = humanoid()) -> NDArray[np.intp]:
    """Geom ids of the soles (2, N) in the model of the character alone."""
    return character.sole_geoms


def forward_kinematics(qpos: NDArray[np.float64], character: Character = humanoid()) -> Kinematics:
    """Kinematics of every pose.

    Args:
        qpos: (T, nq) poses.
        character: the humanoid.

    Returns:
        Kinematics with T frames.
    """
    model = character.model
    data = mujoco.MjData(model)
    n = len(qpos)
    xpos = np.empty((n, model.nbody - 1, 3))
    xquat = np.empty((n, model.nbody - 1, 4))
    xipos = np.empty((n, model.nbody - 1, 3))
    feet = character.sole_geoms
    geoms = np.empty((n, *feet.shape, 3))
    data_qpos, data_xpos, data_xquat = data.qpos, data.xpos, data.xquat
    data_xipos, data_geom = data.xipos, data.geom_xpos
    for frame in range(n):
        data_qpos[:] = qpos[frame]
        mujoco.mj_kinematics(model, data)
        xpos[frame] = data_xpos[1:]
        xquat[frame] = data_xquat[1:]
        xipos[frame] = data_xipos[1:]
        geoms[frame] = data_geom[feet]
    mass = model.body_mass[1:]
    geoms[..., 2] -= model.geom_size[feet, 0]
    return Kinematics(xpos, xquat, xipos, np.einsum("b,tbi->ti", mass, xipos) / mass.sum(), geoms)


def body_clearance(qpos: NDArray[np.float64], character: Character = humanoid()) -> NDArray[np.float64]:
    """Height of the lowest point of each body's geoms above z = 0.

    Args:
        qpos: (T, nq) poses.
        character: the humanoid.

    Returns:
        (T, segments) [m]; negative in the floor.
    """
    model = character.model
    kinematics = forward_kinematics(qpos, character)
    clearance = np.full((len(qpos), model.nbody - 1), np.inf)
    rotation = rotation_matrix(kinematics.xquat)[..., 2, :]  # (T, segments, 3) third row of each rotation matrix
    for geom in range(model.ngeom):
        if model.geom_contype[geom] == 0:
            continue
        part = model.geom_bodyid[geom] - 1
        row = rotation[:, part]
        centre = kinematics.xpos[:, part, 2] + row @ model.geom_pos[geom]
        axis = rotation_matrix(model.geom_quat[geom])[:, 2]
        half = model.geom_size[geom, 1]  # 0 for spheres: the humanoid has spheres and capsules only
        low = centre - np.abs(row @ axis) * half - model.geom_size[geom, 0]
        clearance[:, part] = np.minimum(clearance[:, part], low)
    return clearance
