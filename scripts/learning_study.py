"""Why did SARSA's policy sometimes stay away from the goal, and what cures it? Ways of learning compared over several seeds.

Writes results/controller/learning.json and learning.md. About 8 minutes on two cores.

    python scripts/learning_study.py --jobs 2
"""

import argparse
import sys
from dataclasses import asdict, replace
from functools import lru_cache
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from measuring.processes import each_result
from simprep.controller.assess import assess
from simprep.controller.best import measure
from simprep.controller.displacement import DisplacementTable
from simprep.controller.model import QuantisedModel, build_model
from simprep.controller.policy import Policy
from simprep.controller.sarsa import Learner, allowed_values, learn, new_learner
from simprep.controller.settings import ControllerSettings, LearningSettings
from simprep.controller.spaces import ALPHA_LEVELS, ALPHA_STEP, GOAL_ANGLES, INFLUENCE_ANGLES
from simprep.controller.value_iteration import (
    AT_GOAL,
    Backup,
    backup,
    best_actions,
    by_action,
    reachable,
    value_iteration,
)
from simprep.files import atomic_path
from simprep.report.results import provenance, save_json

SETTINGS = ControllerSettings()
LEAST_TRIED = 1e6  # so large a confidence makes the number of updates decide
BEFORE = {"confidence": LEAST_TRIED, "longest": 30}
WAYS: dict[str, dict[str, Any]] = {
    "least tried first, 30 actions (before)": BEFORE,
    "... values averaged over about 10 rounds": {**BEFORE, "average": 0.1},
    "... learning rate halved 4 times as early": {**BEFORE, "rate_decay": 5.0},
    "... episodes of 10 actions": {"confidence": LEAST_TRIED},
    "upper confidence, 30 actions": {"longest": 30},
    "upper confidence, 10 actions (default)": {},
}
FIRST_LOOK, EARLY = 10, 20
"""Millions of steps: of the first look for states that never reach the goal, and of the first full assessment."""


@lru_cache(maxsize=1)
def problem() -> tuple[DisplacementTable, QuantisedModel, Backup]:
    table = measure(SETTINGS)
    model = build_model(table, SETTINGS)
    return table, model, backup(model)


def study(job: tuple[str, int, int]) -> dict[str, Any]:
    """One training: way, seed, millions of steps."""
    way, seed, millions = job
    table, model, exact = problem()
    change = dict(WAYS[way])
    average = change.pop("average", None)
    settings = replace(LearningSettings(seed=seed), **change)
    learner = new_learner(model, settings)
    learn(learner, model, settings, 0)  # compiles
    mean = learner.values.copy()
    never: list[int] = []
    row: dict[str, Any] = {"way": way, "seed": seed, "settings": asdict(settings), "average": average}
    cpu_s = 0.0
    for million in range(1, millions + 1):
        begin = process_time()
        learn(learner, model, settings, 1_000_000)
        cpu_s += process_time() - begin
        mean += (average if average and million > FIRST_LOOK else 1.0) * (learner.values - mean)
        if million < FIRST_LOOK:
            continue
        judged = replace(learner, values=mean)
        actions = best_actions(allowed_values(judged, model))
        stays = ~reachable(exact, actions)
        never.append(int(stays.sum()))
        if million in (EARLY, millions):
            result = assess(Policy(actions, table, SETTINGS, {}))
            wrong = actions != best_actions(best_values()[1])
            row[f"after_{million}_million"] = {
                "cpu_s_of_steps": cpu_s, "optimal_share": result.optimal_share, "least_share": result.least_share,
                "unreached": result.unreached, "never_reached": never[-1],
                "examples": [explain(tuple(state), actions, judged) for state in np.argwhere(stays & wrong)[:3]],
            }  # fmt: skip
    return {**row, "never_reached_each_million": never}


