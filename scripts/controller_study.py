"""How good is the behaviour controller? Learned against best, against two baselines, between obstacles, and what its settings are worth.

Writes results/controller/study.json and learning_curve.png, and prints tables. A few minutes on one core.

    python scripts/controller_study.py
"""

import argparse
import sys
from dataclasses import asdict, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from simprep.controller.assess import SURELY, assess, summary
from simprep.controller.best import measure
from simprep.controller.model import OUT_OF_RANGE, build_model
from simprep.controller.policy import Policy
from simprep.controller.rollout import Choice, Starts, greedy, random_starts, roll_out
from simprep.controller.runtime.approach import NEAR_M, near_obstacles
from simprep.controller.settings import ControllerSettings, LearningSettings, RewardSettings
from simprep.controller.spaces import ALPHA_LEVELS, ALPHA_STEP, AT_INFLUENCE, CORE_NODES
from simprep.controller.training import Training, run, start
from simprep.controller.value_iteration import arrival_probability, backup, value_iteration
from simprep.report.learning_curve import plot_learning_curve
from simprep.report.results import provenance, save_json

CORE_SETS = {
    "default": ControllerSettings().cores,
    "curved walks": ("walk", "walk_turn_left", "walk_turn_right", "stand"),
    "steps aside": ("walk", "walk_left", "walk_right", "stand"),
    "all directions": ("walk", "walk_backward", "walk_left", "walk_right"),
}
DISTANCES_M = tuple(round(0.45 + 0.05 * step, 2) for step in range(92))
DIRECTIONS_DEG = (0.0, 45.0, 90.0, 135.0, 180.0)
"""Of the next obstacle, from the heading in which the last one was passed."""


def unprepared(policy: Policy) -> Choice:
    """The same way of walking, without ever preparing."""

    def choose(level: Any, node: Any, goal: Any, influence: Any) -> Any:
        return policy.actions[0, node, goal, OUT_OF_RANGE].astype(np.int64) // ALPHA_LEVELS, np.zeros_like(level)

    return choose


def learning(
    settings: ControllerSettings, steps: int, seeds: int
) -> tuple[list[dict[str, Any]], list[Policy], Training]:
    """Seeds, then the paper's learning rate; gives the policies of the seeds and the training of the first."""
    table = measure(settings)
    rows, kept = [], []
    run(start(table, settings, LearningSettings(steps=1000)))  # compiles
    ways: dict[str, dict[str, Any]] = {"default": {}, "paper's constant rate": {"rate_decay": 0.0}}
    for label, change in ways.items():
        for seed in range(seeds if not change else 1):
            training = start(table, settings, replace(LearningSettings(steps=steps, seed=seed), **change))
            begin = process_time()
            policy = run(training)
            returns = np.array([point.mean_return for point in training.curve])
            rows.append({
                "learning": label, "seed": seed, "steps": training.learner.steps, "cpu_s": process_time() - begin,
                "wall_s_of_steps": training.wall_s, "largest_fall_of_curve": float(np.maximum(-np.diff(returns), 0).max()),
                **asdict(assess(policy)),
            })  # fmt: skip
            kept.append((policy, training))
    return rows, [policy for policy, _ in kept[:seeds]], kept[0][1]


def best_arrivals(settings: ControllerSettings) -> dict[str, Any]:
    """From which share of the states the best policy reaches the goal, for other core nodes and discounts."""
    rows = []
    for label, cores in CORE_SETS.items():
        table = measure(replace(settings, cores=cores))
        for discount in (0.3, 0.6, 0.9):
            other = replace(settings, cores=cores, rewards=RewardSettings(discount=discount))
            exact = backup(build_model(table, other))
            values, policy = value_iteration(exact)
            arrives = arrival_probability(exact, policy)[:, :, 8:] > SURELY
            rows.append({"cores": label, "names": cores, "discount": discount, "mean_return": float(values.mean()),
                         "arrival_share_from_elsewhere": float(arrives.mean())})  # fmt: skip
    return {"rows": rows}


def baselines(policies: list[Policy], count: int, seed: int) -> list[dict[str, Any]]:
    """Random starts under the policy of every seed, and under two controllers that walk like the first but prepare otherwise."""
    policy = policies[0]
    starts = random_starts(count, np.random.default_rng(seed))
    plain = replace(starts, level=np.zeros_like(starts.level))
    table, smoothing = policy.table, policy.settings.smoothing
    return [
        *({"controller": f"learned, seed {number}", **summary(roll_out(table, greedy(one), starts, smoothing))}
          for number, one in enumerate(policies)),
        {"controller": "no preparation",
         **summary(roll_out(table, unprepared(policy), plain, smoothing, force=False))},
        {"controller": "alpha switched on at the last step",
         **summary(roll_out(table, unprepared(policy), plain, smoothing, force=True))},
    ]  # fmt: skip


