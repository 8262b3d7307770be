"""One task at run time: act until the goal is reached, then launch the target."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from time import process_time
from typing import Protocol

import numpy as np

from simprep.arrays import FloatArray
from simprep.controller.graph import MotionGraph
from simprep.controller.influence import Influence, contact_weights, mixed_style, style_of, time_to_contact
from simprep.controller.runtime.locomotion import CoreNodes
from simprep.controller.runtime.performer import Performer, RuntimeSettings
from simprep.controller.spaces import REACH_M, SETTLES_S, Action, Observation, observe
from simprep.errors import MotionError, SettingError
from simprep.motion.edit import resample
from simprep.motion.motion import Motion
from simprep.preparation.reference_posture import reference_posture
from simprep.preparation.scenario import RISE_EVENT
from simprep.preparation.synthesis import Style
from simprep.preparation.transition import DEFAULT_WINDOW_S, launch, launch_frame

APPROACH_M_S = 0.6
"""About the speed over the last 2 m [m/s]; with it the place of contact with a moving source is foreseen."""
_SETTLED = 0.01


class Acts(Protocol):
    """What chooses actions, such as `simprep.controller.policy.Policy`."""

    def act(self, observation: Observation) -> Action:
        """Core node (index) and level of preparation that come next."""


@dataclass(frozen=True)
class Task:
    """One target to approach and launch.

    Attributes:
        goal: (x, y) where to go [m].
        target: name of the motion launched there; None launches none.
        influences: what is prepared for on the way.
        keep: least level of preparation until the goal is reached, such as between near obstacles.
        meet: instead of `goal`, go to where contact with the first source of influence is expected, and launch on
            reaching it: an opponent who comes nearer is met on the way.

    Raises:
        SettingError: nobody to meet.
    """

    goal: tuple[float, float]
    target: str | None
    influences: tuple[Influence, ...] = ()
    keep: float = 0.0
    meet: bool = False

    def __post_init__(self) -> None:
        if self.meet and not self.influences:
            raise SettingError("a task to meet a source of influence without one; valid: at least one in `influences`")


@dataclass(frozen=True)
class ActionRecord:
    """One action of an approach.

    Attributes:
        frame: of the whole motion at which it begins.
        node: core node.
        alpha: level of preparation commanded, before it was forced.
        forced: the source of influence was reached, the level is 1 from there on.
        jump: largest change of the commanded level in this action, forced change included.
        goal_distance: at its beginning [m].
        observation: what the policy saw.
        weights: of the sources of influence, by time to contact.
    """

    frame: int
    node: str
    alpha: float
    forced: bool
    jump: float
    goal_distance: float
    observation: Observation
    weights: tuple[float, ...]


@dataclass(frozen=True)
class World:
    """What approaches are made of.

    Attributes:
        cores: the core nodes, in the order in which the policy numbers them.
        targets: target motions by name.
        graph: transitions between them.
        policy: chooses core node and level of preparation.
        action_frames: frames per action.
        settings: of the synthesis.
        prepare: False walks to the goal unprepared and launches the target: the plain motion graph.
        power: see `simprep.controller.influence.expected_posture`.
        max_actions: after so many an approach counts as failed.
    """

    cores: CoreNodes
    targets: Mapping[str, Motion]
    graph: MotionGraph
    policy: Acts
    action_frames: int = 32
    settings: RuntimeSettings = field(default_factory=RuntimeSettings)
    prepare: bool = True
    power: float = 2.0
    max_actions: int = 60

    def target(self, name: str) -> Motion:
        """A target at the graph's frame rate; UnknownNameError if it is not in the graph."""
        self.graph.node(name)
        return resample(replace(self.targets[name], loop=False), self.graph.settings.fps)

    def style(self, name: str) -> Style:
        """The style of a target."""
        return style_of(self.target(name), self.settings.preparation)


