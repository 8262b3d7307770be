"""Walking at a fast pace, backward and along a curve, from the parameters of `walk`.

Backward walking is forward walking with time reversed, as measured joint angles nearly are (Winter, Pluck & Yang 1989,
J Mot Behav 21:291). Reversed time leaves accelerations, so also the zero-moment point, as they are.
"""

from dataclasses import replace

import numpy as np

from simprep.library.entry import Entry, mirrored
from simprep.library.walking.walk import WalkStyle, walk
from simprep.motion.edit import loop_displacement
from simprep.motion.motion import Motion

FAST = WalkStyle(
    frames=56, step_length=0.81, step_width=0.10, stance_share=0.615, com_height=0.912, com_bounce=0.019,
    trunk_lean_deg=3.0, arm_swing_deg=24.0, elbow_deg=48.0, pelvis_yaw_deg=8.0,
    roll=(
        (0.0, 20.0), (0.085, 0.0), (0.29, 0.0), (0.46, -20.0), (0.61, -52.0), (0.68, -66.0), (0.80, -17.0), (0.90, 4.0),
        (0.965, 21.0),
    ),
    swing=((0.80, 0.48, 0.05), (0.90, 0.16, None), (0.955, 0.055, None)),
    pressure=((0.12, 0.01, 0.0), (0.20, 0.08, 0.0), (0.28, 0.14, 0.0), (0.36, 0.17, 0.006), (0.5, 0.174, 0.010)),
)  # fmt: skip
"""The heel rises earlier than at a normal pace."""
BACKWARD = WalkStyle(
    frames=70, step_length=0.42, step_width=0.15, stance_share=0.65, com_height=0.962, com_bounce=0.010,
    trunk_lean_deg=3.0, arm_swing_deg=9.0, elbow_deg=28.0, foot_roll=0.55,
)  # fmt: skip
CURVE = WalkStyle(
    frames=66, step_length=0.55, step_width=0.13, com_height=0.966, com_bounce=0.016, arm_swing_deg=14.0, turn_deg=40.0,
    bank_deg=3.0,
)  # fmt: skip


def walk_fast() -> Motion:
    """Walking at a fast pace."""
    return walk(FAST, "walk_fast")


def walk_backward() -> Motion:
    """Walking backward while facing x."""
    return reversed_in_time(walk(BACKWARD, "walk_backward"))


def walk_turn_left() -> Motion:
    """Walking along a curve to the left."""
    return walk(CURVE, "walk_turn_left")


def reversed_in_time(loop: Motion) -> Motion:
    """One cycle of a loop without turn, played backwards from the same first pose; touch-downs become its events."""
    _, step = loop_displacement(loop)
    order = -np.arange(len(loop)) % len(loop)
    qpos = loop.qpos[order].copy()
    qpos[1:, :2] -= step
    contacts = loop.contacts[order]
    touch = {}
    for number, side in enumerate(("left", "right")):
        begins = contacts[:, number] & ~np.roll(contacts[:, number], 1)
        touch[f"{side}_touch_down"] = int(np.flatnonzero(begins)[0])
    return replace(loop, qpos=qpos, contacts=contacts, events=touch)


def _parameters(style: WalkStyle, backward: bool = False) -> dict[str, float | str]:
    return {
        "speed_m_s": round(-style.speed if backward else style.speed, 3),
        "cadence_steps_min": round(2 * 3600 / style.frames, 1),
        "turn_deg_per_stride": style.turn_deg,
    }


_LEFT = Entry("walk_turn_left", "locomotion", "walks along a curve to the left", walk_turn_left, _parameters(CURVE))
ENTRIES = (
    Entry("walk_fast", "locomotion", "walks forward at a fast pace", walk_fast, _parameters(FAST)),
    Entry("walk_backward", "locomotion", "walks backward", walk_backward, _parameters(BACKWARD, backward=True)),
    _LEFT,
    mirrored(
        _LEFT, "walk_turn_right", "walks along a curve to the right",
        {**_LEFT.parameters, "turn_deg_per_stride": -CURVE.turn_deg},
    ),
)  # fmt: skip
