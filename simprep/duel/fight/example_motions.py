"""The recorded actions, ready to be performed anew: poses, contacts, interaction moments, reference frames.

All that does not depend on the fight is computed once. Actions are numbered as in B of the model; those of a further
recording may be appended (`with_recording`), such as held-out attacks.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.character import Character
from simprep.duel.labels.labels import attacking, decode, neutral
from simprep.duel.labels.segmentation import contact_force
from simprep.duel.model.action_features import ActionSummaries, FloorFrame, PoseBasis, floor_frame, summarise_actions
from simprep.duel.model.structures import ActionList
from simprep.duel.model.tracks import pair_tracks
from simprep.duel.model.transition_model import DuelModel
from simprep.duel.stream.stream import DuelStream
from simprep.errors import MotionError
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.rotations import continuous_quat, rotation_matrix
from simprep.physics.overlap import overlap_of_poses
from simprep.preparation.planting import foot_heading

SMOOTHING_S = 0.02
"""Standard deviation of the Gaussian that removes noise from recorded poses [s]."""
PLAY = np.radians(4.0)
"""A standing foot that turns by less than this does not pivot."""
START_OVERLAP_M = 0.002
"""Bodies that are deeper in each other than this do not begin a fight [m]."""


@dataclass(frozen=True)
class Excerpt:
    """Frames of a recording around an action.

    Attributes:
        qpos: (F, nq) poses.
        contacts: (F, 2) supporting feet.
        turning: (F, 2) headings of the feet, see `ExampleMotions` [rad].
    """

    qpos: FloatArray
    contacts: BoolArray
    turning: FloatArray


@dataclass(frozen=True)
class ExampleMotions:
    """Actions of one or more recordings with all that synthesis needs. Arrays are read-only by convention.

    Attributes:
        fps: frame rate [1/s].
        bodies: of players 0 and 1.
        actions: all actions; the first `known` are B of the model, frames are counted over all recordings.
        known: number of actions in B.
        bounds: (clips, 2) first frame of every clip and the frame after its last.
        qpos: (2, T, nq) poses of both players, noise taken out.
        contacts: (2, T, 2) supporting feet.
        turning: (2, T, 2) headings of the feet without wobbling, for their changes [rad].
        moments: (A,) frame of each action's greatest contact force, its interaction moment.
        attacks: (A,) whether the action brings a fist or foot towards the opponent.
        guard: (A,) whether the action is none of a punch, kick or jump.
        frames: (A,) reference frame in which each action began.
        summaries: (A,) means over the recorded frames.
        basis: principal components of the local poses.
    """

    fps: float
    bodies: tuple[Character, Character]
    actions: ActionList
    known: int
    bounds: IntArray
    qpos: FloatArray
    contacts: BoolArray
    turning: FloatArray
    moments: IntArray
    attacks: BoolArray
    guard: BoolArray
    frames: FloorFrame
    summaries: ActionSummaries
    basis: PoseBasis

    @classmethod
    def of(cls, stream: DuelStream, model: DuelModel) -> "ExampleMotions":
        """Examples of the stream that a model was learned from.

        Raises:
            MotionError: a stream of another frame rate, of more than two people, or too short for the model's actions.
        """
        return _examples(stream, model.graph.actions, model.basis, model.fps)

    def with_recording(self, stream: DuelStream, actions: ActionList) -> "ExampleMotions":
        """The same with another recording's actions appended, in its own frames; they follow the present ones.

        Raises:
            MotionError: other bodies or another frame rate.
        """
        other = _examples(stream, actions, self.basis, self.fps)
        if other.bodies != self.bodies:
            raise MotionError(f"{stream.name}: bodies {other.bodies}; the examples have {self.bodies}")
        shift, clips, count = self.qpos.shape[1], len(self.bounds), len(self.actions)
        own, new = self.actions, other.actions
        joined = ActionList(
            player=np.concatenate([own.player, new.player]),
            start=np.concatenate([own.start, new.start + shift]),
            end=np.concatenate([own.end, new.end + shift]),
            label=np.concatenate([own.label, new.label]),
            clip=np.concatenate([own.clip, new.clip + clips]),
            next=np.concatenate([own.next, np.where(new.next >= 0, new.next + count, -1)]),
            concurrent=np.concatenate([own.concurrent, np.where(new.concurrent >= 0, new.concurrent + count, -1)]),
        )
        return replace(
            self,
            actions=joined,
            bounds=np.concatenate([self.bounds, other.bounds + shift]),
            qpos=np.concatenate([self.qpos, other.qpos], axis=1),
            contacts=np.concatenate([self.contacts, other.contacts], axis=1),
            turning=np.concatenate([self.turning, other.turning], axis=1),
            moments=np.concatenate([self.moments, other.moments + shift]),
            attacks=np.concatenate([self.attacks, other.attacks]),
            guard=np.concatenate([self.guard, other.guard]),
            frames=FloorFrame(
                np.concatenate([self.frames.origin, other.frames.origin]),
                np.concatenate([self.frames.toward, other.frames.toward]),
            ),
            summaries=ActionSummaries(
                *(
                    np.concatenate([getattr(self.summaries, name), getattr(other.summaries, name)])
                    for name in ActionSummaries.__dataclass_fields__
                )
            ),
        )

    def excerpt(self, action: int, times: FloatArray) -> Excerpt:
        """An action at times (F,) [frames from its first, fractions allowed]; beyond its clip as at the clip's end."""
        player = int(self.actions.player[action])
        first, after = self.bounds[np.searchsorted(self.bounds[:, 0], self.actions.start[action], side="right") - 1]
        wanted = self.actions.start[action] + times
        low = np.clip(np.floor(wanted).astype(np.int64), first, after - 2)
        share = (wanted - low)[:, None]
        a, b = self.qpos[player, low], self.qpos[player, low + 1]
        qpos = a + share * (b - a)  # neighbours are near: the straight way is the round one
        qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
        nearest = np.clip(np.round(wanted).astype(np.int64), first, after - 1)
        turning = self.turning[player, low] + share * (self.turning[player, low + 1] - self.turning[player, low])
        return Excerpt(qpos, self.contacts[player, nearest], turning)

    def at(self, frame: int) -> tuple[int, int]:
        """The two actions that hold a frame.

        Raises:
            MotionError: no actions of both players hold it.
        """
        found = np.flatnonzero((self.actions.start <= frame) & (frame < self.actions.end))
        if sorted(self.actions.player[found]) != [0, 1]:
            raise MotionError(f"frame {frame}: no actions of both players there; valid: frames inside the recordings")
        a, b = found if self.actions.player[found[0]] == 0 else found[::-1]
        return int(a), int(b)

    def guard_frames(self, recordings: bool = False) -> IntArray:
        """Frames where a fight may begin: an action begins, both fighters stand in guard, and their clip goes on.

        They are of the model's stream, or with `recordings` of the appended ones.
        """
        picked = np.arange(len(self.actions)) >= self.known
        starts = np.unique(self.actions.start[picked == recordings])
        inside = starts[(starts < self.qpos.shape[1])]
        standing = self.contacts[:, inside].all(axis=(0, 2))
        good = []
        for frame in inside[standing]:
            pair = [
                np.flatnonzero(
                    (self.actions.player == who) & (self.actions.start <= frame) & (frame < self.actions.end)
                )
                for who in (0, 1)
            ]
            if all(len(one) == 1 and self.guard[one[0]] and self.actions.next[one[0]] >= 0 for one in pair):
                good.append(int(frame))
        return np.array(good, dtype=np.int64)

    def start_frame(self, rng: np.random.Generator) -> int:
        """One of the `guard_frames`, drawn again while the bodies are within each other there, as some recordings have them.

        Raises:
            MotionError: there is none.
        """
        frames = self.guard_frames()
        if not len(frames):
            raise MotionError("the examples have no frame at which both fighters stand in guard; give a start")
        while True:
            start = int(rng.choice(frames))
            apart = overlap_of_poses([one[[start]] for one in self.qpos], self.bodies)[0] <= START_OVERLAP_M
            if apart or len(frames) == 1:
                return start
            frames = frames[frames != start]


