"""Shapes of geoms: the points of them that touch a plane first."""

from itertools import product

import mujoco
import numpy as np

from simprep.arrays import FloatArray


def bearing_points(model: mujoco.MjModel, geom: int) -> list[tuple[FloatArray, float]]:
    """Points of a geom that touch a plane first: centre (3,) in the geom's frame and radius of each [m].

    A capsule has its ends, a box its corners, a cylinder 8 points of each rim, an ellipsoid its 6 poles, a mesh the
    corners of its bounding box.

    Args:
        model: a model.
        geom: id of a geom.
    """
    size, kind, shapes = model.geom_size[geom], model.geom_type[geom], mujoco.mjtGeom
    if kind == shapes.mjGEOM_SPHERE:
        return [(np.zeros(3), float(size[0]))]
    if kind == shapes.mjGEOM_CAPSULE:
        return [(np.array([0.0, 0.0, end]), float(size[0])) for end in (-size[1], size[1])]
    if kind == shapes.mjGEOM_CYLINDER:
        angle = np.arange(8) * np.pi / 4
        return [
            (np.array([size[0] * np.cos(at), size[0] * np.sin(at), end]), 0.0)
            for at in angle
            for end in (-size[1], size[1])
        ]
    if kind == shapes.mjGEOM_ELLIPSOID:
        return [(sign * size[axis] * np.eye(3)[axis], 0.0) for axis in range(3) for sign in (-1.0, 1.0)]
    middle, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    return [(middle + half * signs, 0.0) for signs in np.array(list(product((-1.0, 1.0), repeat=3)))]
