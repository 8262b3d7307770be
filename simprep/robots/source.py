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
        _refuse_loops(path, spec)
        _reduce(spec, root)
        _name_parts(root)
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
    if not robots:
        raise RobotFileError(
            path, f"nothing hangs on the body with the free joint ({names}); valid: a robot with joints"
        )
    if len(robots) != 1:
        raise RobotFileError(path, f"{len(roots)} bodies with free joints ({names}); valid: one robot")
    for body in descendants(robots[0]):
        for joint in body.joints:
            if joint.type not in (FREE, HINGE):
                kind = mujoco.mjtJoint(joint.type).name.removeprefix("mjJNT_").lower()
                raise RobotFileError(path, f"joint {joint.name!r} is a {kind} joint; valid: hinges, and one free joint")
    return robots[0]


def _refuse_loops(path: Path, spec: mujoco.MjSpec) -> None:
    """Refuse bodies that are connected in a ring, and drop what couples joints: each hinge has a motor of its own here."""
    rings = (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD)
    closed = [one for one in spec.equalities if one.type in rings]
    if closed:
        raise RobotFileError(
            path,
            f"{len(closed)} equality constraints close rings of bodies (the first: {closed[0].name1!r} and "
            f"{closed[0].name2!r}); valid: a tree of hinges",
        )
    for actuator in list(spec.actuators):
        if actuator.trntype != mujoco.mjtTrn.mjTRN_JOINT:
            spec.delete(actuator)
    for part in (*spec.equalities, *spec.tendons):
        spec.delete(part)


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
    for part in (*spec.pairs, *spec.excludes):
        spec.delete(part)
    for geom in list(spec.geoms):
        if geom.name in paired:
            geom.contype = 1  # it collides by being listed
        if not geom.contype and not geom.conaffinity and _weighs_nothing(spec, geom):
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


def _name_parts(root: Any) -> None:
    """Names for what has none, since motions, files and planners call joints and segments by them."""
    for number, body in enumerate(descendants(root)):
        body.name = body.name or f"body_{number}"
        for joint in body.joints:
            joint.name = joint.name or ("root" if joint.type == FREE else f"joint_of_{body.name}")


def _weighs_nothing(spec: mujoco.MjSpec, geom: Any) -> bool:
    low, high = spec.compiler.inertiagrouprange
    from_geoms = spec.compiler.inertiafromgeom == mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    told = geom.parent.explicitinertial and not from_geoms
    return bool(told or geom.density == 0.0 or geom.mass == 0.0 or not low <= geom.group <= high)
