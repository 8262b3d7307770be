"""From a robot's clip as its file has it to a Motion of a character: columns by their order, contacts found, all reported."""

from dataclasses import replace

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.errors import MotionError, MotionFileError
from simprep.motion.contacts import detect_contacts
from simprep.motion.formats.format import ReadMotion, ReadOptions
from simprep.motion.formats.robot_clip import RobotClip, all_unit
from simprep.motion.formats.robot_order import find_order
from simprep.motion.formats.skeleton import tidy_fps
from simprep.motion.motion import MAX_FPS, MIN_FPS, Motion

RATE_TOLERANCE = 0.1
"""A stated frame rate that differs from the velocities' by more than this share is doubtful."""
OBJECT = 7
"""Numbers of a free body's pose: place and quaternion, in either order."""
BEYOND_RAD = 1e-3
"""Angles are beyond a limit from here on: text has few digits [rad]."""


def robot_motion(clip: RobotClip, options: ReadOptions) -> ReadMotion:
    """A clip as a motion of `options.character`, unchanged but for the order of its joints, and what was decided.

    Joints that the file lacks keep their angle in the reference pose.

    Args:
        clip: as read.
        options: the character, and the frame rate where the file states none.

    Raises:
        MotionFileError: joints or bodies that are not the character's, or an impossible frame rate.
    """
    character = options.character
    clip = _without_object(clip, character)
    order = find_order(clip, character)
    measured = rate_of_velocities(clip.angles, clip.joint_velocity)
    fps, notes = _frame_rate(clip, options.file_fps, measured)
    qpos = np.tile(character.standing_qpos, (len(clip.angles), 1))
    qpos[:, :3] = clip.position
    qpos[:, 3:7] = order.quat / np.linalg.norm(order.quat, axis=1, keepdims=True)
    known = order.joints >= 0
    qpos[:, 7 + order.joints[known]] = clip.angles[:, known]
    missing = [name for index, name in enumerate(character.joints) if index not in set(order.joints.tolist())]
    if missing:
        notes.append(f"{len(missing)} joints are not in the file and stay in the reference pose: {', '.join(missing)}")
    notes += _limits(qpos, options)
    try:
        motion = Motion(
            qpos=qpos,
            fps=fps,
            contacts=detect_contacts(qpos, fps, character),
            name=clip.path.stem,
            source=f"{clip.format} file {clip.path.name}",
            character=character,
        )
    except MotionError as error:
        raise MotionFileError(clip.path, str(error)) from None
    return ReadMotion(motion, (*clip.notes, *order.notes, *notes), velocity_fps=measured)


def _without_object(clip: RobotClip, character: Character) -> RobotClip:
    """A clip without the pose of an object that the whole qpos of a scene has behind the robot's joints."""
    expected = len(character.joints if clip.joints is None else clip.joints)
    last = clip.angles[:, -OBJECT:]
    if not clip.whole_qpos or clip.angles.shape[1] != expected + OBJECT:
        return clip
    if not (all_unit(last[:, :4]) or all_unit(last[:, 3:])):
        return clip
    note = f"the last {OBJECT} numbers of qpos are the pose of an object: left out"
    return replace(clip, angles=clip.angles[:, :-OBJECT], joint_velocity=None, notes=(*clip.notes, note))


def _frame_rate(clip: RobotClip, given: float | None, measured: float | None) -> tuple[float, list[str]]:
    """Frames per second, and how they are known."""
    if given is not None:
        fps, notes = given, [f"{given:g} frames per second, as given"]
        if clip.fps is not None and abs(given - clip.fps) > 1e-6 * given:
            notes[0] += f"; the file says {clip.fps:g}"
    elif clip.fps is not None:
        fps, notes = tidy_fps(clip.fps), []
    elif clip.usual_fps is not None:
        fps = clip.usual_fps
        notes = [
            f"the frame rate is not in the file: {fps:g} per second taken, the format's usual one; --file-fps gives it"
        ]
    else:
        raise MotionFileError(clip.path, "the frame rate is not in the file; give it with --file-fps")
    if not MIN_FPS <= fps <= MAX_FPS:
        raise MotionFileError(clip.path, f"{fps:g} frames per second; valid: {MIN_FPS:g} to {MAX_FPS:g}")
    if measured is not None and abs(measured / fps - 1) > RATE_TOLERANCE:
        notes.append(f"frame rate doubtful: {fps:g} per second, but the stored joint velocities fit {measured:.1f}")
    return fps, notes


def rate_of_velocities(angles: FloatArray, velocity: FloatArray | None) -> float | None:
    """Frames per second at which stored joint velocities are the angles' changes [1/s]; None if they tell nothing.

    Args:
        angles: (T, J) [rad].
        velocity: (T, J) [rad/s], or None.
    """
    if velocity is None or len(angles) < 3:
        return None
    change = np.gradient(angles, axis=0)
    size = float((change**2).sum())
    if size < 1e-8 or not np.isfinite(velocity).all():
        return None
    rate = float((change * velocity).sum()) / size
    misfit = float(((velocity - rate * change) ** 2).sum()) / max(float((velocity**2).sum()), 1e-12)
    return rate if rate > 0 and misfit < 0.1 else None


def _limits(qpos: FloatArray, options: ReadOptions) -> list[str]:
    low, high = options.character.limits.T
    beyond = np.maximum(low - qpos[:, 7:], qpos[:, 7:] - high).max(axis=0)
    over = np.flatnonzero(beyond > BEYOND_RAD)
    if not len(over):
        return []
    worst = int(np.argmax(beyond))
    return [
        f"{len(over)} joints go beyond their limits, {options.character.joints[worst]} by {np.degrees(beyond[worst]):.1f} deg"
    ]
