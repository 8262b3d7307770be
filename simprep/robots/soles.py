"""Soles of a robot: the spheres under its feet, found from the geoms of the feet where the model has no suitable ones."""

import mujoco
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from simprep.arrays import FloatArray
from simprep.geoms import bearing_points

MOST_POINTS = 6
"""Most spheres under a foot."""
RADIUS = 0.005
"""Radius of spheres under boxes and meshes, whose edges are sharp [m]."""
LEVEL = 0.012
"""Points up to this height above a foot's lowest one belong to its sole [m]."""


def sole_outline(
    model: mujoco.MjModel, data: mujoco.MjData, foot: int, geoms: list[int], radius: float | None
) -> tuple[FloatArray, float]:
    """Centres (N, 3) of spheres in the frame of a foot, which touch the floor where its geoms do [m], and their radius [m].

    They are the corners of the convex outline of the foot's lowest points, without the least ones (see
    `simplified`). Spheres and capsules keep their radius; corners of boxes and meshes move inwards by the spheres'.

    Args:
        model: the robot.
        data: in the reference pose, upright on a level floor.
        foot: body id of the foot.
        geoms: ids of its geoms.
        radius: of the spheres; None to choose it.

    Raises:
        ValueError: fewer than three points that are not on one line.
    """
    points = np.array([[*centre, own] for geom in geoms for centre, own in _support(model, data, geom)])
    points = points[points[:, 2] - points[:, 3] < (points[:, 2] - points[:, 3]).min() + LEVEL]
    lowest = float((points[:, 2] - points[:, 3]).min())
    if radius is None:
        radius = float(points[:, 3].min()) or RADIUS
    middle = (points[:, :2].min(axis=0) + points[:, :2].max(axis=0)) / 2
    inset = radius - points[:, 3:]
    plan = points[:, :2] - np.sign(points[:, :2] - middle) * inset
    try:
        corners = plan[ConvexHull(plan).vertices]
    except (QhullError, ValueError):
        raise ValueError("fewer than three points that are not on one line") from None
    centres = np.column_stack([corners, np.full(len(corners), lowest + radius)])
    turn = data.xmat[foot].reshape(3, 3)
    return np.asarray((centres - data.xpos[foot]) @ turn), radius


def simplified(corners: FloatArray, most: int) -> FloatArray:
    """A convex polygon (N, 3) without the corners whose removal costs the least area, until `most` are left."""
    while len(corners) > most:
        before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
        area = np.linalg.norm(np.cross(corners - before, after - before), axis=1)
        corners = np.delete(corners, int(area.argmin()), axis=0)
    return corners


def _support(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> list[tuple[FloatArray, float]]:
    """Points of a geom that touch the floor first, in the world, and the radius about each [m]."""
    place, turn = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
    mesh = int(model.geom_dataid[geom])
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH and mesh >= 0:
        first = int(model.mesh_vertadr[mesh])
        vertices = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])]
        return [(place + turn @ vertex, 0.0) for vertex in vertices]
    return [(place + turn @ centre, radius) for centre, radius in bearing_points(model, geom)]
