"""Approach a goal under a policy, prepare for what is near, launch the target, and go on to the next one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import process_time
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simprep.behavior.graph import MotionGraph
from simprep.behavior.influence import Influence, contact_weights, mixed_style, style_of, time_to_contact
from simprep.behavior.runtime import Character, RuntimeSettings
from simprep.behavior.runtime_locomotion import CoreNodes
from simprep.behavior.spaces import REACH_M, Action, Observation, observe
from simprep.errors import MotionError, SettingError
from simprep.motion.edit import cut, resample
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.preparation.blending import split_heading
from simprep.preparation.reference_posture import reference_posture
from simprep.preparation.scenario import RISE_EVENT
from simprep.preparation.synthesis import Style
from simprep.preparation.transition import DEFAULT_WINDOW_S, LAUNCH_EVENT, launch, launch_frame

Array = NDArray[np.float64]

NEAR_M = 1.5
"""Two obstacles nearer than this: the style is kept between them."""
KEPT = 0.6
"""Level of preparation kept there: the lowest of the policy's levels that is not below 0.5."""
_SETTLED = 0.01


class Acts(Protocol):
    """What chooses actions, such as `simprep.behavior.policy.Policy`."""

    def act(self, observation: Observation) -> Action:
        """Core node (index) and level of preparation that come next."""


@dataclass(frozen=True)
class Task:
    """One target to approach and launch.

    Attributes:
        goal: (x, y) where to go [m].
        target: name of the motion launched there; None launches none.
        influences: what is prepared for on the way.
        keep: least level of preparation from the beginning until the goal is reached, such as between near obstacles.
    """

    goal: tuple[float, float]
    target: str | None
    influences: tuple[Influence, ...] = ()
    keep: float = 0.0


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
class Approach:
    """An approach and its target, or several of them one after the other.

    Attributes:
        motion: the whole motion; events `rise`, `launch`, `launch_2` ... and those of the targets (of the first, where
            names repeat).
        reached: whether every goal was reached.
        time_s: until the (last) goal was reached [s]; None where it was not.
        level: (T,) level of preparation in effect; NaN while a target plays.
        actions: what was chosen.
        launches: frames of the launches.
        alpha_at_influence: level of preparation in effect when the first target was launched (without a target: at
            the end); None where the goal was not reached.
        max_alpha_jump: largest change of the commanded level between two actions, the forced one included.
        frames: how many were synthesised by the character.
        synthesis_s: computing time it took [s].
        policy_s: computing time of the policy and the planning around it [s].
    """

    motion: Motion
    reached: bool
    time_s: float | None
    level: Array
    actions: tuple[ActionRecord, ...]
    launches: tuple[int, ...]
    alpha_at_influence: float | None
    max_alpha_jump: float
    frames: int
    synthesis_s: float
    policy_s: float

    @property
    def fps(self) -> float:
        """Frames synthesised per second of computing, everything included."""
        return self.frames / max(self.synthesis_s + self.policy_s, 1e-9)


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
        power: see `simprep.behavior.influence.expected_posture`.
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
        """A target at the graph's frame rate.

        Raises:
            UnknownNameError: it is not in the graph.
        """
        self.graph.node(name)
        return resample(replace(self.targets[name], loop=False), self.graph.settings.fps)

    def style(self, name: str) -> Style:
        """The style of a target."""
        return style_of(self.target(name), self.settings.preparation)


def approach(
    world: World,
    tasks: Sequence[Task],
    place: tuple[float, float, float] = (0.0, 0.0, 0.0),
    node: str = "walk",
    frame: int = 0,
) -> Approach:
    """Do the tasks one after the other.

    Between two targets the character starts from where the first leaves it: prepared, it stands there at level 1 in its
    last posture and lowers the level as it walks on; unprepared, the graph's transition leads straight back into the gait.

    Args:
        world: motions, graph, policy.
        tasks: at least one.
        place: (x, y [m], heading [rad]) of the root at the beginning.
        node: core node to begin with, unprepared.
        frame: its frame to begin with.

    Raises:
        SettingError: no tasks, or a target that is not in the world.
        MotionError: the graph has no transition into a target, or none out of one that is not the last.
    """
    if not tasks:
        raise SettingError("an approach without a task; valid: at least one")
    whole: Motion | None = None
    parts: list[_Leg] = []
    level = np.empty(0)
    actions: list[ActionRecord] = []
    launches: list[int] = []
    begin = 0
    for number, task in enumerate(tasks):
        if whole is None:
            character = Character(world.cores, world.settings, node, frame, place)
        else:
            last = tasks[number - 1].target
            begin, character = _leave(world, whole, launches[-1] if launches else 0, last, actions[-1].node)
        leg = _Leg(world, task, character, begin / world.graph.settings.fps)
        leg.go()
        parts.append(leg)
        actions += [replace(action, frame=action.frame + begin) for action in leg.actions]
        motion, at = leg.launched()
        own = np.full(len(motion), np.nan)
        until = len(motion) if at is None else at
        own[:until] = leg.character.level[:until]
        whole, level = _append(whole, level, begin, motion, own, number)
        if at is not None:
            launches.append(begin + at)
        if not leg.reached:
            break
    assert whole is not None
    done = len(parts) == len(tasks) and parts[-1].reached
    reached_at = parts[-1].reach_frame
    fps = world.graph.settings.fps
    alphas = [level[at - 1] for at in launches] or [level[-1]]
    return Approach(
        motion=replace(whole, name="_".join(["approach", *(task.target for task in tasks if task.target)])),
        reached=done,
        time_s=(begin + reached_at + 1) / fps if done and reached_at is not None else None,
        level=level,
        actions=tuple(actions),
        launches=tuple(launches),
        alpha_at_influence=float(alphas[0]) if parts[0].reached else None,
        max_alpha_jump=max((action.jump for action in actions), default=0.0),
        frames=sum(len(leg.character) for leg in parts),
        synthesis_s=sum(leg.character.synthesis_s for leg in parts),
        policy_s=sum(leg.policy_s for leg in parts),
    )


