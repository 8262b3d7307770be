"""Joint angles of a character from the orientations of its segments, and back; exact where the orientations are its own.

A segment's *turn* is its rotation against its parent since the reference pose, in the axes of the world in that pose.
A BVH file holds just that. Of a segment with hinges e1, e2, e3 it is R(e1, q1) R(e2, q2) R(e3, q3), where the angles q count
from the reference pose.
"""

from functools import lru_cache

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.errors import MotionError
from simprep.motion.rotations import rotation_matrix, wrap_angle

LOCKED = 1e-7
"""Cosine of the second of three angles below which the first and third turn about one axis."""


@lru_cache(maxsize=32)
def rest_frames(character: Character) -> tuple[FloatArray, FloatArray]:
    """Positions (S, 3) [m] and orientations (S, 3, 3) of the segments in the reference pose, the root at the origin.

    Read-only.
    """
    data = mujoco.MjData(character.model)
    data.qpos[:] = character.model.qpos0
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    mujoco.mj_kinematics(character.model, data)
    place, turn = data.xpos[1:].copy(), data.xmat[1:].reshape(-1, 3, 3).copy()
    place.setflags(write=False)
    turn.setflags(write=False)
    return place, turn


def parents(character: Character) -> list[int]:
    """Index of each segment's parent segment; -1 for the root."""
    return [int(parent) - 1 for parent in character.model.body_parentid[1:]]


@lru_cache(maxsize=32)
def hinges(character: Character) -> tuple[tuple[tuple[int, ...], FloatArray], ...]:
    """For each segment its hinges, as indices into `Character.joints`, and their axes at rest (K, 3) in the world.

    Raises:
        MotionError: a hinge does not pass through the origin of its segment, or the axes of one segment are not square.
    """
    model = character.model
    frames = rest_frames(character)[1]
    out = []
    for segment in range(model.nbody - 1):
        own = [joint for joint in range(1, model.njnt) if model.jnt_bodyid[joint] == segment + 1]
        axes = np.array([frames[segment] @ model.jnt_axis[joint] for joint in own]).reshape(-1, 3)
        square = np.abs(axes @ axes.T - np.eye(len(own))).max(initial=0.0) < 1e-6
        if len(own) > 3 or not square or np.abs(model.jnt_pos[own]).max(initial=0.0) > 1e-9:
            raise MotionError(
                f"{character.name}: the joints of {character.segments[segment]!r} are not square hinges through its "
                "origin, which this format needs; valid: .npz, .csv or .mot"
            )
        out.append((tuple(joint - 1 for joint in own), axes))
    return tuple(out)


def turns_of_poses(qpos: FloatArray, character: Character) -> FloatArray:
    """Turn of each segment (T, S, 3, 3); the first is the orientation of the root.

    Args:
        qpos: (T, nq) poses.
        character: the body.
    """
    out = np.empty((len(qpos), len(character.segments), 3, 3))
    angles = qpos[:, 7:] - character.model.qpos0[7:]
    for segment, (joints, axes) in enumerate(hinges(character)):
        turn = rotation_matrix(qpos[:, 3:7]) if segment == 0 else np.tile(np.eye(3), (len(qpos), 1, 1))
        for joint, axis in zip(joints, axes):
            turn = turn @ Rotation.from_rotvec(angles[:, joint, None] * axis).as_matrix()
        out[:, segment] = turn
    return out


