"""A foreign skeleton that is not foreign: the joints of a file are a character's segments, with its lengths.

Such a file holds the character's own pose. It is taken as it is, instead of being retargeted.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray, IndexArray
from simprep.character import Character
from simprep.characters import CHARACTERS
from simprep.errors import SettingError
from simprep.humanoid_model import DEFAULT_HEIGHT_M, DEFAULT_MASS_KG, MODEL_NAME, humanoid
from simprep.motion.contacts import detect_contacts
from simprep.motion.formats.format import ReadMotion
from simprep.motion.formats.segments import angles_of_turns, parents, rest_frames
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.motion import Motion
from simprep.motion.normalise import UP_ROTATIONS
from simprep.motion.rotations import continuous_quat

SAME_LENGTH = 1e-3
"""A file's skeleton is a character's if no offset differs by more than this share of the largest."""
SAME_TURN = 2e-3
"""... and if no joint turns by more than this in a way that the character cannot [rad]."""
FILE_UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}


def known_characters(wanted: Character) -> list[Character]:
    """Characters whose poses a file may hold: the one that is wanted first."""
    others = [make(DEFAULT_HEIGHT_M, DEFAULT_MASS_KG) for make in CHARACTERS.values()]
    return [wanted, *(other for other in others if other.name != wanted.name)]


def own_motion(clip: SourceClip, wanted: Character) -> ReadMotion | None:
    """The motion of a file whose joints are a character's, exactly; None if they are not.

    Args:
        clip: the file as read.
        wanted: the character that is tried first.
    """
    joints = [index for index, name in enumerate(clip.names) if not name.endswith("_end")]
    names = [clip.names[index] for index in joints]
    for character in known_characters(wanted):
        if sorted(names) != sorted(character.segments):
            continue
        order = np.array([joints[names.index(segment)] for segment in character.segments])
        above = parents(character)
        if any(above[n] >= 0 and clip.parents[order[n]] != order[above[n]] for n in range(len(order))):
            continue
        found = sized(clip.rest_positions[order], above, character)
        if found is None:
            continue
        character, up, scale = found
        turn = UP_ROTATIONS[up]
        world = turn @ clip.rotations[:, order] @ turn.T
        root = clip.positions[:, order[0]] @ turn.T * scale
        motion = motion_of_frames(root, world, above, character, clip.fps, clip.path, clip.format)
        if motion is not None:
            notes = (*clip.notes, f"the joints are {character.name}'s own: the pose is taken as it is")
            return ReadMotion(motion, notes, up, scale)
    return None


def motion_of_frames(
    root: FloatArray, world: FloatArray, above: list[int], character: Character, fps: float, path: Path, title: str
) -> Motion | None:
    """A motion from the world orientations of the segments; None if the joints cannot turn so.

    Args:
        root: (T, 3) position of the root [m].
        world: (T, S, 3, 3) orientation of each segment since the reference pose, z up.
        above: parent of each segment.
        character: the body.
        fps: frame rate [1/s].
        path: the file.
        title: of its format.
    """
    turns = world.copy()
    for segment, parent in enumerate(above):
        if parent >= 0:
            turns[:, segment] = np.swapaxes(world[:, parent], -1, -2) @ world[:, segment]
    angles, rest = angles_of_turns(turns, character)
    if rest.max() > SAME_TURN:
        return None
    quat = continuous_quat(Rotation.from_matrix(world[:, 0]).as_quat(scalar_first=True))
    return motion_of_poses(np.concatenate([root, quat, angles], axis=1), fps, character, path, title)


def motion_of_poses(qpos: FloatArray, fps: float, character: Character, path: Path, title: str) -> Motion:
    """A motion of poses (T, nq) from a file; contacts are found by height and speed of the feet."""
    contacts = detect_contacts(qpos, fps, character)
    return Motion(qpos, fps, contacts, name=path.stem, source=f"{title} file {path.name}", character=character)


def sized(
    rest: FloatArray,
    above: list[int],
    character: Character,
    units: Mapping[str, float] = FILE_UNITS,
    axes: Mapping[str, FloatArray] = UP_ROTATIONS,
) -> tuple[Character, str, float] | None:
    """The character in the size of a skeleton, its vertical axis and metres per unit; None if it has other bones.

    Args:
        rest: (S, 3) the skeleton in the reference pose [file unit].
        above: parent of each segment.
        character: the body.
        units: metres per unit to try.
        axes: vertical axes to try.
    """
    child = np.array([n for n, parent in enumerate(above) if parent >= 0])
    parent = np.array([above[n] for n in child])
    given = rest[child] - rest[parent]
    for candidate, scale in _sizes(float(np.linalg.norm(given, axis=1).sum()), child, parent, character, units):
        place, _ = rest_frames(candidate)
        own = place[child] - place[parent]
        largest = np.linalg.norm(own, axis=1).max()
        for up, turn in axes.items():
            if np.abs(given @ turn.T * scale - own).max() < SAME_LENGTH * largest:
                return candidate, up, scale
    return None


def _sizes(
    whole: float, child: IndexArray, parent: IndexArray, character: Character, units: Mapping[str, float]
) -> Iterable[tuple[Character, float]]:
    """The character, and if it has many sizes those in which a skeleton of this length fits a common unit."""
    place, _ = rest_frames(character)
    own = float(np.linalg.norm(place[child] - place[parent], axis=1).sum())
    if whole <= 0 or own <= 0:
        return
    for scale in units.values():
        if abs(whole * scale / own - 1) < SAME_LENGTH / 10:
            yield character, scale
    height, mass = character.height_m, character.mass_kg
    if character.name == MODEL_NAME and height is not None and mass is not None:
        for scale in units.values():
            ratio = whole * scale / own
            try:
                yield humanoid(round(height * ratio, 5), mass * ratio**2), scale
            except SettingError:
                continue