def _examples(stream: DuelStream, actions: ActionList, basis: PoseBasis, fps: float) -> ExampleMotions:
    if stream.fps != fps:
        raise MotionError(f"{stream.name}: {stream.fps:g} frames per second; the model has {fps:g}")
    if len(actions) and actions.end.max() > len(stream):
        raise MotionError(
            f"{stream.name}: {len(stream)} frames; the actions reach to frame {actions.end.max()}: not the stream that "
            "they were cut from"
        )
    bounds = stream.bounds.astype(np.int64)
    poses, contacts, turning, both = [], [], [], []
    moments = np.zeros(len(actions), dtype=np.int64)
    for player, motion in enumerate(stream.pair):
        qpos = _smooth(motion.qpos, stream.fps, bounds)
        kinematics = forward_kinematics(qpos, motion.character)
        poses.append(qpos)
        contacts.append(motion.contacts)
        heading = foot_heading(rotation_matrix(kinematics.xquat[:, motion.character.feet]))
        turning.append(np.concatenate([_turning(heading[first:after], stream.fps) for first, after in bounds]))
        both.append(kinematics)
        force = contact_force(kinematics.com, stream.fps, bounds)
        for action in actions.of(player):
            start, end = actions.start[action], actions.end[action]
            moments[action] = start + int(np.argmax(force[start:end]))
    tracks = pair_tracks(stream, (both[0], both[1]))
    rows = np.arange(len(actions))
    com = tracks.com[actions.start]
    return ExampleMotions(
        fps=stream.fps,
        bodies=(stream.pair[0].character, stream.pair[1].character),
        actions=actions,
        known=len(actions),
        bounds=bounds,
        qpos=np.stack(poses),
        contacts=np.stack(contacts),
        turning=np.stack(turning),
        moments=moments,
        attacks=attacking(decode(actions.label)),
        guard=neutral(decode(actions.label)),
        frames=floor_frame(com[rows, actions.player], com[rows, 1 - actions.player]),
        summaries=summarise_actions(tracks, actions, basis),
        basis=basis,
    )


