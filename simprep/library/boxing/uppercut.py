"""Uppercuts of the rear hand to head and body: a dip of the knees, then legs, hips and arm drive the fist up.

Timing and speed have no measured source: knees dip by 10 to 20 deg, fist 7 to 11 m/s (slower than the hooks of Viano et
al. 2005), elbow bent by 70 to 110 deg at contact.
"""

from dataclasses import dataclass, replace

from simprep.library.boxing.postures import LEAD, REAR, Aim, Posture
from simprep.library.boxing.strike import Strike, both_sides, strike_motion
from simprep.motion.motion import Motion

LOAD_S, DRIVE_S, RETURN_S = 0.20, 0.23, 0.42
RISEN_S = 0.05
"""From contact to the highest point of the fist."""


@dataclass(frozen=True)
class Uppercut:
    """An uppercut of the right hand, left foot in front.

    Attributes:
        name: of the motion.
        height: `head` or `body`.
        dip_m: drop of the COM before the drive [m].
        reach_m: shoulder to fist at contact [m].
        rise_m: further rise of the fist after contact [m].
        arm_s: from the start of the arm's own swing to contact [s].
    """

    name: str
    height: str
    dip_m: float = 0.04
    reach_m: float = 0.40
    rise_m: float = 0.17
    arm_s: float = 0.12

    def motion(self) -> Motion:
        """The motion of this uppercut."""
        body = self.height == "body"
        at = 1.08 if body else 1.40
        loaded = Posture(yaw=-30, twist=-14, flexion=16, bend=-12, front_share=0.40, drop=self.dip_m, heels=(0, 8))
        thrown = Posture(
            yaw=22, twist=18, flexion=7, bend=3, pitch=1, front_share=0.62, drop=0.0, heels=(0, 32), pivots=(0, -30)
        )
        load, back = LOAD_S, RETURN_S
        if body:
            load, back = load + 0.10, back + 0.06
            loaded = replace(loaded, drop=self.dip_m + 0.04, heels=(0, 16))
            thrown = replace(thrown, drop=self.dip_m + 0.01, flexion=14, pitch=6, yaw=26, twist=20)
        wound = ((0.22, 0.04, -0.24) if body else (0.22, 0.0, -0.16), (-0.8, 0.3, -1.0), -30.0)
        elbow = (-0.3, 0.3, -1.0)
        strike = Strike(
            self.name, "rear", loaded, thrown, load, DRIVE_S, back,
            fists=(
                (-self.arm_s - 0.16, REAR),
                (-self.arm_s, wound),
                (0.0, Aim(at, 0.0, self.reach_m, elbow, -60.0)),
                (RISEN_S, Aim(at + self.rise_m, 0.02, self.reach_m, elbow, -60.0)),
            ),
            cover=LEAD,
            legs_s=-0.02,
        )  # fmt: skip
        return strike_motion(strike)


ENTRIES = (
    *both_sides("uppercut", "right", "head", Uppercut("uppercut_right_head", "head").motion),
    *both_sides("uppercut", "right", "body", Uppercut("uppercut_right_body", "body", rise_m=0.27, arm_s=0.093).motion),
)
