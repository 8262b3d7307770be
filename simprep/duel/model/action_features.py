"""The numbers that describe an action: where it happens, how it faces, how the body is held, and their change.

Source: the 2008 paper, section 4.1, Eq. 3 and Fig. 9. Two differences leave every density ratio as it is: change is per
second, not per frame; and the opponent's heading is measured from the direction back to the player, so that fighters
who face each other both have heading 0, far from the jump at pi.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import FloatArray, IntArray
from simprep.duel.model.structures import ActionList, Transitions
from simprep.errors import MotionError, SettingError
from simprep.motion.rotations import wrap_angle
from simprep.motion.turns import turned

POSE_COMPONENTS = 3
"""Principal components of the local pose that are kept."""

PLACEMENT = 3
"""Parameters of the root: two horizontal coordinates and a heading."""


@dataclass(frozen=True)
class PairTracks:
    """What the two fighters do, frame by frame. Read-only by convention.

    Attributes:
        fps: frame rate [1/s].
        root: (T, 2, 3) root positions of players 0 and 1 in the world, z up [m].
        heading: (T, 2) direction of the roots about z from the world's x axis, in any winding [rad].
        joints: (T, 2, J, 3) joint positions in the frame of the player's own root [m].
        com: (T, 2, 3) centres of mass in the world [m].

    Raises:
        MotionError: shapes that do not belong together, too few frames, NaN.
    """

    fps: float
    root: FloatArray
    heading: FloatArray
    joints: FloatArray
    com: FloatArray

    def __post_init__(self) -> None:
        t = len(self.root)
        shapes = {"root": (t, 2, 3), "heading": (t, 2), "joints": (t, 2, *self.joints.shape[2:]), "com": (t, 2, 3)}
        for name, shape in shapes.items():
            given = getattr(self, name)
            if given.shape != shape or (name == "joints" and (given.ndim != 4 or given.shape[3] != 3)):
                raise MotionError(
                    f"two fighters: {name} has shape {given.shape}; valid: {shape} and joints (T, 2, J, 3)"
                )
            bad = ~np.isfinite(given.reshape(t, -1)).all(axis=1)
            if bad.any():
                raise MotionError(f"two fighters: frame {int(np.argmax(bad))}: {name} holds NaN or infinity")
        if not self.fps > 0:
            raise MotionError(f"two fighters: frame rate {self.fps} 1/s; valid: above 0")

    def __len__(self) -> int:
        return len(self.root)


@dataclass(frozen=True)
class PoseBasis:
    """Principal components of the local poses of a stream.

    Attributes:
        mean: (3J,) mean of the joint positions in the root's frame [m].
        components: (k, 3J) orthonormal directions of greatest variance, greatest first.
        explained: (k,) share of the variance along each.
    """

    mean: FloatArray
    components: FloatArray
    explained: FloatArray

    def project(self, joints: FloatArray) -> FloatArray:
        """Reduced poses d (..., k) [m] of joint positions (..., J, 3)."""
        return np.asarray((joints.reshape(*joints.shape[:-2], -1) - self.mean) @ self.components.T)


def fit_pose_basis(joints: FloatArray, components: int = POSE_COMPONENTS) -> PoseBasis:
    """Principal components of at least two poses: joint positions (..., J, 3) in the root's frame [m].

    Raises:
        SettingError: more components than coordinates, or none.
    """
    flat = joints.reshape(-1, joints.shape[-2] * 3)
    if not 1 <= components <= flat.shape[1]:
        raise SettingError(f"{components} principal components; valid: 1 to {flat.shape[1]}")
    mean = flat.mean(axis=0)
    centred = flat - mean
    values, vectors = np.linalg.eigh(centred.T @ centred)
    order = np.argsort(values)[::-1][:components]
    directions = vectors[:, order].T
    # the sign of a component is arbitrary: refits agree where its largest entry is positive
    directions = directions * np.sign(directions[np.arange(components), np.abs(directions).argmax(axis=1)])[:, None]
    return PoseBasis(mean, directions, values[order] / values.sum())


@dataclass(frozen=True)
class ActionSummaries:
    """Means over the frames of actions, in the world; entry [...] is one action.

    Attributes:
        position: (..., 2) root on the floor [m].
        heading: (...) of the unwound angle [rad].
        pose: (..., k) reduced pose [m].
        velocity: (..., 2) change of the position [m/s].
        turn: (...) change of the heading [rad/s].
        pose_change: (..., k) change of the reduced pose [m/s].
    """

    position: FloatArray
    heading: FloatArray
    pose: FloatArray
    velocity: FloatArray
    turn: FloatArray
    pose_change: FloatArray

    def __getitem__(self, actions: ArrayLike) -> "ActionSummaries":
        """The summaries of some actions."""
        rows = np.asarray(actions)
        return ActionSummaries(
            self.position[rows],
            self.heading[rows],
            self.pose[rows],
            self.velocity[rows],
            self.turn[rows],
            self.pose_change[rows],
        )


@dataclass(frozen=True)
class FloorFrame:
    """Reference frame of Fig. 9: on the floor, x toward the opponent, z up.

    Attributes:
        origin: (..., 2) midpoint of the two centres of mass [m].
        toward: (...) direction from the player who acts next to the opponent [rad].
    """

    origin: FloatArray
    toward: FloatArray

    def point(self, position: ArrayLike) -> FloatArray:
        """Points (..., 2) of the world's floor, in this frame [m]."""
        return turned(np.asarray(position, dtype=np.float64) - self.origin, -self.toward)

    def world_point(self, position: ArrayLike) -> FloatArray:
        """Points (..., 2) of this frame, in the world [m]."""
        return np.asarray(turned(np.asarray(position, dtype=np.float64), self.toward) + self.origin)