class Pursuit:
    """One task: the approach, and the launch.

    Args:
        world: motions, graph, policy.
        task: what to do.
        character: who does it.
        time: at which it begins [s]; sources of influence may move.
    """

    def __init__(self, world: World, task: Task, performer: Performer, time: float) -> None:
        self.world, self.task, self.performer, self.time = world, task, performer, time
        self.fps = world.graph.settings.fps
        self.actions: list[ActionRecord] = []
        self._met: set[int] = set()
        self.reach_frame: int | None = None
        self.met_frame: int | None = None
        self._held_until = 0
        self.policy_s = 0.0
        names = dict.fromkeys(name for influence in task.influences for name in influence.targets)
        self._styles = {name: world.style(name) for name in names}
        self._neutral = world.style(task.target) if task.target else style_of_performer(performer)
        self._before = np.array(performer.place[:2])

    @property
    def reached(self) -> bool:
        """Whether the goal was reached."""
        return self.reach_frame is not None

    def go(self) -> None:
        """Act until the goal is reached, and after that until the target can be launched."""
        while self.reach_frame is None and len(self.actions) < self.world.max_actions:
            self.act()
        if self.reached:  # frames among which the launch is chosen
            settle = 2 if self.world.prepare and self.performer.command > 0 else 1
            for _ in range(settle):
                self.hold()

    def launched(self) -> tuple[Motion, int | None]:
        """The motion with its target, and the launch frame; None without target or where the goal was not reached."""
        motion = self.performer.motion()
        rise = np.flatnonzero(self.performer.level > 0)
        events = {RISE_EVENT: int(rise[0])} if len(rise) else {}
        if self.reach_frame is None or self.task.target is None:
            return replace(motion, events=events), None
        target = self.world.target(self.task.target)
        if not self.world.graph.between(self.performer.node, target.name, "prepared"):
            raise MotionError(f"the motion graph has no transition from {self.performer.node} into {target.name}")
        reference = reference_posture(target, self.world.settings.preparation)
        first = self._settled()
        # unprepared, half a cycle holds a frame with the right feet on the floor; prepared, any frame is alike
        after = min(first + self.world.action_frames, len(motion) - 2)
        at = launch_frame(motion, first, max(after, first + 1), target, reference.frame)
        settings = self.world.settings.preparation
        events.setdefault(RISE_EVENT, at)
        played = launch(replace(motion, events=events), at, target, reference.frame, DEFAULT_WINDOW_S, settings)
        return played, at

    def _settled(self) -> int:
        """First frame from reaching the goal on in which the filter has settled."""
        assert self.reach_frame is not None
        settled = np.abs(self.performer.level - self.performer.command) < _SETTLED
        settled[: self.reach_frame] = False
        found = np.flatnonzero(settled)
        return min(int(found[0]) if len(found) else self.reach_frame, len(self.performer) - 3)

    def act(self) -> None:
        """One action towards the goal."""
        begun = process_time()
        performer, task, world = self.performer, self.task, self.world
        frames, now = world.action_frames, self.time + len(performer) / self.fps
        position, heading = np.array(performer.place[:2]), performer.place[2]
        weights, nearest = self._weigh(position, now)
        place = self._contact(nearest, position, now) if world.prepare and nearest is not None else None
        index = world.cores.names.index(performer.node)
        before = performer.command
        goal = self._contact(0, position, now) if task.meet else np.asarray(task.goal)
        seen = observe(position, heading, goal, place, before, index)
        action = world.policy.act(seen)
        performer.turn_to(world.cores.names[action.node], frames)
        alpha = max(action.alpha, task.keep) if world.prepare else 0.0
        if len(performer) < self._held_until:
            alpha = 1.0
        commands = np.full(frames, alpha)
        forced = False
        times = now + np.arange(1, frames + 1) / self.fps
        style, share = self._style(weights, nearest)
        self.policy_s += process_time() - begun
        begun = process_time()
        path = performer.path(commands, share)[:, :2]
        if nearest is not None and nearest not in self._met:
            near = np.linalg.norm(path - task.influences[nearest].at(times), axis=1) < REACH_M
            if near.any():
                self._met.add(nearest)
                if self.met_frame is None:
                    self.met_frame = len(performer) + int(near.argmax())
                forced = world.prepare
                if forced:
                    commands[int(near.argmax()) :] = 1.0
                    self._held_until = len(performer) + int(near.argmax()) + round(SETTLES_S * self.fps)
                    path = performer.path(commands, share)[:, :2]
                if task.meet and nearest == 0:
                    self.reach_frame = len(performer) + int(near.argmax())
        at_goal = np.linalg.norm(path - goal, axis=1) < REACH_M
        if at_goal.any() and not task.meet:
            self.reach_frame = len(performer) + int(at_goal.argmax())
        jump = float(np.abs(np.diff(np.concatenate([[before], commands]))).max())
        self.policy_s += process_time() - begun
        record = ActionRecord(
            len(performer), performer.node, alpha, forced, jump, seen.goal_distance, seen, tuple(weights.tolist())
        )
        self.actions.append(record)
        self._before = position
        performer.act(commands, style, share)

    def hold(self) -> None:
        """One more action at the level reached."""
        now = self.time + len(self.performer) / self.fps
        weights, nearest = self._weigh(np.array(self.performer.place[:2]), now)
        style, share = self._style(weights, nearest)
        self.performer.act(np.full(self.world.action_frames, self.performer.command), style, share)

    def _weigh(self, position: FloatArray, now: float) -> tuple[FloatArray, int | None]:
        """Weights of the sources of influence by time to contact, and the one that comes first."""
        sources = self.task.influences
        if not sources:
            return np.zeros(0), None
        step = self.world.action_frames / self.fps
        own = (position - self._before) / step
        offset = np.stack([source.at(now) for source in sources]) - position
        other = np.stack([source.at(now) - source.at(now - step) for source in sources]) / step
        times = time_to_contact(offset, own - other, REACH_M)
        return contact_weights(times), int(times.argmin())

    def _contact(self, number: int, position: FloatArray, now: float) -> FloatArray:
        """Where contact with a source is expected (2,), as policies know still sources only."""
        source = self.task.influences[number]
        offset = source.at(now) - position
        towards = offset / max(float(np.linalg.norm(offset)), 1e-9)
        step = self.world.action_frames / self.fps
        velocity = (source.at(now + step) - source.at(now)) / step
        closing = (APPROACH_M_S * towards - velocity)[None]
        return source.at(now + float(time_to_contact(offset[None], closing, REACH_M)[0]))

    def _style(self, weights: FloatArray, nearest: int | None) -> tuple[Style, float]:
        """What to prepare for, and the probability that it will be needed."""
        if nearest is None or not self.world.prepare:
            return self._neutral, 1.0
        shares: dict[str, float] = dict.fromkeys(self._styles, 0.0)
        for weight, source in zip(weights, self.task.influences):
            for name, probability in source.targets.items():
                shares[name] += float(weight) * probability
        total = sum(shares.values())
        mixed = mixed_style([self._styles[name] for name in shares], list(shares.values()), self.world.power)
        return mixed, min(1.0, total)


def style_of_performer(performer: Performer) -> Style:
    """The posture in which a character begins, as a style."""
    source = performer.stream.window(0, 1)
    return Style(source.qpos[0], np.zeros(2), source.contacts[0])
