"""Side-steps, turns on the spot, a step forward and a step back."""

from dataclasses import dataclass

import numpy as np

from simprep.library.entry import FPS, Entry, mirrored
from simprep.library.stand import FEET_APART_M
from simprep.library.walking.stepping import Step, SteppingStyle, standing, step_cycle, step_sequence
from simprep.motion.motion import Motion

FIRST_LIFT_S = 0.65
"""When the first foot leaves the floor."""


@dataclass(frozen=True)
class SideStep:
    """Side-stepping: the leading foot steps out, the other closes.

    Attributes:
        frames: of one cycle at 60 per second.
        length: of the steps [m].
        swing: time of a foot in the air [s].
    """

    frames: int = 60
    length: float = 0.36
    swing: float = 0.31


@dataclass(frozen=True)
class Turn:
    """A turn on the spot.

    Attributes:
        angle_deg: of the whole turn, to the left [deg].
        pairs: how often each foot steps.
        step_time, swing: from lift to lift, and time of a foot in the air [s].
    """

    angle_deg: float = 90.0
    pairs: int = 2
    step_time: float = 0.48
    swing: float = 0.34


@dataclass(frozen=True)
class SingleStep:
    """A step, after which the other foot closes.

    Attributes:
        length: forward; negative: back [m].
        step_time, swing: from lift to lift, and time of a foot in the air [s].
    """

    length: float = 0.42
    step_time: float = 0.62
    swing: float = 0.42


def side_step_left(style: SideStep) -> Motion:
    """Side-stepping to the left while facing x; one cycle, which begins with the feet together."""
    half, beside = style.frames / FPS / 2, FEET_APART_M / 2
    lift = (half - style.swing) / 2
    steps = (
        Step("left", lift, lift + style.swing, 0.0, beside + style.length),
        Step("right", half + lift, half + lift + style.swing, 0.0, style.length - beside),
    )
    look = SteppingStyle(lift_pitch_deg=-14.0, com_height=0.962, arm_swing_deg=0.0, lean_deg=3.0)
    return step_cycle("walk_left", steps, style.frames, (0.0, style.length), look)


def turn_left(style: Turn) -> Motion:
    """Turning to the left on the spot, left foot first."""
    steps = []
    for number in range(2 * style.pairs):
        side = ("left", "right")[number % 2]
        heading = np.radians(style.angle_deg) * (number // 2 + 1) / style.pairs
        from_middle = standing(side).y
        lift = FIRST_LIFT_S + number * style.step_time
        steps.append(
            Step(side, lift, lift + style.swing, -from_middle * np.sin(heading), from_middle * np.cos(heading), heading)
        )
    look = SteppingStyle(lift_pitch_deg=-16.0, lead_deg=22.0, arm_swing_deg=5.0)
    return step_sequence("turn_left", steps, steps[-1].land + 0.9, look)


def single_step(name: str, style: SingleStep) -> Motion:
    """A step forward or back with the right foot; the left closes."""
    forward = style.length > 0
    steps = []
    for side, late, land_pitch in (("right", 0.0, 12.0 if forward else -14.0), ("left", style.step_time, 0.0)):
        lift = FIRST_LIFT_S + late
        steps.append(Step(side, lift, lift + style.swing, style.length, standing(side).y, land_pitch_deg=land_pitch))
    look = SteppingStyle(
        heel_rise_s=0.20 if forward else 0.12,
        lift_pitch_deg=-32.0 if forward else 10.0,
        forward=(0.03, 0.15) if forward else (0.08, 0.02),
        com_height=0.960,
        arm_swing_deg=12.0 if forward else 7.0,
    )
    return step_sequence(name, steps, steps[-1].land + 0.9, look)


FORWARD, BACKWARD, SIDE, TURN = SingleStep(), SingleStep(-0.36, 0.60, 0.38), SideStep(), Turn()

_LEFT = Entry(
    "walk_left", "locomotion", "side-steps to the left", lambda: side_step_left(SIDE),
    {"direction": "left", "speed_m_s": round(SIDE.length * FPS / SIDE.frames, 3)},
)  # fmt: skip
_TURN = Entry(
    "turn_left", "locomotion", "turns left on the spot by stepping", lambda: turn_left(TURN),
    {"direction": "left", "turn_deg": TURN.angle_deg},
)  # fmt: skip
ENTRIES = (
    _LEFT,
    mirrored(_LEFT, "walk_right", "side-steps to the right"),
    _TURN,
    mirrored(_TURN, "turn_right", "turns right on the spot by stepping"),
    Entry(
        "step_forward", "locomotion", "one step forward", lambda: single_step("step_forward", FORWARD),
        {"length_m": FORWARD.length},
    ),
    Entry(
        "step_backward", "locomotion", "one step back", lambda: single_step("step_backward", BACKWARD),
        {"length_m": BACKWARD.length},
    ),
)  # fmt: skip
