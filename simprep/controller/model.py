"""The quantised world the controller is trained in: where an action leads from a cell, and what it earns.

The place within a cell is unknown: points spread evenly over it are moved by the action's measured displacement, and
each is one equally likely outcome. Where the cells of the goal and of the source of influence overlap, the two count as
one point, as the paper says they usually are; otherwise a character would try to walk round a source that is its goal.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.controller.displacement import DisplacementTable
from simprep.controller.settings import ControllerSettings, RewardSettings
from simprep.controller.spaces import (
    ALPHA_LEVELS,
    ALPHA_STEP,
    AT_INFLUENCE,
    CORE_NODES,
    GOAL_ANGLES,
    INFLUENCE_ANGLES,
    INFLUENCE_CELLS,
    REACH_M,
    cell_samples,
    goal_cell,
    influence_cell,
    polar,
    relative,
)
from simprep.errors import SettingError

REACHED = 255
"""Outcome of a goal cell: the goal is reached, the episode ends."""
ENTERED = 128
"""Added to an influence cell: this action reached the source of influence, alpha becomes 1."""
GOAL_SAMPLES = (16, 16)
INFLUENCE_SAMPLES = (8, 32)
OUT_OF_RANGE = int(influence_cell(np.inf, 0.0))
_STILL_M = 0.002  # an approach by less is standing still
_CHECKS = 8  # instants of an action at which reaching is looked for


@dataclass(frozen=True)
class QuantisedModel:
    """Outcomes of every action, by core node, level before and level commanded.

    Attributes:
        goal_next: (node, before, after, goal cell, samples) next goal cell or `REACHED`.
        goal_reward: the same shape, weighted f_theta + f_d of each outcome.
        influence_next: (node, before, after, influence cell, samples) next influence cell, plus `ENTERED`.
        shared_next: as `influence_next`, by goal cell: of a source of influence that is the goal.
        shared: (goal cell, influence cell, 2) first and number of the goal's samples that lie in the influence cell.
        allowed: (node, before, after, influence cell) whether the action may be chosen.
        steadiness: (before, after) weighted f_alpha.
        successors: (node, node) whether the second may follow the first (Next(m) of Eq. 11).
        rewards: constants.
    """

    goal_next: NDArray[np.uint8]
    goal_reward: NDArray[np.float32]
    influence_next: NDArray[np.uint8]
    shared_next: NDArray[np.uint8]
    shared: IntArray
    allowed: BoolArray
    steadiness: FloatArray
    successors: BoolArray
    rewards: RewardSettings


def build_model(table: DisplacementTable, settings: ControllerSettings) -> QuantisedModel:
    """The quantised model of a displacement table; SettingError if a state has no allowed action.

    Args:
        table: measured displacements.
        settings: successors of each core node, rewards and safety distance.
    """
    rewards = settings.rewards
    goals = cell_samples(GOAL_ANGLES, *GOAL_SAMPLES)
    influences = cell_samples(INFLUENCE_ANGLES, *INFLUENCE_SAMPLES)
    shape = (CORE_NODES, ALPHA_LEVELS, ALPHA_LEVELS)
    goal_next = np.zeros((*shape, *goals.shape[:2]), dtype=np.uint8)
    goal_reward = np.zeros((*shape, *goals.shape[:2]), dtype=np.float32)
    influence_next = np.zeros((*shape, *influences.shape[:2]), dtype=np.uint8)
    shared_next = np.zeros((*shape, *goals.shape[:2]), dtype=np.uint8)
    allowed = np.zeros((*shape, INFLUENCE_CELLS), dtype=bool)
    for node, before, after in measured(table):
        path = table.path[node, before, after]
        move = (node, before, after)
        goal_next[move], goal_reward[move] = goal_outcomes(goals, path, rewards)
        influence_next[move], nearest = influence_outcomes(influences, path)
        shared_next[move], _ = influence_outcomes(goals, path)
        allowed[move] = allowed_moves(before, after, influences, nearest, settings.safety_m)
    level = np.arange(ALPHA_LEVELS) * ALPHA_STEP
    steadiness = rewards.steadiness * (1 - np.abs(level[:, None] - level) ** rewards.power)
    model = QuantisedModel(
        goal_next=goal_next,
        goal_reward=goal_reward,
        influence_next=influence_next,
        shared_next=shared_next,
        shared=shared_samples(goals),
        allowed=allowed,
        steadiness=steadiness,
        successors=settings.successors(),
        rewards=rewards,
    )
    stuck = np.argwhere(~choices(model).any(axis=3))
    if len(stuck):
        before, node, cell = stuck[0]
        raise SettingError(
            f"no action is allowed at alpha {before * ALPHA_STEP:g} after core node {node} in influence cell {cell}; "
            "one of the core nodes must stand or walk slowly"
        )
    return model


def measured(table: DisplacementTable) -> list[tuple[int, int, int]]:
    """Node, level before and level commanded of the changes in a table."""
    return [(int(m), int(a), int(b)) for m, a, b in np.argwhere(np.isfinite(table.path[..., 0, 0]))]


def choices(model: QuantisedModel) -> BoolArray:
    """Which actions may be chosen: (level before, node before, influence cell, actions); an action is node * 6 + level."""
    by_state = np.einsum("pm,mabi->apimb", model.successors, model.allowed)
    return np.asarray(by_state.reshape(ALPHA_LEVELS, CORE_NODES, INFLUENCE_CELLS, CORE_NODES * ALPHA_LEVELS))


def shared_samples(goals: FloatArray) -> IntArray:
    """First and number (40, 20, 2) of each goal cell's samples in each influence cell; none in the one out of range.

    Args:
        goals: (40, samples, 2) from `cell_samples`, in order of angle.
    """
    shared = np.zeros((len(goals), INFLUENCE_CELLS, 2), dtype=np.int64)
    for cell, inside in enumerate(influence_cell(*polar(goals))):
        for other in np.unique(inside):
            if other != OUT_OF_RANGE:
                samples = np.flatnonzero(inside == other)
                shared[cell, other] = samples[0], len(samples)
    return shared


def seen_from(points: FloatArray, path: FloatArray) -> FloatArray:
    """Points as seen along a path: (N, ..., 2) and (T, 3) give (T, N, ..., 2)."""
    turned = path[:, 2].reshape(-1, *(1,) * (points.ndim - 1))
    place = path[:, :2].reshape(-1, *(1,) * (points.ndim - 1), 2)
    return relative(points, place, turned)


def goal_outcomes(
    points: FloatArray, path: FloatArray, rewards: RewardSettings
) -> tuple[NDArray[np.uint8], FloatArray]:
    """Next cell and weighted f_theta + f_d (cells, samples) of goals at points.

    The cell is `REACHED` where the path comes within 0.4 m of the goal.

    Args:
        points: (cells, samples, 2) forward and left [m].
        path: (T, 3) of the action.
        rewards: constants.
    """
    before, _ = polar(points)
    along = seen_from(points, _checked(path))
    distance, angle = polar(along)
    after, facing = distance[-1], angle[-1]
    cell = np.where((distance < REACH_M).any(axis=0), REACHED, goal_cell(after, facing))
    return cell.astype(np.uint8), goal_terms(before, after, facing, rewards)


def goal_terms(before: FloatArray, after: FloatArray, facing: FloatArray, rewards: RewardSettings) -> FloatArray:
    """Weighted f_theta + f_d (paper, Eq. 14, 15 and 17).

    Args:
        before: distance to the goal before the action [m].
        after: the same after it.
        facing: angle of the goal from the heading after the action [rad].
        rewards: constants.
    """
    towards = 1 - np.abs(facing) / np.pi
    nearer = (rewards.distance_norm + before - after) / (2 * rewards.distance_norm)
    return np.asarray(rewards.facing * towards + rewards.approach * nearer)


def influence_outcomes(points: FloatArray, path: FloatArray) -> tuple[NDArray[np.uint8], FloatArray]:
    """Next cell of sources of influence at points, and least distance on the way [m], (cells, samples) both.

    `ENTERED` is added where the path comes within 0.4 m of a source that was further away.

    Args:
        points: (cells, samples, 2) forward and left [m].
        path: (T, 3) of the action.
    """
    distance, angle = polar(seen_from(points, _checked(path)))
    before, _ = polar(points)
    nearest = distance.min(axis=0)
    entered = (nearest < REACH_M) & (before >= REACH_M)
    return (influence_cell(distance[-1], angle[-1]) + ENTERED * entered).astype(np.uint8), nearest


def allowed_moves(before: int, after: int, points: FloatArray, nearest: FloatArray, safety: float) -> BoolArray:
    """Influence cells (cells,) in which an action may be chosen.

    Reaching the source of influence forces alpha to 1. An action that might reach it must begin and end at a level of
    0.8 or more, so that this is never a jump of more than one level. The paper only makes the jump costly.

    Args:
        before: level before the action.
        after: level commanded.
        points: (cells, samples, 2).
        nearest: (cells, samples) least distance on the way [m].
        safety: distance beyond reach that counts as reaching, for the places between the samples [m].
    """
    distance = polar(points)[0]
    reaches = (nearest < REACH_M + safety) & (distance >= REACH_M) & (nearest < distance - _STILL_M)
    return np.asarray(~reaches.any(axis=1) | (min(before, after) >= AT_INFLUENCE - 1))


def _checked(path: FloatArray) -> FloatArray:
    return np.asarray(path[np.round(np.linspace(0, len(path) - 1, _CHECKS + 1)).astype(int)[1:]])
