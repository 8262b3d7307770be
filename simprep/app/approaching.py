"""Preparation: a character walks to goals under the learned controller and launches targets, a piece at a time."""

from collections import deque
from dataclasses import replace
from functools import lru_cache

import numpy as np

from simprep.app.aiming import IMPACT, aim, task_at, turn_to_strike
from simprep.app.director import Caption, PieceDirector, Place, Point
from simprep.app.stage import Stage, targets
from simprep.arrays import FloatArray
from simprep.controller.policy import Policy
from simprep.controller.runtime.approach import performer_from
from simprep.controller.runtime.performer import Performer, RuntimeSettings
from simprep.controller.runtime.task import Pursuit, Task, World
from simprep.controller.runtime.world import library_world
from simprep.errors import UnknownNameError
from simprep.library import library_motion
from simprep.motion.edit import cut
from simprep.motion.motion import Motion
from simprep.physics.tracker import ASK_S
from simprep.physics.tracker_state import TrackerState
from simprep.preparation.scenario import ARMS
from simprep.preparation.settings import DEFAULT_SETTINGS
from simprep.preparation.transition import DEFAULT_WINDOW_S, launch

LONGEST_S = 60.0
"""A walk of this length is begun anew, so that what is remembered of it stays small [s]."""
RIGHT = 1
KEPT_S = 70.0
"""How long levels are remembered for the chart [s]."""


@lru_cache(maxsize=2)
def page_world(policy: Policy | None = None) -> World:
    """Motions, graph and policy of the page, made once."""
    return library_world(targets(), policy=policy)


def world_of(arm: str, world: World) -> World:
    """The same world in one of `ARMS` (see `simprep.preparation.scenario.build_scenario`); UnknownNameError for another."""
    if arm not in ARMS:
        raise UnknownNameError("arm", arm, ARMS)
    preparation = replace(DEFAULT_SETTINGS, curve="linear") if arm == "traditional" else DEFAULT_SETTINGS
    return replace(
        world, prepare=arm != "none", settings=RuntimeSettings(optimise=arm == "optimised", preparation=preparation)
    )


