"""Ducking under something at head height: down by knees and trunk, hold, up.

Timing and depth after boxing practice: about 0.4 s down, head lowered by 25 to 35 cm; hips by bending the knees, the rest by the
trunk. The downward acceleration stays below free fall.
"""

import numpy as np

from simprep.library.entry import Entry
from simprep.library.feet import FootPath, Stance
from simprep.library.target import (
    GUARD_LEAD,
    GUARD_REAR,
    HANGING,
    UPRIGHT,
    Target,
    arm_keys,
    build_target,
    curve,
    degrees_curve,
    shared_pressure,
    support_point,
)
from simprep.motion.motion import Motion

READY_S, TARGET_S, DOWN_S, UP_S, STAND_S, DURATION_S = 0.70, 0.90, 1.32, 1.62, 2.12, 2.80
UPRIGHT_M, GUARD_M, LOW_M = 0.976, 0.954, 0.785


def duck() -> Motion:
    """A duck from a guard, feet in a short stride."""
    left = Stance(0.0, DURATION_S, 0.12, 0.12, np.radians(5))
    right = Stance(0.0, DURATION_S, -0.12, -0.12, np.radians(18))
    heel = degrees_curve((TARGET_S, 0), (DOWN_S, -22), (UP_S, -22), (STAND_S - 0.05, 0))
    points = (support_point("left", left, 0.06), support_point("right", right, 0.12))
    guard = {"lumbar_flexion": 6, "thorax_flexion": 10, "neck_flexion": -6}
    low = {"lumbar_flexion": 16, "thorax_flexion": 20, "neck_flexion": -18, "head_flexion": -6}
    cover = ((0.20, -0.08, 0.20), (0.1, 0.3, -1.0), 35.0)
    return build_target(
        Target(
            name="duck",
            duration=DURATION_S,
            feet=(FootPath("left", (left,)), FootPath("right", (right,), pitch=heel)),
            pressure=shared_pressure(points, ((0.0, 0.5), (DURATION_S, 0.5))),
            com_height=curve(
                (0.1, UPRIGHT_M), (READY_S, GUARD_M), (TARGET_S, GUARD_M), (DOWN_S, LOW_M), (UP_S, LOW_M),
                (STAND_S, GUARD_M), (STAND_S + 0.1, GUARD_M), (DURATION_S - 0.05, UPRIGHT_M),
            ),
            trunk=[
                (0.1, UPRIGHT), (READY_S, guard), (TARGET_S, guard), (DOWN_S, low), (UP_S, low), (STAND_S, guard),
                (STAND_S + 0.1, guard), (DURATION_S - 0.05, UPRIGHT),
            ],
            pitch=degrees_curve(
                (0.1, 0), (READY_S, 5), (TARGET_S, 5), (DOWN_S, 20), (UP_S, 20), (STAND_S, 5), (STAND_S + 0.1, 5),
                (DURATION_S - 0.05, 0),
            ),
            arms=(
                arm_keys(
                    (0.1, HANGING), (READY_S, GUARD_LEAD), (TARGET_S, GUARD_LEAD), (DOWN_S, cover), (UP_S, cover),
                    (STAND_S, GUARD_LEAD), (STAND_S + 0.1, GUARD_LEAD), (DURATION_S - 0.05, HANGING),
                ),
                arm_keys(
                    (0.1, HANGING), (READY_S, GUARD_REAR), (TARGET_S, GUARD_REAR), (DOWN_S, cover), (UP_S, cover),
                    (STAND_S, GUARD_REAR), (STAND_S + 0.1, GUARD_REAR), (DURATION_S - 0.05, HANGING),
                ),
            ),
            events={"target": TARGET_S},
        )
    )  # fmt: skip


ENTRIES = (Entry("duck", "duck", "ducks on the spot", duck),)
