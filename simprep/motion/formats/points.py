"""Files of points over time (TRC, C3D): joint positions become a clip; a character's own points give its pose exactly.

Each of our segments is written as three points: its origin, called by its name, and two more 0.1 m along the axes that
are its x and y in the reference pose. Joint positions alone would leave open how straight limbs are twisted.
"""

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES, Character
from simprep.errors import MotionFileError
from simprep.motion.formats.format import ReadMotion, ReadOptions
from simprep.motion.formats.numbers import LARGEST
from simprep.motion.formats.own_skeleton import known_characters, motion_of_frames, sized
from simprep.motion.formats.segments import parents, rest_frames, turns_of_poses
from simprep.motion.formats.skeleton import MAX_VALUES, SourceClip
from simprep.motion.joint_map import LIMB_PARTS, guess_roles, shown_names
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import MAX_FPS, MIN_FPS, Motion
from simprep.motion.positions import PositionSettings, Recording, position_clip

LEVER_M = 0.1
"""Distance of a segment's second and third point from its first [m]."""
SETTINGS = PositionSettings(cutoff_hz=0.0)
"""Points of marker systems and of solvers are smooth; nothing is filtered."""
SKIN = re.compile(
    r"^(?:[lr]?(?:asis?|psis?|thi\d?|tib\d?|kne|ank|hee|mt[1-5]|sho|elb|upa|frm|wr[ab]|fin|[fb]hd)|c7|t10|clav|strn|rbak|sacr"
    r"|sternum|top ?head|[lr]?(?:knee|ankle|elbow|wrist)(?:lat|med|outer|inner|lateral|medial)|[lr]?(?:thigh|shank)(?:upper|front|rear|[1-4])"
    r"|[lr]?(?:acromion|acromium|heel|toetip|toelat|toemed|midfootsup|midfootlat|biceps|vsacral))$"
)
"""Names of markers on the skin: Plug-in Gait, Helen Hayes, OpenSim's gait models. Sides and separators are left out."""


@dataclass(frozen=True)
class PointFile:
    """Points over time as a file holds them.

    Attributes:
        path: the file.
        title: of the format: `TRC`.
        names: J names.
        positions: (T, J, 3) in file units and axes; NaN where a point was not seen.
        fps: frame rate [1/s].
        unit_m: metres per file unit; None if the file does not say.
        axes: (3, 3) turns the file's axes into ours, where the file says which is up; else None.
        notes: the reader's decisions.
    """

    path: Path
    title: str
    names: tuple[str, ...]
    positions: FloatArray
    fps: float
    unit_m: float | None
    axes: FloatArray | None = None
    notes: tuple[str, ...] = ()


def check_points(points: PointFile) -> None:
    """Refuse what no recording holds.

    Raises:
        MotionFileError: too many numbers, one beyond `LARGEST`, or a frame rate out of range.
    """
    if not len(points.positions) or not points.names:
        raise MotionFileError(points.path, "no frames" if points.names else "no points")
    if points.positions.size * 3 > MAX_VALUES:
        raise MotionFileError(points.path, f"{points.positions.size} numbers; valid: up to {MAX_VALUES // 3}")
    if not (np.isfinite(points.fps) and MIN_FPS <= points.fps <= MAX_FPS):
        raise MotionFileError(points.path, f"frame rate {points.fps} 1/s; valid: {MIN_FPS:g} to {MAX_FPS:g}")
    far = np.isfinite(points.positions) & (np.abs(points.positions) > LARGEST)
    if far.any():
        raise MotionFileError(
            points.path, f"a position is {points.positions[far][0]:g}; valid: numbers up to {LARGEST:g}"
        )


def clip_of_points(points: PointFile, options: ReadOptions) -> SourceClip | ReadMotion:
    """A clip of joint positions, or the exact motion if the points are those that we write.

    Raises:
        MotionFileError: points on the skin instead of joints, a joint that is missing or not seen for too long.
    """
    check_points(points)
    own = None if options.joint_map else _own(points, options)
    if own is not None:
        return own
    _refuse_skin(points, options)
    recording = Recording(points.path, points.positions[:, None], points.names, points.fps)
    clip = position_clip(recording, 0, options.joint_map, SETTINGS)
    note = "joint positions alone: orientations follow from the bones, twists stay neutral"
    return replace(
        clip, format=points.title, unit_m=points.unit_m, notes=(*points.notes, note, *clip.notes), by_part=True
    )