class _Leg:
    """One task: approach, and the launch."""

    def __init__(self, world: World, task: Task, character: Character, time: float) -> None:
        self.world, self.task, self.character, self.time = world, task, character, time
        self.fps = world.graph.settings.fps
        self.actions: list[ActionRecord] = []
        self.met = False
        self.reach_frame: int | None = None
        self.policy_s = 0.0
        names = dict.fromkeys(name for influence in task.influences for name in influence.targets)
        self._styles = {name: world.style(name) for name in names}
        self._neutral = world.style(task.target) if task.target else character_style(character)
        self._before = np.array(character.place[:2])

    @property
    def reached(self) -> bool:
        return self.reach_frame is not None

    def go(self) -> None:
        """Act until the goal is reached, and after that until the target can be launched."""
        while self.reach_frame is None and len(self.actions) < self.world.max_actions:
            self._act()
        if self.reached:  # frames among which the launch is chosen
            settle = 2 if self.world.prepare and self.character.command > 0 else 1
            for _ in range(settle):
                self._hold()

    def launched(self) -> tuple[Motion, int | None]:
        """The motion with its target, and the frame of the launch; without a target, or where the goal was not reached, None."""
        motion = self.character.motion()
        rise = np.flatnonzero(self.character.level > 0)
        events = {RISE_EVENT: int(rise[0])} if len(rise) else {}
        if self.reach_frame is None or self.task.target is None:
            return replace(motion, events=events), None
        target = self.world.target(self.task.target)
        if not self.world.graph.between(self.character.node, target.name, "prepared"):
            raise MotionError(f"the motion graph has no transition from {self.character.node} into {target.name}")
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
        settled = np.abs(self.character.level - self.character.command) < _SETTLED
        settled[: self.reach_frame] = False
        found = np.flatnonzero(settled)
        return min(int(found[0]) if len(found) else self.reach_frame, len(self.character) - 3)

    def _act(self) -> None:
        begun = process_time()
        character, task, world = self.character, self.task, self.world
        frames, now = world.action_frames, self.time + len(character) / self.fps
        position, heading = np.array(character.place[:2]), character.place[2]
        weights, nearest = self._weigh(position, now)
        place = task.influences[nearest].at(now) if nearest is not None else None
        index = world.cores.names.index(character.node)
        before = character.command
        if len(character) == 0 and place is not None and not self.met:
            self.met = bool(np.linalg.norm(place - position) < REACH_M)
        seen = observe(position, heading, task.goal, place, before, index)
        action = world.policy.act(seen)
        character.turn_to(world.cores.names[action.node], frames)
        alpha = max(action.alpha, task.keep) if world.prepare else 0.0
        commands = np.full(frames, alpha)
        forced = False
        times = now + np.arange(1, frames + 1) / self.fps
        style, share = self._style(weights, nearest)
        self.policy_s += process_time() - begun
        begun = process_time()
        path = character.path(commands, share)[:, :2]
        if world.prepare and nearest is not None:
            near = np.linalg.norm(path - task.influences[nearest].at(times), axis=1) < REACH_M
            forced = bool(near.any()) and not self.met
            if forced:
                commands[int(near.argmax()) :] = 1.0
                path = character.path(commands, share)[:, :2]
                self.met = True
        at_goal = np.linalg.norm(path - np.asarray(task.goal), axis=1) < REACH_M
        if at_goal.any():
            self.reach_frame = len(character) + int(at_goal.argmax())
        jump = float(np.abs(np.diff(np.concatenate([[before], commands]))).max())
        self.policy_s += process_time() - begun
        record = ActionRecord(
            len(character), character.node, alpha, forced, jump, seen.goal_distance, seen, tuple(weights.tolist())
        )
        self.actions.append(record)
        self._before = position
        character.act(commands, style, share)

    def _hold(self) -> None:
        """One more action at the level reached."""
        now = self.time + len(self.character) / self.fps
        weights, nearest = self._weigh(np.array(self.character.place[:2]), now)
        style, share = self._style(weights, nearest)
        self.character.act(np.full(self.world.action_frames, self.character.command), style, share)

    def _weigh(self, position: Array, now: float) -> tuple[Array, int | None]:
        """Weights of the sources of influence by time to contact, and the one that comes first."""
        sources = self.task.influences
        if not sources or not self.world.prepare:
            return np.zeros(len(sources)), None
        step = self.world.action_frames / self.fps
        own = (position - self._before) / step
        offset = np.stack([source.at(now) for source in sources]) - position
        other = np.stack([source.at(now) - source.at(now - step) for source in sources]) / step
        times = time_to_contact(offset, own - other, REACH_M)
        return contact_weights(times), int(times.argmin())

    def _style(self, weights: Array, nearest: int | None) -> tuple[Style, float]:
        """What to prepare for, and the probability that it will be needed."""
        if nearest is None:
            return self._neutral, 1.0
        shares: dict[str, float] = dict.fromkeys(self._styles, 0.0)
        for weight, source in zip(weights, self.task.influences):
            for name, probability in source.targets.items():
                shares[name] += float(weight) * probability
        total = sum(shares.values())
        mixed = mixed_style([self._styles[name] for name in shares], list(shares.values()), self.world.power)
        return mixed, min(1.0, total)


