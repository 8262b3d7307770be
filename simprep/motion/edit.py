"""Editing motions: slicing, resampling, looping, joining, mirroring and moving on the floor."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.errors import MotionError, SettingError
from simprep.motion.formats.skeleton import MAX_VALUES
from simprep.motion.motion import MAX_FPS, MIN_FPS, Motion
from simprep.motion.rotations import multiply_quat, wrap_angle


def yaw(quat: FloatArray) -> FloatArray:
    """Heading (...) [rad] of root quaternions (..., 4) wxyz: body x against world x, counter-clockwise from above."""
    w, x, y, z = np.moveaxis(np.asarray(quat), -1, 0)
    return np.asarray(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def move(motion: Motion, translation: tuple[float, float] = (0.0, 0.0), turn: float = 0.0) -> Motion:
    """Turn a motion about the world's vertical axis, then shift it on the floor.

    Args:
        motion: the motion.
        translation: x, y [m].
        turn: angle, counter-clockwise seen from above [rad].
    """
    qpos = motion.qpos.copy()
    c, s = np.cos(turn), np.sin(turn)
    qpos[:, :2] = qpos[:, :2] @ np.array([[c, s], [-s, c]]) + translation
    qpos[:, 3:7] = multiply_quat(np.array([np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2)]), qpos[:, 3:7])
    return replace(motion, qpos=qpos)


def at_origin(motion: Motion) -> Motion:
    """Move a motion on the floor so that its first frame is at the origin and faces x."""
    turned = move(motion, turn=-float(yaw(motion.qpos[0, 3:7])))
    x, y = turned.qpos[0, :2]
    return move(turned, translation=(-x, -y))


def cut(motion: Motion, first: int, after: int) -> Motion:
    """Frames first to after - 1; events outside are dropped.

    Raises:
        MotionError: the range is empty or outside the motion.
    """
    if not 0 <= first < after <= len(motion):
        raise MotionError(f"{motion.name}: frames {first}:{after}; valid: 0 <= a < b <= {len(motion)}")
    events = {key: frame - first for key, frame in motion.events.items() if first <= frame < after}
    whole = first == 0 and after == len(motion)
    return replace(
        motion,
        qpos=motion.qpos[first:after],
        contacts=motion.contacts[first:after],
        events=events,
        loop=motion.loop and whole,
    )


def resample(motion: Motion, fps: float) -> Motion:
    """The same motion at another frame rate: linear in positions and hinges, spherical in the root rotation.

    The first frame stays; the last stays where the duration is a whole number of new frames. A loop keeps its period:
    the rate is adjusted to a whole number of frames in it.

    Args:
        motion: the motion.
        fps: new frame rate [1/s].

    Raises:
        SettingError: a rate out of range, or one that makes more frames than a motion may have.
    """
    if not (np.isfinite(fps) and MIN_FPS <= fps <= MAX_FPS):
        raise SettingError(f"frame rate {fps} 1/s; valid: {MIN_FPS:g} to {MAX_FPS:g}")
    if fps == motion.fps:
        return motion
    if motion.duration * fps * motion.character.nq > MAX_VALUES:
        raise SettingError(f"frame rate {fps:g} 1/s: {motion.duration * fps:.0f} frames of {motion.name} are too many")
    if motion.loop:
        frames = max(2, round(motion.duration * fps))
        fps = frames / motion.duration
        source = repeat(motion, 2)
    else:
        frames = int(np.floor(motion.duration * fps + 1e-9)) + 1
        source = motion
    times = np.arange(frames) / fps
    qpos = sample(source, times)
    nearest = np.clip(np.round(times * motion.fps).astype(int), 0, len(source) - 1)
    events = {key: min(round(frame / motion.fps * fps), frames - 1) for key, frame in motion.events.items()}
    return replace(motion, qpos=qpos, fps=fps, contacts=source.contacts[nearest], events=events)


def sample(motion: Motion, times: FloatArray) -> FloatArray:
    """Poses (N, nq) at any times, held at the ends.

    Args:
        motion: the motion.
        times: (N,) from its first frame [s].
    """
    if len(motion) == 1:
        return np.repeat(motion.qpos, len(times), axis=0)
    position = np.clip(np.asarray(times) * motion.fps, 0, len(motion) - 1)
    low = np.minimum(position.astype(int), len(motion) - 2)
    weight = (position - low)[:, None]
    qpos = (1 - weight) * motion.qpos[low] + weight * motion.qpos[low + 1]
    slerp = Slerp(np.arange(len(motion)), Rotation.from_quat(motion.qpos[:, 3:7], scalar_first=True))
    qpos[:, 3:7] = slerp(position).as_quat(scalar_first=True)
    return np.asarray(qpos)


def repeat(motion: Motion, cycles: int) -> Motion:
    """A loop played several times in a row, each cycle moved on by the displacement of the one before.

    Args:
        motion: a motion with `loop` set.
        cycles: how often, at least 1.

    Raises:
        MotionError: the motion is no loop.
    """
    if not motion.loop:
        raise MotionError(f"{motion.name} is not a loop; only loops repeat")
    if cycles < 1:
        raise MotionError(f"{motion.name}: {cycles} cycles; valid: 1 or more")
    turn, step = loop_displacement(motion)
    pieces = [motion.qpos]
    piece = replace(motion, loop=False)
    for _ in range(1, cycles):
        # the next cycle is this one, moved rigidly: its first frame becomes the frame after the last
        anchor = piece.qpos[0, :2].copy()
        heading = float(yaw(piece.qpos[0, 3:7])) - float(yaw(motion.qpos[0, 3:7]))
        piece = move(piece, translation=(-anchor[0], -anchor[1]))
        c, s = np.cos(heading), np.sin(heading)
        goal = anchor + np.array([[c, -s], [s, c]]) @ step
        piece = move(move(piece, turn=turn), translation=(goal[0], goal[1]))
        pieces.append(piece.qpos)
    return replace(motion, qpos=np.concatenate(pieces), contacts=np.tile(motion.contacts, (cycles, 1)))


def to_length(motion: Motion, seconds: float) -> Motion:
    """A motion of a length: a loop is repeated and then no loop any more, other motions are cut.

    Args:
        motion: the motion; one that is shorter and no loop stays as it is.
        seconds: from the first frame to the last, in whole frames [s].

    Raises:
        MotionError: less than two frames are left.
    """
    if motion.loop:
        cycles = int(-(-(seconds * motion.fps + 1) // len(motion)))
        motion = replace(repeat(motion, max(1, cycles)), loop=False)
    motion = cut(motion, 0, min(len(motion), round(seconds * motion.fps) + 1))
    if len(motion) < 2:
        raise MotionError(f"{motion.name}: {len(motion)} frame left; tracking needs at least 2")
    return motion


def loop_displacement(motion: Motion) -> tuple[float, FloatArray]:
    """How far one cycle of a loop turns [rad], and its root's step on the floor (2,), in the motion's world frame [m].

    The pose after the last is interpolated from the last and the first two inter-frame root displacements.

    Args:
        motion: a motion of at least 2 frames.
    """
    heading = np.unwrap(yaw(motion.qpos[:, 3:7]))
    turn = float(wrap_angle(heading[-1] - heading[0] + _missing_step(np.diff(heading), np.diff(heading))))
    turn = 0.0 if abs(turn) < 1e-9 else turn
    c, s = np.cos(turn), np.sin(turn)
    steps = np.diff(motion.qpos[:, :2], axis=0)
    # the first steps of the cycle, turned to its end
    step = motion.qpos[-1, :2] - motion.qpos[0, :2] + _missing_step(steps, steps @ np.array([[c, s], [-s, c]]))
    return turn, step


def _missing_step(before: FloatArray, after: FloatArray) -> FloatArray:
    """The step between two runs of steps: cubic through two on either side; linear where there is only one."""
    nearest = before[-1] + after[0]
    return np.asarray(nearest / 2 if len(before) < 4 else (4 * nearest - before[-2] - after[1]) / 6)


def concatenate(a: Motion, b: Motion) -> Motion:
    """b after a. b is moved on the floor so that its first frame replaces a's last, in place and heading.

    Args:
        a: first motion.
        b: second motion, of the same body; resampled to a's frame rate.

    Raises:
        MotionError: different bodies.
    """
    if a.character != b.character:
        raise MotionError(f"{a.name} and {b.name} belong to different bodies: {a.character}, {b.character}")
    b = at_origin(resample(replace(b, loop=False), a.fps))
    x, y = a.qpos[-1, :2]
    b = move(move(b, turn=float(yaw(a.qpos[-1, 3:7]))), translation=(x, y))
    events = {**a.events, **{key: frame + len(a) - 1 for key, frame in b.events.items()}}
    return replace(
        a,
        qpos=np.concatenate([a.qpos[:-1], b.qpos]),
        contacts=np.concatenate([a.contacts[:-1], b.contacts]),
        events={key: frame for key, frame in events.items() if frame < len(a) - 1 + len(b)},
        name=f"{a.name}+{b.name}",
        source=f"{a.source}; {b.source}",
        loop=False,
    )


def mirror(motion: Motion) -> Motion:
    """The motion reflected in the plane y = 0. Left and right swap, in the names of events too."""
    index, sign = motion.character.mirror_map
    qpos = motion.qpos.copy()
    qpos[:, 1] *= -1
    qpos[:, [4, 6]] *= -1  # a reflection in y keeps the rotation about y and reverses those about x and z
    qpos[:, 7:] = sign * motion.qpos[:, 7:][:, index]
    events = {_other_side(name): frame for name, frame in motion.events.items()}
    return replace(motion, qpos=qpos, contacts=motion.contacts[:, ::-1], events=events, name=f"{motion.name}_mirrored")


def _other_side(name: str) -> str:
    for one, other in (SIDES, SIDES[::-1]):
        if name.startswith(f"{one}_"):
            return other + name.removeprefix(one)
    return name