def between_obstacles(policies: list[Policy]) -> list[dict[str, Any]]:
    """After one obstacle, fully prepared: how far alpha falls on the way to the next one.

    The worst over the seeds and the core nodes to begin with, for the policy alone and with the least level that the run
    time keeps between near obstacles.
    """
    rows = []
    distance, node = (part.ravel() for part in np.meshgrid(DISTANCES_M, np.arange(CORE_NODES), indexing="ij"))
    count, shape = len(distance), (len(DISTANCES_M), CORE_NODES)
    for direction in DIRECTIONS_DEG:
        angle = np.radians(direction)
        goal = np.column_stack([distance * np.cos(angle), distance * np.sin(angle)])
        starts = Starts(goal, goal, np.full(count, AT_INFLUENCE), node)
        kept = np.array([round(near_obstacles((0.0, 0.0), tuple(place)) / ALPHA_STEP) for place in goal])
        for label, least in (("alone", np.zeros_like(kept)), ("kept by the run time", kept)):
            outcomes = [roll_out(p.table, greedy(p), starts, p.settings.smoothing, least=least) for p in policies]
            low = np.min([outcome.level_range[:, 0].reshape(shape).min(axis=1) for outcome in outcomes], axis=0)
            reached = np.all([outcome.reached.reshape(shape).all(axis=1) for outcome in outcomes], axis=0)
            slowest = np.max([outcome.time_s.reshape(shape).max(axis=1) for outcome in outcomes], axis=0)
            rows += [
                {"controller": label, "direction_deg": direction, "distance_m": place, "lowest_alpha": float(alpha),
                 "reached": bool(arrives), "slowest_s": float(time)}
                for place, alpha, arrives, time in zip(DISTANCES_M, low, reached, slowest)
            ]  # fmt: skip
    return rows


def obstacle_summary(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """By controller and direction: the lowest alpha nearer than 1.5 m, and where it falls below 0.5 and to 0.2."""

    def nearest(own: list[dict[str, Any]], below: float) -> float | None:
        return min((row["distance_m"] for row in own if row["lowest_alpha"] < below), default=None)

    summaries = []
    for label, direction in dict.fromkeys((row["controller"], row["direction_deg"]) for row in rows):
        own = [row for row in rows if (row["controller"], row["direction_deg"]) == (label, direction)]
        near = [row["lowest_alpha"] for row in own if row["distance_m"] < NEAR_M]
        summaries.append({
            "controller": label, "direction_deg": direction, "lowest_alpha_nearer_than_1_5_m": min(near),
            "below_0_5_from_m": nearest(own, 0.5), "at_most_0_2_from_m": nearest(own, 0.3),
            "reached": all(row["reached"] for row in own), "slowest_s": max(row["slowest_s"] for row in own),
        })  # fmt: skip
    return summaries


def show(title: str, rows: list[dict[str, Any]], keys: tuple[str, ...]) -> None:
    table = Table(*keys, title=title)
    for row in rows:
        table.add_row(*(f"{row[key]:.4g}" if isinstance(row[key], float) else str(row[key]) for key in keys))
    Console(width=160).print(table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=LearningSettings().steps)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--starts", type=int, default=1000)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/controller"))
    arguments = parser.parse_args()
    settings = ControllerSettings()
    learned, policies, training = learning(settings, arguments.steps, arguments.seeds)
    show("Learning", learned, ("learning", "seed", "cpu_s", "mean_return", "optimal_share", "optimal_share_moving", "least_share",
                               "arrival_share", "unreached", "largest_fall_of_curve"))  # fmt: skip
    starts = baselines(policies, arguments.starts, seed=0)
    show("Random starts", starts, ("controller", "reached_share", "median_time_s", "met_influence", "alpha_at_influence_min",
                                   "alpha_on_crossing_min", "max_alpha_jump", "starts_with_jump_above_0_25"))  # fmt: skip
    obstacles = between_obstacles(policies)
    between = obstacle_summary(obstacles)
    show("Between two obstacles", between, tuple(between[0]))
    arrivals = best_arrivals(settings)["rows"]
    show("Best policies", arrivals, ("cores", "discount", "mean_return", "arrival_share_from_elsewhere"))
    content = {
        "schema": "simprep.controller_study/2", **provenance(()), "command": " ".join(["python", "scripts/controller_study.py", *sys.argv[1:]]),
        "learning": learned, "learning_curve": [asdict(point) for point in training.curve], "random_starts": starts,
        "between_obstacles": between, "between_obstacles_by_distance": obstacles, "best_policies": arrivals,
    }  # fmt: skip
    save_json(arguments.out / "study.json", content)
    plot_learning_curve(
        [point.steps for point in training.curve],
        [point.mean_return for point in training.curve],
        learned[0]["best_return"],
        arguments.out / "learning_curve.png",
    )
    print(f"written: {arguments.out / 'study.json'}, {arguments.out / 'learning_curve.png'}")


if __name__ == "__main__":
    main()
