"""A two-person stream: two synchronised motions in one frame of reference, of one clip or several."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.display import SelfShowing
from simprep.errors import MotionError
from simprep.motion.edit import cut, yaw
from simprep.motion.motion import Motion
from simprep.motion.rotations import wrap_angle

PLAYERS = ("A", "B")
"""Names of the two people, in the order of `DuelStream.players`."""
FARTHEST_M = 10.0
"""The two people are at most this far apart [m]."""
SWAP_SPEED = 8.0
"""Two tracked people have exchanged names where both roots jump faster than this to where the other was [m/s]."""
SHORT_S = 20.0
"""A shorter stream holds too few actions for a model [s]."""
FACING = np.radians(60.0)
"""A person faces the other where the heading is this near to the other's direction [rad]."""


@dataclass(frozen=True)
class DuelStream(SelfShowing):
    """Two people recorded together.

    Attributes:
        players: motions of A and B: the same frames of the same world.
        seams: first frame of every clip but the first. The time before a seam was not recorded, so nothing may be
            differentiated, segmented or counted across it.
        clips: names of the clips, one more than seams.
        name: for tables and files.

    Raises:
        MotionError: lengths, frame rates or loops that do not fit, people too far apart, or seams out of order.
    """

    players: tuple[Motion, Motion]
    seams: tuple[int, ...] = ()
    clips: tuple[str, ...] = ("clip",)
    name: str = "stream"

    def __post_init__(self) -> None:
        if len(self.players) != 2:
            raise MotionError(f"{self.name}: {len(self.players)} people; a two-person stream needs 2")
        a, b = self.players
        if len(a) != len(b):
            raise MotionError(
                f"{self.name}: {a.name} has {len(a)} frames and {b.name} {len(b)}; both must be recorded together"
            )
        if a.fps != b.fps:
            raise MotionError(f"{self.name}: {a.name} has {a.fps:g} frames per second and {b.name} {b.fps:g}")
        for player, motion in zip(PLAYERS, self.players):
            if motion.loop:
                raise MotionError(f"{self.name}: player {player} ({motion.name}) is a loop, not a recording")
        seams = tuple(int(seam) for seam in self.seams)
        if list(seams) != sorted(set(seams)) or any(not 0 < seam < len(a) for seam in seams):
            raise MotionError(f"{self.name}: seams {seams}; valid: rising frames from 1 to {len(a) - 1}")
        if len(self.clips) != len(seams) + 1:
            raise MotionError(f"{self.name}: {len(self.clips)} clip names for {len(seams) + 1} clips")
        object.__setattr__(self, "seams", seams)
        distance = root_distance(self)
        if distance.max() > FARTHEST_M:
            frame = int(np.argmax(distance))
            raise MotionError(
                f"{self.name}: the people are {distance[frame]:.1f} m apart at frame {frame}; valid: up to "
                f"{FARTHEST_M:g} m, both in one frame of reference"
            )

    def __len__(self) -> int:
        return len(self.players[0])

    def __getitem__(self, frames: slice) -> "DuelStream":
        """Frames `stream[10:50]` of both people, with the seams inside.

        Raises:
            MotionError: a step other than 1, or no frame left.
        """
        if not isinstance(frames, slice) or frames.step not in (None, 1):
            raise MotionError(f"{self.name}: {frames!r}; valid: frames a:b")
        first, after, _ = frames.indices(len(self))
        return self.part(first, after)

    @property
    def fps(self) -> float:
        """Frames per second [1/s]."""
        return self.players[0].fps

    @property
    def bounds(self) -> IndexArray:
        """(clips, 2) first frame of every clip and the frame after its last."""
        edges = np.array([0, *self.seams, len(self)], dtype=np.intp)
        return np.stack([edges[:-1], edges[1:]], axis=1)

    @property
    def duration(self) -> float:
        """Recorded time, without what passed between clips [s]."""
        return (len(self) - len(self.clips)) / self.fps

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(stream)` and Jupyter show."""
        return self.name, {
            "people": " and ".join(f"{player}: {motion.name}" for player, motion in zip(PLAYERS, self.players)),
            "recorded [s]": round(self.duration, 2),
            "frames": f"{len(self)} at {self.fps:g}/s",
            "clips": len(self.clips),
            "bodies": ", ".join(dict.fromkeys(motion.character.name for motion in self.players)),
        }

    def part(self, first: int, after: int) -> "DuelStream":
        """Frames first to after - 1, with the seams inside.

        Raises:
            MotionError: the range is empty or outside.
        """
        a, b = (cut(motion, first, after) for motion in self.players)
        held = [number for number, (start, end) in enumerate(self.bounds) if start < after and end > first]
        seams = tuple(seam - first for seam in self.seams if first < seam < after)
        return replace(self, players=(a, b), seams=seams, clips=tuple(self.clips[number] for number in held))


@dataclass(frozen=True)
class StreamReport:
    """What a stream holds, and what is doubtful about it.

    Attributes:
        frames: number of frames.
        fps: frame rate [1/s].
        duration_s: recorded time [s].
        clips: number of clips.
        distance_m: horizontal root distance: smallest, median, largest [m].
        facing_deg: median angle between the heading of A, and of B, and the direction of the other [deg].
        facing_share: share of frames in which A faces B, and B faces A, within 60 degrees.
        warnings: a sentence each.
    """

    frames: int
    fps: float
    duration_s: float
    clips: int
    distance_m: tuple[float, float, float]
    facing_deg: tuple[float, float]
    facing_share: tuple[float, float]
    warnings: tuple[str, ...]


def root_distance(stream: DuelStream) -> FloatArray:
    """Horizontal distance of the two roots (T,) [m]."""
    a, b = (motion.qpos[:, :2] for motion in stream.players)
    return np.asarray(np.linalg.norm(a - b, axis=1))


def facing_error(stream: DuelStream) -> FloatArray:
    """Angle (T, 2) from each one's heading to the other's direction, -pi to pi [rad]; positive: other to the left."""
    a, b = (motion.qpos for motion in stream.players)
    to_b = np.arctan2(b[:, 1] - a[:, 1], b[:, 0] - a[:, 0])
    angles = np.stack([to_b - yaw(a[:, 3:7]), to_b + np.pi - yaw(b[:, 3:7])], axis=1)
    return wrap_angle(angles)


def swapped_frames(roots: FloatArray, fps: float, seams: Sequence[int] = ()) -> IndexArray:
    """First frames (N,) in which two tracked people have exchanged names.

    Both roots (T, 2, 2 or 3) [m] jump faster than `SWAP_SPEED`, while exchanged they move less than half as far: within
    one frame, or two where interpolation put a frame between. Nothing is compared across seams.
    """
    found: list[int] = []
    for lag in (1, 2):
        straight = np.linalg.norm(roots[lag:] - roots[:-lag], axis=-1)  # (T - lag, 2)
        crossed = np.linalg.norm(roots[lag:, ::-1] - roots[:-lag], axis=-1)
        fast = straight.min(axis=1) * fps > SWAP_SPEED * lag
        frames = np.flatnonzero(fast & (crossed.sum(axis=1) < 0.5 * straight.sum(axis=1))) + lag
        within = ~np.isin(frames[:, None] - np.arange(lag), np.array(seams, dtype=np.intp)).any(axis=1)
        # a jump of one frame is found again over two
        found += [int(frame) for frame in frames[within] if not any(abs(frame - known) < 2 for known in found)]
    return np.array(sorted(found), dtype=np.intp)


def check_stream(stream: DuelStream) -> StreamReport:
    """Describe a stream: distances, who faces whom, and what makes it unfit for a model."""
    distance, angle = root_distance(stream), np.abs(facing_error(stream))
    share = (angle < FACING).mean(axis=0)
    warnings = []
    roots = np.stack([motion.qpos[:, :2] for motion in stream.players], axis=1)
    for frame in swapped_frames(roots, stream.fps, stream.seams):
        warnings.append(f"the two people seem to exchange names at frame {frame} ({frame / stream.fps:.2f} s)")
    for player, other, value in zip(PLAYERS, PLAYERS[::-1], share):
        if value < 0.5:
            warnings.append(f"{player} faces {other} in {100 * value:.0f} % of the frames only")
    if stream.duration < SHORT_S:
        warnings.append(f"only {stream.duration:.1f} s: too few actions for a model (at least {SHORT_S:g} s)")
    if distance.min() < 0.15:
        frame = int(np.argmin(distance))
        warnings.append(f"the roots are {100 * distance[frame]:.0f} cm apart at frame {frame}: one inside the other")
    return StreamReport(
        len(stream),
        stream.fps,
        stream.duration,
        len(stream.clips),
        (float(distance.min()), float(np.median(distance)), float(distance.max())),
        (float(np.degrees(np.median(angle[:, 0]))), float(np.degrees(np.median(angle[:, 1])))),
        (float(share[0]), float(share[1])),
        tuple(warnings),
    )


def concatenate_streams(streams: Sequence[DuelStream], name: str = "stream") -> DuelStream:
    """Several recordings of the same two people, one after the other; seams are kept and nothing is moved.

    Raises:
        MotionError: none given, or rates or bodies differ.
    """
    if not streams:
        raise MotionError(f"{name}: no streams to concatenate")
    first = streams[0]
    for other in streams[1:]:
        if other.fps != first.fps:
            raise MotionError(
                f"{name}: {first.name} has {first.fps:g} frames per second and {other.name} {other.fps:g}"
            )
        for player, one, two in zip(PLAYERS, first.players, other.players):
            if one.character != two.character:
                raise MotionError(
                    f"{name}: player {player} has another body in {first.name} ({one.character}) than in {other.name} "
                    f"({two.character})"
                )
    starts = np.cumsum([0, *(len(stream) for stream in streams)])
    players = []
    for number, motion in enumerate(first.players):
        parts = [stream.players[number] for stream in streams]
        events = {key: int(start) + frame for start, part in zip(starts, parts) for key, frame in part.events.items()}
        players.append(
            replace(
                motion,
                qpos=np.concatenate([part.qpos for part in parts]),
                contacts=np.concatenate([part.contacts for part in parts]),
                events=events,
            )
        )
    seams = [int(start + seam) for start, stream in zip(starts, streams) for seam in (0, *stream.seams)][1:]
    clips = [clip for stream in streams for clip in stream.clips]
    return DuelStream((players[0], players[1]), tuple(seams), tuple(clips), name)
