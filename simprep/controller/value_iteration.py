"""The best policy of the quantised model, the return of any policy, and where it ends: by repeated exact backups."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.controller.model import ENTERED, REACHED, QuantisedModel, choices
from simprep.controller.spaces import (
    ACTIONS,
    ALPHA_LEVELS,
    AT_INFLUENCE,
    CORE_NODES,
    GOAL_ANGLES,
    GOAL_CELLS,
    INFLUENCE_CELLS,
    STATES,
    state_index,
)

STATE_SHAPE = (ALPHA_LEVELS, CORE_NODES, GOAL_CELLS, INFLUENCE_CELLS)
AT_GOAL = GOAL_ANGLES
"""The first goal cells, of the nearest ring, are terminal."""


@dataclass(frozen=True)
class Backup:
    """Transition probabilities of the model by move: a core node, a level before and a level commanded.

    Attributes:
        moves: (M, 3).
        goal: (M, 40, 40) probability of the next goal cell, without reaching.
        reached: (M, 40) probability of reaching the goal.
        influence: (M, 20, 20) probability of the next influence cell without reaching the source of influence.
        entered: (M, 20, 20) the same with reaching it.
        pairs: (P, 2) goal and influence cells whose points are taken for one.
        together: (M * P, 19200 + 1) probability of the next state from there; the last column is reaching the goal.
        reward: (M, 40, 20) expected reward.
        choices: (level, node, influence cell, action) which actions may be chosen.
        discount: gamma.
        arrival: return credited on reaching the goal.
    """

    moves: IntArray
    goal: FloatArray
    reached: FloatArray
    influence: FloatArray
    entered: FloatArray
    pairs: IntArray
    together: sparse.csr_array
    reward: FloatArray
    choices: BoolArray
    discount: float
    arrival: float

    def action_values(self, values: FloatArray, discount: float, arrival: float) -> FloatArray:
        """Expected return (M, 40, 20) of every action, then following `values`; without the reward.

        Args:
            values: (6, 4, 40, 20).
            discount: of what follows.
            arrival: return on reaching the goal.
        """
        node, _, after = self.moves.T
        onward = values[after, node] @ self.influence.transpose(0, 2, 1)
        onward += values[AT_INFLUENCE, node] @ self.entered.transpose(0, 2, 1)
        expected = self.reached[:, :, None] * arrival + self.goal @ onward
        joint = self.together @ np.append(values.ravel(), arrival)
        expected[:, self.pairs[:, 0], self.pairs[:, 1]] = joint.reshape(len(self.moves), -1)
        return np.asarray(discount * expected)


def backup(model: QuantisedModel) -> Backup:
    """Probabilities of a model: the shares of its samples."""
    moves = np.argwhere(model.allowed.any(axis=3))
    node, before, after = moves.T
    goal = _shares(model.goal_next[node, before, after], REACHED + 1)
    influence = _shares(model.influence_next[node, before, after], 2 * ENTERED)
    stays, enters = influence[..., :INFLUENCE_CELLS], influence[..., ENTERED : ENTERED + INFLUENCE_CELLS]
    entering = enters.sum(axis=-1)  # (M, 20)
    steady = (1 - entering) * model.steadiness[before, after][:, None]
    steady += entering * model.steadiness[before, AT_INFLUENCE][:, None]
    reward = model.goal_reward[node, before, after].mean(axis=-1, dtype=np.float64)[:, :, None] + steady[:, None, :]
    pairs = np.argwhere(model.shared[..., 1] > 0)
    together = sparse.vstack([_joint(model, move, pairs, reward[number]) for number, move in enumerate(moves)])
    return Backup(
        pairs=pairs,
        together=sparse.csr_array(together),
        moves=moves,
        goal=goal[..., :GOAL_CELLS],
        reached=goal[..., REACHED],
        influence=stays,
        entered=enters,
        reward=reward,
        choices=choices(model),
        discount=model.rewards.discount,
        arrival=model.rewards.arrival_value,
    )


def _joint(model: QuantisedModel, move: IntArray, pairs: IntArray, reward: FloatArray) -> sparse.csr_array:
    """(P, 19201) probabilities of the next state where goal and source of influence are one; sets the reward there."""
    node, before, after = (int(number) for number in move)
    table = np.zeros((len(pairs), STATES + 1))
    for row, (goal, influence) in enumerate(pairs):
        first, count = model.shared[goal, influence]
        samples = slice(first, first + count)
        next_goal = model.goal_next[node, before, after, goal, samples].astype(np.int64)
        next_influence = model.shared_next[node, before, after, goal, samples].astype(np.int64)
        enters = next_influence >= ENTERED
        level = np.where(enters, AT_INFLUENCE, after)
        ends = next_goal == REACHED
        state = state_index(level, node, np.where(ends, 0, next_goal), next_influence % ENTERED)
        np.add.at(table[row], np.where(ends, STATES, state), 1 / count)
        earned = model.goal_reward[node, before, after, goal, samples] + model.steadiness[before, level]
        reward[goal, influence] = earned.mean(dtype=np.float64)
    return sparse.csr_array(table)


def by_action(exact: Backup, by_move: FloatArray) -> FloatArray:
    """Values (6, 4, 40, 20, 24) per state and action, of values (M, 40, 20) per move; -inf if not allowed."""
    node, before, after = exact.moves.T
    table = np.full((ALPHA_LEVELS, ACTIONS, GOAL_CELLS, INFLUENCE_CELLS), -np.inf)
    table[before, node * ALPHA_LEVELS + after] = by_move
    table = table.transpose(0, 2, 3, 1)[:, None]  # level, 1, goal, influence, action
    return np.where(exact.choices[:, :, None], table, -np.inf)


def best_actions(action_values: FloatArray) -> NDArray[np.uint8]:
    """Greedy policy (6, 4, 40, 20) of action values (6, 4, 40, 20, 24)."""
    return np.asarray(action_values.argmax(axis=-1), dtype=np.uint8)


def value_iteration(exact: Backup, tolerance: float = 1e-9) -> tuple[FloatArray, NDArray[np.uint8]]:
    """The largest return from every state, and the actions of a policy that earns it, both (6, 4, 40, 20).

    At the goal the value is the return credited on reaching it.

    Args:
        exact: the backup.
        tolerance: the largest error of a value left, by the contraction of the backup.
    """
    values = np.full(STATE_SHAPE, exact.arrival)
    enough = tolerance * (1 - exact.discount) / max(exact.discount, 1e-9)
    while True:
        action_values = by_action(exact, exact.reward + exact.action_values(values, exact.discount, exact.arrival))
        better = action_values.max(axis=-1)
        better[:, :, :AT_GOAL] = exact.arrival
        change = np.abs(better - values).max()
        values = better
        if change <= enough:
            return values, best_actions(action_values)


def policy_values(
    exact: Backup, policy: NDArray[np.uint8], start: FloatArray | None = None, tolerance: float = 1e-9
) -> FloatArray:
    """Return (6, 4, 40, 20) that a policy earns from every state.

    Args:
        exact: the backup.
        policy: (6, 4, 40, 20) action.
        start: a first guess.
        tolerance: the largest error of a value left.
    """
    values = np.full(STATE_SHAPE, exact.arrival) if start is None else start.copy()
    values[:, :, :AT_GOAL] = exact.arrival
    pick = _picker(exact, policy)
    enough = tolerance * (1 - exact.discount) / max(exact.discount, 1e-9)
    while True:
        better = pick(exact.reward + exact.action_values(values, exact.discount, exact.arrival))
        better[:, :, :AT_GOAL] = exact.arrival
        change = np.abs(better - values).max()
        values = better
        if change <= enough:
            return values


def arrival_probability(exact: Backup, policy: NDArray[np.uint8], actions: int = 2000) -> FloatArray:
    """Probability that a policy reaches the goal within so many actions, from every state (6, 4, 40, 20)."""
    values = np.zeros(STATE_SHAPE)
    values[:, :, :AT_GOAL] = 1.0
    pick = _picker(exact, policy)
    for _ in range(actions):
        better = pick(exact.action_values(values, 1.0, 1.0))
        better[:, :, :AT_GOAL] = 1.0
        if np.abs(better - values).max() < 1e-13:
            break
        values = better
    return values


def reachable(exact: Backup, policy: NDArray[np.uint8] | None = None) -> BoolArray:
    """States (6, 4, 40, 20) from which the goal is reached with a probability above 0.

    Args:
        exact: the backup.
        policy: (6, 4, 40, 20) action; None for any sequence of allowed actions. If these are all states, a policy
            surely reaches the goal.
    """
    known = np.zeros(STATE_SHAPE, dtype=bool)
    known[:, :, :AT_GOAL] = True
    pick = None if policy is None else _picker(exact, policy)
    while True:
        onward = exact.action_values(known.astype(np.float64), 1.0, 1.0)
        wider = known | ((pick(onward) if pick else by_action(exact, onward).max(axis=-1)) > 0)
        if (wider == known).all():
            return known
        known = wider


def _picker(exact: Backup, policy: NDArray[np.uint8]) -> Callable[[FloatArray], FloatArray]:
    number = np.full((ALPHA_LEVELS, ACTIONS), -1)
    node, before, after = exact.moves.T
    number[before, node * ALPHA_LEVELS + after] = np.arange(len(exact.moves))
    level, _, goal, influence = np.indices(STATE_SHAPE)
    move = number[level, policy]

    def pick(by_move: FloatArray) -> FloatArray:
        return np.asarray(by_move[move, goal, influence])

    return pick


def _shares(outcomes: NDArray[np.uint8], kinds: int) -> FloatArray:
    """(..., samples) outcome numbers to (..., kinds) shares."""
    flat = outcomes.reshape(-1, outcomes.shape[-1])
    counts = np.zeros((len(flat), kinds))
    np.add.at(counts, (np.arange(len(flat))[:, None], flat), 1.0)
    return np.asarray((counts / flat.shape[1]).reshape(*outcomes.shape[:-1], kinds))
