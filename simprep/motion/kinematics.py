"""Segment positions, COM and foot points of whole motions."""

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from threading import get_ident

import mujoco
import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.character import Character
from simprep.geoms import bearing_points
from simprep.humanoid_model import humanoid
from simprep.motion.rotations import rotation_matrix


@dataclass(frozen=True)
class Kinematics:
    """Positions of a motion in the world frame.

    Attributes:
        xpos: (T, segments, 3) origins of the segments (their proximal joints), as ordered in `Character.segments` [m].
        xquat: (T, segments, 4) orientations of the segments, wxyz.
        xipos: (T, segments, 3) centres of mass of the segments [m].
        com: (T, 3) whole-body centre of mass [m].
        foot_points: (T, 2, soles, 3) lowest points of the left and right foot's spheres: heel, medial and lateral ball,
            toe [m].
    """

    xpos: FloatArray
    xquat: FloatArray
    xipos: FloatArray
    com: FloatArray
    foot_points: FloatArray


def forward_kinematics(qpos: FloatArray, character: Character = humanoid()) -> Kinematics:
    """Kinematics of every pose.

    Args:
        qpos: (T, nq) poses.
        character: the body.
    """
    model = character.model
    data = working_memory(model, get_ident())
    n = len(qpos)
    feet = character.sole_geoms
    results = (data.xpos, data.xquat, data.xipos, data.geom_xpos)
    flat = [result.reshape(-1) for result in results]
    ends = np.cumsum([0, *(part.size for part in flat)])
    rows = np.empty((n, ends[-1]))
    data_qpos = data.qpos
    for pose, row in zip(qpos, rows):  # one copy a frame: a kinematic synthesis spends its time here
        data_qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        np.concatenate(flat, out=row)
    parts = (rows[:, first:after] for first, after in pairwise(ends.tolist()))
    xpos, xquat, xipos, geoms = (part.reshape(n, *result.shape) for part, result in zip(parts, results))
    points = geoms[:, feet]
    points[..., 2] -= model.geom_size[feet, 0]
    xpos, xquat, xipos = (np.ascontiguousarray(part[:, 1:]) for part in (xpos, xquat, xipos))
    return Kinematics(xpos, xquat, xipos, _com(xipos, character), points)


def changed_kinematics(
    kinematics: Kinematics, qpos: FloatArray, frames: IndexArray, character: Character
) -> Kinematics:
    """Kinematics of a motion of which some frames have changed, the same bits as if computed whole.

    Args:
        kinematics: before the change, of T frames.
        qpos: (T, nq) poses.
        frames: (N,) indices of the changed frames.
        character: the body.
    """
    new = forward_kinematics(qpos[frames], character)
    arrays = {}
    for name in ("xpos", "xquat", "xipos", "foot_points"):
        arrays[name] = getattr(kinematics, name).copy()
        arrays[name][frames] = getattr(new, name)
    return replace(kinematics, com=_com(arrays["xipos"], character), **arrays)


@lru_cache(maxsize=16)
def working_memory(model: mujoco.MjModel, thread: int) -> mujoco.MjData:
    """Data that all kinematics of a model share in a thread, in any state; making one takes as long as a hundred frames."""
    return mujoco.MjData(model)


def _com(xipos: FloatArray, character: Character) -> FloatArray:
    mass = character.model.body_mass[1:]
    return np.asarray(np.einsum("b,tbi->ti", mass, xipos) / mass.sum())


def body_clearance(qpos: FloatArray, character: Character = humanoid()) -> FloatArray:
    """Height of the lowest point of each segment's geoms above z = 0 (T, segments) [m]; negative in the floor.

    Args:
        qpos: (T, nq) poses.
        character: the body.
    """
    model = character.model
    kinematics = forward_kinematics(qpos, character)
    clearance = np.full((len(qpos), model.nbody - 1), np.inf)
    rotation = rotation_matrix(kinematics.xquat)[..., 2, :]  # (T, segments, 3) third row of each
    for geom in range(model.ngeom):
        if model.geom_contype[geom] == 0:
            continue
        part = model.geom_bodyid[geom] - 1
        row = rotation[:, part]
        if model.geom_type[geom] not in (mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE):
            turn = rotation_matrix(model.geom_quat[geom])
            for point, radius in bearing_points(model, geom):
                low = kinematics.xpos[:, part, 2] + row @ (model.geom_pos[geom] + turn @ point) - radius
                clearance[:, part] = np.minimum(clearance[:, part], low)
            continue
        centre = kinematics.xpos[:, part, 2] + row @ model.geom_pos[geom]
        axis = rotation_matrix(model.geom_quat[geom])[:, 2]
        half = model.geom_size[geom, 1]  # 0 for spheres
        low = centre - np.abs(row @ axis) * half - model.geom_size[geom, 0]
        clearance[:, part] = np.minimum(clearance[:, part], low)
    return clearance
