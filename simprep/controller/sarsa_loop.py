"""The training loop of SARSA, compiled by numba (extra `learn`): import it only where it is run.

The update is Q(s, a) += rate (r + discount Q(s', a') - Q(s, a)) (paper, Eq. 19; Sutton & Barto, section 6.4).
"""

import numpy as np
from numba import njit

from simprep.controller.model import ENTERED, REACHED
from simprep.controller.spaces import ALPHA_LEVELS, AT_INFLUENCE, CORE_NODES, GOAL_ANGLES, GOAL_CELLS, INFLUENCE_CELLS


@njit(inline="always", cache=True)  # type: ignore[untyped-decorator]
def draw(random, count):  # type: ignore[no-untyped-def]
    """A number below `count`: splitmix64 (Steele, Lea & Flood 2014), then multiply and shift (Lemire 2019)."""
    random[0] += np.uint64(0x9E3779B97F4A7C15)
    z = random[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.int64(((z >> np.uint64(32)) * np.uint64(count)) >> np.uint64(32))


@njit(cache=True)  # type: ignore[untyped-decorator]
def choose(values, updates, untried, random, actions, count, explore, level, node, goal, influence):  # type: ignore[no-untyped-def]
    """Exploring starts (an untried action first), else epsilon-greedy."""
    number = count[level, node, influence]
    if untried[level, node, goal, influence] > 0:
        first = draw(random, number)
        for k in range(number):
            action = actions[level, node, influence, (first + k) % number]
            if updates[level, node, goal, influence, action] == 0:
                return np.int64(action)
    if draw(random, 1 << 30) < explore * (1 << 30):
        return np.int64(actions[level, node, influence, draw(random, number)])
    best = np.int64(actions[level, node, influence, 0])
    for k in range(1, number):
        action = np.int64(actions[level, node, influence, k])
        if values[level, node, goal, influence, action] > values[level, node, goal, influence, best]:
            best = action
    return best


@njit(cache=True)  # type: ignore[untyped-decorator]
def begin(values, updates, actions, count, confidence, level, node, goal, influence):  # type: ignore[no-untyped-def]
    """Exploring start: an untried action first, else the one of largest upper confidence bound."""
    chosen, top = np.int64(-1), -np.inf
    for k in range(count[level, node, influence]):
        action = np.int64(actions[level, node, influence, k])
        tried = updates[level, node, goal, influence, action]
        if tried == 0:
            return action
        bound = values[level, node, goal, influence, action] + confidence / np.sqrt(tried)
        if bound > top:
            chosen, top = action, bound
    return chosen


@njit(cache=True)  # type: ignore[untyped-decorator]
def loop(  # type: ignore[no-untyped-def]
    values, updates, untried, now, random, goal_next, goal_reward, influence_next, shared_next, shared, steadiness,
    actions, count, discount, arrival, rate, decay, explore, confidence, longest, steps,
):  # fmt: skip
    """Run training steps with the arguments of `simprep.controller.sarsa.learn`; gives the number of episodes ended."""
    level, node, goal, influence, action, length = now
    episodes = 0
    for _ in range(steps):
        if action < 0:  # an episode begins anywhere but at the goal
            level, node = draw(random, ALPHA_LEVELS), draw(random, CORE_NODES)
            goal = GOAL_ANGLES + draw(random, GOAL_CELLS - GOAL_ANGLES)
            influence, length = draw(random, INFLUENCE_CELLS), 0
            action = begin(values, updates, actions, count, confidence, level, node, goal, influence)
        next_node, after = action // ALPHA_LEVELS, action % ALPHA_LEVELS
        if shared[goal, influence, 1] > 0:  # goal and source of influence are one point
            sample = shared[goal, influence, 0] + draw(random, shared[goal, influence, 1])
            next_influence = np.int64(shared_next[next_node, level, after, goal, sample])
        else:
            sample = draw(random, goal_next.shape[4])
            other = draw(random, influence_next.shape[4])
            next_influence = np.int64(influence_next[next_node, level, after, influence, other])
        next_goal = np.int64(goal_next[next_node, level, after, goal, sample])
        if next_influence >= ENTERED:
            next_influence -= ENTERED
            next_level = AT_INFLUENCE
        else:
            next_level = after
        target = goal_reward[next_node, level, after, goal, sample] + steadiness[level, next_level]
        following = np.int64(-1)
        if next_goal == REACHED:
            target += discount * arrival
        else:
            following = choose(
                values, updates, untried, random, actions, count, explore,
                next_level, next_node, next_goal, next_influence,
            )  # fmt: skip
            target += discount * values[next_level, next_node, next_goal, next_influence, following]
        done = updates[level, node, goal, influence, action]
        if done == 0:
            untried[level, node, goal, influence] -= 1
        step = rate / (1.0 + done / decay) if decay > 0 else rate
        values[level, node, goal, influence, action] += step * (target - values[level, node, goal, influence, action])
        updates[level, node, goal, influence, action] = done + 1
        level, node, goal, influence, action = next_level, next_node, next_goal, next_influence, following
        length += 1
        if action < 0 or length >= longest:
            action = np.int64(-1)
            episodes += 1
    now[0], now[1], now[2], now[3], now[4], now[5] = level, node, goal, influence, action, length
    return episodes
