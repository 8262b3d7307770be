"""Who attacks, when, from how far, and how soon the other one answers: measured on positions, without labels.

The same measures serve recordings of joint positions and streams of the humanoid, so that the two can be put side by side.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from simprep.character import SIDES
from simprep.duel.stream.stream import DuelStream
from simprep.errors import MotionError
from simprep.motion.kinematics import Kinematics
from simprep.motion.rotations import wrap_angle

FloatArray = NDArray[np.float64]
ENDS = tuple(f"{side}_{part}" for part in ("hand", "foot") for side in SIDES)
"""What people strike with, in the order of `PairTrack.ends`."""
SMOOTHING_S = 0.067
"""Standard deviation of the Gaussian over positions [s]: one frame of a 15 Hz depth camera."""
ONSET = 0.25
"""A movement begins where its speed, going back from the peak, falls below this share of it."""
ANSWER_S = 0.8
"""A reaction has its peak speed at most this long after the strike [s]."""

STILL = 0.15
"""Someone whose joints on average stay slower than this has not moved [m/s]."""


@dataclass(frozen=True)
class PairTrack:
    """Two people as points, smoothed.

    Attributes:
        joints: (T, 2, J, 3) joint positions of A and B, z up [m].
        root: (T, 2, 3) their roots [m].
        heading: (T, 2) directions that they face, of hips and shoulders [rad].
        ends: indices of the joints in `ENDS`.
        fps: frames per second [1/s].
    """

    joints: FloatArray
    root: FloatArray
    heading: FloatArray
    ends: tuple[int, ...]
    fps: float


@dataclass(frozen=True)
class Strike:
    """The attack of a clip.

    Attributes:
        actor: 0 or 1, who attacks.
        end: what with, of `ENDS`.
        frame: when that hand or foot has got nearest to the other's root along the line between the roots.
        distance_m: horizontal distance of the roots then [m].
        facing_deg: angle between heading and direction of the other then, actor and other [deg].
        delay_s: from the onset of the attack to the onset of the other's movement [s]; NaN where the other does not
            move. Both onsets are told to about a frame, and whoever knows what will come may begin earlier.
        answer_s: from the strike to the other's fastest movement [s]; negative where they move out of the way before.
        lead_m: how much nearer the actor's limb gets than any limb of the other gets to the actor [m]; small where it is
            unclear who attacks.
    """

    actor: int
    end: str
    frame: int
    distance_m: float
    facing_deg: tuple[float, float]
    delay_s: float
    answer_s: float
    lead_m: float


def pair_track(
    joints: FloatArray, root: FloatArray, heading: FloatArray, ends: tuple[int, ...], fps: float
) -> PairTrack:
    """Smooth the positions of two people.

    Args:
        joints: (T, 2, J, 3) [m].
        root: (T, 2, 3) [m].
        heading: (T, 2) [rad].
        ends: indices of the joints in `ENDS`.
        fps: frames per second [1/s].

    Raises:
        MotionError: fewer than 3 frames.
    """
    if len(joints) < 3:
        raise MotionError(f"{len(joints)} frames; who attacks is told from at least 3")
    sigma = SMOOTHING_S * fps
    return PairTrack(
        np.asarray(gaussian_filter1d(joints, sigma, axis=0, mode="nearest")),
        np.asarray(gaussian_filter1d(root, sigma, axis=0, mode="nearest")),
        np.asarray(gaussian_filter1d(np.unwrap(heading, axis=0), sigma, axis=0, mode="nearest")),
        ends,
        fps,
    )


def trunk_heading(hips: FloatArray, shoulders: FloatArray) -> FloatArray:
    """Direction that people face on the floor: square to the mean of their hip and shoulder lines.

    Args:
        hips: (..., 2, 3) left and right hip joint [m].
        shoulders: (..., 2, 3) left and right shoulder joint [m].

    Returns:
        (...) angle from x, counter-clockwise [rad].
    """
    left = hips[..., 0, :] - hips[..., 1, :] + shoulders[..., 0, :] - shoulders[..., 1, :]
    return np.asarray(np.arctan2(-left[..., 0], left[..., 1]))


def stream_track(
    stream: DuelStream, kinematics: tuple[Kinematics, Kinematics], first: int = 0, after: int | None = None
) -> PairTrack:
    """The track of a part of a stream.

    Args:
        stream: two people.
        kinematics: of both.
        first: first frame.
        after: frame after the last; None for all.
    """
    joints = np.stack([player.xpos[first:after] for player in kinematics], axis=1)
    index = stream.players[0].character.segment
    hips, shoulders = ([index(f"{side}_{part}") for side in SIDES] for part in ("thigh", "upper_arm"))
    heading = trunk_heading(joints[:, :, hips], joints[:, :, shoulders])
    return pair_track(joints, joints[:, :, 0], heading, tuple(index(name) for name in ENDS), stream.fps)


def reach(track: PairTrack) -> FloatArray:
    """How far each hand and foot has got towards the other person (T, 2, 4) [m]: 0 at their root, negative before it.

    Measured along the horizontal line from one's own root to the other's, so that what a limb does sideways, and whether
    it is a hand or a foot, makes no difference.
    """
    gap = track.root[:, ::-1] - track.root
    gap[..., 2] = 0.0
    towards = gap / np.maximum(np.linalg.norm(gap, axis=-1, keepdims=True), 1e-9)
    limbs = track.joints[:, :, list(track.ends)] - track.root[:, ::-1, None]
    return np.asarray((limbs * towards[:, :, None]).sum(axis=-1))


def find_strike(track: PairTrack) -> Strike:
    """The attack in a clip that holds one: who comes nearest to the other with a hand or foot is the attacker.

    Args:
        track: two people.
    """
    gained = reach(track)
    best = gained.max(axis=(0, 2))  # (2,)
    actor = int(np.argmax(best))
    frame, end = (int(index) for index in np.unravel_index(np.argmax(gained[:, actor]), gained[:, actor].shape))
    gap = track.root[frame, ::-1] - track.root[frame]
    direction = np.arctan2(gap[:, 1], gap[:, 0])
    angle = np.degrees(np.abs(wrap_angle(direction - track.heading[frame])))
    return Strike(
        actor,
        ENDS[end],
        frame,
        float(np.linalg.norm(gap[0, :2])),
        (float(angle[actor]), float(angle[1 - actor])),
        *_reaction(track, actor, end, frame),
        float(best[actor] - best[1 - actor]),
    )


def _reaction(track: PairTrack, actor: int, end: int, frame: int) -> tuple[float, float]:
    """Onset of a limb's movement against its own root to onset of the other's whole body; strike to its peak [s]."""
    limb = track.joints[:, actor, track.ends[end]] - track.root[:, actor]
    attack = np.linalg.norm(np.gradient(limb, axis=0), axis=-1) * track.fps
    begun = _onset(attack, 0, frame)
    other = np.linalg.norm(np.gradient(track.joints[:, 1 - actor], axis=0), axis=-1).mean(axis=-1) * track.fps
    last = min(len(other) - 1, frame + round(ANSWER_S * track.fps))
    if last <= begun or other[begun : last + 1].max() < STILL:
        return float("nan"), float("nan")
    peak = begun + int(np.argmax(other[begun : last + 1]))
    return (_onset(other, begun, last) - begun) / track.fps, (peak - frame) / track.fps


def _onset(speed: FloatArray, first: int, last: int) -> int:
    """Frame in which the movement begins whose speed is highest in `first` ... `last`; may lie before `first`."""
    peak = first + int(np.argmax(speed[first : last + 1]))
    slow = np.flatnonzero(speed[: peak + 1] < ONSET * speed[peak])
    return int(slow[-1]) + 1 if len(slow) else 0