def character_style(character: Character) -> Style:
    """The posture in which a character begins, as a style."""
    source = character.stream.window(0, 1)
    return Style(source.qpos[0], np.zeros(2), source.contacts[0])


def near_obstacles(first: Sequence[float], second: Sequence[float]) -> float:
    """Least level of preparation between two obstacles: the style is kept where they are nearer than 1.5 m.

    Args:
        first: (x, y) of the obstacle passed [m].
        second: (x, y) of the next one [m].
    """
    return KEPT if float(np.hypot(second[0] - first[0], second[1] - first[1])) < NEAR_M else 0.0


def _leave(world: World, whole: Motion, launched: int, target: str | None, node: str) -> tuple[int, Character]:
    """Frame at which the last target is left, and a character that goes on from there."""
    if target is None:
        exit_frame, entry = len(whole) - 1, 0
    else:
        motion = world.target(target)
        entered = reference_posture(motion, world.settings.preparation).frame
        walking = node if world.graph.between(target, node, "exit") else world.cores.names[0]
        exits = sorted(world.graph.between(target, walking, "exit"), key=lambda t: t.source_frame)
        if not exits:
            raise MotionError(f"the motion graph has no transition from {target} back to {walking}")
        exit_frame, entry, node = launched + exits[0].source_frame - entered, exits[0].target_frame, walking
    exit_frame = min(exit_frame, len(whole) - 1)
    pose = whole.qpos[exit_frame]
    heading = float(split_heading(pose[3:7])[0])
    soles = forward_kinematics(pose[None], whole.body).foot_points[0, :, :, 2].min(axis=1)
    style = Style(pose, np.maximum(soles, 0.0), whole.contacts[exit_frame])
    place = (float(pose[0]), float(pose[1]), heading)
    level = 1.0 if world.prepare else 0.0
    return exit_frame, Character(world.cores, world.settings, node, entry, place, level, style)


def _append(
    whole: Motion | None, level: Array, begin: int, motion: Motion, own: Array, number: int
) -> tuple[Motion, Array]:
    """The motion so far, left at frame `begin`, with the next part after it."""
    if whole is None:
        return motion, own
    names = {LAUNCH_EVENT: f"{LAUNCH_EVENT}_{number + 1}", RISE_EVENT: f"{RISE_EVENT}_{number + 1}"}
    later = {names.get(name, name): frame + begin for name, frame in motion.events.items()}
    joined = launch(whole, begin, replace(motion, events={}), 0, DEFAULT_WINDOW_S)
    kept: dict[str, Any] = {name: frame for name, frame in whole.events.items() if frame < begin}
    before = cut(whole, 0, begin)
    result = replace(
        whole,
        qpos=np.concatenate([before.qpos, joined.qpos[begin:]]),
        contacts=np.concatenate([before.contacts, joined.contacts[begin:]]),
        events={**later, **kept},
    )
    return result, np.concatenate([level[:begin], own])
