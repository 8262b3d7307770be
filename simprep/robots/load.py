"""A robot as a `Character`, by name or path."""

from functools import partial
from pathlib import Path

import mujoco
import numpy as np

from simprep.character import SIDES, Character
from simprep.errors import RobotFileError
from simprep.robots.description import ARM, LEG, TRUNK, RobotDescription, matches, read_description
from simprep.robots.frames import joint_centres
from simprep.robots.mirror import mirrored_joints
from simprep.robots.model import build_robot, hinge_names, sole_names
from simprep.robots.resolve import find_robot


def load_robot(name_or_path: str | Path) -> Character:
    """A robot as a character.

    Args:
        name_or_path: name of a shipped robot (`unitree_g1`), or path of an MJCF or of a TOML description.

    Raises:
        UnknownNameError: no such robot.
        RobotFileError: its model or description is missing or cannot be used; the message says why and what is valid.
        MissingExtraError: a name whose model has to be downloaded, without the extra `robots`.
    """
    found = find_robot(name_or_path)
    return robot_character(found.mjcf, read_description(found.toml))


def robot_character(mjcf: str | Path, description: RobotDescription) -> Character:
    """The character of a model file and its description.

    Args:
        mjcf: the model file.
        description: what its parts are.

    Raises:
        RobotFileError: as `simprep.robots.model.build_robot`; or roles or joints that a character needs are lacking.
    """
    mjcf = Path(mjcf).resolve()
    build = partial(build_robot, str(mjcf), description)
    model = build().compile()
    movements = description.movements
    hinges = hinge_names(model)
    unnamed = [name for name in hinges if name not in movements.values()]
    if unnamed:
        raise RobotFileError(
            description.path, f"says nothing of the joints {', '.join(unnamed)}; valid: an entry in [joints], or locked"
        )
    groups = {
        f"{side}_{limb}": tuple(movements[f"{side}_{name}"] for name in names if f"{side}_{name}" in movements)
        for limb, names in (("leg", LEG), ("arm", ARM))
        for side in SIDES
    }
    trunk = tuple(movements[name] for name in TRUNK if name in movements)
    legs = {*groups["left_leg"], *groups["right_leg"]}
    lower = tuple(name for name in hinges if name in legs)
    upper = tuple(name for name in hinges if name not in legs)
    return Character(
        name=description.name,
        build=build,
        roles=description.roles,
        soles=sole_names(description, model),
        upper=upper,
        lower=lower,
        groups={"trunk": trunk, **groups},
        mirror=mirrored_joints(model, description),
        anatomy=movements,
        balancing=upper,
        fused=tuple(name for name in hinges if matches(name, description.fused)),
        height_m=description.height_m or _stature(model),
        mass_kg=float(model.body_mass.sum()),
        frames=joint_centres(model, description),
        velocity_limits=_velocity_limits(hinges, description),
        origin={"mjcf": str(mjcf), "toml": str(description.path.resolve())},
    )


def _velocity_limits(hinges: list[str], description: RobotDescription) -> tuple[float, ...]:
    known = [description.drive(name).velocity for name in hinges]
    return tuple(one for one in known if one is not None) if None not in known else ()


def _stature(model: mujoco.MjModel) -> float:
    """Height of the highest geom's centre plus its radius in the reference pose [m]."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return float(np.round((data.geom_xpos[:, 2] + model.geom_rbound).max(), 3))
