"""Meshes of a character's segments for a viewer that knows triangles only."""

from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.arrays import FloatArray, IndexArray
from simprep.character import Character
from simprep.errors import MissingExtraError
from simprep.scene import Obstacle

VISIBLE_GROUPS = 3
"""Geoms of the groups 0 to 2 are what MuJoCo's own viewer shows. A segment without such a geom shows the others."""
CELL_DIGITS = 2
"""Vertices of a mesh file are merged where they agree to so many decimals of a metre: a robot fits in a small file."""
SMALL_M = 0.03
"""Balls up to this radius, such as the soles', are drawn with a quarter of the triangles [m]."""
ROUND = 12
"""Sides of a capsule or cylinder."""

Mesh = tuple[NDArray[np.float32], NDArray[np.uint32]]
"""Vertices (V, 3) [m] and triangles (F, 3)."""


def load_trimesh() -> Any:
    """The library of shapes; MissingExtraError where it is not installed."""
    try:
        import trimesh
    except ImportError:
        raise MissingExtraError("a replay", "report") from None
    return trimesh


@lru_cache(maxsize=8)
def segment_meshes(character: Character) -> tuple[Mesh, ...]:
    """The visible shape of each segment in its own frame, as ordered in `Character.segments`; empty where it has none.

    Mesh files are shown with their vertices merged on a grid of 1 cm.
    """
    return tuple(_joined(shapes) for shapes in _visible_shapes(character, ROUND))


@lru_cache(maxsize=8)
def segment_hulls(character: Character, around: int = ROUND) -> tuple[Mesh, ...]:
    """As `segment_meshes`, the convex hull of each: a fraction of the triangles, without dents and what is inside.

    Args:
        character: whose segments.
        around: sides of a capsule or cylinder; fewer than `ROUND` make balls coarser too.
    """
    return tuple(
        _joined([load_trimesh().util.concatenate(shapes).convex_hull] if shapes else [])
        for shapes in _visible_shapes(character, around)
    )


def _visible_shapes(character: Character, around: int) -> list[list[Any]]:
    """Of each segment, what it is made of and shown."""
    model = character.model

    def shown(body: int) -> list[int]:
        geoms = np.flatnonzero(model.geom_bodyid == body)
        visible = geoms[model.geom_group[geoms] < VISIBLE_GROUPS]
        return [int(geom) for geom in (visible if len(visible) else geoms)]

    found = [[geom_mesh(model, geom, around) for geom in shown(body)] for body in range(1, model.nbody)]
    return [[mesh for mesh in shapes if mesh is not None and len(mesh.faces)] for shapes in found]


def geom_mesh(model: mujoco.MjModel, geom: int, around: int = ROUND) -> Any:
    """The shape of a geom in its body's frame, a `trimesh.Trimesh`; of a plane or a height field None.

    Args:
        model: the geom's.
        geom: its id.
        around: sides of a capsule or cylinder; fewer than `ROUND` make balls coarser too.
    """
    shapes = mujoco.mjtGeom
    kind, size = model.geom_type[geom], model.geom_size[geom]
    if kind == shapes.mjGEOM_MESH:
        mesh = _coarse(*_mesh_arrays(model, int(model.geom_dataid[geom])))
    else:
        mesh = _primitive(kind, size, around)
    if mesh is not None:
        mesh.apply_transform(_transform(model.geom_pos[geom], model.geom_quat[geom]))
    return mesh


def obstacle_mesh(obstacle: Obstacle) -> Mesh:
    """An obstacle around its own centre."""
    shapes = mujoco.mjtGeom
    kind = shapes.mjGEOM_SPHERE if obstacle.ball else shapes.mjGEOM_BOX
    return _joined([_primitive(kind, np.array(obstacle.half_size))])


def _primitive(kind: int, size: FloatArray, around: int = ROUND) -> Any:
    trimesh, shapes = load_trimesh(), mujoco.mjtGeom
    fine = 2 if around >= ROUND else 1
    if kind == shapes.mjGEOM_SPHERE:
        return trimesh.creation.icosphere(subdivisions=fine if size[0] > SMALL_M else 1, radius=size[0])
    if kind == shapes.mjGEOM_ELLIPSOID:
        mesh = trimesh.creation.icosphere(subdivisions=fine, radius=1.0)
        mesh.apply_scale(size)
        return mesh
    if kind == shapes.mjGEOM_CAPSULE:
        mesh = trimesh.creation.capsule(height=2 * size[1], radius=size[0], count=[around, around])
        mesh.apply_translation([0, 0, -mesh.bounds.mean(axis=0)[2]])
        return mesh
    if kind == shapes.mjGEOM_CYLINDER:
        return trimesh.creation.cylinder(radius=size[0], height=2 * size[1], sections=around)
    return trimesh.creation.box(extents=2 * size) if kind == shapes.mjGEOM_BOX else None


def _mesh_arrays(model: mujoco.MjModel, mesh: int) -> tuple[FloatArray, IndexArray]:
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return model.mesh_vert[first : first + count], model.mesh_face[face : face + faces]


def _coarse(vertices: FloatArray, faces: IndexArray) -> Any:
    mesh = load_trimesh().Trimesh(vertices=vertices, faces=faces, process=False)
    mesh.merge_vertices(digits_vertex=CELL_DIGITS, merge_norm=True, merge_tex=True)
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.update_faces(mesh.unique_faces())
    mesh.remove_unreferenced_vertices()
    return mesh


def _transform(position: FloatArray, quaternion: FloatArray) -> FloatArray:
    matrix, rotation = np.eye(4), np.zeros(9)
    mujoco.mju_quat2Mat(rotation, quaternion)
    matrix[:3, :3], matrix[:3, 3] = rotation.reshape(3, 3), position
    return matrix


def _joined(meshes: list[Any]) -> Mesh:
    if not meshes:
        return np.zeros((0, 3), dtype=np.float32), np.zeros((0, 3), dtype=np.uint32)
    whole = load_trimesh().util.concatenate(meshes)
    # a tenth of a millimetre is enough, and packs better
    return np.round(whole.vertices, 4).astype(np.float32), whole.faces.astype(np.uint32)