@lru_cache(maxsize=1)
def best_values() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of states, and of actions."""
    exact = problem()[2]
    values, _ = value_iteration(exact)
    return values, by_action(exact, exact.reward + exact.action_values(values, exact.discount, exact.arrival))


def explain(state: tuple[int, ...], actions: NDArray[np.uint8], learner: Learner) -> dict[str, Any]:
    """A state that never reaches the goal: the action chosen there, and the best one."""
    level, node, goal, influence = (int(part) for part in state)
    action_values = best_values()[1]
    chosen, best = int(actions[state]), int(action_values[state].argmax())

    def described(action: int) -> dict[str, Any]:
        return {
            "node": SETTINGS.cores[action // ALPHA_LEVELS], "alpha": round(action % ALPHA_LEVELS * ALPHA_STEP, 1),
            "learned": float(learner.values[state][action]), "exact": float(action_values[state][action]),
            "updates": int(learner.updates[state][action]),
        }  # fmt: skip

    return {
        "alpha": round(level * ALPHA_STEP, 1), "after": SETTINGS.cores[node],
        "goal_ring_sector": divmod(goal, GOAL_ANGLES), "influence_ring_sector": divmod(influence, INFLUENCE_ANGLES),
        "chosen": described(chosen), "best": described(best),
    }  # fmt: skip


def soft_optimum(explore: float) -> dict[str, Any]:
    """What SARSA would converge to with a constant epsilon, exactly: does the greedy part reach the goal?"""
    exact = problem()[2]
    values = best_values()[0].copy()
    may = exact.choices[:, :, None]
    while True:
        action_values = by_action(exact, exact.reward + exact.action_values(values, exact.discount, exact.arrival))
        mean = np.where(may, action_values, 0.0).sum(axis=-1) / may.sum(axis=-1)
        better = (1 - explore) * action_values.max(axis=-1) + explore * mean
        better[:, :, :AT_GOAL] = exact.arrival
        change = np.abs(better - values).max()
        values = better
        if change < 1e-9:
            return {"explore": explore, "unreached": assess(_policy(best_actions(action_values))).unreached}


def standing_cost() -> dict[str, float]:
    """What one action of standing still at the same level costs, by the exact values: quantiles over the states."""
    values, action_values = best_values()
    stand = SETTINGS.cores.index("stand")
    levels = np.arange(ALPHA_LEVELS)
    cost = (values - action_values[levels, :, :, :, stand * ALPHA_LEVELS + levels])[:, :, AT_GOAL:]
    shares = (0.05, 0.25, 0.5, 0.75)
    return {f"{share:g}": float(value) for share, value in zip(shares, np.quantile(cost[np.isfinite(cost)], shares))}


def _policy(actions: NDArray[np.uint8]) -> Policy:
    return Policy(actions, problem()[0], SETTINGS, {})


def markdown(rows: list[dict[str, Any]], millions: int, content: dict[str, Any]) -> str:
    """The table, and why."""
    lines = [
        "# Learning the controller: reaching the goal must not hang on luck", "",
        f"Made by `{content['command']}`; every number is in learning.json.", "",
        "A policy reaches the goal from every state exactly if it has no closed set of states without the goal. Counted below: "
        f"states that can never reach it, at every million from {FIRST_LOOK} to {millions} million steps, over "
        f"{len({row['seed'] for row in rows})} seeds.", "",
        "| way of learning | looks with such states | the last of them [million steps] | optimal share, 20 M | "
        f"optimal share, {millions} M | least share of one state, {millions} M | CPU s per 20 M steps |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]  # fmt: skip
    for way in WAYS:
        own = [row for row in rows if row["way"] == way]
        never = np.array([row["never_reached_each_million"] for row in own]) > 0
        last = np.flatnonzero(never.any(axis=0))
        early, late = ([row[f"after_{when}_million"] for row in own] for when in (EARLY, millions))

        def spread(results: list[dict[str, Any]], key: str) -> str:
            values = [100 * result[key] for result in results]
            return f"{min(values):.2f} to {max(values):.2f} %"

        lines.append(
            f"| {way} | {never.sum()} of {never.size} | {FIRST_LOOK + last[-1] if len(last) else 'none'} | "
            f"{spread(early, 'optimal_share')} | {spread(late, 'optimal_share')} | {spread(late, 'least_share')} | "
            f"{np.median([result['cpu_s_of_steps'] for result in early]):.1f} |"
        )
    cost = content["standing_cost"]
    lines += [
        "", "## Why", "",
        "- Not exploration: the exact limit of SARSA with epsilon 0.1 leaves "
        f"{content['soft_optimum']['unreached']} states from which its greedy policy does not reach the goal.",
        f"- Noise: standing still for one action costs only {cost['0.05']:.3f} to {cost['0.75']:.3f} of a return of about 9 (5 % and "
        "75 % of the states). Where the learned value of standing is too high by more than that, the character stands there for "
        "ever. Examples, met while learning as before:",
    ]  # fmt: skip
    before = [row for row in rows if row["way"] == next(iter(WAYS))]
    shown = [(row["seed"], when, example) for row in before for when in (EARLY, millions)
             for example in row[f"after_{when}_million"]["examples"]]  # fmt: skip
    for seed, when, example in shown[:4]:
        chosen, best = example["chosen"], example["best"]
        lines.append(
            f"  - seed {seed}, {when} M: `{chosen['node']}` at alpha {chosen['alpha']} is chosen, learned {chosen['learned']:.3f} "
            f"(exact, then acting best: {chosen['exact']:.3f}; {chosen['updates']} updates), over `{best['node']}` at "
            f"{best['alpha']}, learned {best['learned']:.3f} (exact {best['exact']:.3f}; {best['updates']} updates)."
        )
    lines += [
        "- Beginning every episode with the action tried least often spends most steps on actions known to be bad. Beginning with the "
        "largest upper confidence bound, untried actions first, spends them where it is open which is best; short "
        "episodes spread them evenly over the states.",
    ]  # fmt: skip
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--millions", type=int, default=30, help="of training steps, above 20")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/controller"))
    arguments = parser.parse_args()
    jobs = [(way, seed, arguments.millions) for way in WAYS for seed in range(arguments.seeds)]
    found = dict(track(each_result(study, jobs, arguments.jobs), total=len(jobs), description="trainings"))
    rows = [found[number] for number in range(len(jobs))]
    content = {
        "schema": "simprep.learning_study/1", **provenance(()),
        "command": " ".join(["python", "scripts/learning_study.py", *sys.argv[1:]]),
        "soft_optimum": soft_optimum(LearningSettings().explore), "standing_cost": standing_cost(), "trainings": rows,
    }  # fmt: skip
    save_json(arguments.out / "learning.json", content)
    with atomic_path(arguments.out / "learning.md") as temporary:
        temporary.write_text(markdown(rows, arguments.millions, content), encoding="utf-8")
    print(f"written: {arguments.out / 'learning.json'}, {arguments.out / 'learning.md'}")


if __name__ == "__main__":
    main()
