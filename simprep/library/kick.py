"""Front kick of the rear leg: chamber, snap, retraction.

Phases and ranges after the literature on kicks: chamber with hip and knee flexed about 85 and 110 deg, foot speed 8 to 10
m/s, knee extended to 10 to 30 deg at impact, trunk leaning back 10 to 30 deg; hip flexors lift the thigh and fold the knee
together, then the knee whips out. Key values are set by hand. The COM is brought over the standing foot first.
"""

import numpy as np
from numpy.typing import NDArray

from simprep.library.curves import Curve
from simprep.library.entry import Entry
from simprep.library.feet import FootPath, Stance
from simprep.library.target import (
    GUARD_LEAD,
    GUARD_REAR,
    HANGING,
    UPRIGHT,
    SwingLeg,
    Target,
    arm_keys,
    build_target,
    curve,
    degrees_curve,
    shared_pressure,
    support_point,
)
from simprep.motion.motion import Motion

READY_S, TARGET_S = 0.70, 0.90
LIFT_S, CHAMBER_S, IMPACT_S, FOLD_S, LAND_S = 1.30, 1.58, 1.75, 2.02, 2.45
LOWER_S, DURATION_S = 2.65, 3.35
UPRIGHT_M, GUARD_M = 0.98, 0.955


def front_kick_right() -> Motion:
    """Right front kick at belly height, left foot in front; the foot returns to where it was."""
    front = Stance(0.0, DURATION_S, 0.12, 0.09, np.radians(6))
    rear = (
        Stance(0.0, LIFT_S, -0.13, -0.10, np.radians(15)),
        Stance(LAND_S, DURATION_S, -0.13, -0.10, np.radians(15)),
    )
    thigh = degrees_curve(
        (LIFT_S, -2), (CHAMBER_S, 90), (IMPACT_S - 0.02, 104), (FOLD_S, 86), (LAND_S - 0.08, 12), (LAND_S, 0)
    )
    knee = degrees_curve(
        (LIFT_S, 42), (CHAMBER_S, 114), (IMPACT_S + 0.02, 17), (FOLD_S, 100), (LAND_S - 0.08, 40), (LAND_S, 26),
    )  # fmt: skip
    ankle = degrees_curve((LIFT_S, 5), (CHAMBER_S, -12), (IMPACT_S, -8), (FOLD_S, -15), (LAND_S, 0))
    weight = curve((LIFT_S, 0), (LIFT_S + 0.2, 1), (FOLD_S + 0.05, 1), (LAND_S - 0.1, 0))
    floor_pitch = degrees_curve(
        (1.02, 0), (LIFT_S, -42), (CHAMBER_S, -50), (FOLD_S, -40), (LAND_S, -18), (LAND_S + 0.15, 0)
    )
    feet = (
        FootPath("left", (front,)),
        FootPath(
            "right",
            rear,
            pitch=_swing_pitch(floor_pitch, thigh, knee, ankle, weight),
            via=((LIFT_S + 0.25, 2, 0.30), (LAND_S - 0.22, 2, 0.28)),
        ),
    )
    points = (support_point("left", front, 0.055), support_point("right", rear[0], 0.10))
    share = ((0.0, 0.5), (TARGET_S, 0.5), (1.0, 0.45), (LIFT_S - 0.03, 1.0), (LAND_S + 0.02, 1.0), (LAND_S + 0.35, 0.5),
             (DURATION_S, 0.5))  # fmt: skip
    guard = {"lumbar_flexion": 4, "thorax_flexion": 7, "lumbar_rotation": -3, "thorax_rotation": -4,
             "neck_rotation": 10, "head_rotation": 5, "neck_flexion": -4}  # fmt: skip
    chamber = {"lumbar_flexion": 12, "thorax_flexion": 10, "neck_flexion": -4, "neck_rotation": -4}
    snap = {"lumbar_flexion": 8, "thorax_flexion": 10, "lumbar_rotation": -5, "thorax_rotation": -6, "neck_flexion": 4}
    target = Target(
        name="kick_front",
        duration=DURATION_S,
        feet=feet,
        pressure=shared_pressure(points, share),
        com_height=curve(
            (0.1, UPRIGHT_M), (READY_S, GUARD_M), (1.05, GUARD_M), (CHAMBER_S, 1.035), (FOLD_S, 1.045),
            (LAND_S, 0.965), (LOWER_S, 0.96), (DURATION_S - 0.05, UPRIGHT_M),
        ),
        trunk=[
            (0.1, UPRIGHT), (READY_S, guard), (1.05, guard), (CHAMBER_S, chamber), (IMPACT_S, snap), (FOLD_S, chamber),
            (LAND_S, guard), (LOWER_S, guard), (DURATION_S - 0.05, UPRIGHT),
        ],
        yaw=degrees_curve(
            (0.1, -6), (READY_S, -14), (1.05, -14), (CHAMBER_S, 4), (IMPACT_S, 16), (FOLD_S, 6), (LAND_S, -14),
            (LOWER_S, -14), (DURATION_S - 0.05, -6),
        ),
        pitch=degrees_curve(
            (0.1, 0), (READY_S, 3), (1.05, 3), (CHAMBER_S, -12), (IMPACT_S, -22), (FOLD_S, -14), (LAND_S, 2),
            (DURATION_S - 0.05, 0),
        ),
        roll=degrees_curve((LIFT_S, 0), (CHAMBER_S, -3), (FOLD_S, -3), (LAND_S, 0)),
        arms=(
            arm_keys((0.1, HANGING), (READY_S, GUARD_LEAD), (LOWER_S, GUARD_LEAD), (DURATION_S - 0.05, HANGING)),
            arm_keys(
                (0.1, HANGING), (READY_S, GUARD_REAR), (CHAMBER_S, GUARD_REAR),
                (IMPACT_S, ((0.28, 0.10, -0.16), (-0.5, 0.6, -0.8), 30.0)), (FOLD_S + 0.1, GUARD_REAR),
                (LOWER_S, GUARD_REAR), (DURATION_S - 0.05, HANGING),
            ),
        ),
        events={"target": TARGET_S, "impact": IMPACT_S - 2 / 60},
        swing_legs=(None, SwingLeg(thigh, knee, weight, outward=-0.02)),
    )  # fmt: skip
    return build_target(target)


def _swing_pitch(floor: Curve, thigh: Curve, knee: Curve, ankle: Curve, weight: Curve) -> Curve:
    """Foot pitch that follows the shank in free swing and the floor otherwise."""

    def pitch(times: NDArray[np.float64]) -> NDArray[np.float64]:
        share = weight(times)
        return np.asarray((1 - share) * floor(times) + share * (thigh(times) - knee(times) + ankle(times)))

    return pitch


ENTRIES = (
    Entry("kick_front", "kick", "front kick at belly height", front_kick_right, {"side": "right", "height": "body"}),
)
