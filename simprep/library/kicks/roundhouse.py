"""Kicks on an arc: roundhouse with the instep to body or head, low kick with the shin to the thigh.

Angles have no measured source: knee folded 100 to 130 deg in the chamber and 10 to 30 deg at contact (low kick 30 to
50), support foot turned 60 to 120 deg outward, trunk leaning 20 to 45 deg away. Phases and foot speed (about 12 m/s)
after Gavagan & Sayers 2017, PLoS One e0182645, and Wasik 2022, J Mens Health 18:138.
"""

from dataclasses import dataclass, field, replace

from simprep.library.entry import Entry, mirrored
from simprep.library.kicks.parts import Kick, KickPhases, LegPose, Posture, build_kick, flexion_towards, leaning_trunk
from simprep.library.parts.movement import GUARD_LEAD, GUARD_REAR, ArmPose
from simprep.motion.motion import Motion

HIP_SHARE, HIP_MOST_DEG = 0.63, 66.0
"""Share of the leg's elevation that comes from the hip, and the hip's largest abduction [deg]."""
DROPPING: ArmPose = ((0.24, 0.06, -0.12), (-0.5, 0.5, -0.9), 30.0)
"""Arm of the kicking side on its way down."""
SWUNG_BACK: ArmPose = ((-0.06, 0.14, -0.55), (-1.0, 0.3, 0.0), 20.0)
"""Arm of the kicking side thrown down and back against the turn."""


PHASES = KickPhases(
    lift=1.25, chamber=1.56, strike=1.77, fold=2.14, land=2.72, lower=2.9, duration=3.55, hip_lead=0.045, pelvis_lead=0.09,
    turn_lead=0.30,
    contact_lead=4 / 60,
)  # fmt: skip
"""Times of a roundhouse: pelvis before hip before knee, so that the standing foot needs little torsional friction."""


@dataclass(frozen=True)
class RoundKick:
    """A kick of the right leg on an arc.

    Attributes:
        name: of the motion.
        elevation: of the leg at the strike: hip abduction plus pelvis hike; 90 is level [deg].
        knee, knee_chamber: flexion at strike and chamber [deg].
        cross: direction of the thigh at the strike, across the midline positive [deg].
        turn: yaw of the pelvis at the strike [deg].
        pivot: turn of the standing foot at the strike [deg].
        lean: of the trunk to the side, away from the leg [deg].
        com_height: at the strike [m].
        chamber_turn, chamber_abduction, chamber_flexion: pelvis yaw, hip abduction and hip flexion in the chamber,
            as shares of those at the strike.
        chamber_hike: share of pelvis hike and trunk lean in the chamber.
        fold_turn: share of the pelvis yaw in the fold.
        phases: times.
    """

    name: str
    elevation: float
    knee: float = 16.0
    knee_chamber: float = 112.0
    cross: float = 10.0
    turn: float = 71.0
    pivot: float = 50.0
    lean: float = 36.0
    com_height: float = 1.045
    chamber_turn: float = 0.90
    chamber_abduction: float = 0.66
    chamber_flexion: float = 0.62
    chamber_hike: float = 0.65
    fold_turn: float = 0.8
    phases: KickPhases = field(default_factory=lambda: PHASES)


def round_kick(kick: RoundKick) -> Motion:
    """The motion of a kick on an arc.

    Raises:
        MotionError: a posture leaves the joint limits.
    """
    abduction = min(HIP_SHARE * kick.elevation, HIP_MOST_DEG)
    hike = kick.elevation - abduction
    flexion = flexion_towards(abduction, hike, kick.turn - kick.cross)
    chamber = Posture(
        leg=LegPose(kick.chamber_flexion * flexion, kick.chamber_abduction * abduction, 0, kick.knee_chamber, -25),
        yaw=kick.chamber_turn * kick.turn, pitch=-4, hike=kick.chamber_hike * hike, pivot=0.62 * kick.pivot,
        com_height=0.7 * kick.com_height + 0.3 * 0.955,
        trunk=leaning_trunk(kick.chamber_hike * kick.lean, kick.chamber_hike * hike, -4, -26), arms=(GUARD_LEAD, DROPPING),
    )  # fmt: skip
    strike = Posture(
        leg=LegPose(flexion, abduction, 0, kick.knee, -35),
        yaw=kick.turn, pitch=-6, hike=hike, pivot=kick.pivot, com_height=kick.com_height,
        trunk=leaning_trunk(kick.lean, hike, -26, -50), arms=(GUARD_LEAD, SWUNG_BACK),
    )  # fmt: skip
    fold = Posture(
        leg=LegPose(flexion + 4, 0.8 * abduction, 0, 0.85 * kick.knee_chamber, -20),
        yaw=kick.fold_turn * kick.turn, pitch=-3, hike=0.58 * hike, pivot=0.8 * kick.pivot,
        com_height=0.6 * kick.com_height + 0.4 * 0.955,
        trunk=leaning_trunk(0.55 * kick.lean, 0.58 * hike, -8, -40), arms=(GUARD_LEAD, GUARD_REAR),
    )  # fmt: skip
    return build_kick(Kick(kick.name, chamber, strike, fold, kick.phases))


BODY = RoundKick("roundhouse_right_body", elevation=92)
HEAD = RoundKick(
    "roundhouse_right_head", elevation=120, com_height=1.085, lean=38, pivot=56, turn=72.5,
    phases=replace(PHASES, chamber=1.58, strike=1.805, fold=2.10, turn_lead=0.33, contact_lead=4 / 60),
)  # fmt: skip
LOW = RoundKick("kick_low_right", elevation=64, knee=32, com_height=1.0, lean=22, pivot=46, turn=66)


def _entry(kick: RoundKick, summary: str, kind: str, height: str) -> Entry:
    return Entry(
        kick.name,
        "kick",
        summary,
        lambda: round_kick(kick),
        {"side": "right", "type": kind, "height": height, "elevation_deg": kick.elevation},
    )


_BODY = _entry(BODY, "roundhouse of the right leg to the body", "roundhouse", "body")
_HEAD = _entry(HEAD, "roundhouse of the right leg to the head", "roundhouse", "head")
_LOW = _entry(LOW, "low kick of the right shin to the thigh", "low", "thigh")

ENTRIES = (
    mirrored(_BODY, "roundhouse_left_body", "roundhouse of the left leg to the body"),
    _BODY,
    mirrored(_HEAD, "roundhouse_left_head", "roundhouse of the left leg to the head"),
    _HEAD,
    mirrored(_LOW, "kick_low_left", "low kick of the left shin to the thigh"),
    _LOW,
)
