"""Unprepared locomotion without end: cycles of the core nodes, joined through the motion graph."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.controller.graph import MotionGraph, pair_distances
from simprep.errors import MotionError, UnknownNameError
from simprep.motion.curves import dying_away
from simprep.motion.edit import loop_displacement, move
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import rotation_matrix, wrap_angle
from simprep.motion.turns import turned
from simprep.preparation.blending import split_heading
from simprep.preparation.planting import foot_heading, plant_feet
from simprep.preparation.prepare import extend
from simprep.preparation.synthesis import Locomotion
from simprep.preparation.trajectory import heading_trend
from simprep.preparation.transition import DEFAULT_WINDOW_S, launch

_SLACK = 1.25
_SLACK_M = 0.01
_CARRY_S = 0.4
"""Time in which speed comes up at a change to a faster core node [s]."""
_SLOWING_S = 1.0
"""Time in which a walker's speed dies away at a change to steps round: who walks on after one turns without a halt [s]."""
_WALKS = 0.5
"""Who is faster than the next core node by this slows down over steps [m/s]."""
_EASE_S = 0.1
"""Time within which the pelvis may begin to sink at a change, where feet stand far apart [s]."""
_STRAY_M = 0.3
"""Feet that stand farther from each other than the next core node has them: the one behind steps [m]."""
_BESIDE_M = 0.05
"""The same for who steps round and stops: over feet behind it the pelvis would have to come back [m]."""
_CLOSE_S = 0.7
"""Time in which who has stopped with feet apart comes up over the foot in front [s]."""
_CHANGE_S = 1.6
"""Length of the piece synthesised at a change of core node: the transition, and the stances that begin in it."""


@dataclass(frozen=True)
class Cycle:
    """One core node, ready to be played.

    Attributes:
        motion: the loop.
        trend: (T,) heading without the pelvis's swing [rad].
        turn: per cycle [rad].
        step: (2,) what is added to positions turned by `turn` to get those of the next cycle [m].
    """

    motion: Motion
    trend: FloatArray
    turn: float
    step: FloatArray

    @property
    def speed(self) -> float:
        """How far a cycle goes on the floor, per frame [m]."""
        first = self.motion.qpos[0, :2]
        return float(np.linalg.norm(turned(first, self.turn) + self.step - first)) / len(self.motion)


class CoreNodes:
    """The core nodes and the ways between them, shared by all characters.

    Args:
        motions: the core nodes by name, at the graph's frame rate.
        graph: transitions between them.

    Raises:
        MotionError: a core node that is no loop, or at another frame rate than the graph.
    """

    def __init__(self, motions: Mapping[str, Motion], graph: MotionGraph) -> None:
        self.fps = graph.settings.fps
        self.cycles = {name: _cycle(motion, self.fps) for name, motion in motions.items()}
        self.names = tuple(motions)
        self.character = next(iter(motions.values())).character
        self._graph = graph
        self._entries: dict[tuple[str, str], IndexArray] = {}

    def cycle(self, name: str) -> Cycle:
        """A core node by name; UnknownNameError if there is none."""
        if name not in self.cycles:
            raise UnknownNameError("core node", name, self.names)
        return self.cycles[name]

    def entry(self, source: str, frame: int, node: str) -> int | None:
        """Frame of a core node to enter from a frame of another; None where it does not fit.

        The same feet must support, and the distance be at most 1.25 times that of the graph's nearest transition, plus
        1 cm: the graph keeps minima only, and in quiet standing or two gaits of one rhythm, other frames are hardly
        worse.

        Args:
            source: core node left.
            frame: its frame.
            node: core node entered.
        """
        if source == node:
            return None
        key = (source, node)
        if key not in self._entries:
            distance = pair_distances(self.cycle(source).motion, self.cycle(node).motion)
            edges = self._graph.between(source, node)
            limit = _SLACK * edges[0].distance + _SLACK_M if edges else -1.0
            self._entries[key] = np.where(distance.min(axis=1) <= limit, distance.argmin(axis=1), -1)
        entry = int(self._entries[key][frame])
        return None if entry < 0 else entry


