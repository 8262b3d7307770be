"""Many characters under a policy, moved on the continuous floor by the measured displacements."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.controller.alpha_filter import filter_kernel
from simprep.controller.displacement import DisplacementTable
from simprep.controller.policy import Policy
from simprep.controller.spaces import (
    ALPHA_LEVELS,
    ALPHA_STEP,
    AT_INFLUENCE,
    CORE_NODES,
    REACH_M,
    SETTLES_S,
    goal_cell,
    influence_cell,
    polar,
    relative,
)

Choice = Callable[[IntArray, IntArray, IntArray, IntArray], tuple[IntArray, IntArray]]
"""From alpha level, core node, goal cell and influence cell, (N,) each, to core node and alpha level."""


@dataclass(frozen=True)
class Starts:
    """Where characters begin: at the origin, facing x.

    Attributes:
        goal: (N, 2) [m].
        influence: (N, 2) [m].
        level: (N,) alpha level, 0 to 5.
        node: (N,) core node performed last.
    """

    goal: FloatArray
    influence: FloatArray
    level: IntArray
    node: IntArray


@dataclass(frozen=True)
class Outcome:
    """How each character fared.

    Attributes:
        reached: (N,) the goal was reached.
        time_s: (N,) until the goal; NaN where it was not reached [s].
        met: (N,) the source of influence was reached.
        alpha_at_influence: (N,) filtered level `SETTLES_S` after coming within reach, when the target can be launched;
            NaN where the source was not reached.
        alpha_on_crossing: (N,) filtered level at the instant of coming within reach; NaN likewise.
        largest_jump: (N,) largest change between successive commands, the forced one included.
        level_range: (N, 2) lowest and highest level commanded.
    """

    reached: BoolArray
    time_s: FloatArray
    met: BoolArray
    alpha_at_influence: FloatArray
    alpha_on_crossing: FloatArray
    largest_jump: FloatArray
    level_range: FloatArray


def random_starts(count: int, rng: np.random.Generator, together: float = 0.5) -> Starts:
    """Goals 0.8 to 4 m away in every direction, sources of influence 0.5 to 4 m away, any level and core node.

    Args:
        count: how many.
        rng: random numbers.
        together: share in which the source of influence is the goal, as in most of the paper's uses.
    """

    def points(nearest: float) -> FloatArray:
        distance, angle = rng.uniform(nearest, 4.0, count), rng.uniform(-np.pi, np.pi, count)
        return np.column_stack([distance * np.cos(angle), distance * np.sin(angle)])

    goal, influence = points(0.8), points(0.5)
    influence = np.where((rng.random(count) < together)[:, None], goal, influence)
    return Starts(goal, influence, rng.integers(ALPHA_LEVELS, size=count), rng.integers(CORE_NODES, size=count))


def greedy(policy: Policy) -> Choice:
    """What a policy chooses, for many states at once."""

    def choose(level: IntArray, node: IntArray, goal: IntArray, influence: IntArray) -> tuple[IntArray, IntArray]:
        action = policy.actions[level, node, goal, influence].astype(np.int64)
        return action // ALPHA_LEVELS, action % ALPHA_LEVELS

    return choose


def roll_out(
    table: DisplacementTable,
    choose: Choice,
    starts: Starts,
    smoothing: float,
    force: bool = True,
    actions: int = 150,
    least: IntArray | int = 0,
) -> Outcome:
    """Let characters act until they reach the goal and, where it lies there too, the source of influence.

    Args:
        table: displacements; changes of more than one level use that of the new level held.
        choose: the policy.
        starts: where they begin.
        smoothing: standard deviation of the filter on alpha [s].
        force: whether alpha is forced to 1 on reaching the source of influence, and held through the next action.
        actions: how many at most.
        least: (N,) lowest level commanded whatever the policy says, 0 to 5
            (`simprep.controller.runtime.task.Task.keep`).
    """
    count, frames = len(starts.goal), table.frames
    kernel = filter_kernel(smoothing, table.fps)
    place, heading = np.zeros((count, 2)), np.zeros(count)
    level, node = starts.level.copy(), starts.node.copy()
    history = np.repeat(level[:, None] * ALPHA_STEP, len(kernel) - 1, axis=1)
    active, reached, met, held = (np.full(count, flag) for flag in (True, False, False, False))
    settles = round(SETTLES_S * table.fps)
    time, at_influence, crossing = (np.full(count, np.nan) for _ in range(3))
    jump = np.zeros(count)
    extremes = np.array(np.column_stack([level, level]) * ALPHA_STEP, dtype=np.float64)
    for number in range(actions):
        goal_distance, goal_angle = polar(relative(starts.goal, place, heading))
        distance, angle = polar(relative(starts.influence, place, heading))
        chosen, after = choose(level, node, goal_cell(goal_distance, goal_angle), influence_cell(distance, angle))
        after = np.where(held, AT_INFLUENCE, np.maximum(after, least))
        before = np.where(np.abs(after - level) > 1, after, level)
        path = table.path[chosen, before, after]  # (N, frames + 1, 3)
        c, s = np.cos(heading)[:, None], np.sin(heading)[:, None]
        x = place[:, :1] + c * path[..., 0] - s * path[..., 1]
        y = place[:, 1:] + s * path[..., 0] + c * path[..., 1]
        way = np.stack([x, y], axis=-1)
        to_goal = np.linalg.norm(starts.goal[:, None] - way, axis=-1)[:, 1:]
        to_influence = np.linalg.norm(starts.influence[:, None] - way, axis=-1)
        near = to_influence < REACH_M
        comes = near[:, 1:] & ~near[:, :-1]
        meets = active & comes.any(axis=1)
        at = comes.argmax(axis=1)  # frame of the crossing
        forced = meets & force
        commands = np.repeat(after[:, None] * ALPHA_STEP, frames, axis=1)
        commands = np.where(forced[:, None] & (np.arange(frames) >= at[:, None]), AT_INFLUENCE * ALPHA_STEP, commands)
        signal = np.concatenate([history, commands, np.repeat(commands[:, -1:], settles, axis=1)], axis=1)
        smoothed = np.lib.stride_tricks.sliding_window_view(signal, len(kernel), axis=1) @ kernel
        first = meets & ~met
        crossing = np.where(first, smoothed[np.arange(count), at], crossing)
        at_influence = np.where(first, smoothed[np.arange(count), at + settles], at_influence)
        met |= meets
        change = np.abs(after - level)
        change = np.where(forced, np.maximum(change, AT_INFLUENCE - after), change)
        jump = np.where(active, np.maximum(jump, change * ALPHA_STEP), jump)
        final = np.where(forced, AT_INFLUENCE, after)
        extremes[active, 0] = np.minimum(extremes[active, 0], np.minimum(after, final)[active] * ALPHA_STEP)
        extremes[active, 1] = np.maximum(extremes[active, 1], final[active] * ALPHA_STEP)
        arrives = active & (to_goal < REACH_M).any(axis=1)
        arrival = number * frames + (to_goal < REACH_M).argmax(axis=1) + 1
        time = np.where(arrives, arrival / table.fps, time)
        reached |= arrives
        place = np.where(active[:, None], way[:, -1], place)
        heading = np.where(active, heading + path[:, -1, 2], heading)
        level, node = np.where(active, final, level), np.where(active, chosen, node)
        history, held = signal[:, frames : frames + len(kernel) - 1], forced
        active &= ~arrives
        if not active.any():
            break
    return Outcome(reached, time, met, at_influence, crossing, jump, extremes)
