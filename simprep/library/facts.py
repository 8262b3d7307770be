"""A motion in numbers: times, contacts, speeds, heights, travel."""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES, Character
from simprep.library.parts.limbs import fist_middle
from simprep.motion.contacts import stances
from simprep.motion.edit import loop_displacement, repeat, yaw
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import rotation_matrix
from simprep.motion.turns import turned


@dataclass(frozen=True)
class MotionFacts:
    """A motion in numbers; those of a loop cover one cycle.

    Attributes:
        duration_s: length [s].
        frames, fps: number of frames, and frames per second [1/s].
        loop: whether it repeats.
        events_s: events in order of time [s].
        stances_s: `left` and `right`: (begin, end) of every stance of that foot [s].
        flight_s: time with no foot on the floor [s]; hands and knees are not counted.
        peak_fist_speed_m_s: `left` and `right`: of the middle of the fist in the world [m/s]; empty without hands.
        peak_foot_speed_m_s: `left` and `right`: of the fastest point of the sole in the world [m/s].
        com_height_m: lowest and highest centre of mass [m].
        path_m: length of the pelvis's path over the floor [m].
        travel_m: forward and left displacement of the pelvis, by its heading at the start [m].
        turn_deg: change of heading, left positive [deg].
    """

    duration_s: float
    frames: int
    fps: float
    loop: bool
    events_s: dict[str, float]
    stances_s: dict[str, list[tuple[float, float]]]
    flight_s: float
    peak_fist_speed_m_s: dict[str, float]
    peak_foot_speed_m_s: dict[str, float]
    com_height_m: tuple[float, float]
    path_m: float
    travel_m: tuple[float, float]
    turn_deg: float


def event_times(motion: Motion) -> dict[str, float]:
    """Events of a motion in order of time [s]."""
    return {name: frame / motion.fps for name, frame in sorted(motion.events.items(), key=lambda event: event[1])}


def motion_facts(motion: Motion) -> MotionFacts:
    """The numbers of a motion of any length; speeds of a single frame are 0."""
    cycles = repeat(motion, 2) if motion.loop and len(motion) > 1 else motion  # so that the seam counts
    kinematics = forward_kinematics(cycles.qpos, cycles.character)
    hands = all(cycles.character.has(f"{side}_hand") for side in SIDES)
    fists = fist_positions(kinematics, cycles.character) if hands else None
    soles = kinematics.foot_points
    frames = len(motion)
    span = min(frames + 1, len(cycles)) if motion.loop else frames
    com = kinematics.com[:frames, 2]
    forward, left, turn = _travel(motion)
    path = np.linalg.norm(np.diff(cycles.qpos[:span, :2], axis=0), axis=1).sum()
    return MotionFacts(
        duration_s=motion.duration,
        frames=frames,
        fps=motion.fps,
        loop=motion.loop,
        events_s=event_times(motion),
        stances_s={
            side: [
                (first / motion.fps, min(after / motion.fps, motion.duration))
                for first, after in stances(motion.contacts[:, index])
            ]
            for index, side in enumerate(SIDES)
        },
        flight_s=float((~motion.contacts.any(axis=1)).sum() / motion.fps),
        peak_fist_speed_m_s={}
        if fists is None
        else {side: _peak_speed(fists[:, index], motion.fps) for index, side in enumerate(SIDES)},
        peak_foot_speed_m_s={side: _peak_speed(soles[:, index], motion.fps) for index, side in enumerate(SIDES)},
        com_height_m=(float(com.min()), float(com.max())),
        path_m=float(path),
        travel_m=(forward, left),
        turn_deg=float(np.degrees(turn)),
    )


def fist_positions(kinematics: Kinematics, character: Character) -> FloatArray:
    """Middle (T, 2, 3) of the left and right fist in T poses, world [m].

    Raises:
        SettingError: the character lacks a hand.
    """
    places = []
    for side in SIDES:
        hand = character.segment(f"{side}_hand")
        turn = rotation_matrix(kinematics.xquat[:, hand])
        places.append(kinematics.xpos[:, hand] + turn @ fist_middle(side, character))
    return np.stack(places, axis=1)


def _peak_speed(points: FloatArray, fps: float) -> float:
    if len(points) < 2:
        return 0.0
    return float(np.linalg.norm(np.gradient(points, 1 / fps, axis=0), axis=-1).max())


def _travel(motion: Motion) -> tuple[float, float, float]:
    """Forward and left [m], turn [rad]."""
    heading = np.unwrap(yaw(motion.qpos[:, 3:7]))
    if motion.loop and len(motion) > 1:
        turn, step = loop_displacement(motion)
    else:
        turn, step = float(heading[-1] - heading[0]), motion.qpos[-1, :2] - motion.qpos[0, :2]
    forward, left = turned(step, -heading[0])
    return float(forward), float(left), turn
