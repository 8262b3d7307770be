"""From a plan (feet, ZMP, COM height, trunk and arms) to the whole body's poses."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import BoolArray, FloatArray
from simprep.character import Character
from simprep.errors import MotionError
from simprep.humanoid_model import humanoid
from simprep.library.parts.balance import cart_table_zmp, com_from_zmp, ground_reaction, later_period
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.limb_ik import legs, solve_leg
from simprep.motion.rotations import continuous_quat, multiply_quat
from simprep.motion.turns import about_vertical


@dataclass(frozen=True)
class HipRelative:
    """A foot that moves with its hip instead of with the floor (kicks, flights).

    Attributes:
        offset: (T, 2, 3) ankle minus hip centre, world axes [m], left and right.
        weight: (T, 2) share of this against the world path, 0 to 1.
    """

    offset: FloatArray
    weight: FloatArray


@dataclass(frozen=True)
class JointSwing:
    """A leg given by joint angles instead of the place of its foot (kicks out of the sagittal plane).

    Attributes:
        angles: (T, 2, 6) hinges of the left and right leg in the order of `leg_joints` [rad].
        weight: (T, 2) share of these angles against those that put the foot on its path, 0 to 1.
    """

    angles: FloatArray
    weight: FloatArray


@dataclass(frozen=True)
class Plan:
    """What the whole body should do.

    Attributes:
        fps: frames per second [1/s].
        foot_position: (T, 2, 3) ankle centres, world [m], left and right.
        foot_rotation: (T, 2, 3, 3) of the feet.
        contacts: (T, 2) which feet support.
        zmp: (T, 2) planned zero-moment point [m].
        com_height: (T,) [m].
        root_rotation: (T, 3, 3) of the pelvis.
        hinges: (T, joints) of trunk and arms [rad]; those of the legs are ignored.
        shift: (2,) travel per period of a cyclic motion [m], else None.
        turn: turn per period of a cyclic motion about the world's origin, before the shift, to the left [rad].
        hip_relative: feet that move with the hips, or None.
        joint_swing: legs with given joint angles, or None.
        passes: how often the ZMP plan is corrected for the angular momentum of the limbs.
        character: the body.
    """

    fps: float
    foot_position: FloatArray
    foot_rotation: FloatArray
    contacts: BoolArray
    zmp: FloatArray
    com_height: FloatArray
    root_rotation: FloatArray
    hinges: FloatArray
    shift: FloatArray | None = None
    turn: float = 0.0
    hip_relative: HipRelative | None = None
    joint_swing: JointSwing | None = None
    passes: int = 5
    character: Character = field(default_factory=lambda: humanoid())


def solve_whole_body(plan: Plan) -> FloatArray:
    """Poses qpos (T, nq) that follow a plan: feet exactly, COM by moving the pelvis, ZMP by a dynamics filter.

    The cart-table model gives the COM path. What the limbs add to the ZMP is measured and subtracted from the plan, a
    few times (Kajita et al. 2003, section 4, as a boundary value problem instead of preview control).

    Raises:
        MotionError: a pose leaves the joint limits by more than 0.5 deg.
    """
    qpos = np.zeros((len(plan.zmp), plan.character.nq))
    quat = Rotation.from_matrix(plan.root_rotation).as_quat(scalar_first=True)
    qpos[:, 3:7] = continuous_quat(quat)
    qpos[:, 7:] = plan.hinges
    limb_part = np.zeros_like(plan.zmp)
    for _ in range(plan.passes + 1):
        com = np.column_stack(
            [com_from_zmp(plan.zmp - limb_part, plan.com_height, plan.fps, plan.shift, turn=plan.turn), plan.com_height]
        )
        kinematics = follow_com(plan, qpos, com)
        limb_part = _limb_zmp(plan, kinematics)
    check_limits(qpos, plan.character)
    return qpos


def follow_com(plan: Plan, qpos: FloatArray, com: FloatArray, tolerance: float = 1e-6, passes: int = 40) -> Kinematics:
    """Move the pelvis until the COM is on its path; the legs follow.

    Args:
        plan: feet, and rotation of the pelvis.
        qpos: (T, nq) poses; root position and legs change in place.
        com: (T, 3) wanted COM [m].
        tolerance: largest distance from it [m].
        passes: most iterations.
    """
    if not qpos[:, :3].any():
        qpos[:, :3] = com - [0.0, 0.0, 0.06]
    for _ in range(passes):
        _place_legs(plan, qpos)
        kinematics = forward_kinematics(qpos, plan.character)
        error = com - kinematics.com
        if np.abs(error).max() < tolerance:
            break
        qpos[:, :3] += 1.15 * error  # the legs carry about a quarter of the mass and move half as far
    return kinematics


def _place_legs(plan: Plan, qpos: FloatArray) -> None:
    for number, leg in enumerate(legs(plan.character)):
        columns = 7 + leg.hinges
        foot = plan.foot_position[:, number]
        if plan.hip_relative is not None:
            weight = plan.hip_relative.weight[:, number, None]
            hip = qpos[:, :3] + plan.root_rotation @ leg.hip
            foot = (1 - weight) * foot + weight * (hip + plan.hip_relative.offset[:, number])
        qpos[:, columns] = solve_leg(leg, qpos[:, :3], plan.root_rotation, foot, plan.foot_rotation[:, number])
        if plan.joint_swing is not None:
            weight = plan.joint_swing.weight[:, number, None]
            qpos[:, columns] *= 1 - weight
            qpos[:, columns] += weight * plan.joint_swing.angles[:, number]


def _limb_zmp(plan: Plan, kinematics: Kinematics) -> FloatArray:
    """ZMP of the whole body minus that of its COM alone; zero in flight."""
    if plan.shift is not None:
        kinematics = _padded(kinematics, plan.shift, plan.turn)
    _, point = ground_reaction(kinematics, plan.fps, plan.character)
    part = np.nan_to_num(point - cart_table_zmp(kinematics.com, plan.fps))
    if plan.shift is not None:
        return part[1:-1]
    part[[0, -1]] = 0.0
    return part


def _padded(kinematics: Kinematics, shift: FloatArray, turn: float) -> Kinematics:
    """One period with its neighbouring frames."""

    def pad(x: FloatArray) -> FloatArray:
        return np.concatenate([later_period(x[-1:], -1, shift, turn), x, later_period(x[:1], 1, shift, turn)])

    quat = kinematics.xquat
    about = about_vertical(turn)
    back = about * [1.0, 1.0, 1.0, -1.0]
    quat = np.concatenate([multiply_quat(back, quat[-1:]), quat, multiply_quat(about, quat[:1])])
    return Kinematics(
        pad(kinematics.xpos), quat, pad(kinematics.xipos), pad(kinematics.com), pad(kinematics.foot_points)
    )


def check_limits(qpos: FloatArray, character: Character = humanoid()) -> None:
    """Clip the hinges of poses (T, nq) to their ranges, in place.

    Raises:
        MotionError: a pose leaves the joint limits by more than 0.5 deg.
    """
    low, high = character.limits.T
    excess = np.maximum(low - qpos[:, 7:], qpos[:, 7:] - high)
    frame, hinge = np.unravel_index(int(np.argmax(excess)), excess.shape)
    if excess[frame, hinge] > np.radians(0.5):
        raise MotionError(
            f"frame {frame}: {character.joints[hinge]} at {np.degrees(qpos[frame, 7 + hinge]):.1f} deg; "
            f"valid: {np.degrees(low[hinge]):.0f} to {np.degrees(high[hinge]):.0f}"
        )
    qpos[:, 7:] = np.clip(qpos[:, 7:], low, high)
