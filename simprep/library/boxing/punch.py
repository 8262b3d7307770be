"""Straight punch of the rear hand from a guard (the cross).

Kinetic chain after the literature: rear leg, pelvis, trunk, shoulder, elbow, each 20 to 50 ms after the one before;
fist speed 6 to 9 m/s (Liu 2022, junior boxers 7.0-7.5 m/s), 60 % of the load on the front foot at impact (Dinu & Louis
2020). Key values are set by hand.
"""

import numpy as np

from simprep.library.entry import Entry, mirrored
from simprep.library.parts.feet import FootPath, Stance
from simprep.library.parts.movement import (
    GUARD_LEAD,
    GUARD_REAR,
    HANGING,
    UPRIGHT,
    Movement,
    aimed,
    arm_keys,
    build_movement,
    curve,
    degrees_curve,
    shared_pressure,
    support_point,
)
from simprep.motion.motion import Motion

READY_S, TARGET_S, DRIVE_S, IMPACT_S, BACK_S = 0.70, 0.90, 1.08, 74 / 60, 1.75
LOWER_S, DURATION_S = 1.95, 2.55
UPRIGHT_M, GUARD_M = 0.974, 0.96


def cross_right() -> Motion:
    """Right cross, left foot in front."""
    front = Stance(0.0, DURATION_S, 0.18, 0.10, np.radians(-4))
    rear = Stance(0.0, DURATION_S, -0.16, -0.12, np.radians(28))
    heel = degrees_curve((1.02, 0), (IMPACT_S - 0.02, -28), (IMPACT_S + 0.08, -28), (BACK_S - 0.15, 0))
    pivot = degrees_curve((1.03, 0), (IMPACT_S, -30), (IMPACT_S + 0.06, -30), (BACK_S - 0.2, 0))
    feet = (FootPath("left", (front,)), FootPath("right", (rear,), pitch=heel, pivot=pivot))
    points = (support_point("left", front), support_point("right", rear, 0.10))
    share = ((0.0, 0.5), (READY_S, 0.5), (TARGET_S, 0.48), (1.02, 0.36), (1.20, 0.72), (1.35, 0.68), (BACK_S, 0.5),
             (DURATION_S, 0.5))  # fmt: skip
    guard = {"lumbar_flexion": 5, "thorax_flexion": 8, "neck_flexion": -4}
    square = {"lumbar_rotation": -4, "thorax_rotation": -6, "neck_rotation": 16, "head_rotation": 12}
    loaded = {"lumbar_rotation": -8, "thorax_rotation": -12, "neck_rotation": 19, "head_rotation": 16}
    thrown = {"lumbar_flexion": 7, "thorax_flexion": 8, "lumbar_rotation": 9, "thorax_rotation": 14,
              "neck_rotation": -24, "head_rotation": -18, "neck_flexion": -4}  # fmt: skip
    target = Movement(
        name="punch_right",
        duration=DURATION_S,
        feet=feet,
        pressure=shared_pressure(points, share),
        com_height=curve(
            (0.1, UPRIGHT_M), (READY_S, GUARD_M), (1.0, GUARD_M - 0.008), (IMPACT_S, GUARD_M - 0.002), (BACK_S, GUARD_M),
            (LOWER_S, GUARD_M), (DURATION_S - 0.05, UPRIGHT_M),
        ),
        trunk=[
            (0.1, UPRIGHT), (READY_S, guard | square), (TARGET_S, guard | square), (DRIVE_S, guard | loaded),
            (IMPACT_S + 0.02, thrown), (IMPACT_S + 0.06, thrown), (BACK_S, guard | square), (LOWER_S, guard | square),
            (DURATION_S - 0.05, UPRIGHT),
        ],
        yaw=degrees_curve(
            (0.1, -15), (READY_S, -22), (TARGET_S, -22), (1.05, -26), (IMPACT_S + 0.01, 26), (IMPACT_S + 0.05, 26),
            (BACK_S, -22), (LOWER_S, -22), (DURATION_S - 0.05, -15),
        ),
        pitch=degrees_curve((0.1, 0), (READY_S, 4), (LOWER_S, 4), (DURATION_S - 0.05, 0)),
        arms=(
            arm_keys(
                (0.1, HANGING), (READY_S, GUARD_LEAD), (DRIVE_S, GUARD_LEAD), (IMPACT_S, GUARD_REAR),
                (1.35, GUARD_REAR), (BACK_S, GUARD_LEAD), (LOWER_S, GUARD_LEAD), (DURATION_S - 0.05, HANGING),
            ),
            arm_keys(
                (0.1, HANGING), (READY_S, GUARD_REAR), (1.11, GUARD_REAR), (IMPACT_S, aimed(0.54, -24, 6)),
                (IMPACT_S + 0.042, aimed(0.632, -34, 6)), (1.6, GUARD_REAR), (LOWER_S, GUARD_REAR),
                (DURATION_S - 0.05, HANGING), straight=(1.11, 1.6),
            ),
        ),
        events={"target": TARGET_S, "impact": IMPACT_S - 2 / 60},
    )  # fmt: skip
    return build_movement(target)


_RIGHT = Entry(
    "punch_right",
    "punch",
    "cross of the right hand to the chest",
    cross_right,
    {"side": "right", "type": "cross", "height": "chest"},
)

ENTRIES = (mirrored(_RIGHT, "punch_left", "cross of the left hand to the chest"), _RIGHT)
