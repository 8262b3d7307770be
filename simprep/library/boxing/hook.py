"""Hooks of the front hand to head and body: the upper arm nearly level, the elbow bent by about a right angle.

Hips and trunk carry the arm round over the pivoting front foot; the arm adds its own swing. Hand speed at contact of
Olympic boxers 11.0 +- 3.4 m/s (Viano et al. 2005, Neurosurgery 57:1154); hooks are faster than straight punches and
take longer (Piorkowski et al. 2011, Sports Biomech, pubmed 21560747).
"""

from dataclasses import dataclass, replace

from simprep.library.boxing.postures import GUARD, LEAD, REAR, Posture, linked
from simprep.library.boxing.strike import BODY_DROP_M, Strike, both_sides, strike_motion
from simprep.motion.curves import minimum_jerk
from simprep.motion.motion import Motion

LOAD_S, DRIVE_S, RETURN_S = 0.16, 0.19, 0.42
LEGS_S, SWEPT_S = 0.06, 0.095
"""After contact: hips have turned, fist has swept through."""
WOUND = {
    "head": linked((0.25, 0.78, -0.44), (0.68, -0.15, 0.72), 30.0),
    "body": linked((0.10, 0.60, -0.72), (0.80, -0.05, 0.62), 30.0),
}
SWEPT = {
    "head": linked((0.72, 0.66, 0.24), (0.52, -0.76, 0.55), 30.0),
    "body": linked((0.70, 0.52, -0.28), (0.58, -0.75, 0.50), 30.0),
}


@dataclass(frozen=True)
class Hook:
    """A hook of the left hand, left foot in front.

    Attributes:
        name: of the motion.
        height: `head` or `body`.
        open_deg, turn_deg: turn of hips and trunk to the left before the punch, then to the right [deg].
        hip_share: share of both by the hips over the feet.
        arm_s: from the start of the arm's own swing to contact [s].
    """

    name: str
    height: str
    open_deg: float = 40.0
    turn_deg: float = 88.0
    hip_share: float = 0.6
    arm_s: float = 0.055

    def motion(self) -> Motion:
        """The motion of this hook."""
        body = self.height == "body"
        load, back = LOAD_S, RETURN_S
        hips, trunk = self.hip_share, 1 - self.hip_share
        yaw, twist = GUARD.yaw + hips * self.open_deg, GUARD.twist + trunk * self.open_deg
        loaded = Posture(yaw=yaw, twist=twist, front_share=0.54, flexion=8, pitch=1)
        thrown = Posture(
            yaw=yaw - hips * self.turn_deg, twist=twist - trunk * self.turn_deg, front_share=0.38, flexion=4, pitch=-1,
            drop=-0.02, heels=(18, 0), pivots=(-32, 0),
        )  # fmt: skip
        if body:
            load, back = load + 0.10, back + 0.14
            share = float(minimum_jerk(load / (load + DRIVE_S)))
            loaded = replace(loaded, drop=share * BODY_DROP_M, bend=6, heels=(0, 24))
            thrown = replace(
                thrown, drop=BODY_DROP_M, pitch=8, flexion=18, bend=8, heels=(0, 24), pivots=(0, 0), front_share=0.5
            )
        strike = Strike(
            self.name, "lead", loaded, thrown, load, DRIVE_S, back,
            fists=(
                (-self.arm_s - 0.16, LEAD), (-self.arm_s, WOUND[self.height]),
                (SWEPT_S, SWEPT[self.height]),
            ),
            cover=REAR,
            legs_s=LEGS_S,
        )  # fmt: skip
        return strike_motion(strike)


ENTRIES = (
    *both_sides("hook", "left", "head", Hook("hook_left_head", "head").motion),
    *both_sides("hook", "left", "body", Hook("hook_left_body", "body").motion),
)
