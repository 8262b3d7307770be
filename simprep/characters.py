"""The characters known by name, and how files state their character."""

from collections.abc import Callable, Mapping
from typing import Any

from simprep.character import Character
from simprep.errors import MotionError, UnknownNameError
from simprep.humanoid_model import DEFAULT_HEIGHT_M, DEFAULT_MASS_KG, MODEL_NAME, MODEL_VERSION, humanoid
from simprep.primitive_robot import ROBOT_NAME, ROBOT_VERSION, primitive_robot

CHARACTERS: dict[str, Callable[[float, float], Character]] = {
    MODEL_NAME: humanoid,
    ROBOT_NAME: lambda height_m, mass_kg: primitive_robot(),
}
"""Makers by name. They take stature [m] and mass [kg]; a character of one size ignores both."""
VERSIONS = {MODEL_NAME: MODEL_VERSION, ROBOT_NAME: ROBOT_VERSION}
"""Version of each one's poses; it changes when joints change their order or meaning."""


def character_of_name(name: str) -> Character:
    """A character of usual size by its name, with or without `simprep_` before it.

    Raises:
        UnknownNameError: no such character.
    """
    for known, make in CHARACTERS.items():
        if name in (known, known.removeprefix("simprep_")):
            return make(DEFAULT_HEIGHT_M, DEFAULT_MASS_KG)
    raise UnknownNameError("character", name, [known.removeprefix("simprep_") for known in CHARACTERS])


def character_header(character: Character) -> dict[str, Any]:
    """What a file states of the character whose poses it holds.

    Raises:
        MotionError: the character is not in `CHARACTERS`, so that no reader could make it again.
    """
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

    The digest tells whether the model has changed since. Poses stay readable as long as the joints are the same.

    Raises:
        MotionError: an unknown character, or one with other joints.
    """
    name = header.get("model", MODEL_NAME)
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
