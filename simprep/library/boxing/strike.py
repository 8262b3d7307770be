"""Strikes with the fist: load, drive, contact, follow-through, back to the guard."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from simprep.library.boxing.postures import LEAD, REAR, Action, Aim, FistKey, Posture, boxing_motion
from simprep.library.entry import FPS, Entry, mirrored
from simprep.library.parts.movement import ArmPose
from simprep.motion.motion import Motion

LAGS_S = (0.05, 0.075)
"""Pelvis and trunk behind the legs: 20 to 50 ms a link."""
THROUGH_S = 0.058
"""From contact to the end of the follow-through."""
BODY_DROP_M = 0.12
"""Drop of the COM for a punch to the body."""
FIST_HEIGHT_M = {"head": 1.47, "body": 1.10}
"""Of the fist at contact: chin and solar plexus of a person of the same stature in guard."""


@dataclass(frozen=True)
class Strike:
    """One strike of a boxer with the left foot in front.

    Attributes:
        name: of the motion.
        hand: `lead` (left) or `rear` (right).
        loaded, thrown: posture at the end of the wind-up and at contact.
        load_s, drive_s: length of the wind-up, and from its end to contact [s].
        return_s: from contact to the guard [s].
        fists: keys of the striking arm; times relative to contact [s].
        cover: what the other arm does meanwhile.
        legs_s: when the legs end their drive, relative to contact [s].
        straight: the fist moves on a straight line.
    """

    name: str
    hand: str
    loaded: Posture
    thrown: Posture
    load_s: float
    drive_s: float
    return_s: float
    fists: Sequence[tuple[float, ArmPose | Aim]]
    cover: ArmPose
    legs_s: float = -0.05
    straight: bool = False

    @property
    def contact_s(self) -> float:
        """From the first frame of the movement to contact, on a frame [s]."""
        return round((self.load_s + self.drive_s) * FPS) / FPS


def strike_motion(strike: Strike) -> Motion:
    """The motion of a strike, with events `target` and `impact`.

    Raises:
        MotionError: a pose leaves the joint limits.
    """
    contact = strike.contact_s
    other = REAR if strike.hand == "lead" else LEAD
    striking: list[FistKey] = [(contact + time, pose) for time, pose in strike.fists]
    covering: list[FistKey] = [(strike.load_s, other), (contact, strike.cover), (contact + 0.08, strike.cover)]
    return boxing_motion(
        Action(
            name=strike.name,
            postures=(
                (strike.load_s, strike.loaded),
                (contact + strike.legs_s, strike.thrown),
                (contact + max(strike.legs_s + 0.01, THROUGH_S), strike.thrown),
            ),
            back=contact + strike.return_s,
            fists=(striking, covering) if strike.hand == "lead" else (covering, striking),
            straight=(strike.straight, False) if strike.hand == "lead" else (False, strike.straight),
            lags=LAGS_S,
            events={"impact": contact},
        )
    )


def both_sides(kind: str, side: str, height: str, generate: Callable[[], Motion]) -> tuple[Entry, Entry]:
    """Entries of a punch and of its mirror image.

    Args:
        kind: `jab`, `cross`, `hook` or `uppercut`.
        side: of the hand that the generator moves, `left` or `right`.
        height: `head` or `body`.
        generate: makes the motion, named kind_side_height.
    """

    def texts(of: str) -> tuple[str, str]:
        return f"{kind}_{of}_{height}", f"{kind} of the {of} hand to the {height}"

    name, summary = texts(side)
    entry = Entry(name, "punch", summary, generate, {"side": side, "type": kind, "height": height})
    return entry, mirrored(entry, *texts("right" if side == "left" else "left"))
