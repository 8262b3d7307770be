"""Passive and interactive mode in the simulation: are attacks answered, and requests?

As `scripts/fight_study.py` has it, but with both bodies simulated while the fight is drawn (`simprep.duel.fight.live`). In
passive bouts, held-out attacks of either fighter are answered or not by what the truth counts as fitting. In interactive bouts,
fighter A is asked for kinds of attack and for places at random times; a place is where a random example would lead from where
the body is.

Example: python scripts/fight_modes_study.py --bouts 4 --seconds 30 --first-seed 300 -o results/fight_modes
"""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from measuring.fights import ATTACKS_ASKED_FOR, Setup, answered, reach_of, set_up, ways
from measuring.save import save_study
from simprep.duel.fight.live import LiveFight
from simprep.duel.fight.modes import begin_fight
from simprep.duel.labels.labels import ATTACKING_QUALIFIERS, Label
from simprep.duel.model.structures import REQUESTS
from simprep.metrics.paired import bootstrap_median
from simprep.motion.edit import yaw
from simprep.motion.turns import turned
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.report.results import provenance

SCHEMA = "simprep.fight_modes_study/1"
LAST_S = 3.0
"""Nothing is asked for in the last seconds of a bout: it could not be answered in time [s]."""
PAUSES_S = (1.8, 3.2)
"""Time between two requests [s], as in `scripts/fight_study.py`."""


def passive_bout(setup: Setup, seed: int, seconds: float, preset: str) -> dict[str, Any]:
    """One bout; who attacks takes turns with the seed."""
    attacker = seed % 2
    live = LiveFight(begin_fight(setup.model, "passive", seed, attacker, examples=setup.examples), seed, preset=preset)
    live.run(seconds)
    attacks, fitting, any_react, fast, unknown = answered(setup, live.result().fight, attacker)
    return {
        "seed": seed, "attacks": attacks, "answered": fitting, "answered_with_any_react": any_react,
        "answered_in_half_a_second": fast, "not_judged": unknown, **end_of(live),
    }  # fmt: skip


def interactive_bout(setup: Setup, seed: int, seconds: float, preset: str) -> dict[str, Any]:
    """One bout; every request asks for a kind of attack and a place."""
    rng, reached, kinds = np.random.default_rng([seed, 1]), ways(setup), ATTACKS_ASKED_FOR
    made = begin_fight(setup.model, "interactive", seed, examples=setup.examples)
    live, avatar, asked, clock = LiveFight(made, seed, preset=preset), made.avatar, [], 1.0
    assert avatar is not None
    while clock < seconds - LAST_S:
        live.run(clock)
        if live.tracker.end:
            break
        pose = live.tracker.state.bodies_qpos[0]
        way = turned(reached[rng.integers(len(reached))], float(yaw(pose[3:7])))
        goal = (float(pose[0] + way[0]), float(pose[1] + way[1]))
        asked.append(avatar.request(kinds[rng.integers(len(kinds))], goal, live.time))
        clock += rng.uniform(*PAUSES_S)
    live.run(seconds)
    run, delay = live.result().run, setup.model.model.goal_delay
    requests = []
    for request in asked:
        answers = [one for one in avatar.answers if one.request is request]
        row: dict[str, Any] = {"asked_s": request.time, "choices": None, "replaced": False}
        if answers and answers[0].choices == 0:
            row["replaced"] = True
        elif answers:
            answer = answers[0]
            row |= {"choices": answer.choices, "begins_s": answer.begins}
            if setup.match[answer.example] >= 0:
                label = Label.from_code(int(setup.truth.codes[setup.match[answer.example]]))
                row["right_by_truth"] = any(
                    getattr(label, aspect) in ATTACKING_QUALIFIERS[aspect] for aspect in REQUESTS[request.action]
                )
            if answer.begins + delay <= run.end_s and request.goal is not None:
                began, there = (
                    run.body(0).qpos[round(at / run.timestep), :2] for at in (answer.begins, answer.begins + delay)
                )
                row["way_m"] = float(np.linalg.norm(np.subtract(request.goal, began)))
                row["goal_error_m"] = float(np.linalg.norm(np.subtract(request.goal, there)))
        requests.append(row)
    return {"seed": seed, "requests": requests, **end_of(live)}


