"""Crawling under a bar at about 1 m, on two feet: down into a deep crouch, trunk level, short low steps, and up again.

The hands hang before the shins and help to balance. The crouch is about as low as the ankles allow with flat feet. Key
values are set by hand; COM and footsteps obey the cart-table model.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.library.entry import Entry
from simprep.library.parts.feet import FootPath, Stance, ankle_height
from simprep.library.parts.limbs import SIGNS
from simprep.library.parts.movement import (
    HANGING,
    UPRIGHT,
    ArmKey,
    ArmPose,
    Movement,
    arm_keys,
    between,
    build_movement,
    curve,
    degrees_curve,
    support_point,
)
from simprep.motion.curves import Curve, key_curve
from simprep.motion.motion import Motion

READY_S, TARGET_S = 0.70, 0.90
UPRIGHT_M, READY_M = 0.985, 0.952


@dataclass(frozen=True)
class CrawlStyle:
    """Parameters of a crawl.

    Attributes:
        steps: number of steps, the last of which closes the feet.
        step_length: how far a foot passes the other [m].
        step_time, swing_time: from lift to lift, and from lift to landing [s].
        step_width: between the ankles [m].
        clearance: height of the ankle's rise in a step [m].
        com_height: in the crouch [m].
        pitch_deg: forward pitch of the pelvis in the crouch [deg].
        lumbar_deg, thorax_deg: bend of lower and upper trunk in the crouch [deg].
        neck_deg: extension of the neck that keeps the eyes ahead [deg].
        down_s, up_s: from the ready posture to the crouch, and from the crouch to standing [s].
        sway_deg: turn of the pelvis with each step [deg].
    """

    steps: int = 7
    step_length: float = 0.18
    step_time: float = 0.50
    swing_time: float = 0.34
    step_width: float = 0.24
    clearance: float = 0.07
    com_height: float = 0.66
    pitch_deg: float = 50.0
    lumbar_deg: float = 25.0
    thorax_deg: float = 18.0
    neck_deg: float = 42.0
    down_s: float = 0.75
    up_s: float = 0.85
    sway_deg: float = 5.0


def crawl(style: CrawlStyle | None = None, name: str = "crawl") -> Motion:
    """A crawl under a bar along x, right foot first."""
    style = style or CrawlStyle()
    bottom = TARGET_S + style.down_s
    lifts = [bottom - 0.05 + style.step_time * number for number in range(style.steps)]
    up = lifts[-1] + style.swing_time + 0.05
    stand = up + style.up_s
    end = stand + 0.45
    stances = _stances(lifts, end, style)
    feet = (_foot("left", stances["left"], style), _foot("right", stances["right"], style))
    ready = {"lumbar_flexion": 14, "thorax_flexion": 12, "neck_flexion": -22}
    low = {
        "lumbar_flexion": style.lumbar_deg, "thorax_flexion": style.thorax_deg, "neck_flexion": -style.neck_deg,
        "head_flexion": -14,
    }  # fmt: skip
    return build_movement(
        Movement(
            name=name,
            duration=end,
            feet=feet,
            pressure=_pressure(lifts, stances, end, style),
            com_height=curve(
                (0.1, UPRIGHT_M), (READY_S, READY_M), (TARGET_S, READY_M), (bottom, style.com_height), (up, style.com_height),
                (stand, UPRIGHT_M),
            ),
            trunk=[
                (0.1, UPRIGHT), (READY_S, ready), (TARGET_S, ready), (bottom, low), (up, low), (stand, UPRIGHT),
            ],
            pitch=degrees_curve((0.1, 0), (READY_S, 14), (TARGET_S, 14), (bottom, style.pitch_deg),
                (up, style.pitch_deg), (stand, 0)),
            yaw=_sway(lifts, up, style.sway_deg),
            arms=(_arm(0, lifts, up, stand), _arm(1, lifts, up, stand)),
            events={"target": TARGET_S, "low": bottom, "rise": up},
        )
    )  # fmt: skip


def _stances(lifts: list[float], end: float, style: CrawlStyle) -> dict[str, list[Stance]]:
    beside = {side: SIGNS[side] * style.step_width / 2 for side in SIDES}
    toe_out = np.radians(12)
    current = {side: (0.0, 0.0) for side in SIDES}  # start time, x
    out: dict[str, list[Stance]] = {"left": [], "right": []}
    for number, lift in enumerate(lifts):
        side = ("right", "left")[number % 2]
        start, x = current[side]
        out[side].append(Stance(start, lift, x, beside[side], toe_out))
        closing = number == len(lifts) - 1
        ahead = style.step_length * (number + (0 if closing else 1))
        current[side] = (lift + style.swing_time, ahead)
    for side, (start, x) in current.items():
        out[side].append(Stance(start, end, x, beside[side], toe_out))
    return out


def _foot(side: str, stances: list[Stance], style: CrawlStyle) -> FootPath:
    keys, via = [(0.0, 0.0)], []
    for before, after in pairwise(stances):
        keys += [(before.end - 0.15, 0.0), (before.end, -24.0), (before.end + 0.1, -26.0), (after.start - 0.06, 0.0)]
        via.append(((before.end + after.start) / 2, 2, ankle_height() + style.clearance))
    return FootPath(side, tuple(stances), pitch=degrees_curve(*keys), via=tuple(via))


def _pressure(
    lifts: list[float], stances: dict[str, list[Stance]], end: float, style: CrawlStyle
) -> list[tuple[float, float, float]]:
    forward = 0.06

    def point(side: str, time: float) -> FloatArray:
        current = [stance for stance in stances[side] if stance.start <= time + 1e-9][-1]
        return support_point(side, current, forward)

    first = between((point("left", 0.0), point("right", 0.0)), 0.5)
    keys = [(0.0, *first), (TARGET_S, *first), (lifts[0] - 0.3, *first)]
    for number, lift in enumerate(lifts):
        side = SIDES[number % 2]  # the foot that stays
        x, y = point(side, lift)
        keys += [(lift - 0.01, x, y), (lift + style.swing_time + 0.01, x + 0.065, y)]
    last = between((point("left", end), point("right", end)), 0.5)
    return [*keys, (lifts[-1] + style.swing_time + 0.35, *last), (end, *last)]


def _sway(lifts: list[float], up: float, degrees: float) -> Curve:
    times = [lifts[0] - 0.2, *(lift + 0.2 for lift in lifts), up + 0.3]
    turns = [0.0, *(degrees * (1 if number % 2 == 0 else -1) for number in range(len(lifts))), 0.0]
    return key_curve(times, np.radians(turns))


def _arm(late: int, lifts: list[float], up: float, stand: float) -> tuple[ArmKey, ...]:
    ready: ArmPose = ((0.16, 0.08, -0.52), (-1.0, 0.4, 0.0), 25.0)
    reach: ArmPose = ((0.50, 0.06, 0.12), (-0.3, 0.8, -0.6), 60.0)
    trail: ArmPose = ((0.46, 0.08, -0.20), (-0.3, 0.8, -0.6), 60.0)
    swings = [(lift + 0.2, (reach, trail)[(number + late) % 2]) for number, lift in enumerate(lifts)]
    return arm_keys((0.1, HANGING), (READY_S, ready), (TARGET_S, ready), *swings, (stand, HANGING))


LOW = CrawlStyle(
    steps=9, step_length=0.13, step_time=0.52, swing_time=0.34, step_width=0.27, com_height=0.59, pitch_deg=51.0,
    lumbar_deg=40.0, thorax_deg=28.0, neck_deg=47.0, down_s=0.95, up_s=1.05, sway_deg=4.0,
)  # fmt: skip


def _entry(name: str, summary: str, style: CrawlStyle) -> Entry:
    parameters: dict[str, float | str] = {
        "com_height_m": style.com_height,
        "distance_m": round(style.step_length * (style.steps - 1), 3),
    }
    return Entry(name, "crawl", summary, lambda: crawl(style, name), parameters)


ENTRIES = (
    _entry("crawl", "walks under something low, deeply crouched", CrawlStyle()),
    _entry("crawl_low", "walks under something lower still, trunk level", LOW),
)
