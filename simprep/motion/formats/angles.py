"""Files of joint angles by name (CSV, MOT, STO): from columns to a motion of a character."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.errors import MotionFileError, SettingError
from simprep.humanoid_model import DEFAULT_HEIGHT_M, DEFAULT_MASS_KG, MODEL_NAME, humanoid
from simprep.motion.formats.format import ReadMotion, ReadOptions
from simprep.motion.formats.own_skeleton import known_characters, motion_of_poses
from simprep.motion.formats.skeleton import tidy_fps
from simprep.motion.joint_map import shown_names
from simprep.motion.motion import MAX_FPS, MIN_FPS

UNEVEN = 0.05
"""A step in time may differ from the median by at most this share of it."""
BEYOND_RAD = 1e-3
"""An angle further beyond a limit than this is told [rad]."""


def rate_of_times(path: Path, times: FloatArray | None, options: ReadOptions) -> float:
    """Frame rate [1/s] of a column of times (T,) [s], or the one that the user gives.

    Raises:
        MotionFileError: no rate, out of range, or times that are not even.
    """
    if (times is None or len(times) < 2) and options.file_fps is not None:
        return options.file_fps
    if times is None or len(times) < 2:
        raise MotionFileError(path, "no frame rate: no column of times with two frames; give it with --file-fps")
    steps = np.diff(times)
    step = float(np.median(steps))
    if not 1 / MAX_FPS <= step <= 1 / MIN_FPS:
        raise MotionFileError(path, f"times {step:g} s apart; valid: {1 / MAX_FPS:.3g} to {1 / MIN_FPS:g}")
    worst = int(np.argmax(np.abs(steps - step)))
    if abs(steps[worst] - step) > UNEVEN * step:
        raise MotionFileError(
            path,
            f"the step after time {times[worst]:g} s is {steps[worst]:g} s where the median is {step:g} s; valid: even "
            "times",
        )
    return tidy_fps((len(times) - 1) / float(times[-1] - times[0]))


def character_of_columns(path: Path, names: Sequence[str], wanted: Character) -> Character:
    """The character whose joints a file's columns are: the wanted one, if it has more than one of them, else another.

    Raises:
        MotionFileError: no column is a joint of a known character.
    """
    found = [(len(set(names) & set(character.joints)), character) for character in known_characters(wanted)]
    count, best = max(found, key=lambda item: item[0])
    if not count:
        raise MotionFileError(
            path, f"no column is a joint of {wanted.name}; columns: {shown_names(names, 8)}; joints: "
            f"{shown_names(wanted.joints, 40)}"
        )  # fmt: skip
    return best


def sized_character(path: Path, character: Character, height_m: float | None, mass_kg: float | None) -> Character:
    """The humanoid of a stature [m] and mass [kg] that a file states; any other character, and None, as it is.

    Raises:
        MotionFileError: outside of the humanoid's range.
    """
    if character.name != MODEL_NAME or height_m is None:
        return character
    try:
        return humanoid(height_m, DEFAULT_MASS_KG if mass_kg is None else mass_kg)
    except SettingError as error:
        raise MotionFileError(path, str(error)) from None


def unusual_size(character: Character) -> dict[str, float]:
    """What a file must state of the humanoid's size, by key with unit; nothing for the usual one and other characters."""
    height, mass = character.height_m, character.mass_kg
    if character.name != MODEL_NAME or height is None or mass is None:
        return {}
    return {} if (height, mass) == (DEFAULT_HEIGHT_M, DEFAULT_MASS_KG) else {"height_m": height, "mass_kg": mass}


def motion_of_angles(
    path: Path,
    title: str,
    fps: float,
    root: FloatArray | None,
    angles: Mapping[str, FloatArray],
    character: Character,
    notes: Sequence[str] = (),
) -> ReadMotion:
    """A motion of joint angles.

    Args:
        path: the file.
        title: of its format.
        fps: frame rate [1/s].
        root: (T, 7) position [m] and quaternion wxyz, z up; None if the file has none.
        angles: (T,) of each joint [rad]; joints that are not given stay as in the
            reference pose.
        character: the body.
        notes: for the report.
    """
    notes = list(notes)
    count = len(next(iter(angles.values())))
    qpos = np.tile(character.standing_qpos, (count, 1))
    if root is None:
        notes.append("no columns of the root: it stays in the reference pose")
    else:
        norm = np.linalg.norm(root[:, 3:], axis=1)
        if np.abs(norm - 1).max() > 0.01:
            frame = int(np.argmax(np.abs(norm - 1)))
            raise MotionFileError(path, f"frame {frame}: the root's quaternion has length {norm[frame]:.3g}; valid: 1")
        qpos[:, :7] = root
    missing = [name for name in character.joints if name not in angles]
    if missing:
        notes.append(
            f"{len(missing)} joints have no column and stay as in the reference pose: {shown_names(missing, 8)}"
        )
    for name, values in angles.items():
        qpos[:, 7 + character.joint(name)] = values
    over = np.maximum(character.limits[:, 0] - qpos[:, 7:], qpos[:, 7:] - character.limits[:, 1]).max(axis=0)
    beyond = [
        f"{character.joints[joint]} by {np.degrees(over[joint]):.0f} deg" for joint in np.flatnonzero(over > BEYOND_RAD)
    ]
    if beyond:
        notes.append(f"{len(beyond)} joints go beyond their limits: {shown_names(beyond, 6)}")
    notes.append(f"joint angles of {character.name}: the pose is taken as it is")
    return ReadMotion(motion_of_poses(qpos, fps, character, path, title), tuple(notes))
