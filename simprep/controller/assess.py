"""How good a policy is: in the quantised model, against the best one, and on the continuous floor."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from simprep.controller.model import build_model
from simprep.controller.policy import Policy
from simprep.controller.rollout import Outcome, greedy, random_starts, roll_out
from simprep.controller.spaces import STATES
from simprep.controller.value_iteration import (
    AT_GOAL,
    arrival_probability,
    backup,
    policy_values,
    reachable,
    value_iteration,
)

SURELY = 1 - 1e-6


@dataclass(frozen=True)
class Assessment:
    """A policy in its quantised model, by exact backups.

    Attributes:
        states: how many there are.
        mean_return: mean over all states.
        best_return: that of value iteration.
        optimal_share: their ratio.
        optimal_share_moving: the same over the states that are not at the goal.
        least_share: smallest ratio of the returns of one state.
        reachable_share: share of the states from which some sequence of actions leads to the goal.
        arrival_share: share of those from which the policy surely reaches the goal in 2000 actions (to a millionth).
        unreached: number of those from which it does not.
        best_arrival_share: `arrival_share` of value iteration's policy.
    """

    states: int
    mean_return: float
    best_return: float
    optimal_share: float
    optimal_share_moving: float
    least_share: float
    reachable_share: float
    arrival_share: float
    unreached: int
    best_arrival_share: float


def assess(policy: Policy) -> Assessment:
    """Compare a policy with the best one of its quantised model, made of its own displacements and settings."""
    exact = backup(build_model(policy.table, policy.settings))
    best, best_policy = value_iteration(exact)
    values = policy_values(exact, policy.actions)
    possible = reachable(exact)
    arrives = arrival_probability(exact, policy.actions) > SURELY
    best_arrives = arrival_probability(exact, best_policy) > SURELY
    return Assessment(
        states=STATES,
        mean_return=float(values.mean()),
        best_return=float(best.mean()),
        optimal_share=float(values.mean() / best.mean()),
        optimal_share_moving=float(values[:, :, AT_GOAL:].mean() / best[:, :, AT_GOAL:].mean()),
        least_share=float((values / best).min()),
        reachable_share=float(possible.mean()),
        arrival_share=float(arrives[possible].mean()),
        unreached=int((possible & ~arrives).sum()),
        best_arrival_share=float(best_arrives[possible].mean()),
    )


def random_approaches(policy: Policy, count: int, rng: np.random.Generator) -> dict[str, Any]:
    """`summary` of approaches of a policy from so many random starts on the continuous floor."""
    starts = random_starts(count, rng)
    return summary(roll_out(policy.table, greedy(policy), starts, policy.settings.smoothing))


def summary(outcome: Outcome) -> dict[str, Any]:
    """Shares of an outcome, and the worst and median of the levels at the source of influence."""
    met = outcome.met

    def least(values: Any) -> float | None:
        return float(values[met].min()) if met.any() else None

    def middle(values: Any) -> float | None:
        return float(np.median(values[met])) if met.any() else None

    return {
        "starts": len(met),
        "reached_share": float(outcome.reached.mean()),
        "median_time_s": float(np.median(outcome.time_s[outcome.reached])) if outcome.reached.any() else None,
        "met_influence": int(met.sum()),
        "alpha_at_influence_min": least(outcome.alpha_at_influence),
        "alpha_at_influence_median": middle(outcome.alpha_at_influence),
        "alpha_on_crossing_min": least(outcome.alpha_on_crossing),
        "alpha_on_crossing_median": middle(outcome.alpha_on_crossing),
        "max_alpha_jump": float(outcome.largest_jump.max()),
        "starts_with_jump_above_0_25": int((outcome.largest_jump > 0.25).sum()),
    }
