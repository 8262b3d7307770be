"""A stream: synchronised motions of two people or more in one frame of reference, of one clip or several."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.display import SelfShowing
from simprep.errors import MotionError
from simprep.motion.edit import cut, yaw
from simprep.motion.motion import Motion
from simprep.motion.rotations import wrap_angle
from simprep.scene import body_letters

PLAYERS = ("A", "B")
"""Names of the two people of a pair (`DuelStream.pair`)."""
FARTHEST_M = 10.0
"""Any two people are at most this far apart [m]."""
SWAP_SPEED = 8.0
"""Two tracked people have exchanged names where both roots jump faster than this to where the other was [m/s]."""
SHORT_S = 20.0
"""A shorter stream holds too few actions for a model [s]."""
FACING = np.radians(60.0)
"""A person faces another where the heading is this near to the other's direction [rad]."""


def player_name(number: int) -> str:
    """What a person of a stream is called, counted from 0: A, B, C ..."""
    return body_letters(number).upper()


@dataclass(frozen=True)
class DuelStream(SelfShowing):
    """Two people or more recorded together.

    The *opponent* of a person at a frame is the nearest of the others, by horizontal distance of the roots: of two, the
    other one.

    Attributes:
        players: motions of A, B, C ...: the same frames of the same world.
        seams: first frame of every clip but the first. The time before a seam was not recorded, so nothing may be
            differentiated, segmented or counted across it.
        clips: names of the clips, one more than seams.
        name: for tables and files.

    Raises:
        MotionError: fewer than two people, lengths, frame rates or loops that do not fit, people too far apart, or seams
            out of order.
    """

    players: tuple[Motion, ...]
    seams: tuple[int, ...] = ()
    clips: tuple[str, ...] = ("clip",)
    name: str = "stream"

    def __post_init__(self) -> None:
        if len(self.players) < 2:
            raise MotionError(f"{self.name}: {len(self.players)} people; a stream needs 2 or more")
        a = self.players[0]
        for b in self.players[1:]:
            if len(a) != len(b):
                raise MotionError(
                    f"{self.name}: {a.name} has {len(a)} frames and {b.name} {len(b)}; people of a stream must be "
                    "recorded together"
                )
            if a.fps != b.fps:
                raise MotionError(f"{self.name}: {a.name} has {a.fps:g} frames per second and {b.name} {b.fps:g}")
        for player, motion in zip(self.names, self.players):
            if motion.loop:
                raise MotionError(f"{self.name}: player {player} ({motion.name}) is a loop, not a recording")
        seams = tuple(int(seam) for seam in self.seams)
        if list(seams) != sorted(set(seams)) or any(not 0 < seam < len(a) for seam in seams):
            raise MotionError(f"{self.name}: seams {seams}; valid: rising frames from 1 to {len(a) - 1}")
        if len(self.clips) != len(seams) + 1:
            raise MotionError(f"{self.name}: {len(self.clips)} clip names for {len(seams) + 1} clips")
        object.__setattr__(self, "seams", seams)
        distance = _distances(self).max(axis=(1, 2))
        if distance.max() > FARTHEST_M:
            frame = int(np.argmax(distance))
            raise MotionError(
                f"{self.name}: the people are {distance[frame]:.1f} m apart at frame {frame}; valid: up to "
                f"{FARTHEST_M:g} m, all in one frame of reference"
            )

    def __len__(self) -> int:
        return len(self.players[0])

    def __getitem__(self, frames: slice) -> "DuelStream":
        """Frames `stream[10:50]` of all people, with the seams inside.

        Raises:
            MotionError: a step other than 1, or no frame left.
        """
        if not isinstance(frames, slice) or frames.step not in (None, 1):
            raise MotionError(f"{self.name}: {frames!r}; valid: frames a:b")
        first, after, _ = frames.indices(len(self))
        return self.part(first, after)

    @property
    def names(self) -> tuple[str, ...]:
        """What the people are called, in the order of `players`: A, B, C ..."""
        return tuple(player_name(number) for number in range(len(self.players)))

    @property
    def pair(self) -> tuple[Motion, Motion]:
        """Motions of A and B, for what is of pairs only: labels of actions, models of who answers what, fights by them.

        Raises:
            MotionError: more than two people.
        """
        self.check_pair()
        return self.players[0], self.players[1]

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

    def check_pair(self) -> None:
        """Refuse more than two people where something is of pairs only.

        Raises:
            MotionError: more than two people.
        """
        if len(self.players) != 2:
            raise MotionError(
                f"{self.name}: {len(self.players)} people; valid here: 2, as actions are learned from pairs"
            )

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(stream)` and Jupyter show."""
        return self.name, {
            "people": " and ".join(f"{player}: {motion.name}" for player, motion in zip(self.names, self.players)),
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
        players = tuple(cut(motion, first, after) for motion in self.players)
        held = [number for number, (start, end) in enumerate(self.bounds) if start < after and end > first]
        seams = tuple(seam - first for seam in self.seams if first < seam < after)
        return replace(self, players=players, seams=seams, clips=tuple(self.clips[number] for number in held))


@dataclass(frozen=True)
class StreamReport:
    """What a stream holds, and what is doubtful about it.

    Attributes:
        frames: number of frames.
        fps: frame rate [1/s].
        duration_s: recorded time [s].
        clips: number of clips.
        distance_m: horizontal distance of a person's root to the opponent's: smallest, median, largest [m].
        facing_deg: of each person, median angle between the heading and the direction of the opponent [deg].
        facing_share: of each person, share of frames in which the opponent is faced, within 60 degrees.
        warnings: a sentence each.
    """

    frames: int
    fps: float
    duration_s: float
    clips: int
    distance_m: tuple[float, float, float]
    facing_deg: tuple[float, ...]
    facing_share: tuple[float, ...]
    warnings: tuple[str, ...]


def opponent_distance(stream: DuelStream) -> FloatArray:
    """Horizontal distance (T, N) of the root of each of N people to the opponent's, who is the nearest of the others [m]."""
    return np.asarray(_apart(stream).min(axis=2))


def root_distance(stream: DuelStream) -> FloatArray:
    """Horizontal distance of the roots (T,) [m]: to the opponent (`opponent_distance`), mean over the people."""
    return np.asarray(opponent_distance(stream).mean(axis=1))


def facing_error(stream: DuelStream) -> FloatArray:
    """Angle (T, N) from each one's heading to the opponent's direction, -pi to pi [rad]; positive: opponent to the left.

    The opponent is the nearest of the others, by horizontal distance of the roots; of equally near ones the first.
    """
    qpos = [motion.qpos for motion in stream.players]
    direction = np.zeros((len(stream), len(qpos), len(qpos)))
    for one, other in combinations(range(len(qpos)), 2):
        way = qpos[other][:, :2] - qpos[one][:, :2]
        direction[:, one, other] = np.arctan2(way[:, 1], way[:, 0])
        direction[:, other, one] = direction[:, one, other] + np.pi
    opponent = _apart(stream).argmin(axis=2)
    ahead = np.take_along_axis(direction, opponent[..., None], axis=2)[..., 0]
    return wrap_angle(ahead - np.stack([yaw(one[:, 3:7]) for one in qpos], axis=1))


def _distances(stream: DuelStream) -> FloatArray:
    """Horizontal distances (T, N, N) of all roots from each other [m]."""
    roots = np.stack([motion.qpos[:, :2] for motion in stream.players], axis=1)
    return np.asarray(np.linalg.norm(roots[:, :, None] - roots[:, None], axis=-1))


def _apart(stream: DuelStream) -> FloatArray:
    """`_distances` (T, N, N) [m], but infinite from a person to itself: nobody is the own opponent."""
    distance = _distances(stream)
    own = np.arange(distance.shape[1])
    distance[:, own, own] = np.inf
    return distance


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


def swap_warning(names: Sequence[str], frame: int, fps: float) -> str:
    """What to say of two people, by their names, who have exchanged names (`swapped_frames`)."""
    return f"{' and '.join(names)} seem to exchange names at frame {frame} ({frame / fps:.2f} s)"


def check_stream(stream: DuelStream) -> StreamReport:
    """Describe a stream: distances, who faces whom, and what makes it unfit for a model."""
    distance, angle = opponent_distance(stream), np.abs(facing_error(stream))
    share = (angle < FACING).mean(axis=0)
    warnings = []
    roots = np.stack([motion.qpos[:, :2] for motion in stream.players], axis=1)
    for pair in combinations(range(len(stream.players)), 2):
        for frame in swapped_frames(roots[:, list(pair)], stream.fps, stream.seams):
            warnings.append(swap_warning([stream.names[number] for number in pair], int(frame), stream.fps))
    for player, value in zip(stream.names, share):
        if value < 0.5:
            others = " or ".join(name for name in stream.names if name != player)
            warnings.append(f"{player} faces {others} in {100 * value:.0f} % of the frames only")
    if stream.duration < SHORT_S:
        warnings.append(f"only {stream.duration:.1f} s: too few actions for a model (at least {SHORT_S:g} s)")
    nearest = distance.min(axis=1)
    if nearest.min() < 0.15:
        frame = int(np.argmin(nearest))
        warnings.append(f"the roots are {100 * nearest[frame]:.0f} cm apart at frame {frame}: one inside the other")
    return StreamReport(
        len(stream),
        stream.fps,
        stream.duration,
        len(stream.clips),
        (float(distance.min()), float(np.median(distance)), float(distance.max())),
        tuple(float(np.degrees(np.median(one))) for one in angle.T),
        tuple(float(one) for one in share),
        tuple(warnings),
    )


def concatenate_streams(streams: Sequence[DuelStream], name: str = "stream") -> DuelStream:
    """Several recordings of the same people, one after the other; seams are kept and nothing is moved.

    Raises:
        MotionError: none given, or numbers of people, rates or bodies differ.
    """
    if not streams:
        raise MotionError(f"{name}: no streams to concatenate")
    first = streams[0]
    for other in streams[1:]:
        if other.fps != first.fps:
            raise MotionError(
                f"{name}: {first.name} has {first.fps:g} frames per second and {other.name} {other.fps:g}"
            )
        if len(other.players) != len(first.players):
            raise MotionError(
                f"{name}: {len(first.players)} people in {first.name} and {len(other.players)} in {other.name}; valid: "
                "the same ones in all"
            )
        for player, one, two in zip(first.names, first.players, other.players):
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
    return DuelStream(tuple(players), tuple(seams), tuple(clips), name)