def floor_frame(com: FloatArray, opponent_com: FloatArray) -> FloorFrame:
    """Frame at the moment of choice, from the centres of mass (..., 2 or 3) of who acts next and of the opponent [m].

    Raises:
        MotionError: both stand on the same spot, so no direction leads from one to the other.
    """
    offset = opponent_com[..., :2] - com[..., :2]
    if np.any(np.hypot(offset[..., 0], offset[..., 1]) < 1e-6):
        raise MotionError("the two fighters' centres of mass are above the same spot: who faces whom is undefined")
    return FloorFrame(
        0.5 * (com[..., :2] + opponent_com[..., :2]), np.asarray(np.arctan2(offset[..., 1], offset[..., 0]))
    )


def summarise(position: FloatArray, heading: FloatArray, pose: FloatArray, fps: float) -> ActionSummaries:
    """Summary of one action from its root positions (F, 2 or 3) [m], headings (F,) [rad] and reduced poses (F, k) [m].

    It needs at least two frames, `fps` of them a second.
    """
    track = np.column_stack([position[:, :2], np.unwrap(heading), pose])
    return _summaries(track, np.array([0]), np.array([len(track)]), fps)[0]


def summarise_actions(tracks: PairTracks, actions: ActionList, basis: PoseBasis) -> ActionSummaries:
    """Summaries (A, ...) of all actions of a stream, where they were recorded.

    Raises:
        MotionError: an action beyond the last frame, or of a single frame, which has no change.
    """
    if len(actions) and actions.end.max() > len(tracks):
        raise MotionError(f"an action ends at frame {actions.end.max()}; the stream has {len(tracks)} frames")
    parts = []
    for player in (0, 1):
        track = np.column_stack(
            [tracks.root[:, player, :2], np.unwrap(tracks.heading[:, player]), basis.project(tracks.joints[:, player])]
        )
        own = actions.of(player)
        parts.append(_summaries(track, actions.start[own], actions.end[own], tracks.fps))
    return ActionSummaries(
        # B is sorted by player
        *(np.concatenate([getattr(part, name) for part in parts]) for name in ActionSummaries.__dataclass_fields__)
    )


