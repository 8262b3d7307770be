"""Getting up from lying face down: push up on the knees, hips back, knees under them, and on to the feet.

Fists, knees and toes bear the load, as in `hands_and_knees`, whose way up is the second half. Until then the hips move on
circles about the knee that bears. The movement is slow, so positions are planned.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.humanoid_model import humanoid
from simprep.library.entry import FPS, Entry
from simprep.library.hands_and_knees import (
    BESIDE_M,
    CRAWL_S,
    FIST_M,
    HAND_BESIDE_M,
    KNEE_M,
    KNEELING_PITCH_DEG,
    LEVEL,
    STYLE,
    TOE_PITCH_DEG,
    UNDER_M,
    LimbEnds,
    crawl_hands_knees,
    place_limbs,
)
from simprep.library.parts.feet import FootPath, Stance, both_feet
from simprep.library.parts.limbs import SIGNS, limb_lengths
from simprep.library.parts.movement import degrees_curve
from simprep.library.parts.posture import RELAXED, Pose, key_poses
from simprep.library.parts.whole_body import check_limits
from simprep.motion.curves import constant, key_curve
from simprep.motion.edit import concatenate, cut, move
from simprep.motion.motion import Motion
from simprep.motion.rotations import axis_rotation

LIE_S, PUSHED_S, BACK_S, KNEELING_S = 0.5, 1.7, 2.7, 4.3
"""Last moment of lying, arms straight, hips back over the knees, on hands and knees."""
STEPS_S, SWING_S = (2.9, 3.6), 0.5
"""When the left and the right knee leave the floor, and for how long."""
STEP_M, LIFT_M = 0.16, 0.14
"""How far the knees come forward, and how high the toes are lifted in that."""
THIGH_DEG = (12.0, 35.0, 68.0)
"""Slope of the thighs while lying, pushed up, hips back."""
PITCH_DEG = (90.0, 57.0, 72.0)
"""Pitch of the pelvis in the same moments."""
THICKER_M = 0.013
"""The thigh is so much thicker than the shank; while both lie, the knees are higher by this."""


def get_up_prone() -> Motion:
    """From lying face down, head along x, to standing.

    Raises:
        MotionError: a pose leaves the joint limits by more than 0.5 deg.
    """
    whole = crawl_hands_knees()
    rise = len(whole) - 1 - round(CRAWL_S * FPS)  # time runs backwards there: from the moment before the first step
    way_up = move(cut(whole, rise, len(whole)), (-STYLE.distance, 0.0))
    both = concatenate(_onto_knees(float(way_up.qpos[0, 0])), replace(way_up, events={}))
    target = round(LIE_S * FPS)
    name = "get_up_prone"
    return replace(
        both, events={"target": target, "rise": round(BACK_S * FPS)}, name=name, source=f"simprep library: {name}"
    )


def _onto_knees(hips_at: float) -> Motion:
    """From lying to hands and knees, the hips over a place (x) in the end [m]."""
    times = np.arange(round(KNEELING_S * FPS) + 1) / FPS
    character, lengths = humanoid(), limb_lengths()
    ankle, rotation, contacts = both_feet([_foot(side, start) for side, start in zip(SIDES, STEPS_S)], times)
    rise = ankle[0, 0, 2] - KNEE_M  # of the shank from knee to ankle
    after = float(ankle[-1, 0, 0] + np.sqrt(lengths.shank**2 - rise**2))
    before = after - STEP_M
    landed = STEPS_S[0] + SWING_S + 0.1
    slope = np.radians(THIGH_DEG)
    lying, pushed, back = before + lengths.thigh * np.cos(slope)
    keys = [0.0, LIE_S, PUSHED_S, BACK_S, landed, STEPS_S[1] + SWING_S, KNEELING_S]
    hip_x = key_curve(keys, [lying, lying, pushed, back, (before + after) / 2, hips_at, hips_at])(times)
    bearing = np.where(times < landed, before, after)  # the knee that bears; halfway between both, both do
    hip_z = KNEE_M + np.sqrt(np.maximum(lengths.thigh**2 - (hip_x - bearing) ** 2, 0.0))
    pitch = degrees_curve(
        (0, PITCH_DEG[0]),
        (LIE_S, PITCH_DEG[0]),
        (PUSHED_S, PITCH_DEG[1]),
        (BACK_S, PITCH_DEG[2]),
        (KNEELING_S, KNEELING_PITCH_DEG),
    )
    root = axis_rotation("y", pitch(times))
    qpos = np.zeros((len(times), character.nq))
    arms: Pose = {name: float(value) for name, value in RELAXED.items()}
    qpos[:, 7:] = key_poses([(LIE_S, {**arms, "neck_flexion": -10.0}), (PUSHED_S, {**arms, **LEVEL})], times)
    qpos[:, 3:7] = Rotation.from_matrix(root).as_quat(scalar_first=True)
    hips = np.column_stack([hip_x, np.zeros(len(times)), hip_z])
    qpos[:, :3] = hips - np.einsum("tij,j->ti", root, lengths.hip.mean(axis=0))
    place_limbs(qpos, LimbEnds(root, ankle, rotation, _fists(len(times)), np.ones((len(times), 1))))
    qpos[:, 2] += key_curve([0.0, LIE_S, PUSHED_S], [THICKER_M, THICKER_M, 0.0])(times)
    contacts[times < PUSHED_S] = False  # until then the toes bear nothing
    check_limits(qpos, character)
    return Motion(qpos, FPS, contacts, character=character)


def _foot(side: str, start: float) -> FootPath:
    """Toes on the floor behind the knee, which steps forward once."""
    beside, pitch = SIGNS[side] * BESIDE_M, constant(np.radians(TOE_PITCH_DEG))
    still = FootPath(side, (Stance(0.0, KNEELING_S, 0.0, beside, 0.0),), pitch=pitch)
    rest = float(still.at(np.zeros(1))[0][0, 2])
    stances = Stance(0.0, start, -STEP_M, beside, 0.0), Stance(start + SWING_S, KNEELING_S, 0.0, beside, 0.0)
    return FootPath(side, stances, pitch=pitch, via=((start + SWING_S / 2, 2, rest + LIFT_M),))


def _fists(frames: int) -> FloatArray:
    """(frames, 2, 3) on the floor, where they stay."""
    places = np.array([[UNDER_M, SIGNS[side] * HAND_BESIDE_M, FIST_M] for side in SIDES])
    return np.repeat(places[None], frames, axis=0)


ENTRIES = (
    Entry("get_up_prone", "get_up", "lies face down, gets up over hands and knees", get_up_prone, {"from": "prone"}),
)
