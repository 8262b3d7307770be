"""Where to go so that a target strikes a place, tried out beforehand without physics; and the last turn towards it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from simprep.arrays import FloatArray
from simprep.controller.influence import Influence
from simprep.controller.runtime.performer import Performer
from simprep.controller.runtime.task import Pursuit, Task, World
from simprep.motion.curves import minimum_jerk
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import multiply_quat, wrap_angle
from simprep.motion.turns import about_vertical, turned

TRIES = 7
NEAR_M = 0.05
"""A strike that passes so near needs no better goal [m]."""
MOST_TURN = 0.3
"""Largest turn on the standing foot between lifting the other and its impact [rad]."""
IMPACT = "impact"
BEFORE_S = 0.25


@dataclass(frozen=True)
class Aim:
    """A task, and how well it strikes.

    Attributes:
        task: with a goal from which the target strikes.
        miss: distance of the striking foot to the place at impact, as synthesised [m]; NaN where the goal is not reached.
    """

    task: Task
    miss: float


def task_at(goal: tuple[float, float], target: str | None) -> Task:
    """Go to a goal [m], prepare for a target on the way, and launch it there; without a target, just go."""
    return Task(goal, target, (Influence(goal, {target: 1.0}),) if target else ())


def aim(
    world: World,
    start: Callable[[], Performer],
    task: Task,
    place: tuple[float, float, float],
    side: int,
    time: float = 0.0,
) -> Aim:
    """A goal near that of a task from which the target's impact comes nearest to a place, the last turn included.

    The whole approach is synthesised a few times. Each time the goal moves by what the strike missed.

    Args:
        world: motions, graph, policy.
        start: makes the character as it is now.
        task: whose goal is tried first; its target has an event `impact`.
        place: what to strike (x, y, z) [m].
        side: of the striking foot, 0 left, 1 right.
        time: now [s].
    """
    goal, best, gap = np.array(task.goal), Aim(task, float("nan")), np.zeros(3)
    rng = np.random.default_rng(0)
    for _ in range(TRIES):
        tried = task_at((float(goal[0]), float(goal[1])), task.target)
        pursuit = Pursuit(world, tried, start(), time)
        pursuit.go()
        motion, _ = pursuit.launched()
        if not pursuit.reached or IMPACT not in motion.events:
            break
        now = np.asarray(place) - strike(turn_to_strike(motion, place, side), side)
        miss = float(np.linalg.norm(now))
        if not miss >= best.miss:  # NaN at first
            best, gap = Aim(tried, miss), now
        if miss < NEAR_M:
            break
        # where a step differs, the strike jumps: then try about half as far, and to the side
        goal = np.array(best.task.goal) + (gap[:2] if best.task is tried else 0.5 * gap[:2] + rng.normal(0.0, 0.1, 2))
    return best


def strike(motion: Motion, side: int) -> FloatArray:
    """Where the middle of the sole (3,) of the striking foot is when it strikes (`strike_frame`) [m]."""
    frame = strike_frame(motion, side)
    pose = motion.qpos[frame : frame + 1]
    return np.asarray(forward_kinematics(pose, motion.character).foot_points[0, side].mean(axis=0))


def strike_frame(motion: Motion, side: int) -> int:
    """Frame before the impact at which the striking foot is fastest along the floor: a ball met there flies away."""
    impact = motion.events[IMPACT]
    first = max(impact - round(BEFORE_S * motion.fps), 0)
    poses = forward_kinematics(motion.qpos[first : impact + 1], motion.character)
    speed = np.linalg.norm(np.diff(poses.foot_points[:, side, :, :2].mean(axis=1), axis=0), axis=1)
    return first + int(speed.argmax())


def turn_to_strike(motion: Motion, place: tuple[float, float, float], side: int) -> Motion:
    """The same motion, turned on the standing foot towards a place from lifting the striking foot until it strikes.

    Args:
        motion: with an event `impact`.
        place: what to strike (x, y, z) [m].
        side: of the striking foot, 0 left, 1 right.
    """
    impact = strike_frame(motion, side)
    lifted = np.flatnonzero(motion.contacts[:impact, side])
    first = int(lifted[-1]) if len(lifted) else 0
    standing = (
        forward_kinematics(motion.qpos[first : first + 1], motion.character).foot_points[0, 1 - side].mean(axis=0)
    )
    own, wanted = strike(motion, side)[:2] - standing[:2], np.asarray(place)[:2] - standing[:2]
    angle = float(wrap_angle(np.arctan2(wanted[1], wanted[0]) - np.arctan2(own[1], own[0])))
    angle = float(np.clip(angle, -MOST_TURN, MOST_TURN))
    share = minimum_jerk((np.arange(len(motion)) - first) / max(impact - first, 1))
    qpos = motion.qpos.copy()
    qpos[:, :2] = standing[:2] + turned(qpos[:, :2] - standing[:2], share * angle)
    qpos[:, 3:7] = multiply_quat(about_vertical(share * angle), qpos[:, 3:7])
    return replace(motion, qpos=qpos)
