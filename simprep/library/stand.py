"""Quiet standing with breathing, cyclic."""

import numpy as np

from simprep.character import SIDES
from simprep.library.entry import FPS, Entry
from simprep.library.parts.feet import FootPath, Stance, both_feet
from simprep.library.parts.limbs import SIGNS
from simprep.library.parts.posture import RELAXED, hinge_angles, set_hinges, trunk_rotation
from simprep.library.parts.whole_body import Plan, solve_whole_body
from simprep.motion.motion import Motion

PERIOD_S = 4.0
"""One breath (15 per minute)."""
STAND_HEIGHT_M = 1.0
"""COM height with nearly straight knees."""
FEET_APART_M = 0.18
"""Between the ankles: the heels of a preferred quiet stance are 0.17 m apart (McIlroy & Maki 1997)."""
TOE_OUT = np.radians(7.0)
CENTRE_M = 0.045
"""Centre of pressure before the ankles: about the middle of the foot, as in quiet standing."""


def stand() -> Motion:
    """Quiet standing facing x: breathing, and a sway of a few millimetres."""
    frames = round(PERIOD_S * FPS)
    times = np.arange(frames) / FPS
    angle = 2 * np.pi * times / PERIOD_S
    hinges = np.tile(hinge_angles(RELAXED), (frames, 1))
    breath = np.radians(0.6) * np.sin(angle)
    set_hinges(hinges, {"thorax_flexion": -breath, "neck_flexion": breath})
    stances = {side: Stance(0.0, PERIOD_S, 0.0, SIGNS[side] * FEET_APART_M / 2, TOE_OUT) for side in SIDES}
    paths = [FootPath(side, (stance,)) for side, stance in stances.items()]
    plan = Plan(
        FPS,
        *both_feet(paths, times),
        zmp=np.column_stack([CENTRE_M + 0.004 * np.sin(angle + 0.8), 0.003 * np.sin(2 * angle)]),
        com_height=np.full(frames, STAND_HEIGHT_M),
        root_rotation=trunk_rotation(np.zeros(frames), np.zeros(frames), np.zeros(frames)),
        hinges=hinges,
        shift=np.zeros(2),
    )
    qpos = solve_whole_body(plan)
    source = "simprep library: stand"
    return Motion(qpos, FPS, plan.contacts, name="stand", source=source, loop=True, character=plan.character)


ENTRIES = (Entry("stand", "locomotion", "stands upright, arms hanging", stand),)
