"""Evasions of a boxer: slip, bob and weave, sway back, shoulder roll. The feet stay, the head leaves the blow's line.

Timing is chosen: 0.25 to 0.4 s to the peak, 0.3 to 0.5 s back; 25 to 35 cm of drop clear a hook to the head. Boxers
move their hips up and down about 56 times a minute (Dinu et al. 2020, Proceedings 49:61).
"""

from dataclasses import dataclass

from simprep.library.boxing.postures import LEAD, REAR, Action, Posture, boxing_motion
from simprep.library.entry import Entry, mirrored
from simprep.library.parts.movement import ArmPose
from simprep.motion.motion import Motion

LOW_LEAD: ArmPose = ((0.22, -0.16, -0.16), (-0.3, 0.6, -1.0), 40.0)
"""Front arm across the belly, shoulder before the chin."""
LEANING_LEAD: ArmPose = ((0.30, -0.05, 0.02), (-0.3, 0.35, -1.0), 35.0)
LEANING_REAR: ArmPose = ((0.22, -0.09, 0.06), (-0.4, 0.35, -1.0), 35.0)
"""Guard with the trunk leaning back."""
COVER_LEAD: ArmPose = ((0.24, -0.07, 0.20), (-0.1, 0.30, -1.0), 35.0)
COVER_REAR: ArmPose = ((0.18, -0.10, 0.21), (-0.2, 0.28, -1.0), 35.0)


@dataclass(frozen=True)
class Evasion:
    """One evasion, left foot in front.

    Attributes:
        name: of the motion.
        away: posture in which the head is off the line.
        peak_s: from the first frame of the movement to the event `peak`: `under` where given, else `away` [s].
        return_s: back to the guard [s].
        under: posture on the way down and under, before `away`; None goes there directly.
        rise_s: from `under` to `away` [s].
        hold_s: how long `away` lasts [s].
        arms: front and rear arm.
    """

    name: str
    away: Posture
    peak_s: float
    return_s: float
    under: Posture | None = None
    rise_s: float = 0.24
    hold_s: float = 0.05
    arms: tuple[ArmPose, ArmPose] = (COVER_LEAD, COVER_REAR)

    def motion(self) -> Motion:
        """The motion of this evasion."""
        there = self.peak_s if self.under is None else self.peak_s + self.rise_s
        way = () if self.under is None else ((self.peak_s, self.under),)
        end = there + self.hold_s
        return boxing_motion(
            Action(
                name=self.name,
                postures=(*way, (there, self.away), (end, self.away)),
                back=end + self.return_s,
                fists=(
                    ((0.0, LEAD), (self.peak_s, self.arms[0]), (end, self.arms[0])),
                    ((0.0, REAR), (self.peak_s, self.arms[1]), (end, self.arms[1])),
                ),
                lags=(0.015, 0.03),
                events={"peak": self.peak_s + 0.03},
            )
        )


SLIP = Evasion(
    "slip_left",
    Posture(yaw=-10, twist=6, flexion=18, pitch=8, bend=26, roll=-10, front_share=0.74, drop=0.05, heels=(0, 24)),
    peak_s=0.28, return_s=0.38,
)  # fmt: skip
WEAVE = Evasion(
    "weave_left",
    Posture(yaw=-12, twist=4, flexion=16, pitch=8, bend=22, roll=-8, front_share=0.74, drop=0.05, heels=(0, 22)),
    peak_s=0.42, return_s=0.44, rise_s=0.34,
    under=Posture(yaw=-20, twist=-4, flexion=28, pitch=22, bend=2, front_share=0.56, drop=0.16, heels=(0, 24)),
)  # fmt: skip
SWAY = Evasion(
    "sway_back",
    Posture(yaw=-30, twist=-10, flexion=-12, pitch=-14, bend=-2, front_share=0.26, drop=-0.01),
    peak_s=0.30, return_s=0.42, arms=(LEANING_LEAD, LEANING_REAR),
)  # fmt: skip
SHOULDER_ROLL = Evasion(
    "shoulder_roll",
    Posture(yaw=-48, twist=-22, flexion=6, pitch=-3, bend=-14, front_share=0.32, drop=0.0),
    peak_s=0.28, return_s=0.42, arms=(LOW_LEAD, COVER_REAR),
)  # fmt: skip


def _side(evasion: Evasion, move: str, type_: str) -> tuple[Entry, Entry]:
    entry = Entry(evasion.name, "dodge", f"{move} to the left", evasion.motion, {"side": "left", "type": type_})
    return entry, mirrored(entry, evasion.name.replace("left", "right"), f"{move} to the right")


ENTRIES = (
    *_side(SLIP, "slips a straight punch", "slip"),
    *_side(WEAVE, "bobs and weaves under a hook", "weave"),
    Entry("sway_back", "dodge", "sways back out of reach", SWAY.motion, {"side": "left", "type": "sway"}),
    Entry(
        "shoulder_roll", "dodge", "rolls with a punch behind the front shoulder", SHOULDER_ROLL.motion,
        {"side": "left", "type": "roll"},
    ),
)  # fmt: skip
