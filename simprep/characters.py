"""The characters known by name, and how files state their character."""

from collections.abc import Callable, Mapping
from typing import Any

from simprep.character import Character
from simprep.errors import MotionError, SettingError, SimprepError, UnknownNameError
from simprep.humanoid_model import DEFAULT_HEIGHT_M, DEFAULT_MASS_KG, MODEL_NAME, MODEL_VERSION, humanoid
from simprep.primitive_robot import ROBOT_NAME, ROBOT_VERSION, primitive_robot
from simprep.robots.description import read_description
from simprep.robots.load import load_robot, robot_character

CHARACTERS: dict[str, Callable[[float, float], Character]] = {
    MODEL_NAME: humanoid,
    ROBOT_NAME: lambda height_m, mass_kg: primitive_robot(),
}
"""Makers by name. They take stature [m] and mass [kg]; a character of one size ignores both."""
VERSIONS = {MODEL_NAME: MODEL_VERSION, ROBOT_NAME: ROBOT_VERSION}
"""Version of each one's poses; it changes when joints change their order or meaning."""


def character_of_name(name: str, height_m: float | None = None, mass_kg: float | None = None) -> Character:
    """A character by its name, with or without `simprep_` before it, or a robot by its name or file.

    Args:
        name: `humanoid`, `primitive_robot`, a shipped robot, or the path of a robot's MJCF or TOML.
        height_m: stature of the humanoid [m]; None for the usual one.
        mass_kg: its mass [kg]; None for one that grows with the square of the stature (equal BMI).

    Raises:
        UnknownNameError: no such character.
        RobotFileError: the robot's files are missing or cannot be used.
        SettingError: a stature or mass out of range, or of a character of one size.
    """
    if (height_m, mass_kg) != (None, None) and name not in (MODEL_NAME, MODEL_NAME.removeprefix("simprep_")):
        raise SettingError(f"character {name!r} has one size; valid: a stature or mass of the humanoid only")
    height = DEFAULT_HEIGHT_M if height_m is None else height_m
    mass = DEFAULT_MASS_KG * (height / DEFAULT_HEIGHT_M) ** 2 if mass_kg is None else mass_kg
    for known, make in CHARACTERS.items():
        if name in (known, known.removeprefix("simprep_")):
            return make(height, mass)
    try:
        return load_robot(name)
    except UnknownNameError as error:
        own = [known.removeprefix("simprep_") for known in CHARACTERS]
        raise UnknownNameError("character", name, [*own, *error.choices]) from None


def character_header(character: Character) -> dict[str, Any]:
    """What a file states of the character whose poses it holds.

    Raises:
        MotionError: the character is neither in `CHARACTERS` nor a robot from files, so that no reader could make it
            again.
    """
    if character.origin:
        return {
            "model": character.name,
            "digest": character.digest,
            "hinges": character.joints,
            "robot": dict(character.origin),
        }
    if character.name not in CHARACTERS:
        raise MotionError(
            f"a file cannot name {character}; valid: {', '.join(CHARACTERS)}, or one listed in simprep.characters.CHARACTERS"
        )
    return {
        "model": character.name,
        "model_version": VERSIONS[character.name],
        "digest": character.digest,
        "hinges": character.joints,
        "height_m": character.height_m,
        "mass_kg": character.mass_kg,
    }


def character_of_header(header: Mapping[str, Any]) -> Character:
    """The character of a file's header. Old files state no character or no digest; they hold poses of the humanoid.

    The digest tells whether the model has changed since. Poses stay readable as long as the joints are the same; those
    of a robot, whose files are not ours, only while its model is the same.

    Raises:
        MotionError: an unknown character, one with other joints, or a robot whose files are missing or have changed.
    """
    name = header.get("model", MODEL_NAME)
    if "robot" in header:
        return _robot_of_header(str(name)[:80], header)
    if name not in CHARACTERS:
        raise MotionError(f"poses of model {str(name)[:80]!r}; valid: {', '.join(CHARACTERS)}")
    character = CHARACTERS[name](header.get("height_m", DEFAULT_HEIGHT_M), header.get("mass_kg", DEFAULT_MASS_KG))
    if header.get("model_version", VERSIONS[name]) != VERSIONS[name]:
        raise MotionError(
            f"poses of model {name!r} version {header['model_version']!r}; valid: version {VERSIONS[name]}"
        )
    if tuple(header.get("hinges", character.joints)) != character.joints:
        raise MotionError(f"poses of model {name!r} with other joints; valid: {', '.join(character.joints)}")
    return character


def _robot_of_header(name: str, header: Mapping[str, Any]) -> Character:
    """The robot of a file: from the files that made it, else by its name."""
    origin = {key: str(header["robot"].get(key, "")) for key in ("mjcf", "toml")}
    problems = []
    ways: tuple[Callable[[], Character], ...] = (
        lambda: robot_character(origin["mjcf"], read_description(origin["toml"])),
        lambda: load_robot(name),
        lambda: load_robot(origin["mjcf"]),
    )
    for make in ways:
        try:
            character = make()
        except SimprepError as error:
            problems.append(str(error))
            continue
        if character.digest == header.get("digest"):
            return character
        problems.append(f"{character.origin['mjcf']} with {character.origin['toml']} has changed since")
    raise MotionError(
        f"poses of robot {name!r}, whose model is not found as it was: {problems[0]}. Valid: {origin['mjcf']} and "
        f"{origin['toml']} as they were (digest {header.get('digest')})"
    )
