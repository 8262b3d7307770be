"""A first TOML description of a robot, written from its model alone, and what to check in it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from simprep.errors import RobotFileError, SimprepError
from simprep.robots.anatomy import Anatomy, CannotTell, find_anatomy
from simprep.robots.description import ARM, LEG, MOVEMENTS, SCHEMA, read_description
from simprep.robots.load import robot_character
from simprep.robots.model import hinge_names, own_torque
from simprep.robots.source import read_robot_model


@dataclass(frozen=True)
class FirstDescription:
    """A first description of a robot.

    Attributes:
        text: the TOML file.
        checks: what to check or fill in, a line each.
    """

    text: str
    checks: tuple[str, ...]


def describe_robot(mjcf: str | Path) -> FirstDescription:
    """Write a first description of a robot that looks along x, with z up.

    Args:
        mjcf: its model file.

    Raises:
        RobotFileError: the model cannot be read, or has no two legs.
    """
    mjcf = Path(mjcf)
    _, model = read_robot_model(mjcf)
    try:
        anatomy = find_anatomy(model)
    except CannotTell as error:
        raise RobotFileError(mjcf, f"no humanoid: {error}") from None
    unlimited = [
        name for name in hinge_names(model) if not model.joint(name).limited[0] and name not in anatomy.fingers
    ]
    checks = list(anatomy.doubts)
    checks += [f"missing: {name}" for name in _missing(anatomy)]
    if unlimited:
        checks.append(f"these joints have no limits in the model, [limits] is a guess: {', '.join(unlimited)}")
    text = _text(mjcf, model, anatomy, unlimited, checks)
    checks += ["[standing]: limbs straight, arms hanging? [joints]: which wrist joint flexes, which deviates?"]
    return FirstDescription(text, tuple(checks))


def try_description(mjcf: str | Path, toml: str | Path) -> list[str]:
    """What is known once a description has been read back: soles, stature and mass; or the error that remains to be mended.

    Args:
        mjcf: the model file.
        toml: the description.
    """
    try:
        character = robot_character(mjcf, read_description(toml))
    except SimprepError as error:
        return [f"not yet usable: {error}"]
    length = np.ptp(character.model.geom_pos[character.sole_geoms[0], 0])
    return [
        f"usable: {character.height_m:g} m, {character.mass_kg:.1f} kg, {len(character.joints)} joints; soles of "
        f"{len(character.soles[0])} spheres over {1000 * length:.0f} mm"
    ]


def _missing(anatomy: Anatomy) -> list[str]:
    wanted = [f"{side}_{name}" for side in ("left", "right") for name in (*LEG, *ARM[:4])]
    return [name for name in wanted if name not in anatomy.movements]


def _text(mjcf: Path, model: mujoco.MjModel, anatomy: Anatomy, unlimited: list[str], checks: list[str]) -> str:
    lines = [
        f"# First description of {mjcf.name}, written by 'simprep robot describe'. Check it (docs/robots.md).",
        f'schema = "{SCHEMA}"',
        f"name = {_quoted(mjcf.stem)}",
        f"model = {_quoted(mjcf.name)}",
    ]
    light = [name for movement, name in anatomy.movements.items() if movement.partition("_")[2] in ARM[4:]]
    for key, names in (("fused", light), ("locked", list(anatomy.fingers))):
        if names:
            lines.append(f"{key} = [{', '.join(map(_quoted, names))}]")
    lines += _table("roles", {role: _quoted(body) for role, body in anatomy.roles.items()})
    ordered = [movement for movement in MOVEMENTS if movement in anatomy.movements]
    lines += _table("joints", {movement: _quoted(anatomy.movements[movement]) for movement in ordered})
    lines += _table("standing", {_key(name): f"{angle:.6g}" for name, angle in anatomy.standing.items()})
    for role, (body, place) in anatomy.hands.items():
        lines += _table(f"frames.{role}", {"body": _quoted(body), "position": str(list(place))})
    lines += _table("limits", {_key(name): "[-3.1416, 3.1416]" for name in unlimited})
    lines += _drives(model, anatomy, checks)
    return "\n".join(lines) + "\n"


def _drives(model: mujoco.MjModel, anatomy: Anatomy, checks: list[str]) -> list[str]:
    """Tables of drives, with what the model does not tell left to be filled in."""
    moved = set(anatomy.movements.values())
    torque = [name for name in hinge_names(model) if name in moved and not _states_torque(model, name)]
    armature = [
        name for name in hinge_names(model) if name in moved and not model.dof_armature[model.joint(name).dofadr[0]]
    ]
    positions = model.nu and bool((model.actuator_biasprm[:, 1] < 0).all())
    if not torque and (not armature or positions):
        return []
    checks.append(
        "the model lacks "
        + " and ".join(what for what, lacking in (("torque limits", torque), ("armatures", armature)) if lacking)
        + ": fill in the [[drive]] tables at the end"
    )
    lines: list[str] = []
    for kind in ("hip", "knee", "ankle", "lumbar", "thorax", "neck", "head", "shoulder", "elbow", "forearm", "wrist"):
        names = [name for movement, name in anatomy.movements.items() if kind in movement.split("_")]
        if names:
            listed = ", ".join(map(_quoted, names))
            lines += [
                "",
                "[[drive]]",
                f"joints = [{listed}]",
                "# armature =  # kg m^2",
                "# torque =  # N m",
                "# velocity =  # rad/s",
            ]
    return lines


def _states_torque(model: mujoco.MjModel, joint: str) -> bool:
    return own_torque(model, joint) is not None


def _table(name: str, entries: Mapping[str, str]) -> list[str]:
    return ["", f"[{name}]", *(f"{key} = {value}" for key, value in entries.items())] if entries else []


def _quoted(text: str) -> str:
    return json.dumps(text)


def _key(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else _quoted(name)