def angles_of_turns(turns: FloatArray, character: Character) -> tuple[FloatArray, FloatArray]:
    """Joint angles (T, joints) [rad] of turns (T, S, 3, 3), and what no joint can do of each (T, S) [rad].

    Of the two ways to three angles, the one within the limits is taken, else the one nearer to the frame before.
    """
    angles = np.zeros((len(turns), len(character.joints)))
    rest = np.zeros(turns.shape[:2])
    for segment, (joints, axes) in enumerate(hinges(character)):
        if segment == 0:
            continue
        reference = character.model.qpos0[7:][list(joints)]
        found = _angles(turns[:, segment], axes, character.limits[list(joints)] - reference[:, None])
        angles[:, list(joints)] = reference + found
        own = np.tile(np.eye(3), (len(turns), 1, 1))
        for angle, axis in zip(found.T, axes):
            own = own @ Rotation.from_rotvec(angle[:, None] * axis).as_matrix()
        rest[:, segment] = Rotation.from_matrix(np.swapaxes(own, -1, -2) @ turns[:, segment]).magnitude()
    return angles, rest


def _angles(turn: FloatArray, axes: FloatArray, limits: FloatArray) -> FloatArray:
    """Angles (T, K) about K square axes (K, 3) whose product is nearest to a turn (T, 3, 3), within limits (K, 2)."""
    if len(axes) == 0:
        return np.zeros((len(turn), 0))
    if len(axes) == 1:
        quat = Rotation.from_matrix(turn).as_quat(scalar_first=True)
        return _near(2 * np.arctan2(quat[:, 1:] @ axes[0], quat[:, 0])[:, None], limits)
    third = np.cross(axes[0], axes[1])
    base = np.stack([axes[0], axes[1], third], axis=-1)
    own = base.T @ turn @ base  # about x, then y, then z
    if len(axes) == 2:
        first = np.arctan2(own[:, 2, 1], own[:, 1, 1])
        return _near(np.stack([first, np.arctan2(own[:, 0, 2], own[:, 0, 0])], axis=-1), limits)
    cosine = np.hypot(own[:, 0, 0], own[:, 0, 1])
    locked = cosine < LOCKED
    x = np.where(locked, np.arctan2(own[:, 2, 1], own[:, 1, 1]), np.arctan2(-own[:, 1, 2], own[:, 2, 2]))
    y = np.arctan2(own[:, 0, 2], cosine)
    z = np.where(locked, 0.0, np.arctan2(-own[:, 0, 1], own[:, 0, 0]))
    sign = np.array([1.0, 1.0, np.sign(third @ axes[2])])
    one = _near(np.stack([x, y, z], axis=-1) * sign, limits)
    other = _near(np.stack([x + np.pi, np.pi - y, z + np.pi], axis=-1) * sign, limits)
    beyond = [np.maximum(np.maximum(limits[:, 0] - way, way - limits[:, 1]), 0.0).max(axis=1) for way in (one, other)]
    out = np.where((beyond[0] <= beyond[1])[:, None], one, other)
    for frame in np.flatnonzero(np.abs(beyond[0] - beyond[1]) < 1e-6):
        if frame > 0:  # both within the limits
            ways = np.stack([one[frame], other[frame]])
            out[frame] = ways[np.argmin(np.abs(wrap_angle(ways - out[frame - 1])).max(axis=1))]
    return out


def _near(angle: FloatArray, limits: FloatArray) -> FloatArray:
    """The same angles (T, K), not farther than half a turn from the middle of their limits (K, 2)."""
    middle = limits.mean(axis=1)
    return np.asarray(middle + wrap_angle(angle - middle))


def tips(character: Character) -> dict[int, FloatArray]:
    """Where each segment without children ends (3,), from its origin, in the reference pose and the world's axes [m].

    Feet end at the middle of their foremost sole points, others at twice the way to their centre of mass.
    """
    model = character.model
    place, turn = rest_frames(character)
    above = set(parents(character))
    feet = dict(zip(character.feet, character.sole_geoms))
    out = {}
    for segment in range(len(place)):
        if segment in above:
            continue
        points = 2 * model.body_ipos[segment + 1][None]
        if segment in feet:
            points = model.geom_pos[feet[segment]]
            points = points[points[:, 0] > points[:, 0].max() - 1e-6]
        out[segment] = turn[segment] @ points.mean(axis=0)
    return out
