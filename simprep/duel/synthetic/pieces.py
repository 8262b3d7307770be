"""Movements of the fighters, taken from the built-in motions: out, back, and the instants that divide them.

Only the posture is kept: pelvis, trunk, arms, a kicking leg, how the feet roll and pivot. The drawn clip decides where
feet stand and the centre of mass goes (`simprep.duel.synthetic.perform`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES
from simprep.library.registry import library_motion
from simprep.motion.curves import minimum_jerk
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.rotations import rotation_matrix

FIRST_HINGE, PITCH, PIVOT = 3, -4, -2
"""Channels of a posture [rad]: yaw, pitch, roll of the pelvis; hinges from the first; pitch and pivot of the feet."""
AFTER_GUARD_S = 0.80
"""Boxing motions end this long after they are back in guard [s]."""
THROUGH_FRAMES, LEAD_IN, LEAD_OUT = 3, 14, 10
"""From contact of a punch to its end; how long before lift-off and after touch-down a kick is used."""

SURFACE_M = 0.21
"""From wrist or ankle to knuckles or ball of the foot, plus from the target's surface to above its pelvis [m]."""

PUNCHES = {
    ("left", "lead"): ("jab_left_head", "jab_left_body", "hook_left_head", "hook_left_body"),
    ("left", "rear"): ("punch_left", "cross_left_body", "uppercut_left_head"),
    ("right", "lead"): ("jab_right_head", "jab_right_body", "hook_right_head", "hook_right_body"),
    ("right", "rear"): ("punch_right", "cross_right_body", "uppercut_right_head"),
}
"""Motions by the side of the hand and whether that side is in front."""
PUNCH_SHARES = {"lead": (0.5, 0.17, 0.22, 0.11), "rear": (0.55, 0.22, 0.23)}
KICKS = {
    "left": ("kick_front_left", "roundhouse_left_body", "roundhouse_left_head", "side_kick_left_body", "kick_low_left"),
    "right": ("kick_front", "roundhouse_right_body", "roundhouse_right_head", "side_kick_right_body", "kick_low_right"),
}
KICK_SHARES = {"kickboxing": (0.2, 0.34, 0.12, 0.12, 0.22), "taekwondo": (0.15, 0.4, 0.27, 0.18, 0.0)}
BLOCKS = {"kick": ("block_low_left", "block_low_right"), "punch": ("block_high_left", "block_high_right")}
DODGES = {
    "left": ("slip_left", "slip_right", "weave_left", "sway_back", "shoulder_roll"),
    "right": ("slip_right", "slip_left", "weave_right"),
}


@dataclass(frozen=True)
class Piece:
    """A movement from guard out and back.

    Attributes:
        name: of the built-in motion.
        channels: (T, channels) posture at 60 frames per second.
        out: frames of the way out: begin, lift-off (kicks), furthest point.
        back: frames of the way back: furthest point, touch-down (kicks), end.
        rise_m: centre of mass at the furthest point above that in guard [m].
        reach_m: from the pelvis to the striking wrist or ankle at the furthest point, on the floor [m]; 0 without one.
    """

    name: str
    channels: FloatArray
    out: tuple[float, ...]
    back: tuple[float, ...]
    rise_m: float
    reach_m: float = 0.0

    def at(self, frames: FloatArray, amplitude: float = 1.0) -> FloatArray:
        """Postures (N, channels) at frames, the way from guard scaled."""
        low = np.clip(frames.astype(np.int64), 0, len(self.channels) - 2)
        weight = (frames - low)[:, None]
        posture = (1 - weight) * self.channels[low] + weight * self.channels[low + 1]
        guard = self.channels[int(self.out[0])]
        return np.asarray(guard + amplitude * (posture - guard))


