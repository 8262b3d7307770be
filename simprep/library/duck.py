"""Ducking under something at head height: down by knees and trunk, hold, up.

Timing and depth after boxing practice: 0.25 to 0.45 s down, 0.3 to 0.5 s up, head lowered by 25 to 35 cm. The hips go
down by the knees, the head further by the trunk. The downward acceleration stays below free fall.
"""

from dataclasses import dataclass

import numpy as np

from simprep.library.entry import Entry
from simprep.library.parts.feet import FootPath, Stance
from simprep.library.parts.movement import (
    GUARD_LEAD,
    GUARD_REAR,
    HANGING,
    UPRIGHT,
    Movement,
    arm_keys,
    build_movement,
    curve,
    degrees_curve,
    shared_pressure,
    support_point,
)
from simprep.motion.motion import Motion

READY_S, TARGET_S = 0.70, 0.90
UPRIGHT_M, GUARD_M = 0.976, 0.954


@dataclass(frozen=True)
class DuckStyle:
    """Parameters of a duck.

    Attributes:
        low: COM height at the bottom [m].
        down_s, hold_s, up_s: to the bottom, at the bottom, back to the guard [s].
        pitch_deg: forward pitch of the pelvis at the bottom [deg].
        lumbar_deg, thorax_deg: bend of lower and upper trunk at the bottom [deg].
        neck_deg: extension of the neck that keeps the eyes ahead [deg].
        heel_deg: rise of the rear heel at the bottom [deg].
    """

    low: float = 0.785
    down_s: float = 0.42
    hold_s: float = 0.30
    up_s: float = 0.50
    pitch_deg: float = 20.0
    lumbar_deg: float = 16.0
    thorax_deg: float = 20.0
    neck_deg: float = 18.0
    heel_deg: float = 22.0


def duck(style: DuckStyle | None = None, name: str = "duck") -> Motion:
    """A duck from a guard, feet in a short stride."""
    style = style or DuckStyle()
    down = round(TARGET_S + style.down_s, 9)
    up = round(down + style.hold_s, 9)
    stand = round(up + style.up_s, 9)
    end = round(stand + 0.68, 9)
    left = Stance(0.0, end, 0.12, 0.12, np.radians(5))
    right = Stance(0.0, end, -0.12, -0.12, np.radians(18))
    heel = degrees_curve((TARGET_S, 0), (down, -style.heel_deg), (up, -style.heel_deg), (stand - 0.05, 0))
    points = (support_point("left", left, 0.06), support_point("right", right, 0.12))
    guard = {"lumbar_flexion": 6, "thorax_flexion": 10, "neck_flexion": -6}
    low = {
        "lumbar_flexion": style.lumbar_deg, "thorax_flexion": style.thorax_deg, "neck_flexion": -style.neck_deg,
        "head_flexion": -6,
    }  # fmt: skip
    cover = ((0.20, -0.08, 0.20), (0.1, 0.3, -1.0), 35.0)
    settled, last = round(stand + 0.1, 9), round(end - 0.05, 9)
    arms = [
        arm_keys(
            (0.1, HANGING), (READY_S, own), (TARGET_S, own), (down, cover), (up, cover), (stand, own), (settled, own),
            (last, HANGING),
        )
        for own in (GUARD_LEAD, GUARD_REAR)
    ]  # fmt: skip
    return build_movement(
        Movement(
            name=name,
            duration=end,
            feet=(FootPath("left", (left,)), FootPath("right", (right,), pitch=heel)),
            pressure=shared_pressure(points, ((0.0, 0.5), (end, 0.5))),
            com_height=curve(
                (0.1, UPRIGHT_M), (READY_S, GUARD_M), (TARGET_S, GUARD_M), (down, style.low), (up, style.low),
                (stand, GUARD_M), (settled, GUARD_M), (last, UPRIGHT_M),
            ),
            trunk=[
                (0.1, UPRIGHT), (READY_S, guard), (TARGET_S, guard), (down, low), (up, low), (stand, guard),
                (settled, guard), (last, UPRIGHT),
            ],
            pitch=degrees_curve(
                (0.1, 0), (READY_S, 5), (TARGET_S, 5), (down, style.pitch_deg), (up, style.pitch_deg), (stand, 5),
                (settled, 5), (last, 0),
            ),
            arms=(arms[0], arms[1]),
            events={"target": TARGET_S, "peak": down},
        )
    )  # fmt: skip


SHALLOW = DuckStyle(
    low=0.872, down_s=0.30, hold_s=0.16, up_s=0.38, pitch_deg=14.0, lumbar_deg=11.0, thorax_deg=15.0, neck_deg=12.0,
    heel_deg=12.0,
)  # fmt: skip
DEEP = DuckStyle(
    low=0.63, down_s=0.62, hold_s=0.34, up_s=0.74, pitch_deg=36.0, lumbar_deg=20.0, thorax_deg=22.0, neck_deg=26.0,
    heel_deg=46.0,
)  # fmt: skip


def _entry(name: str, summary: str, style: DuckStyle) -> Entry:
    parameters: dict[str, float | str] = {"com_drop_m": round(GUARD_M - style.low, 3), "down_s": style.down_s}
    return Entry(name, "duck", summary, lambda: duck(style, name), parameters)


ENTRIES = (
    _entry("duck", "ducks on the spot", DuckStyle()),
    _entry("duck_shallow", "ducks a little, fast", SHALLOW),
    _entry("duck_deep", "ducks into a crouch", DEEP),
)
