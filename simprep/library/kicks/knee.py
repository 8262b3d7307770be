"""Knee strike straight ahead at belly height, the hands pulling down."""

from dataclasses import dataclass, field

from simprep.library.entry import Entry, mirrored
from simprep.library.kicks.parts import Kick, KickPhases, LegPose, Posture, build_kick
from simprep.library.parts.movement import ArmPose
from simprep.motion.motion import Motion

CLINCH: ArmPose = ((0.42, -0.08, 0.10), (0.0, 0.5, -1.0), 60.0)
"""Hands reaching for the opponent's neck."""
PULL: ArmPose = ((0.26, -0.02, -0.16), (-0.6, 0.5, -0.6), 60.0)
"""Hands pulled down against the knee."""


@dataclass(frozen=True)
class KneeStrike:
    """A knee strike of the right leg.

    Attributes:
        name: of the motion.
        flexion, knee: flexion of hip and knee at the strike [deg].
        thrust: backward tilt of the pelvis at the strike, which drives the hip forward [deg].
        turn: yaw of the pelvis at the strike [deg].
        com_height: at the strike [m].
        phases: times.
    """

    name: str
    flexion: float = 106.0
    knee: float = 128.0
    thrust: float = 20.0
    turn: float = 20.0
    com_height: float = 1.075
    phases: KickPhases = field(
        default_factory=lambda: KickPhases(
            lift=1.25, chamber=1.44, strike=1.66, fold=2.0, land=2.42, lower=2.6, duration=3.25, hip_lead=-0.03,
            pelvis_lead=0.0,
        )
    )  # fmt: skip


def knee_strike(strike: KneeStrike) -> Motion:
    """The motion of a knee strike.

    Raises:
        MotionError: a posture leaves the joint limits.
    """
    guard_pull = {"lumbar_flexion": 8, "thorax_flexion": 10, "neck_flexion": -6}
    driven = {
        "lumbar_flexion": 14,
        "thorax_flexion": 14,
        "neck_flexion": -6,
        "lumbar_rotation": -6,
        "thorax_rotation": -8,
    }
    wound = Posture(
        leg=LegPose(0.28 * strike.flexion, 8, 0, 0.78 * strike.knee, -20),
        yaw=-2, pitch=-2, hike=2, pivot=8, com_height=0.5 * (0.955 + strike.com_height),
        trunk=guard_pull, arms=(CLINCH, CLINCH),
    )  # fmt: skip
    hit = Posture(
        leg=LegPose(strike.flexion, 4, 0, strike.knee, -30),
        yaw=strike.turn, pitch=-strike.thrust, hike=8, pivot=20, com_height=strike.com_height,
        trunk=driven, arms=(PULL, PULL),
    )  # fmt: skip
    fold = Posture(
        leg=LegPose(0.7 * strike.flexion, 6, 0, 0.75 * strike.knee, -15),
        yaw=0.5 * strike.turn, pitch=-0.5 * strike.thrust, hike=4, pivot=14,
        com_height=0.4 * 0.955 + 0.6 * strike.com_height, trunk=guard_pull,
    )  # fmt: skip
    return build_kick(Kick(strike.name, wound, hit, fold, strike.phases))


RIGHT = KneeStrike("knee_right")
_RIGHT = Entry(
    RIGHT.name,
    "kick",
    "right knee to the body",
    lambda: knee_strike(RIGHT),
    {"side": "right", "type": "knee", "height": "body"},
)

ENTRIES = (mirrored(_RIGHT, "knee_left", "left knee to the body"), _RIGHT)
