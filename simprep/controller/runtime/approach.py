"""Approach goals under a policy, one target after the other, as one motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simprep.arrays import FloatArray
from simprep.controller.runtime.performer import Performer
from simprep.controller.runtime.task import ActionRecord, Pursuit, Task, World
from simprep.controller.spaces import SETTLES_S
from simprep.display import SelfShowing, data_frame
from simprep.errors import MotionError, SettingError
from simprep.motion.edit import cut
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.preparation.blending import split_heading
from simprep.preparation.reference_posture import reference_posture
from simprep.preparation.scenario import RISE_EVENT
from simprep.preparation.synthesis import Style
from simprep.preparation.transition import DEFAULT_WINDOW_S, LAUNCH_EVENT, launch

NEAR_M = 1.5
"""The style is kept between two obstacles nearer than this [m]."""
KEPT = 0.6
"""Level of preparation kept there: the lowest of the policy's levels that is not below 0.5."""


@dataclass(frozen=True)
class Approach(SelfShowing):
    """An approach and its target, or several of them one after the other.

    Attributes:
        motion: the whole motion; events `rise`, `launch`, `launch_2` ... and those of the targets (of the first, where
            names repeat).
        reached: whether every goal was reached.
        time_s: until the (last) goal was reached [s]; None where it was not.
        level: (T,) level of preparation in effect; NaN while a target plays.
        actions: what was chosen.
        launches: frames of the launches.
        alpha_at_influence: level of preparation in effect 0.5 s after the first source of influence was reached, or at
            the launch where that is sooner; None where none was reached.
        max_alpha_jump: largest change of the commanded level between two actions, the forced one included.
        frames: how many were synthesised by the character.
        synthesis_s: computing time it took [s].
        policy_s: computing time of the policy and the planning around it [s].
    """

    motion: Motion
    reached: bool
    time_s: float | None
    level: FloatArray
    actions: tuple[ActionRecord, ...]
    launches: tuple[int, ...]
    alpha_at_influence: float | None
    max_alpha_jump: float
    frames: int
    synthesis_s: float
    policy_s: float

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(approach)` and Jupyter show."""
        return "approach", {
            "reached": self.reached,
            "until the goal [s]": self.time_s,
            "length [s]": round(self.motion.duration, 2),
            "actions": len(self.actions),
            "launches [s]": ", ".join(f"{at / self.motion.fps:.2f}" for at in self.launches),
            "level of preparation at the influence": self.alpha_at_influence,
            "largest change of the level": self.max_alpha_jump,
        }

    def to_dataframe(self) -> Any:
        """A pandas DataFrame of the actions: when each began [s], core node, level, distance to the goal [m]."""
        rows = [
            {"time_s": one.frame / self.motion.fps, "node": one.node, "alpha": one.alpha, "forced": one.forced,
             "goal_distance_m": one.goal_distance}
            for one in self.actions
        ]  # fmt: skip
        return data_frame(rows)

    @property
    def fps(self) -> float:
        """Frames synthesised per second of computing, everything included."""
        return self.frames / max(self.synthesis_s + self.policy_s, 1e-9)


def approach(
    world: World,
    tasks: Sequence[Task],
    place: tuple[float, float, float] = (0.0, 0.0, 0.0),
    node: str = "walk",
    frame: int = 0,
) -> Approach:
    """Do the tasks one after the other.

    Prepared, the character goes on from a target at level 1, in its last posture, and lowers the level as it walks on.
    Unprepared, the graph's transition leads straight back into the gait.

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
    parts: list[Pursuit] = []
    level = np.empty(0)
    actions: list[ActionRecord] = []
    launches: list[int] = []
    begin = 0
    for number, task in enumerate(tasks):
        if whole is None:
            performer = Performer(world.cores, world.settings, node, frame, place)
        else:
            last = tasks[number - 1].target
            begin, performer = _leave(world, whole, launches[-1] if launches else 0, last, actions[-1].node)
        pursuit = Pursuit(world, task, performer, begin / world.graph.settings.fps)
        pursuit.go()
        parts.append(pursuit)
        actions += [replace(action, frame=action.frame + begin) for action in pursuit.actions]
        motion, at = pursuit.launched()
        own = np.full(len(motion), np.nan)
        until = len(motion) if at is None else at
        own[:until] = pursuit.performer.level[:until]
        whole, level = _append(whole, level, begin, motion, own, number)
        if at is not None:
            launches.append(begin + at)
        if not pursuit.reached:
            break
    assert whole is not None
    done = len(parts) == len(tasks) and parts[-1].reached
    reached_at = parts[-1].reach_frame
    fps = world.graph.settings.fps
    return Approach(
        motion=replace(whole, name="_".join(["approach", *(task.target for task in tasks if task.target)])),
        reached=done,
        time_s=(begin + reached_at + 1) / fps if done and reached_at is not None else None,
        level=level,
        actions=tuple(actions),
        launches=tuple(launches),
        alpha_at_influence=_alpha_at_influence(parts, level, launches, fps),
        max_alpha_jump=max((action.jump for action in actions), default=0.0),
        frames=sum(len(pursuit.performer) for pursuit in parts),
        synthesis_s=sum(pursuit.performer.synthesis_s for pursuit in parts),
        policy_s=sum(pursuit.policy_s for pursuit in parts),
    )


def _alpha_at_influence(
    pursuits: Sequence[Pursuit], level: FloatArray, launches: Sequence[int], fps: float
) -> float | None:
    first = pursuits[0]
    if first.met_frame is None:
        return None
    last = launches[0] - 1 if launches else len(first.performer) - 1
    return float(level[min(first.met_frame + round(SETTLES_S * fps), last)])


def near_obstacles(first: Sequence[float], second: Sequence[float]) -> float:
    """Least level of preparation between two obstacles at (x, y) [m]: `KEPT` where they are nearer than `NEAR_M`."""
    return KEPT if float(np.hypot(second[0] - first[0], second[1] - first[1])) < NEAR_M else 0.0


def _leave(world: World, whole: Motion, launched: int, target: str | None, node: str) -> tuple[int, Performer]:
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
    return exit_frame, performer_from(world, whole, exit_frame, node, entry)


def performer_from(world: World, motion: Motion, frame: int, node: str, entry: int = 0) -> Performer:
    """A character that goes on from a frame of a motion: prepared, at level 1 in that very posture.

    Args:
        world: motions, graph, policy.
        motion: what was done so far.
        frame: of it, after which it goes on.
        node: core node to begin with.
        entry: its frame to begin with.
    """
    pose = motion.qpos[frame]
    heading = float(split_heading(pose[3:7])[0])
    soles = forward_kinematics(pose[None], motion.character).foot_points[0, :, :, 2].min(axis=1)
    style = Style(pose, np.maximum(soles, 0.0), motion.contacts[frame])
    place = (float(pose[0]), float(pose[1]), heading)
    return Performer(world.cores, world.settings, node, entry, place, 1.0 if world.prepare else 0.0, style)


def _append(
    whole: Motion | None, level: FloatArray, begin: int, motion: Motion, own: FloatArray, number: int
) -> tuple[Motion, FloatArray]:
    """The motion so far, left at frame `begin`, with the next part after it."""
    if whole is None:
        return motion, own
    names = {LAUNCH_EVENT: f"{LAUNCH_EVENT}_{number + 1}", RISE_EVENT: f"{RISE_EVENT}_{number + 1}"}
    later = {names.get(name, name): frame + begin for name, frame in motion.events.items()}
    joined = launch(whole, begin, replace(motion, events={}), 0, DEFAULT_WINDOW_S)
    kept: dict[str, int] = {name: frame for name, frame in whole.events.items() if frame < begin}
    before = cut(whole, 0, begin)
    result = replace(
        whole,
        qpos=np.concatenate([before.qpos, joined.qpos[begin:]]),
        contacts=np.concatenate([before.contacts, joined.contacts[begin:]]),
        events={**later, **kept},
    )
    return result, np.concatenate([level[:begin], own])
