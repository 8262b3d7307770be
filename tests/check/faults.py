"""Faults that real motion files have, put into a clean motion; each with the checks of which one must raise it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.motion.contacts import stances
from simprep.motion.edit import repeat
from simprep.motion.formats.robot_order import breadth_first
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion


@dataclass(frozen=True)
class Fault:
    name: str
    apply: Callable[[Motion], Motion]
    raised: tuple[str, ...]
    bases: tuple[str, ...] = ("walk", "walk_fast", "kick_front")


def once(motion: Motion) -> Motion:
    """A loop as three cycles."""
    return replace(repeat(motion, 3), loop=False) if motion.loop else motion


def with_root(motion: Motion, position=None, quat=None) -> Motion:
    qpos = motion.qpos.copy()
    if position is not None:
        qpos[:, :3] = position
    if quat is not None:
        qpos[:, 3:7] = quat
    return replace(motion, qpos=qpos)


def with_angles(motion: Motion, angles) -> Motion:
    qpos = motion.qpos.copy()
    qpos[:, 7:] = angles
    return replace(motion, qpos=qpos)


def quat_order(motion: Motion, order) -> Motion:
    return with_root(motion, quat=motion.qpos[:, 3:7][:, order])


def turned(motion: Motion, turn: Rotation, quat: bool = True) -> Motion:
    about = (turn * Rotation.from_quat(motion.qpos[:, 3:7], scalar_first=True)).as_quat(scalar_first=True)
    return with_root(motion, turn.apply(motion.qpos[:, :3].copy()), about if quat else None)


def about_face(motion: Motion) -> Motion:
    quat = Rotation.from_quat(motion.qpos[:, 3:7], scalar_first=True) * Rotation.from_rotvec([0, 0, np.pi])
    return with_root(motion, quat=quat.as_quat(scalar_first=True))


def longest_stance(motion: Motion) -> tuple[int, int, int]:
    spans = [
        (after - first, side, first, after) for side in (0, 1) for first, after in stances(motion.contacts[:, side])
    ]
    _, side, first, after = max(spans)
    return side, first, min(after, first + round(0.6 * motion.fps))


def skating(motion: Motion) -> Motion:
    _, first, after = longest_stance(motion)
    position = motion.qpos[:, :3].copy()
    ramp = np.zeros(len(motion))
    ramp[first:after] = np.linspace(0, 0.1, after - first)
    ramp[after:] = 0.1
    position[:, 1] += ramp
    return with_root(motion, position)


def foot_in_floor(motion: Motion) -> Motion:
    """The pelvis tilts so that one foot is 3 cm lower than the lowest point was."""
    qpos = motion.qpos.copy()
    turn = Rotation.from_quat(qpos[:, 3:7], scalar_first=True) * Rotation.from_rotvec([0.15, 0, 0])
    qpos[:, 3:7] = turn.as_quat(scalar_first=True)
    low = forward_kinematics(qpos, motion.character).foot_points[..., 2].min(axis=(1, 2))
    was = forward_kinematics(motion.qpos, motion.character).foot_points[..., 2].min(axis=(1, 2))
    qpos[:, 2] += was - 0.03 - low
    return replace(motion, qpos=qpos)


def beyond_limit(motion: Motion) -> Motion:
    joint = motion.character.joint(motion.character.group("left_leg")[3])
    angles = motion.qpos[:, 7:].copy()
    middle = slice(len(motion) // 2, len(motion) // 2 + 12)
    angles[middle, joint] = motion.character.limits[joint, 1] + np.radians(10)
    return with_angles(motion, angles)


def spike(motion: Motion) -> Motion:
    joint = motion.character.joint(motion.character.group("right_arm")[3])
    angles = motion.qpos[:, 7:].copy()
    angles[len(motion) // 2, joint] += 200 / motion.fps
    return with_angles(motion, angles)


def swapped(motion: Motion, mirrored: bool = False) -> Motion:
    index, sign = motion.character.mirror_map
    return with_angles(motion, motion.qpos[:, 7:][:, index] * (sign if mirrored else 1.0))


def raised_by(motion: Motion, metres: float) -> Motion:
    return with_root(motion, motion.qpos[:, :3] + [0, 0, metres])


def hover(motion: Motion) -> Motion:
    bump = np.zeros(len(motion))
    middle, width = len(motion) // 2, round(0.5 * motion.fps)
    bump[middle - width : middle + width] = 0.06 * np.hanning(2 * width)
    return with_root(motion, motion.qpos[:, :3] + bump[:, None] * [0, 0, 1])


def teleport(motion: Motion) -> Motion:
    position = motion.qpos[:, :3].copy()
    position[len(motion) // 2 :] += [0.3, 0, 0]
    return with_root(motion, position)


def lost_frames(motion: Motion) -> Motion:
    keep = np.r_[: len(motion) // 2, len(motion) // 2 + round(0.25 * motion.fps) : len(motion)]
    return replace(motion, qpos=motion.qpos[keep], contacts=motion.contacts[keep], events={})


def arm_in_body(motion: Motion) -> Motion:
    angles = motion.qpos[:, 7:].copy()
    flexion, abduction, rotation, elbow = motion.character.joint_indices(motion.character.group("left_arm")[:4])
    angles[:, [flexion, rotation]] = 0.0
    angles[:, elbow] = 0.2
    angles[:, abduction] = motion.character.limits[abduction, 0]
    return with_angles(motion, angles)


def treadmill(motion: Motion) -> Motion:
    return with_root(motion, motion.qpos[:, :3] * [0, 0, 1])


def reordered(motion: Motion) -> Motion:
    return with_angles(motion, motion.qpos[:, 7:][:, breadth_first(motion.character)[0]])


RATE = ("frame rate: steps", "frame rate: fall")
WALKS = ("walk", "walk_fast", "walk_turn_left")
JUMPS = ("jump", "jump_far")
FAULTS = (
    Fault("xyzw read as wxyz", lambda m: quat_order(m, [1, 2, 3, 0]), ("quaternion order",)),
    Fault("wxyz read as xyzw", lambda m: quat_order(m, [3, 0, 1, 2]), ("quaternion order",)),
    Fault("30 read as 60 Hz, walking", lambda m: replace(m, fps=2 * m.fps), RATE, WALKS),
    Fault("30 read as 60 Hz, jumping", lambda m: replace(m, fps=2 * m.fps), RATE, JUMPS),
    Fault("60 read as 30 Hz, jumping", lambda m: replace(m, fps=m.fps / 2), (*RATE, "float"), JUMPS),
    Fault("one foot 3 cm in the floor", foot_in_floor, ("penetration",)),
    Fault("body 3 cm in the floor", lambda m: raised_by(m, -0.03), ("penetration",)),
    Fault("skating stance", skating, ("skating",)),
    Fault("joint 10 deg over its limit", beyond_limit, ("joint range",)),
    Fault("spike of 200 rad/s", spike, ("joint velocity",)),
    Fault("left and right swapped", swapped, ("left and right",)),
    Fault("y up", lambda m: turned(m, Rotation.from_rotvec([-np.pi / 2, 0, 0])), ("vertical axis",)),
    Fault("y up in the position", lambda m: turned(m, Rotation.from_rotvec([-np.pi / 2, 0, 0]), False), ("vertical axis",)),
    Fault("feet floating 5 cm", lambda m: raised_by(m, 0.05), ("float",)),
    Fault("hovering by 6 cm for a second", hover, ("float",)),
    Fault("root reversed", about_face, ("root direction",), WALKS),
    Fault("root travels backwards", lambda m: with_root(m, m.qpos[:, :3] * [-1, -1, 1]), ("root direction",), WALKS),
    Fault("joints breadth first", reordered, ("joint order",)),
    Fault("angles in degrees", lambda m: with_angles(m, np.degrees(m.qpos[:, 7:])), ("units",)),
    Fault("position in centimetres", lambda m: with_root(m, 100 * m.qpos[:, :3]), ("units",)),
    Fault("teleport by 30 cm", teleport, ("jump",)),
    Fault("a quarter of a second lost", lost_frames, ("jump",), ("walk_fast", "jump_far")),
    Fault("arm in the body", arm_in_body, ("self-collision",)),
    Fault("walking without travel", treadmill, ("footing", "skating"), WALKS),
)  # fmt: skip
