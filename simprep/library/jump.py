"""Two-footed jumps with arm swing, up, forward and over something: countermovement, push-off, flight, soft landing.

The COM height is a chain of quintics through (height, velocity, acceleration), at take-off and landing those of free
fall, so the flight is the exact parabola. Jump height h gives take-off speed sqrt(2 g h) and flight time 2 sqrt(2 h /
g). Phases as in the literature on countermovement jumps (take-off after 0.7 to 0.9 s, dip 28 to 35 cm, peak force 2.2
to 2.6 body weights).
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BPoly

from simprep.character import SIDES
from simprep.humanoid_model import GRAVITY
from simprep.library.entry import Entry
from simprep.library.parts.feet import FootPath, Stance
from simprep.library.parts.limbs import SIGNS
from simprep.library.parts.movement import UPRIGHT, Movement, build_movement, degrees_curve
from simprep.library.parts.posture import RELAXED
from simprep.motion.curves import Curve
from simprep.motion.motion import Motion


@dataclass(frozen=True)
class JumpStyle:
    """Parameters of a jump.

    Attributes:
        rise: COM rise after take-off [m].
        take_off_height, landing_height: COM height when the toes leave the floor and when the feet touch it again [m].
        dip_height, landing_dip: lowest COM height before take-off and after landing [m].
        tuck: how far the feet are drawn up towards the COM in flight [m].
        distance: how far ahead the feet land [m].
        obstacle: height of the obstacle, 0 for none; `OBSTACLE_DEPTH_M` deep [m].
        obstacle_ahead: its middle before the ankles at take-off [m].
        lean_deg: forward pitch of the pelvis at take-off and in flight [deg].
        land_pitch_deg: pitch of the feet at landing, toe up positive [deg].
        back: how far back the pressure moves in the dip, to fall forward [m].
        dip_lean_deg, land_lean_deg: further forward pitch of the pelvis in the dip and after landing [deg].
        heel_rise_s: time before take-off at which the heels leave the floor [s].
        absorb_s: from landing to the lowest COM [s].
    """

    rise: float = 0.30
    take_off_height: float = 1.055
    landing_height: float = 1.0
    dip_height: float = 0.79
    landing_dip: float = 0.81
    tuck: float = 0.0
    distance: float = 0.07
    obstacle: float = 0.0
    obstacle_ahead: float = 0.0
    lean_deg: float = 0.0
    land_pitch_deg: float = -16.0
    back: float = 0.0
    dip_lean_deg: float = 0.0
    heel_rise_s: float = 0.24
    absorb_s: float = 0.21
    land_lean_deg: float = 0.0


UPRIGHT_M, READY_M = 0.995, 0.962
READY_S, TARGET_S, DIP_S, TAKE_OFF_S = 0.65, 0.85, 1.25, 1.53
OBSTACLE_DEPTH_M = 0.10
"""Of the obstacle, along the jump."""
TUCK_PITCH = 70.0
"""How much more the toes point down per metre of tuck [deg/m]."""
HEEL_M = -0.02
"""Pressure before the ankle in a heel-first landing."""
REST_S = 0.9
"""From landing to standing still."""


def _arms(flexion: float, abduction: float, elbow: float, rotation: float = 8.0) -> dict[str, float]:
    return {
        "arms_shoulder_flexion": flexion, "arms_shoulder_abduction": abduction, "arms_shoulder_rotation": rotation,
        "arms_elbow_flexion": elbow, "arms_forearm_pronation": 15.0,
    }  # fmt: skip


def jump(style: JumpStyle | None = None, name: str = "jump") -> Motion:
    """A jump from both feet onto both feet, along x."""
    style = style or JumpStyle()
    speed, landing_speed = _speeds(style)
    land = TAKE_OFF_S + (speed + landing_speed) / GRAVITY
    apex = TAKE_OFF_S + speed / GRAVITY
    end = land + REST_S + 0.35
    earlier = style.heel_rise_s - 0.24
    rising = [(TAKE_OFF_S - 0.24, -90 * earlier)] if earlier else []
    pitch = degrees_curve(
        (TAKE_OFF_S - style.heel_rise_s, 0), *rising, (TAKE_OFF_S, -46), (TAKE_OFF_S + 0.08, -56),
        (apex, -46 - TUCK_PITCH * style.tuck), (land, style.land_pitch_deg), (land + 0.09, 0),
    )  # fmt: skip
    feet = tuple(_foot(side, land, end, pitch, style) for side in SIDES)
    middle, toes = 0.05, 0.174
    first = style.distance + (toes if style.land_pitch_deg < 0 else HEEL_M)
    touch = [(land + 0.06, first)] if style.land_pitch_deg < 0 else [(land - 0.03, first), (land + 0.03, first)]
    legs_forward = [
        (0.0, middle), (TARGET_S, middle), (DIP_S - earlier, middle + 0.02 - style.back), (TAKE_OFF_S - 0.22 - earlier, 0.125), (TAKE_OFF_S - 0.15 - earlier, 0.170), (TAKE_OFF_S - 0.02, toes),
        *touch, (land + 0.14, style.distance + middle + 0.03), (land + 0.5, style.distance + middle),
        (end, style.distance + middle),
    ]  # fmt: skip
    ready = {"lumbar_flexion": 5, "thorax_flexion": 6, "neck_flexion": -8}
    folded = {"lumbar_flexion": 14, "thorax_flexion": 12, "neck_flexion": -25, "head_flexion": -5}
    stretched = {"lumbar_flexion": -2, "thorax_flexion": -3, "neck_flexion": -4}
    absorbing = {"lumbar_flexion": 12, "thorax_flexion": 10, "neck_flexion": -18}
    return build_movement(
        Movement(
            name=name,
            duration=end,
            feet=(feet[0], feet[1]),
            pressure=[(time, forward, 0.0) for time, forward in legs_forward],
            com_height=_com_height(style, land),
            trunk=[
                (0.1, UPRIGHT), (READY_S, ready), (TARGET_S, ready), (DIP_S, folded), (TAKE_OFF_S, stretched),
                (apex, stretched), (land, ready), (land + 0.18, absorbing), (land + 0.32, absorbing), (land + REST_S, UPRIGHT),
            ],
            pitch=degrees_curve(
                (0.1, 0), (READY_S, 8), (TARGET_S, 8), (DIP_S, 28 + style.dip_lean_deg), (TAKE_OFF_S, style.lean_deg),
                (apex, style.lean_deg), (land, 12 + style.lean_deg), (land + 0.14, 26 + 0.5 * style.lean_deg + 0.6 * style.land_lean_deg),
                (land + 0.28, 30 + style.land_lean_deg),
                (land + REST_S, 0),
            ),
            arm_poses=[
                (0.1, RELAXED), (READY_S, _arms(8, 8, 35)), (TARGET_S, _arms(8, 8, 35)), (DIP_S - 0.14, _arms(-38, 12, 20)),
                (TAKE_OFF_S + 0.04, _arms(88, 14, 40)), (apex, _arms(92, 14, 38)), (land, _arms(72, 16, 38)),
                (land + 0.28, _arms(28, 14, 45)), (land + REST_S, RELAXED),
            ],
            events={"target": TARGET_S, "take_off": TAKE_OFF_S, "landing": land},
        )
    )  # fmt: skip


def _foot(side: str, land: float, end: float, pitch: Curve, style: JumpStyle) -> FootPath:
    beside, toe_out = SIGNS[side] * 0.11, np.radians(8)
    via = []
    heights = _com_height(style, land)
    for share, reference, ankle in (
        (0.25, TAKE_OFF_S, 0.165), (0.5, TAKE_OFF_S, 0.155 + style.tuck), (0.7, land, 0.11 + style.tuck), (0.86, land, 0.115),
    ):  # fmt: skip
        # in flight the ankle rises and falls with the COM
        times = np.array([TAKE_OFF_S + share * (land - TAKE_OFF_S), reference])
        rise = heights(times)
        via.append((float(times[0]), 2, ankle + float(rise[0] - rise[1])))
    return FootPath(
        side,
        (Stance(0.0, TAKE_OFF_S, 0.0, beside, toe_out), Stance(land, end, style.distance, beside, toe_out)),
        pitch=pitch,
        via=tuple(via),
    )


def _speeds(style: JumpStyle) -> tuple[float, float]:
    """Vertical COM speed at take-off, upwards, and at landing, downwards [m/s]."""
    drop = style.rise + style.take_off_height - style.landing_height
    return float(np.sqrt(2 * GRAVITY * style.rise)), float(np.sqrt(2 * GRAVITY * drop))


def _com_height(style: JumpStyle, land: float) -> Curve:
    speed, landing_speed = _speeds(style)
    keys = (
        (0.1, UPRIGHT_M, 0.0, 0.0), (READY_S, READY_M, 0.0, 0.0), (TARGET_S, READY_M, 0.0, 0.0),
        (DIP_S, style.dip_height, 0.0, 11.0), (TAKE_OFF_S, style.take_off_height, speed, -GRAVITY),
        (land, style.landing_height, -landing_speed, -GRAVITY), (land + style.absorb_s, style.landing_dip, 0.0, 8.0),
        (land + REST_S, UPRIGHT_M, 0.0, 0.0),
    )  # fmt: skip
    table = np.array(keys)
    spline = BPoly.from_derivatives(table[:, 0], table[:, 1:])
    return lambda times: np.asarray(spline(np.clip(times, table[0, 0], table[-1, 0])))


HIGH = JumpStyle(
    rise=0.415, take_off_height=1.035, landing_height=0.98, dip_height=0.732, landing_dip=0.74, tuck=0.04, land_pitch_deg=-16.5,
    dip_lean_deg=13.4, heel_rise_s=0.287, absorb_s=0.25, land_lean_deg=21.4,
)  # fmt: skip
FORWARD = JumpStyle(
    rise=0.25, take_off_height=1.01, landing_height=0.90, dip_height=0.77, landing_dip=0.72, tuck=0.06, distance=0.8,
    lean_deg=10.0, land_pitch_deg=6.0, back=0.05, dip_lean_deg=12.0, heel_rise_s=0.36, absorb_s=0.24, land_lean_deg=8.0,
)  # fmt: skip
FAR = JumpStyle(
    rise=0.32, take_off_height=0.972, landing_height=0.84, dip_height=0.703, landing_dip=0.62, tuck=0.026, distance=1.2,
    lean_deg=11.6, land_pitch_deg=3.4, back=0.06, dip_lean_deg=29.9, heel_rise_s=0.417, absorb_s=0.264, land_lean_deg=-3.6,
)  # fmt: skip
OVER_LOW = JumpStyle(
    rise=0.28, take_off_height=1.01, landing_height=0.92, dip_height=0.77, landing_dip=0.72, tuck=0.10, distance=0.85,
    obstacle=0.20, obstacle_ahead=0.55, lean_deg=10.0, land_pitch_deg=-12.0, back=0.05, dip_lean_deg=12.0,
    heel_rise_s=0.36, absorb_s=0.25, land_lean_deg=8.0,
)  # fmt: skip
OVER_HIGH = JumpStyle(
    rise=0.404, take_off_height=0.98, landing_height=0.937, dip_height=0.704, landing_dip=0.652, tuck=0.143, distance=0.98,
    obstacle=0.40, obstacle_ahead=0.60, lean_deg=10.1, land_pitch_deg=-15.9, back=0.045, dip_lean_deg=25.7,
    heel_rise_s=0.389, absorb_s=0.292, land_lean_deg=15.2,
)  # fmt: skip


def _entry(name: str, summary: str, style: JumpStyle) -> Entry:
    parameters: dict[str, float | str] = {
        "rise_m": style.rise,
        "distance_m": style.distance,
        "obstacle_m": style.obstacle,
    }
    return Entry(name, "jump", summary, lambda: jump(style, name), parameters)


ENTRIES = (
    _entry("jump", "jumps straight up", JumpStyle()),
    _entry("jump_high", "jumps straight up, high", HIGH),
    _entry("jump_forward", "jumps forward from both feet", FORWARD),
    _entry("jump_far", "jumps far forward from both feet", FAR),
    _entry("jump_over_low", "jumps over something knee-high or lower", OVER_LOW),
    _entry("jump_over_high", "jumps over something above the knee, legs tucked", OVER_HIGH),
)