def action_parameters(summary: ActionSummaries, frame: FloorFrame, opponent: bool = False) -> FloatArray:
    """Parameters n (..., 2 (3 + k)) of actions in a frame (Eq. 3).

    These are position (2) [m], heading [rad], pose (k) [m], and the changes of these per second.

    Args:
        summary: of the actions, (...).
        frame: one for all, or one each.
        opponent: the actions are the opponent's, whose heading is 0 toward the player, against the frame's x axis.
    """
    ahead = frame.toward + (np.pi if opponent else 0.0)
    heading = wrap_angle(summary.heading - ahead)
    return np.concatenate(
        [
            frame.point(summary.position),
            heading[..., None],
            summary.pose,
            turned(summary.velocity, -frame.toward),
            summary.turn[..., None],
            summary.pose_change,
        ],
        axis=-1,
    )


@dataclass(frozen=True)
class ActionFeatures:
    """What a transition model learns the geometry from: actions of a stream and the frames they begin in.

    Attributes:
        summaries: (A, ...) of all actions.
        frames: (A,) at each action's first frame, for the player who performs it.
        goal: (A, 2) root on the floor `goal_delay` after each action begins, in that frame [m]; NaN past the clip.
        parameters: (A, 2 (3 + k)) each action's own n in the frame in which it begins (the examples of Eq. 12).
    """

    summaries: ActionSummaries
    frames: FloorFrame
    goal: FloatArray
    parameters: FloatArray = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", action_parameters(self.summaries, self.frames))

    def samples(self, transitions: Transitions) -> FloatArray:
        """(N, 6 (3 + k)) n1, n2 and n1' of transitions, in the frame in which the next action begins."""
        begins = FloorFrame(self.frames.origin[transitions.next], self.frames.toward[transitions.next])
        return np.concatenate(
            [
                action_parameters(self.summaries[transitions.current], begins),
                action_parameters(self.summaries[transitions.opponent], begins, opponent=True),
                self.parameters[transitions.next],
            ],
            axis=-1,
        )


def action_features(
    tracks: PairTracks, actions: ActionList, basis: PoseBasis, goal_delay: float = 0.5
) -> ActionFeatures:
    """Summaries, frames and reached positions of all actions of a stream.

    A wanted position is reached `goal_delay` seconds after an action begins (Eq. 13: 0.5).

    Raises:
        MotionError: actions that do not fit the stream, fighters on one spot.
    """
    summaries = summarise_actions(tracks, actions, basis)
    rows = np.arange(len(actions))
    com = tracks.com[actions.start]
    frames = floor_frame(com[rows, actions.player], com[rows, 1 - actions.player])
    later = actions.start + round(goal_delay * tracks.fps)
    clips, where = np.unique(actions.clip, return_inverse=True)
    clip_end = np.zeros(len(clips), dtype=np.int64)
    np.maximum.at(clip_end, where, actions.end)
    inside = later < clip_end[where]
    goal = np.full((len(actions), 2), np.nan)
    position = tracks.root[np.where(inside, later, 0), actions.player, :2]
    goal[inside] = frames.point(position)[inside]
    return ActionFeatures(summaries, frames, goal)


def _summaries(track: FloatArray, start: IntArray, end: IntArray, fps: float) -> ActionSummaries:
    """Summaries of the columns x, y, heading, pose over the frames start ... end - 1."""
    frames = end - start
    if np.any(frames < 2):
        raise MotionError(f"the action at frame {start[np.argmin(frames)]} has one frame; valid: two or more")
    # one running total gives the mean over any span by two look-ups; centring keeps its rounding error small
    centre = track.mean(axis=0)
    running = np.concatenate([np.zeros((1, track.shape[1])), np.cumsum(track - centre, axis=0)])
    mean = (running[end] - running[start]) / frames[:, None] + centre
    # the mean difference of neighbours telescopes to that of the ends
    change = (track[end - 1] - track[start]) * (fps / (frames - 1))[:, None]
    return ActionSummaries(
        mean[:, :2], mean[:, 2], mean[:, PLACEMENT:], change[:, :2], change[:, 2], change[:, PLACEMENT:]
    )
