"""Limits of the joints: range, velocity, torque; and jumps from one frame to the next."""

import numpy as np

from simprep.arrays import FloatArray
from simprep.check.finding import Finding, graded
from simprep.check.subject import Subject
from simprep.humanoid_model import GRAVITY
from simprep.motion.rotations import multiply_quat
from simprep.physics.inverse_dynamics import InverseDynamics
from simprep.physics.reference import make_reference

RANGE_WARN_DEG, RANGE_FAIL_DEG = 1.0, 5.0
"""MuJoCo's limits are soft: a degree is what a joint gives."""
USUAL_VELOCITY = 40.0
"""Joint velocity taken as the limit where the character states none: fast human joints, elite throws aside [rad/s]."""
VELOCITY_FAIL = 1.5
"""Times the limit from which a velocity is a fault, not effort."""
JUMP_WARN_M, JUMP_FAIL_M = 0.03, 0.08
JUMP_G = 10.0
"""A centre of mass is not accelerated by more than this many g: no landing or kick of a person does [1]."""
TORQUE_WARN, TORQUE_FAIL = 0.4, 0.7
"""Share of the time in which some joint needs more than its limit. Captured noise alone makes a third in fast clips."""
TORQUE_STEP_S = 1 / 240


def joint_range(subject: Subject) -> Finding:
    """The farthest that a joint is outside its range."""
    low, high = subject.character.limits.T
    angles = subject.motion.qpos[:, 7:]
    beyond = np.degrees(np.maximum(low - angles, angles - high))
    frame, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    value = max(0.0, float(beyond[frame, joint]))
    over = int((beyond > RANGE_WARN_DEG).any(axis=0).sum())
    return graded(
        "joint range", value, "deg", RANGE_WARN_DEG, RANGE_FAIL_DEG, subject.frame(frame),
        subject.character.joints[joint] if value else "", f"{over} joints beyond their range" if over else "",
    )  # fmt: skip


def joint_velocity(subject: Subject) -> Finding:
    """The largest joint velocity between two frames, as a multiple of the joint's limit.

    Where the character states limits, every hinge is a motor and is judged by itself. Where it states none, hinges that
    move the same segment are one joint, as in a person: an arm may turn half around in coordinates and hardly move.
    """
    limits, stated = velocity_limits(subject)
    hinges = np.abs(np.diff(subject.motion.qpos[:, 7:], axis=0)) * subject.fps
    speed = hinges if stated else np.minimum(hinges, _segment_speed(subject))
    share = speed / limits
    frame, joint = np.unravel_index(int(np.argmax(share)), share.shape)
    fast = int((share > 1).any(axis=1).sum())
    source = "limits of the character" if stated else f"the character states no limits: {USUAL_VELOCITY:g} rad/s taken"
    return graded(
        "joint velocity", float(share[frame, joint]), "of the limit", 1.0, VELOCITY_FAIL, subject.frame(frame),
        subject.character.joints[joint],
        f"{speed[frame, joint]:.0f} rad/s" + (f", too fast in {fast} frames" if fast else "") + f"; {source}",
    )  # fmt: skip


def _segment_speed(subject: Subject) -> FloatArray:
    """Speed (T - 1, J) at which the segment of each hinge turns against the one that carries it [rad/s]."""
    model, quat = subject.character.model, subject.kinematics.xquat  # of every segment: model bodies from 1
    own = model.jnt_bodyid[1:]
    carrier = model.body_parentid[own]
    relative = multiply_quat(quat[:, carrier - 1] * [1.0, -1.0, -1.0, -1.0], quat[:, own - 1])
    turn = multiply_quat(relative[:-1] * [1.0, -1.0, -1.0, -1.0], relative[1:])
    angle = 2 * np.arctan2(np.linalg.norm(turn[..., 1:], axis=-1), np.abs(turn[..., 0]))
    return np.asarray(angle * subject.fps)


def velocity_limits(subject: Subject) -> tuple[FloatArray, bool]:
    """Largest velocity of each joint (J,) [rad/s], and whether the character states it."""
    limits = np.asarray(getattr(subject.character, "velocity_limits", ()), dtype=np.float64)
    if not len(limits):
        return np.full(len(subject.character.joints), USUAL_VELOCITY), False
    return np.where(np.isfinite(limits) & (limits > 0), limits, USUAL_VELOCITY), True


def jumps(subject: Subject) -> Finding:
    """The largest jump of the centre of mass between frames, beyond what any acceleration explains.

    A frame is off if the centre of mass leaves the straight line through its neighbours farther than `JUMP_G` allow.
    """
    off = np.linalg.norm(np.diff(subject.kinematics.com, 2, axis=0), axis=1)
    beyond = np.maximum(off - JUMP_G * GRAVITY / subject.fps**2, 0.0)
    frame = int(np.argmax(beyond))
    return graded(
        "jump", float(beyond[frame]), "m", JUMP_WARN_M, JUMP_FAIL_M, subject.frame(frame + 1), "centre of mass",
        f"{off[frame] * subject.fps**2 / GRAVITY:.0f} g between frames" if beyond[frame] > JUMP_WARN_M else "",
    )  # fmt: skip


def torque(subject: Subject) -> Finding:
    """Share of the time in which the motion needs more than some joint's torque, by inverse dynamics."""
    reference = make_reference(subject.motion, TORQUE_STEP_S)
    needed = np.abs(InverseDynamics(subject.character).torques(reference)) / subject.character.torque_limits
    over = needed.max(axis=1)
    step = int(np.argmax(over))
    joint = int(np.argmax(np.percentile(needed, 95, axis=0)))
    return graded(
        "torque", float((over > 1).mean()), "of the time", TORQUE_WARN, TORQUE_FAIL,
        subject.frame(round(step * TORQUE_STEP_S * subject.fps)), _moved_joint(subject, joint),
        f"95th percentile of the joint nearest to its limit: {np.percentile(needed[:, joint], 95):.2f} of it",
    )  # fmt: skip


def _moved_joint(subject: Subject, actuator: int) -> str:
    model = subject.character.model
    return str(model.joint(int(model.actuator_trnid[actuator, 0])).name)
