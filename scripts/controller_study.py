"""How good is the behaviour controller? Learned against best, against two baselines, and what its settings are worth.

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

from simprep.behavior.assess import SURELY, assess, summary
from simprep.behavior.best import measure
from simprep.behavior.model import OUT_OF_RANGE, build_model
from simprep.behavior.policy import Policy
from simprep.behavior.rollout import Choice, Starts, greedy, random_starts, roll_out
from simprep.behavior.settings import ControllerSettings, LearningSettings, RewardSettings
from simprep.behavior.spaces import ALPHA_LEVELS, AT_INFLUENCE
from simprep.behavior.training import run, start
from simprep.behavior.value_iteration import arrival_probability, backup, value_iteration
from simprep.report.learning_curve import plot_learning_curve
from simprep.report.record import provenance, write_json

CORE_SETS = {
    "default": ControllerSettings().cores,
    "curved walks": ("walk", "walk_turn_left", "walk_turn_right", "stand"),
    "steps aside": ("walk", "walk_left", "walk_right", "stand"),
    "all directions": ("walk", "walk_backward", "walk_left", "walk_right"),
}
DISTANCES_M = (0.6, 0.8, 1.0, 1.2, 1.4, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0)


def unprepared(policy: Policy) -> Choice:
    """The same way of walking, without ever preparing."""

    def choose(level: Any, node: Any, goal: Any, influence: Any) -> Any:
        return policy.actions[0, node, goal, OUT_OF_RANGE].astype(np.int64) // ALPHA_LEVELS, np.zeros_like(level)

    return choose


def learning(settings: ControllerSettings, steps: int, seeds: int) -> tuple[list[dict[str, Any]], Policy, Any]:
    table = measure(settings)
    rows, kept = [], []
    run(start(table, settings, LearningSettings(steps=1000)))  # compiles
    for label, change in {"default": {}, "paper's constant rate": {"rate_decay": 0.0}}.items():
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
    return rows, *kept[0]


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


def baselines(policy: Policy, count: int, seed: int) -> list[dict[str, Any]]:
    starts = random_starts(count, np.random.default_rng(seed))
    plain = replace(starts, level=np.zeros_like(starts.level))
    table, smoothing = policy.table, policy.settings.smoothing
    return [
        {"controller": "learned", **summary(roll_out(table, greedy(policy), starts, smoothing))},
        {"controller": "no preparation",
         **summary(roll_out(table, unprepared(policy), plain, smoothing, force=False))},
        {"controller": "alpha switched on at the last step",
         **summary(roll_out(table, unprepared(policy), plain, smoothing, force=True))},
    ]  # fmt: skip


def between_obstacles(policy: Policy) -> list[dict[str, Any]]:
    """After one obstacle, fully prepared: how far alpha falls on the way to the next, straight ahead."""
    goal = np.column_stack([DISTANCES_M, np.zeros(len(DISTANCES_M))])
    count = len(DISTANCES_M)
    starts = Starts(goal, goal, np.full(count, AT_INFLUENCE), np.full(count, 3))
    outcome = roll_out(policy.table, greedy(policy), starts, policy.settings.smoothing)
    return [
        {"distance_m": distance, "lowest_alpha": float(low), "reached": bool(reached), "time_s": float(time)}
        for distance, low, reached, time in zip(DISTANCES_M, outcome.level_range[:, 0], outcome.reached, outcome.time_s)
    ]


def show(title: str, rows: list[dict[str, Any]], keys: tuple[str, ...]) -> None:
    table = Table(*keys, title=title)
    for row in rows:
        table.add_row(*(f"{row[key]:.4g}" if isinstance(row[key], float) else str(row[key]) for key in keys))
    Console(width=160).print(table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=20_000_000)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--starts", type=int, default=1000)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/controller"))
    arguments = parser.parse_args()
    settings = ControllerSettings()
    learned, policy, training = learning(settings, arguments.steps, arguments.seeds)
    show("Learning", learned, ("learning", "seed", "cpu_s", "mean_return", "optimal_share", "optimal_share_moving",
                               "arrival_share", "unreached", "largest_fall_of_curve"))  # fmt: skip
    starts = baselines(policy, arguments.starts, seed=0)
    show("Random starts", starts, ("controller", "reached_share", "median_time_s", "met_influence", "alpha_at_influence_min",
                                   "alpha_on_crossing_min", "max_alpha_jump", "starts_with_jump_above_0_25"))  # fmt: skip
    obstacles = between_obstacles(policy)
    show("Between two obstacles", obstacles, ("distance_m", "lowest_alpha", "reached", "time_s"))
    arrivals = best_arrivals(settings)["rows"]
    show("Best policies", arrivals, ("cores", "discount", "mean_return", "arrival_share_from_elsewhere"))
    content = {
        "schema": "simprep.controller_study/1", **provenance(()), "command": " ".join(["python", "scripts/controller_study.py", *sys.argv[1:]]),
        "learning": learned, "learning_curve": [asdict(point) for point in training.curve], "random_starts": starts,
        "between_obstacles": obstacles, "best_policies": arrivals,
    }  # fmt: skip
    write_json(arguments.out / "study.json", content)
    plot_learning_curve(
        [point.steps for point in training.curve],
        [point.mean_return for point in training.curve],
        learned[0]["best_return"],
        arguments.out / "learning_curve.png",
    )
    print(f"written: {arguments.out / 'study.json'}, {arguments.out / 'learning_curve.png'}")


if __name__ == "__main__":
    main()
