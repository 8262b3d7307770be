"""Cutting each player's stream into actions at the local minima of the contact force.

Source: the 2008 paper, section 3.1. The contact force is f = m c'' - m g with c the centre of mass. Every local minimum
is a cut, so each action holds one force peak, at which the player pushes off. Small minima around slow kicks give false
cuts, which a person removes (`simprep.duel.labels.cuts`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks

from simprep.arrays import FloatArray, IntArray
from simprep.duel.stream.stream import PLAYERS, DuelStream
from simprep.errors import MotionError, SettingError
from simprep.humanoid_model import GRAVITY
from simprep.motion.kinematics import Kinematics, forward_kinematics


@dataclass(frozen=True)
class SegmentationSettings:
    """How minima of the contact force become cuts.

    Attributes:
        smoothing_s: standard deviation of the Gaussian that smooths c before it is differenced [s]. 0.065 s halves what
            repeats 2.9 times a second, the rate of the shortest actions (punches of 0.35 s). Smaller values cut at
            noise, above all at 30 frames per second; larger ones lose fast punches.
        prominence: how far the force must rise on both sides of a minimum, in body weights.
        shortest_s: least distance of cuts from each other and from the ends of a clip; the lowest stays [s].
        flight: below this force the person flies, which is one flat minimum, cut in its middle [body weights].
        component: `norm` of the force vector, which also sees horizontal push-offs, or its `vertical` component alone.
    """

    smoothing_s: float = 0.065
    prominence: float = 0.06
    shortest_s: float = 0.12
    flight: float = 0.15
    component: Literal["norm", "vertical"] = "norm"

    def __post_init__(self) -> None:
        if not 0.005 <= self.smoothing_s <= 0.5:
            raise SettingError(f"smoothing {self.smoothing_s} s; valid: 0.005 to 0.5")
        if not 0 <= self.prominence <= 5:
            raise SettingError(f"prominence {self.prominence} body weights; valid: 0 to 5")
        if not 0 <= self.shortest_s <= 2:
            raise SettingError(f"shortest action {self.shortest_s} s; valid: 0 to 2")
        if not 0 <= self.flight <= 0.5:
            raise SettingError(f"flight below {self.flight} body weights; valid: 0 to 0.5")
        if self.component not in ("norm", "vertical"):
            raise SettingError(f"component {self.component!r}; valid: norm, vertical")


DEFAULT_SETTINGS = SegmentationSettings()


@dataclass(frozen=True)
class Cuts:
    """Where the actions of both players begin, within the clips; the ends of clips are cuts by themselves.

    Attributes:
        frames: (A, B) rising frame numbers of the cuts. Read-only.
        bounds: (clips, 2) first frame of every clip and the frame after its last.

    Raises:
        MotionError: a cut that is not inside a clip, or cuts out of order.
    """

    frames: tuple[IntArray, IntArray]
    bounds: IntArray

    def __post_init__(self) -> None:
        bounds = np.asarray(self.bounds, dtype=np.int64)
        kept = []
        for player, given in zip(PLAYERS, self.frames):
            frames = np.array(given, dtype=np.int64)
            if (np.diff(frames) <= 0).any():
                raise MotionError(f"cuts of player {player} do not rise: {frames[int(np.argmin(np.diff(frames)))]}")
            outside = frames[(frames <= 0) | (frames >= bounds[-1, 1] - 1) | np.isin(frames, bounds[:, 0])]
            if len(outside):
                raise MotionError(
                    f"cut of player {player} at frame {outside[0]}; valid: inside a clip, between 0 and {bounds[-1, 1] - 1}"
                )
            frames.setflags(write=False)
            kept.append(frames)
        bounds.setflags(write=False)
        object.__setattr__(self, "frames", tuple(kept))
        object.__setattr__(self, "bounds", bounds)

    def segments(self, player: int) -> IntArray:
        """Actions (S, 3) of player 0 or 1: first frame, frame at which the next begins (or clip's end), clip."""
        inner = self.frames[player]
        rows = []
        for clip, (first, after) in enumerate(self.bounds):
            edges = [first, *inner[(inner > first) & (inner < after)], after]
            rows += [(start, end, clip) for start, end in pairwise(edges)]
        return np.array(rows, dtype=np.int64).reshape(-1, 3)

    def table(self) -> IntArray:
        """Actions (S, 4) of both: player, first frame, frame at which the next begins, clip; by player and time."""
        parts = [self.segments(player) for player in range(2)]
        return np.concatenate([np.insert(part, 0, player, axis=1) for player, part in enumerate(parts)], dtype=np.int64)


def stream_kinematics(stream: DuelStream) -> tuple[Kinematics, ...]:
    """Kinematics of all players, for segmentation, features and metrics."""
    return tuple(forward_kinematics(motion.qpos, motion.character) for motion in stream.players)


def contact_force(
    com: FloatArray, fps: float, bounds: IntArray, settings: SegmentationSettings = DEFAULT_SETTINGS
) -> FloatArray:
    """Contact force (T,) over body weight, |c'' - g| / |g|, of a centre of mass (T, 3), z up [m]; each clip by itself.

    Source: section 3.1 of the 2008 paper; c'' is the second difference of the Gaussian-smoothed path. Clips (rows of
    `bounds`, as of `Cuts`) are continued by reflection in the end point, which keeps the velocity.
    """
    sigma = settings.smoothing_s * fps
    reach = int(np.ceil(4 * sigma))
    force = np.empty(len(com))
    for first, after in bounds:
        part = com[first:after]
        if len(part) < 3:
            force[first:after] = 1.0
            continue
        width = min(reach + 1, len(part) - 1)
        padded = np.pad(part, ((width, width), (0, 0)), mode="reflect", reflect_type="odd")
        # smoothing, then differences: sampled second derivatives of a Gaussian do not sum to 0, and see the position
        smooth = gaussian_filter1d(padded, sigma, axis=0, mode="nearest", radius=reach)
        f = np.diff(smooth, n=2, axis=0)[width - 1 : width - 1 + len(part)] * fps**2
        f[:, 2] += GRAVITY
        value = f[:, 2] if settings.component == "vertical" else np.linalg.norm(f, axis=1)
        force[first:after] = value / GRAVITY
    return force


def force_minima(
    force: FloatArray, fps: float, bounds: IntArray, settings: SegmentationSettings = DEFAULT_SETTINGS
) -> tuple[IntArray, FloatArray]:
    """Frames of prominent minima of a contact force (T,) within each clip, and their prominences, in body weights."""
    apart = max(1, round(settings.shortest_s * fps))
    frames, prominences = [], []
    for first, after in bounds:
        valley = -np.maximum(force[first:after], settings.flight)
        found, about = find_peaks(valley, prominence=max(settings.prominence, 1e-9), distance=apart)
        inside = (found >= apart) & (found < after - first - apart)
        frames.append(found[inside] + first)
        prominences.append(about["prominences"][inside])
    return np.concatenate(frames).astype(np.int64), np.concatenate(prominences)


@dataclass(frozen=True)
class Segmentation:
    """Cuts with what they were made from.

    Attributes:
        cuts: where actions begin.
        force: (A, B) contact force (T,) of each player, in body weights.
        suspicious: (player 0 or 1, frame, reason) of cuts and actions that a person should look at, in order of time.
    """

    cuts: Cuts
    force: tuple[FloatArray, FloatArray]
    suspicious: tuple[tuple[int, int, str], ...]


def segment_stream(
    stream: DuelStream,
    settings: SegmentationSettings = DEFAULT_SETTINGS,
    kinematics: Sequence[Kinematics] | None = None,
) -> Segmentation:
    """Cut both players' motions into actions; `kinematics` is of both, where already computed.

    Raises:
        MotionError: more than two people.
    """
    motions = stream.pair
    kinematics = kinematics or stream_kinematics(stream)
    bounds = stream.bounds.astype(np.int64)
    forces, frames, suspicious = [], [], []
    for number, player in enumerate(kinematics):
        force = contact_force(player.com, stream.fps, bounds, settings)
        minima, prominences = force_minima(force, stream.fps, bounds, settings)
        forces.append(force)
        frames.append(minima)
        lift = player.foot_points[..., 2].min(axis=-1)  # (T, 2)
        ankles = player.xpos[:, motions[number].character.feet]
        suspicious += [
            (number, int(frame), reason)
            for frame, reason in _doubts(minima, prominences, lift, ankles, stream.fps, bounds, settings)
        ]
    cuts = Cuts((frames[0], frames[1]), bounds)
    return Segmentation(cuts, (forces[0], forces[1]), tuple(sorted(suspicious, key=lambda entry: entry[1])))


LOWEST_KICK_M = 0.3
MIDWAY_M = 0.15
LONG_S = 2.5


def _doubts(
    minima: IntArray,
    prominences: FloatArray,
    lift: FloatArray,
    feet: FloatArray,
    fps: float,
    bounds: IntArray,
    settings: SegmentationSettings,
) -> list[tuple[int, str]]:
    """Cuts that are shallow or in the middle of a kick, and actions that are too long."""
    out = []
    near = round(0.25 * fps)
    for frame, prominence in zip(minima, prominences):
        if prominence < 1.5 * settings.prominence:
            out.append((int(frame), f"shallow minimum (prominence {prominence:.2f} body weights)"))
        clip = bounds[np.searchsorted(bounds[:, 0], frame, side="right") - 1]
        window = lift[max(clip[0], frame - near) : min(clip[1], frame + near + 1)]
        for side, word in enumerate(("left", "right")):
            # between kick up and kick down the foot is at its highest; halfway up it is no end of an action
            top = float(window[:, side].max())
            if lift[frame, side] > LOWEST_KICK_M and top - lift[frame, side] > MIDWAY_M:
                out.append(
                    (int(frame), f"{word} foot {lift[frame, side]:.2f} m high on its way to or from {top:.2f} m")
                )
    for first, after in bounds:
        edges = np.array([first, *minima[(minima > first) & (minima < after)], after])
        out += [
            (int(start), f"{length / fps:.1f} s without a cut")
            for start, length in zip(edges, np.diff(edges))
            if length > LONG_S * fps
        ]
    return out