def _refuse_skin(points: PointFile, options: ReadOptions) -> None:
    bare = [re.sub(r"^.*:", "", name) for name in points.names]
    skin = [name for name in bare if SKIN.match(re.sub(r"[^a-z0-9]", "", name.lower()))]
    roles = guess_roles(points.path, points.names, options.joint_map)
    missing = [f"{side}_{part}" for side in SIDES for part in LIMB_PARTS if f"{side}_{part}" not in roles]
    if missing and len(skin) >= 3:
        raise MotionFileError(
            points.path,
            f"markers on the skin ({shown_names(skin, 6)}), not joints; valid: joint centres, as a marker solver "
            "(OpenSim, Visual3D, Theia, Vicon's joint centres LHJC, LKJC ...) exports them",
        )


def points_of_motion(motion: Motion) -> tuple[tuple[str, ...], FloatArray]:
    """Names (3 S) and positions (T, 3 S, 3) of the points of a motion, in our axes [m].

    Raises:
        MotionError: the character has joints that points cannot tell.
    """
    character = motion.character
    turns = turns_of_poses(motion.qpos, character)
    for segment, parent in enumerate(parents(character)):
        if parent >= 0:
            turns[:, segment] = turns[:, parent] @ turns[:, segment]
    origin = forward_kinematics(motion.qpos, character).xpos
    levers = np.swapaxes(turns, -1, -2)[..., :2, :] * LEVER_M  # (T, S, 2, 3): first and second column
    positions = np.concatenate([origin[:, :, None], origin[:, :, None] + levers], axis=2)
    names = tuple(f"{segment}{end}" for segment in character.segments for end in ("", "_x", "_y"))
    return names, positions.reshape(len(origin), -1, 3)


def _own(points: PointFile, options: ReadOptions) -> ReadMotion | None:
    index = {name: number for number, name in enumerate(points.names)}
    for character in known_characters(options.character):
        wanted = [f"{segment}{end}" for segment in character.segments for end in ("", "_x", "_y")]
        if not all(name in index for name in wanted) or points.unit_m is None or points.axes is None:
            continue
        given = points.positions[:, [index[name] for name in wanted]] @ points.axes.T * points.unit_m
        if not np.isfinite(given).all():
            continue
        own = _own_motion(given.reshape(len(given), -1, 3, 3), character, points)
        if own is not None:
            note = f"the points are those of {own.character.name}'s segments: the pose is taken as it is"
            return ReadMotion(own, (*points.notes, note), "y" if points.axes[2, 1] else "z", points.unit_m)
    return None


def _own_motion(given: FloatArray, character: Character, points: PointFile) -> Motion | None:
    """The motion whose segments have these points (T, S, 3, 3), in our axes [m]; None if the bones are others."""
    origin = given[:, :, 0]
    x = given[:, :, 1] - origin
    x = x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-12)
    y = given[:, :, 2] - origin
    y = y - x * (x * y).sum(axis=-1, keepdims=True)
    y = y / np.maximum(np.linalg.norm(y, axis=-1, keepdims=True), 1e-12)
    world = np.stack([x, y, np.cross(x, y)], axis=-1)
    above = parents(character)
    rest = np.zeros((len(above), 3))
    for segment, parent in enumerate(above):
        if parent >= 0:
            bone = np.einsum("tji,tj->ti", world[:, parent], origin[:, segment] - origin[:, parent])
            rest[segment] = rest[parent] + np.median(bone, axis=0)
    found = sized(rest, above, character, {"m": 1.0}, {"z": np.eye(3)})
    if found is None:
        return None
    place, _ = rest_frames(found[0])
    for segment, parent in enumerate(above):  # every frame has these bones
        if parent >= 0:
            bone = np.einsum("tji,tj->ti", world[:, parent], origin[:, segment] - origin[:, parent])
            if np.abs(bone - (place[segment] - place[parent])).max() > 2e-3:
                return None
    return motion_of_frames(origin[:, 0], world, above, found[0], points.fps, points.path, points.title)
