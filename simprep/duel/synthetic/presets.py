"""The two synthetic streams, with the sizes of the 2008 paper: kickboxing and taekwondo.

Rates and times are plausible, not chosen to make any result come out: punches take 0.2 to 0.3 s to contact and 0.2 to
0.4 s back, kicks about 0.5 s from lift to contact; reactions 0.24 s to a punch (simple reaction of boxers, Bianco et
al. 2011) and about 0.4 s to a kick (choice reaction).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from simprep.duel.synthetic.generating_model import Footing, Temper
from simprep.errors import SettingError, UnknownNameError

DURATIONS_S: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "neutral": (0.46, 0.95), "fwd": (0.36, 0.48), "bwd": (0.34, 0.48), "bwdfwd": (0.42, 0.54),
        "fwdbwd": (0.44, 0.58), "_to_left": (0.40, 0.52), "_to_right": (0.40, 0.52), "_up": (0.52, 0.70), "_down": (0.52, 0.74),
        "downup": (0.58, 0.76), "jump_up": (0.64, 0.80), "jump_down": (0.60, 0.76),
    }
)  # fmt: skip
"""Shortest and longest action by the end of its kind's name, the longest that fits [s]."""


@dataclass(frozen=True)
class SyntheticSettings:
    """How a synthetic stream is made.

    Attributes:
        name: of the preset.
        fps: frames per second [1/s], 60 or 30.
        clips: number of clips.
        clip_s: length of each clip [s].
        tempers: of A and B.
        changes_foot: probability that an action ends on another foot than it began, by the end of its kind's name.
        distance_m: of the roots while nobody attacks [m].
        reaction_s: mean and standard deviation of the time from the beginning of the opponent's punch, and kick, until
            a waiting fighter acts [s].
        joint_noise_deg: standard deviation of the measurement noise of every hinge and of the root's rotation [deg].
        root_noise_m: the same of the root's position [m].
        noise_s: over which the noise is correlated (standard deviation of a Gaussian) [s].

    Raises:
        SettingError: a value out of range.
    """

    name: str
    fps: float
    clips: int
    clip_s: float
    tempers: tuple[Temper, Temper]
    changes_foot: Mapping[str, float] = field(
        default_factory=lambda: {
            "neutral": 0.42, "fwd": 0.75, "bwd": 0.35, "bwdfwd": 0.35, "fwdbwd": 0.65, "_to_left": 0.55, "_to_right": 0.55,
            "_down": 0.3, "jump_down": 0.25,
        }
    )  # fmt: skip
    distance_m: float = 1.15
    reaction_s: tuple[tuple[float, float], tuple[float, float]] = ((0.25, 0.03), (0.39, 0.05))
    joint_noise_deg: float = 0.3
    root_noise_m: float = 0.001
    noise_s: float = 0.012

    def __post_init__(self) -> None:
        if self.fps not in (30.0, 60.0):
            raise SettingError(f"{self.fps} frames per second; valid: 30 or 60")
        if not 5 <= self.clip_s < 90 or self.clips < 1:
            raise SettingError(f"{self.clips} clips of {self.clip_s} s; valid: at least 1, of 5 to 90 s")
        if min(self.joint_noise_deg, self.root_noise_m, self.noise_s) < 0:
            raise SettingError("noise must not be negative")

    @property
    def footing(self) -> Footing:
        """Last foot by kind and first foot."""
        return Footing(self.changes_foot)


_KICKBOXER = Temper(
    start={
        "left_fwd": 0.17, "right_fwd": 0.10, "left_fwdbwd": 0.09, "right_fwdbwd": 0.06, "left_up": 0.08, "right_up": 0.12,
        "jump_up": 0.025, "left_jump_up": 0.02, "right_jump_up": 0.03,
    },
    contexts={"kick": (0.35, 0.4), "punch": (0.5, 0.7), "recovering": (1.5, 1.6), "neutral": (1.0, 1.0)},
    double_punch=0.25,
    double_kick=0.28,
)  # fmt: skip
_OUTFIGHTER = Temper(
    start={
        "left_fwd": 0.13, "right_fwd": 0.11, "left_fwdbwd": 0.10, "right_fwdbwd": 0.05, "left_up": 0.12, "right_up": 0.12,
        "jump_up": 0.03, "left_jump_up": 0.025, "right_jump_up": 0.025,
    },
    contexts={"kick": (0.6, 0.3), "punch": (0.8, 0.4), "recovering": (2.0, 1.4), "neutral": (0.8, 0.8)},
    again=0.5,
    double_punch=0.28,
    other_hand=0.24,
    double_kick=0.3,
)  # fmt: skip
_TAEKWONDO_A = Temper(
    start={
        "left_fwd": 0.07, "right_fwd": 0.09, "left_fwdbwd": 0.08, "right_fwdbwd": 0.07, "left_up": 0.19, "right_up": 0.24,
        "jump_up": 0.04, "left_jump_up": 0.05, "right_jump_up": 0.06,
    },
    contexts={"kick": (0.5, 0.3), "punch": (0.8, 0.6), "recovering": (1.7, 1.3), "neutral": (1.0, 1.0)},
    again=0.8,
    double_punch=0.35,
    double_kick=0.3,
)  # fmt: skip
_TAEKWONDO_B = Temper(
    start={
        "left_fwd": 0.08, "right_fwd": 0.07, "left_fwdbwd": 0.07, "right_fwdbwd": 0.08, "left_up": 0.22, "right_up": 0.18,
        "jump_up": 0.04, "left_jump_up": 0.06, "right_jump_up": 0.05,
    },
    contexts={"kick": (0.7, 0.4), "punch": (1.0, 0.5), "recovering": (1.9, 1.2), "neutral": (0.75, 0.75)},
    again=0.6,
    double_punch=0.35,
    double_kick=0.3,
)  # fmt: skip

PRESETS: Mapping[str, SyntheticSettings] = MappingProxyType(
    {
        "kickboxing": SyntheticSettings("kickboxing", 60.0, 12, 80.0, (_KICKBOXER, _OUTFIGHTER)),
        "taekwondo": SyntheticSettings("taekwondo", 30.0, 7, 84.0, (_TAEKWONDO_A, _TAEKWONDO_B), distance_m=1.22),
    }
)
"""Kickboxing: 16 min at 60 frames/s; taekwondo: 9.8 min at 30."""


def preset(name: str) -> SyntheticSettings:
    """A preset by name.

    Raises:
        UnknownNameError: no such preset.
    """
    if name not in PRESETS:
        raise UnknownNameError("synthetic stream", name, PRESETS)
    return PRESETS[name]


def duration_range(kind: str) -> tuple[float, float]:
    """Shortest and longest action of a kind [s]."""
    return DURATIONS_S[max((end for end in DURATIONS_S if kind.endswith(end)), key=len)]
