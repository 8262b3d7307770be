"""Reading a robot's MJCF, reduced to the one floating body: no floor, no pictures, no sensors."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco

from simprep.errors import RobotFileError

FREE, HINGE = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_HINGE
_ODD_PARTS = ("sensors", "keys", "numerics", "texts", "tuples", "skins", "cameras", "lights", "flexes", "plugins")


def read_robot_model(path: str | Path) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    """Editable model of the only floating body of an MJCF file, with its actuators, and the same compiled.

    Geoms that neither collide nor weigh anything are left out, so that a robot works without the meshes of its looks.

    Args:
        path: the MJCF file.

    Raises:
        RobotFileError: missing, no valid MJCF (cyclic includes, missing meshes ...), or not exactly one body with a free
            joint whose other joints are hinges.
    """
    path = Path(path)
    if not path.is_file():
        raise RobotFileError(path, "no such file")
    try:
        spec = mujoco.MjSpec.from_file(str(path))
        root = _floating_root(path, spec)
        _reduce(spec, root)
        return spec, spec.compile()
    except ValueError as error:
        raise RobotFileError(path, f"no valid MJCF ({_first_line(error)})") from None


def descendants(body: Any) -> Iterator[Any]:
    """A body of an editable model and all below it, in model order."""
    yield body
    for child in body.bodies:
        yield from descendants(child)


def _first_line(error: ValueError) -> str:
    return " ".join(str(error).split())[:300]


def _floating_root(path: Path, spec: mujoco.MjSpec) -> Any:
    roots = [body for body in spec.worldbody.bodies if any(joint.type == FREE for joint in body.joints)]
    names = ", ".join(body.name or "unnamed" for body in spec.worldbody.bodies) or "none"
    if not roots:
        raise RobotFileError(
            path,
            f"no free joint: its root bodies ({names}) are fixed to the world; valid: <freejoint/> in the root body",
        )
    robots = [body for body in roots if len(list(descendants(body))) > 1]
    if len(robots) != 1:
        raise RobotFileError(path, f"{len(roots)} bodies with free joints ({names}); valid: one robot")
    for body in descendants(robots[0]):
        for joint in body.joints:
            if joint.type not in (FREE, HINGE):
                kind = mujoco.mjtJoint(joint.type).name.removeprefix("mjJNT_").lower()
                raise RobotFileError(path, f"joint {joint.name!r} is a {kind} joint; valid: hinges, and one free joint")
    return robots[0]


def _reduce(spec: mujoco.MjSpec, root: Any) -> None:
    for body in list(spec.worldbody.bodies):
        if body != root:
            spec.delete(body)
    for part in (name for name in _ODD_PARTS if hasattr(spec, name)):
        for one in list(getattr(spec, part)):
            spec.delete(one)
    for geom in list(spec.worldbody.geoms):
        spec.delete(geom)
    paired = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    for geom in list(spec.geoms):
        if not geom.contype and not geom.conaffinity and geom.name not in paired and _weighs_nothing(spec, geom):
            spec.delete(geom)
        else:
            geom.material = ""
    for material in list(spec.materials):
        spec.delete(material)
    for texture in list(spec.textures):
        spec.delete(texture)
    used = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in used:
            spec.delete(mesh)


def _weighs_nothing(spec: mujoco.MjSpec, geom: Any) -> bool:
    low, high = spec.compiler.inertiagrouprange
    from_geoms = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    told = geom.parent.explicitinertial and not from_geoms
    return bool(told or geom.density == 0.0 or geom.mass == 0.0 or not low <= geom.group <= high)
