"""Front kick of the rear leg: chamber, snap, retraction.

Ranges after the literature: chamber with hip and knee flexed about 85 and 110 deg, foot speed 8 to 10 m/s, knee
extended to 10 to 30 deg at impact, trunk leaning back 10 to 30 deg. Thigh and knee fold together, then the knee extends
fast. Key values are set by hand. The COM is over the standing foot first.
"""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray
from simprep.library.entry import Entry, mirrored
from simprep.library.parts.feet import FootPath, Stance
from simprep.library.parts.movement import (
    GUARD_LEAD,
    GUARD_REAR,
    HANGING,
    UPRIGHT,
    Movement,
    SwingLeg,
    arm_keys,
    build_movement,
    curve,
    degrees_curve,
    shared_pressure,
    support_point,
)
from simprep.motion.curves import Curve
from simprep.motion.motion import Motion

READY_S, TARGET_S = 0.70, 0.90
LIFT_S, CHAMBER_S, IMPACT_S, FOLD_S, LAND_S = 1.30, 1.58, 1.75, 2.02, 2.45
LOWER_S, DURATION_S = 2.65, 3.35
UPRIGHT_M, GUARD_M = 0.98, 0.955


@dataclass(frozen=True)
class FrontKick:
    """A front kick of the right leg, left foot in front; the foot returns to its place.

    Attributes:
        name: of the motion.
        thigh, thigh_chamber, thigh_fold: angle of the thigh forward from vertical at strike, chamber and fold [deg].
        knee_chamber: knee flexion in the chamber [deg].
        lean, lean_chamber: backward tilt of the pelvis at strike and chamber [deg].
        hike: kicking hip above the standing hip [deg].
        com_height, com_high: in the chamber and after the strike [m].
        toes_out: of the kicking foot, in stance and swing [deg].
        longer: delay of the chamber and all after it [s].
    """

    name: str = "kick_front"
    thigh: float = 104.0
    thigh_chamber: float = 90.0
    thigh_fold: float = 86.0
    knee_chamber: float = 114.0
    lean: float = 22.0
    lean_chamber: float = 12.0
    hike: float = 3.0
    com_height: float = 1.035
    com_high: float = 1.045
    toes_out: float = 15.0
    longer: float = 0.0