@lru_cache(maxsize=64)
def piece(name: str) -> Piece:
    """The movement of a built-in motion: a punch, kick, block or dodge."""
    motion = library_motion(name)
    character = motion.character
    kinematics = forward_kinematics(motion.qpos, character)
    pelvis = character.segment("pelvis")
    rotation = rotation_matrix(kinematics.xquat[:, [pelvis, *character.feet]])
    channels = np.zeros((len(motion), FIRST_HINGE + len(character.joints) - PITCH))
    root = rotation[:, 0]
    channels[:, 0] = np.unwrap(np.arctan2(root[:, 1, 0], root[:, 0, 0]))
    channels[:, 1] = -np.arcsin(np.clip(root[:, 2, 0], -1, 1))
    channels[:, 2] = np.arctan2(root[:, 2, 1], root[:, 2, 2])
    channels[:, FIRST_HINGE:PITCH] = motion.qpos[:, 7:]
    begin = motion.events["target"]
    for side, sign in enumerate((1.0, -1.0)):
        foot = rotation[:, 1 + side]
        turn = np.unwrap(np.arctan2(foot[:, 1, 0], foot[:, 0, 0]))
        supports = motion.contacts[:, side]
        channels[:, PITCH + side] = np.where(supports, np.arcsin(np.clip(foot[:, 2, 0], -1, 1)), 0.0)
        channels[:, PIVOT + side] = np.where(supports, sign * (turn - turn[begin]), 0.0)
    out: tuple[int, ...]
    back: tuple[int, ...]
    peak = motion.events.get("impact", motion.events.get("peak", begin))
    limb: int | None = None
    if "kick" in name or "roundhouse" in name:
        side = SIDES.index("left" if "left" in name else "right")
        limb = character.feet[side]
        ahead = kinematics.xpos[:, limb, 0] - kinematics.xpos[:, pelvis, 0]
        furthest = peak + int(np.argmax(ahead[peak : peak + 9]))
        down = np.flatnonzero(motion.contacts[:, side])
        lift, land = int(down[down < peak].max()) + 1, int(down[down > peak].min())
        out, back = (lift - LEAD_IN, lift, furthest), (furthest, land, min(land + LEAD_OUT, len(motion) - 1))
    else:
        furthest = peak + (THROUGH_FRAMES if "impact" in motion.events and "block" not in name else 0)
        out, back = (begin, furthest), (furthest, len(motion) - 1 - round(AFTER_GUARD_S * motion.fps))
        if "impact" in motion.events and "block" not in name:
            limb = character.segment("left_hand" if "left" in name else "right_hand")
    rise = float(kinematics.com[furthest, 2] - kinematics.com[out[0], 2])
    stretch = np.zeros(3) if limb is None else kinematics.xpos[furthest, limb] - kinematics.xpos[furthest, pelvis]
    return Piece(name, channels, out, back, rise, float(np.hypot(*stretch[:2])))


def striking_distance(name: str) -> float:
    """Distance of the roots at which the fist or foot of a punch or kick touches a head or trunk [m]."""
    return piece(name).reach_m + SURFACE_M


@lru_cache(maxsize=2)
def guard_posture(lead: str) -> FloatArray:
    """(channels,) guard of a boxer with a foot in front."""
    found = piece(f"jab_{lead}_head")
    return np.array(found.channels[int(found.out[0])])


def warped(shares: FloatArray, instants: Sequence[tuple[float, float]]) -> FloatArray:
    """Frames of a piece at shares of an action, by (share, frame) pairs between which time runs evenly."""
    given, frames = np.array(instants, dtype=np.float64).T
    return np.asarray(np.interp(shares, given, frames))


def way_out(found: Piece, shares: FloatArray, amplitude: float, lift: float = 0.25) -> FloatArray:
    """Posture of a punch or kick on its way; a kicking foot lifts at a share of the action."""
    middle = [(lift, found.out[1])] if len(found.out) == 3 else []
    return found.at(warped(shares, [(0.0, found.out[0]), *middle, (1.0, found.out[-1])]), amplitude)


def way_back(found: Piece, shares: FloatArray, amplitude: float, land: float = 0.62) -> FloatArray:
    """Posture of a punch or kick on its way back; a kicking foot lands at a share of the action."""
    middle = [(land, found.back[1])] if len(found.back) == 3 else []
    return found.at(warped(shares, [(0.0, found.back[0]), *middle, (1.0, found.back[-1])]), amplitude)


def there_and_back(found: Piece, shares: FloatArray, amplitude: float) -> FloatArray:
    """Posture of a movement that goes out and returns within one action."""
    return found.at(warped(shares, [(0.0, found.out[0]), (0.5, found.out[-1]), (1.0, found.back[-1])]), amplitude)


def back_and_out(
    first: Piece, second: Piece, shares: FloatArray, amplitude: float, next_amplitude: float
) -> FloatArray:
    """Posture while one movement returns and the next goes out."""
    returning = way_back(first, np.clip(shares / 0.66, 0, 1), amplitude, 0.95)
    going = way_out(second, np.clip((shares - 0.34) / 0.66, 0, 1), next_amplitude, 0.05)
    weight = minimum_jerk((shares - 0.3) / 0.4)[:, None]
    return np.asarray((1 - weight) * returning + weight * going)
