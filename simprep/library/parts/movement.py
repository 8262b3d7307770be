"""Building blocks of movements: arm keys, support points and assembly of a motion from curves in time."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.library.entry import FPS
from simprep.library.parts.feet import FootPath, Stance, both_feet
from simprep.library.parts.limbs import SIGNS, arm_angles, limb_lengths
from simprep.library.parts.posture import Pose, key_poses, set_hinges, trunk_rotation
from simprep.library.parts.whole_body import HipRelative, JointSwing, Plan, solve_whole_body
from simprep.motion.curves import Curve, constant, key_curve
from simprep.motion.motion import Motion
from simprep.motion.rotations import axis_rotation


@dataclass(frozen=True)
class ArmKey:
    """Where a fist is at one time.

    Attributes:
        time: [s].
        fist: middle of the fist relative to the shoulder, in the thorax frame: forward, outward, up [m].
        elbow: direction in which the elbow points: forward, outward, up.
        pronation_deg: of the forearm; 0: thumb on the elbow's inner side, 80: palm down [deg].
        straight: the fist moves to the next key on a straight line; else the joint angles are interpolated. Change it
            only where the arm rests (a key held twice).
    """

    time: float
    fist: tuple[float, float, float]
    elbow: tuple[float, float, float] = (-0.3, 0.4, -1.0)
    pronation_deg: float = 20.0
    straight: bool = False


HANGING = ((0.07, 0.08, -0.60), (-1.0, 0.35, 0.0), 15.0)
"""Arm beside the body: fist, elbow direction, pronation."""
GUARD_LEAD = ((0.30, -0.06, 0.13), (-0.1, 0.35, -1.0), 35.0)
"""Guard of the front hand: fist at chin height before the face."""
GUARD_REAR = ((0.21, -0.10, 0.15), (-0.2, 0.30, -1.0), 35.0)
"""Guard of the rear hand: fist beside the chin."""

UPRIGHT: Pose = {}
"""Trunk and neck straight."""

ArmPose = tuple[tuple[float, float, float], tuple[float, float, float], float]


def arm_keys(*keys: tuple[float, ArmPose], straight: tuple[float, float] | None = None) -> tuple[ArmKey, ...]:
    """Arm keys from (time [s], pose) pairs; in the time span `straight` [s] the fist moves on straight lines."""
    first, last = straight or (np.inf, np.inf)
    return tuple(ArmKey(time, *pose, straight=bool(first <= time < last)) for time, pose in keys)


def aimed(reach: float, inward_deg: float, up_deg: float, pronation_deg: float = 75.0) -> ArmPose:
    """An arm stretched towards a direction of the thorax frame, elbow below.

    Args:
        reach: shoulder to fist [m].
        inward_deg: direction from straight ahead, towards the other side [deg].
        up_deg: direction above level [deg].
        pronation_deg: of the forearm [deg].
    """
    inward, up = np.radians(inward_deg), np.radians(up_deg)
    level = reach * np.cos(up)
    fist = (float(level * np.cos(inward)), float(-level * np.sin(inward)), float(reach * np.sin(up)))
    return fist, (0.0, 0.5, -1.0), pronation_deg


@dataclass(frozen=True)
class Movement:
    """A movement as curves in time; what is not given stays as in standing.

    Attributes:
        name: of the motion.
        duration: [s].
        feet: path of the left and right foot.
        pressure: planned ZMP keys: (time [s], x, y [m]).
        com_height: COM height over time [m].
        trunk: key poses of trunk and neck [deg].
        yaw, pitch, roll: of the pelvis over time [rad].
        arms: keys of the left and right arm; an arm without keys follows `arm_poses`.
        arm_poses: key poses of the arms [deg], for swings about the shoulder.
        events: times of the events [s].
        swing_legs, joint_legs: (left, right) leg in free swing, or None.
    """

    name: str
    duration: float
    feet: tuple[FootPath, FootPath]
    pressure: Sequence[tuple[float, float, float]]
    com_height: Curve
    trunk: Sequence[tuple[float, Pose]]
    arms: tuple[Sequence[ArmKey], Sequence[ArmKey]] = ((), ())
    arm_poses: Sequence[tuple[float, Pose]] = ((0.0, {}), (1.0, {}))
    yaw: Curve = field(default_factory=constant)
    pitch: Curve = field(default_factory=constant)
    roll: Curve = field(default_factory=constant)
    events: Mapping[str, float] = field(default_factory=dict)
    swing_legs: tuple["SwingLeg | None", "SwingLeg | None"] = (None, None)
    joint_legs: tuple["JointLeg | None", "JointLeg | None"] = (None, None)


@dataclass(frozen=True)
class SwingLeg:
    """A leg that swings freely, as angles in its sagittal plane.

    Attributes:
        thigh: angle of the thigh forward from vertical over time [rad].
        knee: knee flexion over time [rad].
        weight: share of these against the foot's path over the floor, over time, 0 to 1.
        outward: ankle beside the hip, outward positive [m].
    """

    thigh: Curve
    knee: Curve
    weight: Curve
    outward: float = 0.0

    def offset(self, side: str, times: FloatArray) -> FloatArray:
        """Ankle minus hip centre (T, 3), world axes [m]."""
        lengths = limb_lengths()
        thigh, shank = self.thigh(times), self.thigh(times) - self.knee(times)
        forward = lengths.thigh * np.sin(thigh) + lengths.shank * np.sin(shank)
        up = -lengths.thigh * np.cos(thigh) - lengths.shank * np.cos(shank)
        return np.stack([forward, np.full(len(times), SIGNS[side] * self.outward), up], axis=-1)


@dataclass(frozen=True)
class JointLeg:
    """A leg that swings freely in any direction, as joint angles.

    Attributes:
        angles: (T, 6) over time in the order of `simprep.library.parts.limbs.leg_joints` [rad].
        weight: share of these against the angles that put the foot on its path, over time, 0 to 1.
    """

    angles: Curve
    weight: Curve


def build_movement(movement: Movement) -> Motion:
    """The motion of a movement at 60 frames per second.

    Raises:
        MotionError: a pose leaves the joint limits.
    """
    times = np.arange(round(movement.duration * FPS) + 1) / FPS
    hinges = key_poses(movement.trunk, times) + key_poses(movement.arm_poses, times)
    for side, keys in zip(SIDES, movement.arms):
        if keys:
            _set_arm(hinges, side, keys, times)
    swing = None
    if any(leg is not None for leg in movement.swing_legs):
        offset, weight = np.zeros((len(times), 2, 3)), np.zeros((len(times), 2))
        for number, (side, leg) in enumerate(zip(SIDES, movement.swing_legs)):
            if leg is not None:
                offset[:, number], weight[:, number] = leg.offset(side, times), leg.weight(times)
        swing = HipRelative(offset, weight)
    joints = None
    if any(joint_leg is not None for joint_leg in movement.joint_legs):
        angles, weight = np.zeros((len(times), 2, 6)), np.zeros((len(times), 2))
        for number, joint_leg in enumerate(movement.joint_legs):
            if joint_leg is not None:
                angles[:, number], weight[:, number] = joint_leg.angles(times), joint_leg.weight(times)
        joints = JointSwing(angles, weight)
    table = np.array(movement.pressure)
    plan = Plan(
        FPS,
        *both_feet(movement.feet, times),
        zmp=key_curve(list(table[:, 0]), table[:, 1:])(times),
        com_height=movement.com_height(times),
        root_rotation=trunk_rotation(movement.yaw(times), movement.pitch(times), movement.roll(times)),
        hinges=hinges,
        hip_relative=swing,
        joint_swing=joints,
    )
    return Motion(
        qpos=solve_whole_body(plan),
        fps=FPS,
        contacts=plan.contacts,
        character=plan.character,
        events={name: round(time * FPS) for name, time in movement.events.items()},
        name=movement.name,
        source=f"simprep library: {movement.name}",
    )


def support_point(side: str, stance: Stance, forward: float = 0.05) -> FloatArray:
    """A point (2,) on the long axis of the `left` or `right` flat sole, `forward` metres before the ankle [m]."""
    turn = axis_rotation("z", SIGNS[side] * stance.toe_out)
    return np.array([stance.x, stance.y]) + forward * turn[:2, 0]


def between(points: tuple[FloatArray, FloatArray], left_share: float) -> tuple[float, float]:
    """The point between the left and right support point (2,) [m]; a share of 1 is the left one."""
    x, y = left_share * points[0] + (1 - left_share) * points[1]
    return float(x), float(y)


def shared_pressure(
    points: tuple[FloatArray, FloatArray], left_shares: Sequence[tuple[float, float]]
) -> list[tuple[float, float, float]]:
    """Pressure keys (time [s], x, y [m]) of two feet that stay where they are.

    Args:
        points: left and right support point (2,) [m].
        left_shares: keys (time [s], share of the load on the left foot).
    """
    return [(time, *between(points, share)) for time, share in left_shares]


def degrees_curve(*keys: tuple[float, float]) -> Curve:
    """Curve through (time [s], angle [deg]) keys, in radians."""
    times, degrees = np.array(keys).T
    return key_curve(list(times), np.radians(degrees))


def curve(*keys: tuple[float, float]) -> Curve:
    """Curve through (time [s], value) keys."""
    times, values = np.array(keys).T
    return key_curve(list(times), values)


def _set_arm(hinges: FloatArray, side: str, keys: Sequence[ArmKey], times: FloatArray) -> None:
    outward = np.array([1.0, SIGNS[side], 1.0])
    shoulder = limb_lengths().shoulder[SIDES.index(side)]
    at = [key.time for key in keys]
    fists = np.array([key.fist for key in keys]) * outward + shoulder
    elbows = np.array([key.elbow for key in keys]) * outward
    angles = key_curve(at, np.unwrap(arm_angles(side, fists, elbows), axis=0))(times)
    if any(key.straight for key in keys):
        line = arm_angles(side, key_curve(at, fists)(times), key_curve(at, elbows)(times))
        segment = np.clip(np.searchsorted(at, times, side="right") - 1, 0, None)
        on_line = np.array([key.straight for key in keys])[segment]
        angles = np.where(on_line[:, None], line, angles)
    names = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")
    values: dict[str, FloatArray | float] = {f"{side}_{name}": angles[:, number] for number, name in enumerate(names)}
    values[f"{side}_forearm_pronation"] = np.radians(key_curve(at, [key.pronation_deg for key in keys])(times))
    set_hinges(hinges, values)