def end_of(live: LiveFight) -> dict[str, Any]:
    """How a bout ended."""
    run = live.result().run
    return {"end": run.end, "end_s": run.end_s, "falls": len(live.falls), "s_per_s": live.wall_s / run.end_s}


def passive_summary(bouts: list[dict[str, Any]]) -> dict[str, Any]:
    """All attacks of all bouts together."""
    attacks = sum(one["attacks"] for one in bouts)
    out: dict[str, Any] = {"bouts": len(bouts), "attacks": attacks}
    for key in ("answered", "answered_with_any_react", "answered_in_half_a_second"):
        out[f"{key}_share"] = sum(one[key] for one in bouts) / attacks if attacks else None
    return out


def interactive_summary(bouts: list[dict[str, Any]], reach: float) -> dict[str, Any]:
    """All requests of all bouts together that no newer one replaced; goals within reach of the examples where answers began."""
    counted = [row for one in bouts for row in one["requests"] if not row["replaced"]]
    judged = [row["right_by_truth"] for row in counted if "right_by_truth" in row]
    near = [row["goal_error_m"] for row in counted if row.get("way_m", np.inf) <= reach]
    far = [row["goal_error_m"] for row in counted if row.get("way_m", -1.0) > reach]
    out: dict[str, Any] = {"bouts": len(bouts), "requests": len(counted), "reach_m": reach}
    if counted:
        for name, most in (("next_action_share", 1), ("within_two_actions_share", 2)):
            out[name] = float(np.mean([row["choices"] is not None and row["choices"] <= most for row in counted]))
        out["unanswered"] = sum(row["choices"] is None for row in counted)
    out["right_by_truth_share"] = float(np.mean(judged)) if judged else None
    for name, errors in (("within_reach", near), ("all", near + far)):
        median, low, high = bootstrap_median(errors, np.random.default_rng(0))
        out[f"goal_error_{name}_m"] = {"median": median, "low": low, "high": high, "n": len(errors)}
    return out


def markdown(study: dict[str, Any]) -> str:
    """What was found, in two tables."""
    lines = [f"Simulated bouts of {study['seconds']:g} s, preset `{study['preset']}`, seeds {study['seeds']}."]
    for mode in ("passive", "interactive"):
        if mode in study:
            lines += ["", f"## {mode.capitalize()}", "", "| | |", "| --- | --- |"]
            bouts = study[mode]["bouts"]
            ends = {end: sum(one["end"] == end for one in bouts) for end in ("done", "diverged")}
            lines.append(
                f"| bouts done, diverged; falls | {ends['done']}, {ends['diverged']}; {sum(one['falls'] for one in bouts)} |"
            )
            for key, value in study[mode]["summary"].items():
                text = value
                if isinstance(value, dict):
                    text = "-" if value["median"] is None else f"{value['median']:.3f}, n {value['n']}"
                elif isinstance(value, float):
                    text = f"{value:.3f}"
                lines.append(f"| {key} | {text} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bouts", type=int, default=4, help="of each mode")
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--modes", nargs="+", choices=("passive", "interactive"), default=["passive", "interactive"])
    parser.add_argument("--preset", choices=list(MPC_PRESETS), default="default")
    parser.add_argument("-o", "--out", type=Path, default=Path("results/fight_modes"))
    options = parser.parse_args()
    setup, seeds = set_up("kickboxing", 0), range(options.first_seed, options.first_seed + options.bouts)
    makers: dict[str, Callable[[Setup, int, float, str], dict[str, Any]]] = {
        "passive": passive_bout, "interactive": interactive_bout,
    }  # fmt: skip
    study: dict[str, Any] = {
        "schema": SCHEMA, **provenance(sys.argv), "seconds": options.seconds, "preset": options.preset,
        "seeds": f"{seeds[0]} to {seeds[-1]}",
    }  # fmt: skip
    for mode in options.modes:
        bouts = []
        for seed in seeds:
            bouts.append(makers[mode](setup, seed, options.seconds, options.preset))
            print(f"{mode}, bout {seed}: {bouts[-1]['end_s']:.1f} s, {bouts[-1]['falls']} falls", file=sys.stderr)
        summary = passive_summary(bouts) if mode == "passive" else interactive_summary(bouts, reach_of(setup))
        study[mode] = {"summary": summary, "bouts": bouts}
    text = markdown(study)
    print(text)
    save_study(options.out, "fight_modes", study, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
