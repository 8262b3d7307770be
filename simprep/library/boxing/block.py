"""Blocks: an arm comes between a blow and its target, and the body braces.

The cover stands about a quarter of a second after the movement starts, or a straight punch is there first (simple
reaction of boxers 0.24 s, Bianco et al. 2011).
"""

from dataclasses import dataclass

from simprep.library.boxing.postures import LEAD, REAR, Action, Posture, boxing_motion, linked
from simprep.library.entry import Entry, mirrored
from simprep.library.parts.movement import ArmPose
from simprep.motion.motion import Motion

HIGH: ArmPose = linked((0.70, 0.35, 0.10), (-0.62, -0.22, 0.80), 20.0)
"""Forearm upright beside the head, elbow forward: against a hook or a round kick to the head."""
LOW: ArmPose = linked((0.10, 0.10, -1.0), (0.62, -0.12, 0.78), 10.0)
"""Upper arm against the ribs, forearm before the liver: against a blow to the body."""


@dataclass(frozen=True)
class Block:
    """A block with the left arm, left foot in front.

    Attributes:
        name: of the motion.
        height: `high` (head) or `low` (ribs).
        close_s: from the first frame of the movement to the block in place [s].
        hold_s, return_s: time in the block, and back to the guard [s].
        brace_m: drop of the COM by the knees [m].
        bend_deg: of the trunk towards the blocking arm [deg].
    """

    name: str
    height: str
    close_s: float = 0.25
    hold_s: float = 0.12
    return_s: float = 0.38
    brace_m: float = 0.03
    bend_deg: float = 4.0

    def motion(self) -> Motion:
        """The motion of this block."""
        high = self.height == "high"
        braced = Posture(
            yaw=-20, twist=-6, flexion=16 if high else 20, pitch=5 if high else 7,
            bend=self.bend_deg, roll=-1.0 if high else -3.0, front_share=0.54, drop=self.brace_m, heels=(0, 14),
        )  # fmt: skip
        rear = ((0.17, -0.10, 0.22), (-0.1, 0.25, -1.0), 35.0)
        held = self.close_s + self.hold_s
        return boxing_motion(
            Action(
                name=self.name,
                postures=((self.close_s, braced), (held, braced)),
                back=held + self.return_s,
                fists=(
                    ((0.0, LEAD), (self.close_s, HIGH if high else LOW), (held, HIGH if high else LOW)),
                    ((0.0, REAR), (self.close_s, rear), (held, rear)),
                ),
                lags=(0.01, 0.02),
                events={"impact": self.close_s},
            )
        )


def _entries(block: Block) -> tuple[Entry, Entry]:
    place = {"high": "the head", "low": "the ribs"}[block.height]
    entry = Entry(
        block.name, "block", f"covers {place} with the left arm", block.motion, {"side": "left", "height": block.height}
    )
    return entry, mirrored(entry, block.name.replace("left", "right"), f"covers {place} with the right arm")


ENTRIES = (
    *_entries(Block("block_high_left", "high")),
    *_entries(Block("block_low_left", "low", close_s=0.28, brace_m=0.05, bend_deg=14.0)),
)