def _smooth(qpos: FloatArray, fps: float, bounds: IntArray) -> FloatArray:
    """Poses without noise, each clip by itself; quaternions of a clip in one winding."""
    out = qpos.copy()
    for first, after in bounds:
        part = out[first:after]
        part[:, 3:7] = continuous_quat(part[:, 3:7])
        reach = min(int(np.ceil(4 * SMOOTHING_S * fps)), len(part) - 1)
        if reach < 1:
            continue
        padded = np.pad(part, ((reach, reach), (0, 0)), mode="reflect", reflect_type="odd")
        part[:] = gaussian_filter1d(padded, SMOOTHING_S * fps, axis=0, mode="nearest")[reach:-reach]
        part[:, 3:7] /= np.linalg.norm(part[:, 3:7], axis=1, keepdims=True)
    return out


def _turning(heading: FloatArray, fps: float) -> FloatArray:
    """Headings (F, 2) of feet without wobbling: they follow only when off by more than `PLAY`."""
    out = np.unwrap(heading, axis=0)
    for side in range(2):
        track = out[:, side].tolist()
        held = track[0]
        for frame, value in enumerate(track):
            held = min(max(held, value - PLAY), value + PLAY)
            track[frame] = held
        out[:, side] = track
    return np.asarray(gaussian_filter1d(out, SMOOTHING_S * fps, axis=0, mode="nearest"))
