"""Side kick: the heel is thrust sideways to body or knee height."""

from dataclasses import dataclass, field

from simprep.library.entry import Entry, mirrored
from simprep.library.kicks.parts import Kick, KickPhases, LegPose, Posture, build_kick, flexion_towards, leaning_trunk
from simprep.library.parts.movement import GUARD_LEAD, GUARD_REAR, ArmPose
from simprep.motion.motion import Motion

LOWERED: ArmPose = ((0.16, 0.12, -0.38), (-0.8, 0.5, -0.5), 30.0)
"""Arm of the kicking side stretched along the leg."""
FLEXION = (4.0, 6.0)
"""Of the lumbar spine and the thorax: straighter than in kicks on an arc [deg]."""


@dataclass(frozen=True)
class SideKick:
    """A side kick of the right leg.

    Attributes:
        name: of the motion.
        elevation: of the leg at the strike: hip abduction plus pelvis hike; 90 is level [deg].
        knee, knee_chamber: flexion at strike and chamber [deg].
        flexion: of the hip in the chamber [deg].
        cross: direction of the thigh at the strike, across the midline positive [deg].
        rotation: of the hip in the chamber, inward: brings the heel towards the target [deg].
        turn: yaw of the pelvis at the strike [deg].
        pivot: turn of the standing foot at the strike [deg].
        lean: of the trunk to the side, away from the leg [deg].
        com_height: at the strike [m].
        chamber_turn, chamber_abduction: pelvis yaw and hip abduction in the chamber, as shares of those at the strike.
        phases: times.
    """

    name: str
    elevation: float
    knee: float = 14.0
    knee_chamber: float = 128.0
    flexion: float = 78.0
    cross: float = 4.0
    rotation: float = 40.0
    turn: float = 70.0
    pivot: float = 74.0
    lean: float = 38.0
    com_height: float = 1.04
    chamber_turn: float = 0.81
    chamber_abduction: float = 0.36
    phases: KickPhases = field(
        default_factory=lambda: KickPhases(
            lift=1.25, chamber=1.73, strike=1.94, fold=2.27, land=2.92, lower=3.1, duration=3.75, hip_lead=0.015,
            pelvis_lead=0.06, turn_lead=0.31, contact_lead=3 / 60,
        )
    )  # fmt: skip


def side_kick(kick: SideKick) -> Motion:
    """The motion of a side kick.

    Raises:
        MotionError: a posture leaves the joint limits.
    """
    abduction = min(0.66 * kick.elevation, 66.0)
    hike = kick.elevation - abduction
    flexion = flexion_towards(abduction, hike, kick.turn - kick.cross)
    chamber = Posture(
        leg=LegPose(kick.flexion, kick.chamber_abduction * abduction, kick.rotation, kick.knee_chamber, 12, 0),
        yaw=kick.chamber_turn * kick.turn, pitch=-6, hike=0.5 * hike, pivot=0.8 * kick.pivot,
        com_height=0.7 * kick.com_height + 0.3 * 0.955,
        trunk=leaning_trunk(0.5 * kick.lean, 0.5 * hike, -10, -44, FLEXION), arms=(GUARD_LEAD, GUARD_REAR),
    )  # fmt: skip
    strike = Posture(
        leg=LegPose(flexion, abduction, 14, kick.knee, 14, 8),
        yaw=kick.turn, pitch=-2, hike=hike, pivot=kick.pivot, com_height=kick.com_height,
        trunk=leaning_trunk(kick.lean, hike, -14, -66, FLEXION), arms=(GUARD_LEAD, LOWERED),
    )  # fmt: skip
    fold = Posture(
        leg=LegPose(0.85 * kick.flexion, 0.4 * abduction, 0.8 * kick.rotation, 0.88 * kick.knee_chamber, 5, 0),
        yaw=0.78 * kick.turn, pitch=-5, hike=0.55 * hike, pivot=0.85 * kick.pivot,
        com_height=0.6 * kick.com_height + 0.4 * 0.955,
        trunk=leaning_trunk(0.55 * kick.lean, 0.55 * hike, -10, -46, FLEXION), arms=(GUARD_LEAD, GUARD_REAR),
    )  # fmt: skip
    return build_kick(Kick(kick.name, chamber, strike, fold, kick.phases, inward=0.012))


BODY = SideKick("side_kick_right_body", elevation=92)
LOW = SideKick("side_kick_right_low", elevation=62, com_height=1.0, lean=24, flexion=74, turn=70)


def _entry(kick: SideKick, summary: str, height: str) -> Entry:
    return Entry(
        kick.name,
        "kick",
        summary,
        lambda: side_kick(kick),
        {"side": "right", "type": "side", "height": height, "elevation_deg": kick.elevation},
    )


_BODY = _entry(BODY, "side kick of the right leg to the body", "body")
_LOW = _entry(LOW, "side kick of the right leg to the knee", "knee")

ENTRIES = (
    mirrored(_BODY, "side_kick_left_body", "side kick of the left leg to the body"),
    _BODY,
    mirrored(_LOW, "side_kick_left_low", "side kick of the left leg to the knee"),
    _LOW,
)