class LocomotionStream:
    """Frames of locomotion, appended as they are needed; UnknownNameError for a core node that is not there.

    Args:
        cores: the core nodes.
        node: core node to begin with.
        frame: its frame to begin with.
        place: (x, y [m], heading [rad]) of the root in the first frame; the heading is that of the trend.
    """

    def __init__(
        self, cores: CoreNodes, node: str, frame: int = 0, place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> None:
        cycle = cores.cycle(node)
        self._cores = cores
        self.fps, self.character, self.node = cores.fps, cores.character, node
        turn = place[2] - float(cycle.trend[frame % len(cycle.motion)])
        x, y = turned(cycle.motion.qpos[frame % len(cycle.motion), :2], turn)
        self._next = frame  # frame of the core node that comes next
        self._planted = False  # whether feet stand elsewhere than in the core node
        self._apart = False  # and far from each other
        self._turn, self._shift = turn, np.array([place[0] - x, place[1] - y])  # placement of the current cycle
        self._qpos = np.empty((0, self.character.nq))
        self._contacts = np.empty((0, 2), dtype=bool)
        self._trend = np.empty(0)
        self._phase: list[tuple[str, int]] = []

    def __len__(self) -> int:
        return len(self._qpos)

    def phase(self, frame: int) -> tuple[str, int]:
        """Core node and its frame that is played at a frame of the stream."""
        return self._phase[frame]

    def window(self, first: int, after: int) -> Locomotion:
        """Frames first to after - 1 of the stream; missing ones are made."""
        while len(self) < after:
            self._play()
        part = slice(first, after)
        return Locomotion(self._qpos[part], self._contacts[part], self._trend[part], self.fps, self.character)

    def change(self, node: str, first: int, within: int) -> int | None:
        """Go over to another core node in the first frame from which the graph allows it (`CoreNodes.entry`).

        Gives the frame of the stream at which it begins; None where there is none in that time, and the core node is
        kept.

        Args:
            node: core node to go over to, UnknownNameError if there is none.
            first: frame of the stream from which on it may be left; what was made beyond is thrown away.
            within: frames of the stream in which the change must begin.
        """
        self._cores.cycle(node)
        self.window(0, first + within + 2)
        for at in range(max(first, 2), first + within):
            entry = self._cores.entry(*self.phase(at), node)
            if entry is not None:
                self._launch(node, at, entry)
                return at
        return None

    def _launch(self, node: str, at: int, entry: int, closing: bool = False) -> None:
        cycle = self._cores.cycle(node)
        n = len(cycle.motion)
        count = round(_CHANGE_S * self.fps)
        part = slice(at - 2, at + 2)
        approach = Motion(self._qpos[part], self.fps, self._contacts[part], name=self.node, character=self.character)
        before = entry - 1 if entry > 0 else entry - 1 + n  # the frame before is needed for the velocity
        long = extend(cycle.motion, before + 1 + count)
        ahead = replace(long, qpos=long.qpos[before:], contacts=long.contacts[before:], events={}, name=node)
        # where a foot never leaves the floor, the root has to come back over both
        lifts = bool((~cycle.motion.contacts).any(axis=0).all())
        slowing = (self._cores.cycle(self.node).speed - cycle.speed) * self.fps > _WALKS
        carry = (_SLOWING_S if slowing else _CARRY_S) if lifts else 0.0
        # who walks and stops keeps the stride for now, as the next action may walk on
        stray = _STRAY_M if lifts or closing else np.inf if slowing else _BESIDE_M
        window = _CLOSE_S if closing else DEFAULT_WINDOW_S
        played = launch(approach, 2, ahead, 1, window, carry=carry, ease=_EASE_S, stray=stray)
        qpos, contacts = played.qpos[2:], played.contacts[2:]
        to, start = (float(split_heading(pose[3:7])[0]) for pose in (approach.qpos[2], ahead.qpos[1]))
        trend = cycle.trend[(entry + np.arange(count)) % n] + cycle.turn * ((entry + np.arange(count)) // n)
        trend = trend + (to - start) - cycle.turn * ((before + 1) // n - entry // n)
        gap = self._trend[at] - trend[0]
        trend = trend + 2 * np.pi * np.round(gap / (2 * np.pi))
        x = np.minimum(np.arange(count) / (window * self.fps), 1.0)
        trend = trend + dying_away(x, self._trend[at] - trend[0], 0.0)
        self._cut(at)
        self._append(qpos[:count], contacts[:count], trend, [(node, int(f)) for f in (entry + np.arange(count)) % n])
        # go on where this piece ends: there it is the placed cycle again, if its feet have been lifted
        self._planted = not lifts
        self._apart = (
            not lifts and not closing and self._stride(qpos[count - 1]) > self._stride(ahead.qpos[count]) + _STRAY_M
        )
        self.node, self._next = node, (entry + count) % n
        last = (entry + count - 1) % n
        pose = self._qpos[-1]
        turn = float(split_heading(pose[3:7])[0] - split_heading(cycle.motion.qpos[last, 3:7])[0])
        turn += 2 * np.pi * round((self._trend[-1] - cycle.trend[last] - turn) / (2 * np.pi))
        self._turn, self._shift = turn, pose[:2] - turned(cycle.motion.qpos[last, :2], turn)
        if self._next == 0:
            self._carry()

    def _play(self) -> None:
        """Append the rest of the current cycle; who stands with feet apart closes the step first."""
        cycle = self._cores.cycle(self.node)
        if self._apart:
            self._launch(self.node, len(self) - 2, self.phase(len(self) - 2)[1], closing=True)
            return
        first = self._next % len(cycle.motion)
        placed = move(cycle.motion, (float(self._shift[0]), float(self._shift[1])), self._turn)
        phases = [(self.node, frame) for frame in range(first, len(cycle.motion))]
        qpos = self._standing(placed, first) if self._planted else placed.qpos[first:]
        self._append(qpos, placed.contacts[first:], cycle.trend[first:] + self._turn, phases)
        self._next = 0
        self._carry()

    def _stride(self, pose: FloatArray) -> float:
        """Distance between the feet on the floor [m]."""
        left, right = forward_kinematics(pose[None], self.character).xpos[0, self.character.feet, :2]
        return float(np.linalg.norm(left - right))

    def _standing(self, placed: Motion, first: int) -> FloatArray:
        """Poses from frame `first` of a placed cycle on whose feet are never lifted: they stay where they are."""
        last = self._qpos[-1]
        rows = placed.qpos[np.arange(first - 1, len(placed))]
        rows[:, :3] += last[:3] - rows[0, :3]
        now, there = (forward_kinematics(pose[None], self.character) for pose in (last, rows[0]))
        feet = np.array(self.character.feet)
        headings = [foot_heading(rotation_matrix(found.xquat[0, feet])[:, None])[:, 0] for found in (now, there)]
        start = np.column_stack([now.xpos[0, feet] - there.xpos[0, feet], wrap_angle(headings[0] - headings[1])])
        contacts, weight = np.ones((len(rows), 2), dtype=bool), np.ones(len(rows))
        height = now.foot_points[0, :, :, 2].min(axis=1)
        planted = plant_feet(rows, None, contacts, weight, height, self.fps, self.character, start=start)
        return np.asarray(planted.qpos[1:])

    def _carry(self) -> None:
        cycle = self._cores.cycle(self.node)
        self._shift = self._shift + turned(cycle.step, self._turn)
        self._turn += cycle.turn

    def _append(self, qpos: FloatArray, contacts: BoolArray, trend: FloatArray, phases: list[tuple[str, int]]) -> None:
        self._qpos = np.concatenate([self._qpos, qpos])
        self._contacts = np.concatenate([self._contacts, contacts])
        self._trend = np.concatenate([self._trend, trend])
        self._phase += phases

    def _cut(self, after: int) -> None:
        self._qpos, self._contacts, self._trend = self._qpos[:after], self._contacts[:after], self._trend[:after]
        del self._phase[after:]


def _cycle(motion: Motion, fps: float) -> Cycle:
    if not motion.loop:
        raise MotionError(f"{motion.name} is no loop; core nodes are cyclic locomotion")
    if abs(motion.fps - fps) > 1e-6:
        raise MotionError(f"{motion.name} has {motion.fps:g} frames/s; the motion graph has {fps:g}")
    turn, step = loop_displacement(motion)
    heading = np.unwrap(split_heading(motion.qpos[:, 3:7])[0])
    first = motion.qpos[0, :2]
    # the next cycle is R(turn) q + step', and maps the first frame to the one after the last
    return Cycle(motion, heading_trend(heading, fps, (len(motion), turn)), turn, first + step - turned(first, turn))