def front_kick(kick: FrontKick) -> Motion:
    """The motion of a front kick.

    Raises:
        MotionError: a posture leaves the joint limits.
    """
    chamber, impact, fold, land, lower, duration = (
        time + kick.longer for time in (CHAMBER_S, IMPACT_S, FOLD_S, LAND_S, LOWER_S, DURATION_S)
    )
    front = Stance(0.0, duration, 0.12, 0.09, np.radians(6))
    rear = (
        Stance(0.0, LIFT_S, -0.13, -0.10, np.radians(kick.toes_out)),
        Stance(land, duration, -0.13, -0.10, np.radians(kick.toes_out)),
    )
    thigh = degrees_curve(
        (LIFT_S, -2), (chamber, kick.thigh_chamber), (impact - 0.02, kick.thigh), (fold, kick.thigh_fold),
        (land - 0.08, 12), (land, 0),
    )  # fmt: skip
    knee = degrees_curve(
        (LIFT_S, 42), (chamber, kick.knee_chamber), (impact + 0.02, 17), (fold, 100), (land - 0.08, 40),
        (land, 26),
    )  # fmt: skip
    ankle = degrees_curve((LIFT_S, 5), (chamber, -12), (impact, -8), (fold, -15), (land, 0))
    weight = curve((LIFT_S, 0), (LIFT_S + 0.2, 1), (fold + 0.05, 1), (land - 0.1, 0))
    floor_pitch = degrees_curve((1.02, 0), (LIFT_S, -42), (chamber, -50), (fold, -40), (land, -18), (land + 0.15, 0))
    feet = (
        FootPath("left", (front,)),
        FootPath(
            "right",
            rear,
            pitch=_swing_pitch(floor_pitch, thigh, knee, ankle, weight),
            via=((LIFT_S + 0.25, 2, 0.30), (land - 0.22, 2, 0.28)),
        ),
    )
    points = (support_point("left", front, 0.055), support_point("right", rear[0], 0.10))
    share = ((0.0, 0.5), (TARGET_S, 0.5), (1.0, 0.45), (LIFT_S - 0.03, 1.0), (land + 0.02, 1.0), (land + 0.35, 0.5),
             (duration, 0.5))  # fmt: skip
    guard = {"lumbar_flexion": 4, "thorax_flexion": 7, "lumbar_rotation": -3, "thorax_rotation": -4,
             "neck_rotation": 10, "head_rotation": 5, "neck_flexion": -4}  # fmt: skip
    folded = {"lumbar_flexion": 12, "thorax_flexion": 10, "neck_flexion": -4, "neck_rotation": -4}
    snap = {"lumbar_flexion": 8, "thorax_flexion": 10, "lumbar_rotation": -5, "thorax_rotation": -6, "neck_flexion": 4}
    target = Movement(
        name=kick.name,
        duration=duration,
        feet=feet,
        pressure=shared_pressure(points, share),
        com_height=curve(
            (0.1, UPRIGHT_M), (READY_S, GUARD_M), (1.05, GUARD_M), (chamber, kick.com_height), (fold, kick.com_high),
            (land, 0.965), (lower, 0.96), (duration - 0.05, UPRIGHT_M),
        ),
        trunk=[
            (0.1, UPRIGHT), (READY_S, guard), (1.05, guard), (chamber, folded), (impact, snap), (fold, folded),
            (land, guard), (lower, guard), (duration - 0.05, UPRIGHT),
        ],
        yaw=degrees_curve(
            (0.1, -6), (READY_S, -14), (1.05, -14), (chamber, 4), (impact, 16), (fold, 6), (land, -14),
            (lower, -14), (duration - 0.05, -6),
        ),
        pitch=degrees_curve(
            (0.1, 0), (READY_S, 3), (1.05, 3), (chamber, -kick.lean_chamber), (impact, -kick.lean), (fold, -14),
            (land, 2),
            (duration - 0.05, 0),
        ),
        roll=degrees_curve((LIFT_S, 0), (chamber, -kick.hike), (fold, -kick.hike), (land, 0)),
        arms=(
            arm_keys((0.1, HANGING), (READY_S, GUARD_LEAD), (lower, GUARD_LEAD), (duration - 0.05, HANGING)),
            arm_keys(
                (0.1, HANGING), (READY_S, GUARD_REAR), (chamber, GUARD_REAR),
                (impact, ((0.28, 0.10, -0.16), (-0.5, 0.6, -0.8), 30.0)), (fold + 0.1, GUARD_REAR),
                (lower, GUARD_REAR), (duration - 0.05, HANGING),
            ),
        ),
        events={"target": TARGET_S, "impact": impact - 2 / 60},
        swing_legs=(None, SwingLeg(thigh, knee, weight, outward=-0.02)),
    )  # fmt: skip
    return build_movement(target)


def _swing_pitch(floor: Curve, thigh: Curve, knee: Curve, ankle: Curve, weight: Curve) -> Curve:
    """Foot pitch that follows the shank in free swing and the floor otherwise."""

    def pitch(times: FloatArray) -> FloatArray:
        share = weight(times)
        return np.asarray((1 - share) * floor(times) + share * (thigh(times) - knee(times) + ankle(times)))

    return pitch


_BODY, _HIGH = FrontKick(), FrontKick("kick_front_head_right", 138, 108, 90, 124, 35, 17, 4, 1.045, 1.055, 5, 0.08)
_RIGHT = Entry(
    "kick_front", "kick", "front kick at belly height", lambda: front_kick(_BODY), {"side": "right", "height": "body"}
)
_HEAD_RIGHT = Entry(
    _HIGH.name, "kick", "front kick at head height", lambda: front_kick(_HIGH), {"side": "right", "height": "head"}
)

ENTRIES = (
    _RIGHT,
    mirrored(_RIGHT, "kick_front_left", "front kick of the left leg at belly height"),
    mirrored(_HEAD_RIGHT, "kick_front_head_left", "front kick of the left leg at head height"),
    _HEAD_RIGHT,
)
