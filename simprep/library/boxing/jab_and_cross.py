"""Straight punches: the jab of the front hand and the cross of the rear hand, to head and body.

Published peak speeds: elite and junior jabs 7.2 and 6.3 m/s, 1.3 to 1.6 m/s faster than at contact (Liu et al. 2022,
PMC9798280); rear crosses of juniors 7.0 to 7.5 m/s (doi 10.1177/1747954120952574) with about 60 % of the load on the
front foot (Dinu & Louis 2020, Front Sports Act Living 2:598861).
"""

from dataclasses import dataclass, replace

from simprep.library.boxing.postures import LEAD, REAR, Aim, Posture
from simprep.library.boxing.strike import BODY_DROP_M, FIST_HEIGHT_M, THROUGH_S, Strike, both_sides, strike_motion
from simprep.library.parts.movement import ArmPose
from simprep.motion.curves import minimum_jerk
from simprep.motion.motion import Motion


@dataclass(frozen=True)
class StraightPunch:
    """A jab or a cross.

    Attributes:
        name: of the motion.
        hand: `lead` or `rear`.
        height: `head` or `body`.
        reach_m: shoulder to fist at the end of the follow-through [m].
        arm_s: from the start of the arm to contact [s].
    """

    name: str
    hand: str
    height: str
    reach_m: float = 0.625
    arm_s: float = 0.086

    def strike(self) -> Strike:
        """The strike of this punch."""
        lead, body = self.hand == "lead", self.height == "body"
        if lead:
            load, drive, back = 0.06, 0.19, 0.28
            loaded = Posture(yaw=-16, twist=-5, pitch=3, flexion=11, front_share=0.40)
            thrown = Posture(yaw=-41, twist=-12, pitch=7, flexion=13, front_share=0.68, heels=(0, 22), pivots=(0, 0))
        else:
            load, drive, back = 0.115, 0.21, 0.36
            loaded = Posture(yaw=-28, twist=-14, front_share=0.40)
            thrown = Posture(yaw=28, twist=22, pitch=6, front_share=0.66, heels=(0, 32), pivots=(0, -32))
        if body:
            load, back = load + (0.18 if lead else 0.13), back + 0.24
            share = float(minimum_jerk(load / (load + drive - 0.05)))
            loaded = replace(loaded, drop=share * BODY_DROP_M, heels=(0, 18))
            thrown = replace(thrown, drop=BODY_DROP_M, pitch=thrown.pitch + 6, flexion=thrown.flexion + 6)
        elbow = (0.0, 0.45, -1.0)
        at = FIST_HEIGHT_M[self.height]
        guard, cover = (LEAD, REAR) if lead else (REAR, _COVER_LEAD)
        return Strike(
            self.name, self.hand, loaded, thrown, load, drive, back,
            fists=(
                (-self.arm_s - (0.0 if lead else 0.004), guard), (THROUGH_S, Aim(at, 0.0, self.reach_m, elbow)),
            ),
            cover=cover,
            legs_s=-0.05 if lead else -0.035,
            straight=True,
        )  # fmt: skip

    def motion(self) -> Motion:
        """The motion of this punch."""
        return strike_motion(self.strike())


_COVER_LEAD: ArmPose = ((0.20, -0.07, 0.19), (-0.2, 0.30, -1.0), 35.0)


ENTRIES = (
    *both_sides("jab", "left", "head", StraightPunch("jab_left_head", "lead", "head").motion),
    *both_sides("jab", "left", "body", StraightPunch("jab_left_body", "lead", "body").motion),
    *both_sides("cross", "right", "body", StraightPunch("cross_right_body", "rear", "body").motion),
)
