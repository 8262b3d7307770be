"""Assembly of a kick from postures: guard, lift-off, chamber, strike, fold, landing, guard.

A kick uses the right leg, the left foot in front; left kicks are mirror images. The order of the movements is that of
Gavagan & Sayers 2017, PLoS One e0182645: pelvis, hip, knee; the support foot pivots on its ball.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from simprep.arrays import FloatArray
from simprep.library.parts.feet import FootPath, Stance
from simprep.library.parts.limbs import SIGNS
from simprep.library.parts.movement import (
    GUARD_LEAD,
    GUARD_REAR,
    HANGING,
    UPRIGHT,
    ArmKey,
    ArmPose,
    JointLeg,
    Movement,
    arm_keys,
    build_movement,
    curve,
    degrees_curve,
)
from simprep.library.parts.posture import Pose
from simprep.motion.curves import Curve, key_curve
from simprep.motion.motion import Motion

BALL_M, MIDFOOT_M, PUSH_M = 0.108, 0.055, 0.10
"""Centre of pressure before the ankle: pivoting on the ball, standing on one foot, under the rear foot [m]."""
INWARD_M = 0.01
"""Shift of the pressure under the standing foot towards the landing foot while the leg comes back [m]."""
HEEL_UP_DEG = 1.5
"""Foot pitch while pivoting: the ball carries and the heel is half a centimetre up [deg]."""


@dataclass(frozen=True)
class LegPose:
    """Joint angles of the kicking leg [deg].

    Attributes:
        flexion, abduction, rotation: of the hip; rotation inward positive.
        knee: flexion.
        ankle, inversion: of the foot; ankle: dorsiflexion.
    """

    flexion: float
    abduction: float = 0.0
    rotation: float = 0.0
    knee: float = 0.0
    ankle: float = 0.0
    inversion: float = 0.0

    def hip(self) -> tuple[float, float, float]:
        """Flexion, abduction, rotation [deg]."""
        return self.flexion, self.abduction, self.rotation


@dataclass(frozen=True)
class Posture:
    """The whole body at one phase of a kick.

    Attributes:
        leg: the kicking leg.
        yaw: of the pelvis, towards the side of the standing leg positive [deg].
        pitch: of the pelvis, forward positive [deg].
        hike: roll of the pelvis, kicking hip up [deg].
        pivot: turn of the standing foot outward [deg].
        com_height: [m].
        trunk: hinges of trunk and neck [deg].
        arms: left and right.
    """

    leg: LegPose
    yaw: float
    pitch: float
    hike: float
    pivot: float
    com_height: float
    trunk: Pose
    arms: tuple[ArmPose, ArmPose] = (GUARD_LEAD, GUARD_REAR)


@dataclass(frozen=True)
class KickPhases:
    """Times of a kick [s].

    Attributes:
        ready: guard reached.
        target: first frame of the target movement; the weight begins to shift.
        lift, land: the kicking foot leaves the floor, is back on it.
        chamber, strike: knee most flexed, knee straightest.
        fold: leg folded again.
        lower: the arms begin to leave the guard.
        duration: end of the motion.
        hip_lead: lead of the hip on the knee at the strike.
        pelvis_lead: lead of the pelvis and the pivot on the knee at the strike.
        turn_lead: from the start of the pelvis turn to the lift.
        follow: time the pelvis stays turned after the strike.
        contact_lead: from the event `impact`, when the foot is fastest, to the strike.
    """

    ready: float = 0.70
    target: float = 0.90
    lift: float = 1.28
    chamber: float = 1.55
    strike: float = 1.75
    fold: float = 2.02
    land: float = 2.48
    lower: float = 2.68
    duration: float = 3.35
    hip_lead: float = 0.02
    pelvis_lead: float = 0.04
    turn_lead: float = 0.24
    follow: float = 0.10
    contact_lead: float = 2 / 60


@dataclass(frozen=True)
class KickStance:
    """Fighting stance at the beginning and end of a kick, left foot in front.

    Attributes:
        front, rear: left and right foot: x, y [m], toes outward [deg].
        yaw: of the pelvis [deg].
        upright, low: COM height standing and in guard [m].
        trunk: hinges of trunk and neck in guard [deg].
        front_share: of the load on the front foot in guard.
    """

    front: tuple[float, float, float] = (0.13, 0.10, 16.0)
    rear: tuple[float, float, float] = (-0.14, -0.11, 25.0)
    yaw: float = -16.0
    upright: float = 0.978
    low: float = 0.955
    trunk: Pose = field(
        default_factory=lambda: {
            "lumbar_flexion": 4, "thorax_flexion": 7, "lumbar_rotation": -3, "thorax_rotation": -4,
            "neck_rotation": 14, "head_rotation": 8, "neck_flexion": -4,
        }
    )  # fmt: skip
    front_share: float = 0.52


@dataclass(frozen=True)
class Kick:
    """One kick of the right leg.

    Attributes:
        name: of the motion.
        chamber: posture with the leg folded and the knee towards the target.
        strike: posture with the leg at its straightest.
        fold: posture after the leg was pulled back.
        phases: times.
        stance: before and after.
        lift_leg, land_leg: angles of the leg when the foot leaves the floor and when it returns.
        inward: shift of the pressure to the inner edge of the standing foot at the strike [m].
    """

    name: str
    chamber: Posture
    strike: Posture
    fold: Posture
    phases: KickPhases = field(default_factory=KickPhases)
    stance: KickStance = field(default_factory=KickStance)
    lift_leg: LegPose = field(default_factory=lambda: LegPose(-4, 8, 0, 45, 5))
    land_leg: LegPose = field(default_factory=lambda: LegPose(4, 8, 0, 30, 0))
    inward: float = 0.0


def flexion_towards(abduction: float, hike: float, turn: float) -> float:
    """Hip flexion that brings an abducted thigh into a vertical plane [deg].

    It is the root of tan(turn) sin f - sin h cos f = tan a cos h, with flexion f, abduction a and hike h.

    Args:
        abduction: of the hip [deg].
        hike: of the pelvis, kicking side up [deg].
        turn: from the pelvis's forward direction to the plane, towards the kicking side [deg].
    """
    a, h, slope = np.radians(abduction), np.radians(hike), np.tan(np.radians(turn))
    share = np.clip(np.tan(a) * np.cos(h) / np.hypot(slope, np.sin(h)), -1.0, 1.0)
    return float(np.degrees(np.arctan2(np.sin(h), slope) + np.arcsin(share)))


def leaning_trunk(
    lean: float, hike: float, twist: float, gaze: float, flexion: tuple[float, float] = (6.0, 8.0)
) -> Pose:
    """Trunk and neck of a kick in which the body leans away from the leg.

    Args:
        lean: to the side, in the world [deg].
        hike: of the pelvis, which takes part of the lean [deg].
        twist: rotation of the trunk against the pelvis [deg].
        gaze: turn of the head against the chest [deg].
        flexion: of the lumbar spine and the thorax [deg].
    """
    bend = lean - hike
    return {
        "lumbar_flexion": flexion[0], "thorax_flexion": flexion[1], "lumbar_bending": 0.5 * bend,
        "thorax_bending": 0.5 * bend, "lumbar_rotation": 0.45 * twist, "thorax_rotation": 0.55 * twist,
        "neck_bending": -0.4 * lean, "neck_rotation": 0.55 * gaze, "head_rotation": 0.45 * gaze, "neck_flexion": -2,
    }  # fmt: skip


def build_kick(kick: Kick) -> Motion:
    """The motion of a kick.

    Raises:
        MotionError: a posture leaves the joint limits.
    """
    phases, stance = kick.phases, kick.stance
    end = phases.duration - 0.05
    front = Stance(0.0, phases.duration, stance.front[0], stance.front[1], np.radians(stance.front[2]))
    rear = [
        Stance(a, b, stance.rear[0], stance.rear[1], np.radians(stance.rear[2]))
        for a, b in ((0.0, phases.lift), (phases.land, phases.duration))
    ]
    floor_pitch = degrees_curve(
        (phases.lift - 0.26, 0), (phases.lift, -40), (phases.chamber, -50), (phases.fold, -40), (phases.land, -18),
        (phases.land + 0.16, 0),
    )  # fmt: skip
    pivot, heel = _pivot(kick)
    feet = (
        FootPath("left", (front,), pitch=heel, pivot=pivot),
        FootPath(
            "right", tuple(rear), pitch=floor_pitch,
            via=((phases.lift + 0.25, 2, 0.30), (phases.land - 0.22, 2, 0.28)),
        ),
    )  # fmt: skip
    chamber, strike, fold = kick.chamber, kick.strike, kick.fold
    target = Movement(
        name=kick.name,
        duration=phases.duration,
        feet=feet,
        pressure=_pressure(kick, front, rear[0], pivot, heel),
        com_height=curve(
            (0.1, stance.upright), (phases.ready, stance.low), (phases.lift - 0.2, stance.low),
            (phases.chamber, chamber.com_height), (phases.strike, strike.com_height), (phases.fold, fold.com_height),
            (phases.land, stance.low + 0.008), (phases.lower, stance.low), (end, stance.upright),
        ),
        trunk=[
            (0.1, UPRIGHT), (phases.ready, stance.trunk), (phases.lift - 0.18, stance.trunk),
            (phases.chamber, chamber.trunk), (phases.strike, strike.trunk), (phases.fold, fold.trunk),
            (phases.land, stance.trunk), (phases.lower, stance.trunk), (end, UPRIGHT),
        ],
        yaw=_pelvis(kick, 0.5 * stance.yaw, stance.yaw, [chamber.yaw, strike.yaw, fold.yaw]),
        pitch=_pelvis(kick, 0.0, 3.0, [chamber.pitch, strike.pitch, fold.pitch]),
        roll=_pelvis(kick, 0.0, 0.0, [-chamber.hike, -strike.hike, -fold.hike]),
        arms=(_arm(kick, 0), _arm(kick, 1)),
        events={"target": phases.target, "impact": phases.strike - phases.contact_lead},
        joint_legs=(None, _leg(kick)),
    )  # fmt: skip
    return build_movement(target)


def _leg(kick: Kick) -> JointLeg:
    phases = kick.phases
    late = phases.land - 0.08
    hip = _angles(
        (phases.lift, kick.lift_leg.hip()), (phases.chamber, kick.chamber.leg.hip()),
        (phases.strike - phases.hip_lead, kick.strike.leg.hip()), (phases.fold, kick.fold.leg.hip()),
        (late, kick.land_leg.hip()), (phases.land, kick.land_leg.hip()),
    )  # fmt: skip
    foot = _angles(
        *(
            (time, (leg.knee, leg.ankle, leg.inversion))
            for time, leg in (
                (phases.lift, kick.lift_leg), (phases.chamber, kick.chamber.leg), (phases.strike, kick.strike.leg),
                (phases.fold, kick.fold.leg), (late, kick.land_leg), (phases.land, kick.land_leg),
            )
        )
    )  # fmt: skip

    def angles(times: FloatArray) -> FloatArray:
        return np.concatenate([hip(times), foot(times)], axis=1)

    weight = curve((phases.lift + 0.05, 0), (phases.lift + 0.24, 1), (phases.fold + 0.05, 1), (phases.land - 0.15, 0))
    return JointLeg(angles, weight)


def _pelvis(kick: Kick, standing: float, guard: float, kicking: Sequence[float]) -> Curve:
    phases = kick.phases
    chamber, strike, fold = kicking
    return degrees_curve(
        (0.1, standing), (phases.ready, guard), (phases.lift - phases.turn_lead, guard), (phases.chamber, chamber),
        (phases.strike - phases.pelvis_lead, strike), (phases.strike + phases.follow, strike),
        (phases.fold, fold), (phases.land, guard), (phases.lower, guard),
        (phases.duration - 0.05, standing),
    )  # fmt: skip


def _pivot(kick: Kick) -> tuple[Curve, Curve]:
    """Turn and pitch of the standing foot."""
    phases = kick.phases
    angles = (kick.chamber.pivot, kick.strike.pivot, kick.fold.pivot)
    if not any(angles):
        return degrees_curve((0.0, 0), (1.0, 0)), degrees_curve((0.0, 0), (1.0, 0))
    begin, end = phases.lift - 0.10, phases.land + 0.12
    turn = degrees_curve(
        (begin, 0), (phases.chamber, angles[0]), (phases.strike - phases.pelvis_lead, angles[1]),
        (phases.fold, angles[2]), (end, 0),
    )  # fmt: skip
    heel = degrees_curve((begin - 0.12, 0), (begin, -HEEL_UP_DEG), (end, -HEEL_UP_DEG), (end + 0.12, 0))
    return turn, heel


def _pressure(kick: Kick, front: Stance, rear: Stance, pivot: Curve, heel: Curve) -> list[tuple[float, float, float]]:
    """Pressure keys: shared by both feet, then under the standing foot as it turns."""
    phases, share = kick.phases, kick.stance.front_share
    behind = _sole_point(FootPath("right", (rear,)), np.zeros(1), PUSH_M)[0]
    path = FootPath("left", (front,), pitch=heel, pivot=pivot)
    ahead = MIDFOOT_M + (BALL_M - MIDFOOT_M) * np.clip(
        -heel(np.array([phases.chamber])) / np.radians(HEEL_UP_DEG), 0, 1
    )

    def key(time: float, left: float, forward: float = MIDFOOT_M) -> tuple[float, float, float]:
        inward = (
            float(
                np.interp(
                    time,
                    [phases.lift, phases.chamber, phases.strike, phases.fold],
                    [0.0, kick.inward, kick.inward, max(kick.inward, INWARD_M)],
                )
            )
            if left == 1.0
            else 0.0
        )
        point = left * _sole_point(path, np.array([time]), forward, inward)[0] + (1 - left) * behind
        return time, float(point[0]), float(point[1])

    alone = np.linspace(phases.lift - 0.02, phases.land + 0.01, 20)
    return [
        key(0.0, 0.5), key(phases.ready, share), key(phases.target, share), key(phases.target + 0.1, share - 0.06),
        *(key(float(time), 1.0, float(ahead[0])) for time in alone),
        key(phases.land + 0.34, share), key(phases.duration, 0.5),
    ]  # fmt: skip


def _sole_point(path: FootPath, times: FloatArray, forward: float, inward: float = 0.0) -> FloatArray:
    position, rotation, _ = path.at(times)
    return np.asarray((position + forward * rotation[:, :, 0] - SIGNS[path.side] * inward * rotation[:, :, 1])[:, :2])


def _arm(kick: Kick, number: int) -> Sequence[ArmKey]:
    phases, guard = kick.phases, (GUARD_LEAD, GUARD_REAR)[number]
    return arm_keys(
        (0.1, HANGING), (phases.ready, guard), (phases.lift - 0.1, guard), (phases.chamber, kick.chamber.arms[number]),
        (phases.strike, kick.strike.arms[number]), (phases.fold + 0.1, kick.fold.arms[number]),
        (phases.land + 0.1, guard), (phases.lower, guard), (phases.duration - 0.05, HANGING),
    )  # fmt: skip


def _angles(*keys: tuple[float, tuple[float, ...]]) -> Curve:
    times, degrees = zip(*keys)
    return key_curve(list(times), np.radians(np.array(degrees)))