class Approaching(PieceDirector):
    """A `Director` whose first body does tasks; the others of the stage stay where they are, in guard.

    Args:
        stage: the scene.
        arm: one of `ARMS`.
        world: None for that of the library.

    Attributes:
        task: what is being done; None: the character stands.
        miss: how far the strike passes from its place, as synthesised [m]; NaN where nothing is struck.
    """

    def __init__(self, stage: Stage, arm: str = "optimised", world: World | None = None) -> None:
        self.stage, self.characters = stage, stage.characters
        self._plain = world or page_world()
        self.arm, self.world = arm, world_of(arm, self._plain)
        self.task: Task | None = None
        self.miss = float("nan")
        self._tasks: deque[Task] = deque()
        self._now: str | None = None  # a target to launch at once
        self._strike: Place | None = None
        self._striking: Place | None = None  # of the present task
        self._performer: Performer | None = None
        self._pursuit: Pursuit | None = None
        self._sent = 0  # frames of the performer that were given
        self._tail: Motion | None = None  # last frames that were given
        self._levels: deque[tuple[float, float, FloatArray, str]] = deque()

    @property
    def busy(self) -> bool:
        """Whether there is something to do."""
        return self._pursuit is not None or bool(self._tasks) or self._now is not None

    def go(self, *tasks: Task, strike: Place | None = None) -> None:
        """Do these tasks, instead of what was asked before.

        Args:
            tasks: one after the other.
            strike: place (x, y, z) that the right foot of the first task's target is to strike [m]; where the character
                stands when it begins, its goal is moved so that it does.
        """
        for task in tasks:
            if task.target is not None:
                self.world.graph.node(task.target)
        self._tasks, self._now = deque(tasks), None
        self._pursuit, self._strike, self.miss = None, strike, float("nan")

    def launch(self, target: str) -> None:
        """Launch a target here and now, after preparing for it on the spot; UnknownNameError if it is not in the world."""
        self.world.graph.node(target)
        self._tasks.clear()
        self._pursuit, self._now = None, target

    def switch(self, arm: str) -> None:
        """Go on in another arm from the next piece on."""
        self.world, self.arm = world_of(arm, self._plain), arm
        if self._performer is not None:
            self._performer.settings = self.world.settings
        if self._pursuit is not None:
            self._pursuit.world = self.world

    def first(self) -> tuple[Motion, ...]:
        """Standing at the origin (see `PieceDirector.first`)."""
        stand = library_motion("stand")
        self._tail = cut(replace(stand, loop=False), 0, min(len(stand), 31))
        return self._tail, *self.stage.others

    def more(self, state: TrackerState) -> tuple[Motion | None, ...] | None:
        """The next piece (see `PieceDirector.more`)."""
        own = self._next(state) if state.ahead_s[0] < ASK_S else None
        others = [motion if ahead < ASK_S else None for motion, ahead in zip(self.stage.others, state.ahead_s[1:])]
        return (own, *others) if any(one is not None for one in (own, *others)) else None

    def caption(self, time: float) -> Caption:
        """Level and activity (see `Director.caption`)."""
        goal = None if self.task is None else self.task.goal
        for start, fps, level, doing in reversed(self._levels):
            if time >= start:
                frame = round((time - start) * fps)
                if frame < len(level):
                    return Caption(float(level[frame]), (doing,), goal=goal)
                break
        return Caption(doing=("stands",), goal=goal)

    def _next(self, state: TrackerState) -> Motion | None:
        if self._pursuit is None and not self._tasks and self._now is None:
            self.task, self._performer = None, None
            return None
        stub: Motion | None = None
        if self._performer is not None and len(self._performer) > LONGEST_S * self._performer.fps:
            self._performer = None
        if self._performer is None:
            stub = self._stub(state)
            self._performer = performer_from(self.world, stub, len(stub) - 1, "stand" if self._now else "walk")
            self._sent = 0
        performer = self._performer
        if self._pursuit is None:
            place: Point = (performer.place[0], performer.place[1])
            self.task = task_at(place, self._now) if self._now else self._tasks.popleft()
            self._now = None
            time = state.time + state.ahead_s[0]
            self._striking, self._strike = self._strike, None
            if self._striking is not None and stub is not None:
                self._take_aim(stub, self._striking, time)
            self._pursuit = Pursuit(self.world, self.task, performer, time - len(performer) / performer.fps)
        pursuit = self._pursuit
        pursuit.act()
        if stub is not None and not pursuit.reached:
            pursuit.act()  # the way out of the last posture takes more than one action
        doing = (
            performer.node
            if self.task is None or self.task.target is None
            else (f"{performer.node}, for {self.task.target}")
        )
        first = self._sent
        whole, level = performer.motion(), performer.level
        if pursuit.reached:
            whole, level, doing = self._finish(pursuit, doing)
        elif len(pursuit.actions) >= self.world.max_actions:
            self._pursuit = None
        self._sent = len(whole)
        piece = cut(whole, max(first - 1, 0), len(whole))
        if stub is not None:  # feet that stand stay where they are while the pose becomes that of the walk
            joined = launch(stub, len(stub) - 1, replace(piece, events={}), 0, DEFAULT_WINDOW_S)
            piece = cut(joined, len(stub) - 1, len(joined))
        self._note(state, piece, level[max(first - 1, 0) :], doing)
        self._tail = cut(piece, max(len(piece) - 31, 0), len(piece))
        return replace(piece, events={}, name=doing.replace(", for ", "_"))

    def _take_aim(self, stub: Motion, strike: Place, time: float) -> None:
        assert self.task is not None
        found = aim(
            self.world, lambda: performer_from(self.world, stub, len(stub) - 1, "walk"), self.task, strike, RIGHT, time
        )
        self.task, self.miss = found.task, found.miss

    def _finish(self, pursuit: Pursuit, doing: str) -> tuple[Motion, FloatArray, str]:
        """The whole motion with its target, once the goal is reached."""
        performer, self._pursuit = pursuit.performer, None
        if pursuit.task.target is None:
            return performer.motion(), performer.level, doing
        for _ in range(2 if self.world.prepare and performer.command > 0 else 1):  # as `Pursuit.go`
            pursuit.hold()
        whole, at = pursuit.launched()
        if self._striking is not None and at is not None and IMPACT in whole.events:
            whole = turn_to_strike(whole, self._striking, RIGHT)
        level = np.full(len(whole), np.nan)
        until = len(whole) if at is None else at
        level[:until] = performer.level[:until]
        self._performer = None
        return whole, level, pursuit.task.target

    def _stub(self, state: TrackerState) -> Motion:
        """The last frames given, or the pose in which the reference has come to stand."""
        assert self._tail is not None
        if state.ahead_s[0] > 0:
            return self._tail
        pose = state.reference_qpos[0]
        return replace(self._tail, qpos=np.repeat(pose[None], 3, axis=0), contacts=np.ones((3, 2), dtype=bool))

    def _note(self, state: TrackerState, piece: Motion, level: FloatArray, doing: str) -> None:
        start = state.time + state.ahead_s[0]
        self._levels.append((start, piece.fps, np.asarray(level[: len(piece)]), doing))
        while self._levels and self._levels[0][0] < start - KEPT_S:
            self._levels.popleft()
