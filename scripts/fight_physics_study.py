"""Automatic bouts under physics, with and without feedback, with and without posture optimisation, on the same seeds.

Example: python scripts/fight_physics_study.py --bouts 10 --seconds 60 -o results/fight_feedback

*planned*: the whole bout is drawn first and simulated then, up to its first fall (`simprep fight --no-feedback`).
*feedback*: it is simulated while it is drawn, and goes on after falls. The model has learned from two thirds of its
stream; distances to recorded distributions are to the other third.
*feedback_through* (only if asked for, by --arms): as *feedback*, but the fighters pass through each other: what contact
between them costs.

Every case (bout, arm) is written to OUT/cases as soon as it is done; a study that is started again goes on where it
was. Writes OUT/fight_physics.json and OUT/fight_physics.md. Computing times mean something only if nothing else runs.
"""

import argparse
import hashlib
import json
import sys
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from measuring.save import save_study
from simprep.duel.fight.default_model import fight_model
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.duel.fight.falls import KNOCK_DOWN_NS, KNOCK_DOWN_S, blows
from simprep.duel.fight.hits import STRIKING, JudgedContact
from simprep.duel.fight.live import LiveFight, LiveSettings
from simprep.duel.fight.modes import begin_fight
from simprep.duel.model.fight_model import FightModel, stream_digest
from simprep.duel.model.held_out import learn_before, split_frame
from simprep.errors import SimprepError
from simprep.metrics.evaluate import evaluate_run
from simprep.metrics.interaction.distributions import Distributions, distributions
from simprep.metrics.interaction.evaluate import FightResults, evaluate_fight, evaluate_live, recorded_facing
from simprep.metrics.interaction.stream import plain
from simprep.metrics.paired import bootstrap_median
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.settings import SimulationSettings
from simprep.physics.store import save_run
from simprep.physics.tracker import Tracker
from simprep.physics.yardstick import Yardstick
from simprep.report.results import provenance, save_json
from simprep.scene import SceneSettings

SCHEMA = "simprep.fight_physics_study/6"
ARMS = ("planned", "planned_optimised", "feedback", "feedback_optimised", "feedback_through")
SHOWN = {
    "end_s": "simulated s",
    "falls_unprovoked": "falls without a blow",
    "falls_after_collision": "of these after another collision",
    "knock_downs": "knock-downs",
    "got_up": "of all falls: up again",
    "mpjpe_mm": "MPJPE mm",
    "mpjpe_calm_mm": "the same, not in the 0.5 s after a blow, nobody down",
    "g_mpjpe_mm": "G-MPJPE mm",
    "touching_share": "share of the frames in which they touch",
    "touching_mm": "MPJPE while they touch, mean of fighters mm",
    "touching_global_mm": "G-MPJPE then mm",
    "apart_mm": "MPJPE while they do not mm",
    "apart_global_mm": "G-MPJPE then mm",
    "strike_miss_mm": "strikes miss by, median mm",
    "hits_intended_per_min": "attacks landed per minute",
    "hits_blocked_per_min": "attacks blocked per minute",
    "hits_unintended_per_min": "unintended contacts per minute",
    "attacks_per_min": "attacks per minute, both",
    "answered_share": "attacks answered in 0.5 s",
    "reacted_share": "blows of 5 N s or more reacted to",
    "distance_m": "distance, median m",
    "facing_deg": "facing of the pelvis, median deg",
    "facing_head_deg": "of the head",
    "js_distance": "JS to held-out data: distance",
    "js_facing": "JS: facing",
    "overlap_before_mean_mm": "overlap of what was tracked, mean mm",
    "overlap_after_mean_mm": "overlap simulated, mean mm",
    "overlap_after_max_mm": "the same, deepest mm",
    "slip_tracked_mm": "slip of a stance: tracked, without moves to where bodies are, mm",
    "slip_moved_mm": "tracked, with them, mm",
    "slip_simulated_mm": "simulated mm",
    "foot_slip_ratio": "slip ratio, without these moves",
    "moved_slip_ratio": "with them",
    "largest_blow_ns": "largest blow N s",
    "largest_peak_force_n": "largest contact force N",
    "com_cos_mm": "COM to support centre mm",
    "unconverged_steps": "steps in which contacts did not converge",
    "yardsticks": "yardsticks per second",
}
"""What the table shows, and how it is called. All are of the simulation, unless they say otherwise."""


STRIKES = {"speed_m_s": "speed m/s", "peak_force_n": "peak force N", "impulse_ns": "impulse N s"}
"""Of a strike: closing speed at its first touch, largest force of its contacts, impulse of all of them."""
HARD_N, DEEP_M = 11_000.0, 0.015
"""Contacts beyond one of these are kept one by one; all others are in OUT/cases only."""


def held_out(model: FightModel) -> Distributions:
    """What the model has not seen."""
    first, actions = model.learned_until or 0, model.model.graph.actions
    stream = model.stream.part(first, len(model.stream))
    inside = actions.start >= first
    clips = actions.clip[inside] - actions.clip[inside].min()
    table = np.stack(
        [actions.player[inside], actions.start[inside] - first, actions.end[inside] - first, clips], axis=1
    )
    return distributions(stream, table, actions.label[inside])


def numbers(results: FightResults, yardstick_s: float) -> dict[str, Any]:
    """Metrics of a simulated bout; None where one does not exist."""
    run, found = results.run, results.simulated
    assert run is not None
    assert found is not None
    simulated, minutes = found.simulated, run.end_s / 60
    com = [
        value
        for number in range(len(run.bodies))
        if isinstance(value := evaluate_run(run.body(number))["com_cos_mm"], float)
    ]
    out: dict[str, Any] = {
        "end": found.end,
        "end_s": found.end_s,
        "falls": [
            {**asdict(one), "knock_down": one.knock_down, "after_collision": one.after_collision}
            for one in results.falls
        ],
        "falls_unprovoked": sum(not one.knock_down for one in results.falls),
        "falls_after_collision": sum(one.after_collision for one in results.falls),
        "knock_downs": sum(one.knock_down for one in results.falls),
        "got_up": sum(one.up_s is not None for one in results.falls),
        "overlap_before_mean_mm": found.penetration_before.mean_mm,
        "slip_tracked_mm": found.slip_mm_per_stance[0],
        "slip_simulated_mm": found.slip_mm_per_stance[1],
        "foot_slip_ratio": found.foot_slip_ratio,
        "slip_moved_mm": found.moved_slip_mm,
        "moved_slip_ratio": found.moved_slip_ratio,
        "mpjpe_calm_mm": found.mpjpe_calm_mm,
        "touching_share": found.touching_share,
        **{
            f"{name}_of_fighters": [getattr(one, name) for one in found.fighters]
            for name in ("touching_mm", "touching_global_mm", "apart_mm", "apart_global_mm")
        },
        "reacted_share": found.reacted_share,
        "blows": found.blows,
        "largest_blow_ns": max((one.impulse_ns for one in blows(results.contacts)), default=0.0),
        "largest_peak_force_n": max((one.peak_force_n for one in run.contacts), default=0.0),
        "com_cos_mm": float(np.mean(com)) if com else None,
        "unconverged_steps": run.unconverged_steps,
        "assist_n": found.assist_n,
        "s_per_s": found.s_per_s,
        "yardstick_s": yardstick_s,
        "yardsticks": found.s_per_s / yardstick_s,
        "contacts": [asdict(one) for one in results.contacts],
    }
    if simulated is not None:
        out |= {
            "mpjpe_mm": simulated.mpjpe_mm,
            "g_mpjpe_mm": simulated.g_mpjpe_mm,
            "strike_miss_mm": simulated.strike_miss_mm and simulated.strike_miss_mm.median,
            **{
                f"hits_{name}_per_min": getattr(simulated.hits, name) / minutes
                for name in ("intended", "blocked", "unintended")
            },
            "attacks_per_min": sum(simulated.reactions.attacks_per_min),
            "answered_share": simulated.reactions.answered_share,
            "distance_m": simulated.distance_m.median,
            "facing_deg": simulated.facing_error_deg.median,
            "facing_head_deg": simulated.head_facing_error_deg.median,
            **{f"js_{name}": simulated.js.get(name) for name in ("bigram", "distance", "facing")},
            "overlap_after_mean_mm": simulated.penetration.mean_mm,
            "overlap_after_max_mm": simulated.penetration.max_mm,
        }
    for name in ("touching_mm", "touching_global_mm", "apart_mm", "apart_global_mm"):
        values = [one for one in out[f"{name}_of_fighters"] if np.isfinite(one)]
        out[name] = float(np.mean(values)) if values else None
    cleaned: dict[str, Any] = plain(out)
    return cleaned


def bout(
    model: FightModel,
    examples: ExampleMotions,
    recorded: Distributions,
    arm: str,
    options: argparse.Namespace,
    seed: int,
    tick: Callable[[float], None],
) -> FightResults:
    """One bout of one arm."""
    made = begin_fight(model, seed=seed, examples=examples)
    optimise, meet = arm.endswith("_optimised"), not arm.endswith("_through")
    physics = SimulationSettings(SceneSettings(bodies_meet=meet), mpc=MPC_PRESETS[options.preset])
    if arm.startswith("planned"):
        made.run(options.seconds)
        fight = made.fight(options.seconds)
        return evaluate_fight(fight, recorded, True, optimise, seed, tick, None, physics)
    tracker = Tracker(examples.bodies, None, seed, settings=physics)
    live = LiveFight(made, seed, tracker, optimise=optimise)
    live.run(options.seconds, tick)
    return evaluate_live(live, recorded, meet)


def case(
    path: Path, key: str, make: Callable[[], FightResults], yardstick: Yardstick, arm: str, seed: int
) -> dict[str, Any]:
    """One bout, from its file if that is of this very case."""
    if path.exists() and (known := json.loads(path.read_text(encoding="utf-8"))).get("case") == key:
        return dict(known)
    results = make()
    assert results.run is not None
    save_run(results.run, path.with_suffix(".npz"))
    content = {"case": key, "arm": arm, "seed": seed, **numbers(results, yardstick.seconds())}
    save_json(path, content)
    return content


def strikes(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Percentiles 5, 50, 95 of what strikes transfer that landed or were blocked, punches and kicks apart."""
    found: dict[str, list[tuple[float, float, float]]] = {"punch": [], "kick": []}
    for one in cases:
        contacts = [JudgedContact(**contact) for contact in one["contacts"]]
        for blow in blows(contacts):
            own = [c for c in contacts if c.intended and (c.attack, c.struck) == (blow.attack, blow.player)]
            first = min(own, key=lambda c: c.start_s)
            part = first.parts[first.bodies.index(first.attacker)].partition("_")[2]
            peak = max(c.peak_force_n for c in own)
            found[STRIKING[part]].append((first.closing_speed, peak, blow.impulse_ns))
    out: dict[str, Any] = {}
    for kind, values in found.items():
        out[kind] = {"n": len(values)}
        if values:
            out[kind] |= dict(zip(STRIKES, np.percentile(values, (5, 50, 95), axis=0).T.tolist(), strict=True))
    return out


def kept(case: dict[str, Any]) -> dict[str, Any]:
    """A case without its contacts but the hardest and deepest."""
    extreme = [one for one in case["contacts"] if one["peak_force_n"] > HARD_N or one["depth"] > DEEP_M]
    return {**case, "contacts": len(case["contacts"]), "extreme_contacts": extreme}


def summarise(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Medians and quartiles over bouts, and what is pooled over all of them."""
    minutes = sum(c["end_s"] for c in cases) / 60
    out: dict[str, Any] = {
        "n": len(cases),
        "ends": {end: sum(c["end"] == end for c in cases) for end in ("done", "fell", "diverged")},
        "minutes": minutes,
        "falls_unprovoked_per_min": sum(c["falls_unprovoked"] for c in cases) / minutes,
        "falls_after_collision_per_min": sum(c["falls_after_collision"] for c in cases) / minutes,
        "knock_downs_per_min": sum(c["knock_downs"] for c in cases) / minutes,
        "assist_n": max(c["assist_n"] for c in cases),
    }
    before, after = (
        sum((c.get(f"overlap_{when}_mean_mm") or 0.0) * c["end_s"] for c in cases) for when in ("before", "after")
    )
    out["overlap_cut_share"] = 1 - after / before if before else None
    for key in SHOWN:
        values = [c[key] for c in cases if c.get(key) is not None]
        if values:
            low, middle, high = np.percentile(values, (25, 50, 75))
            out[key] = {
                "median": middle, "q25": low, "q75": high, "min": min(values), "max": max(values), "n": len(values),
            }  # fmt: skip
    return out


def differences(done: dict[str, list[dict[str, Any]]], first: str, second: str) -> dict[str, Any]:
    """Second minus first, paired by seed: median, 95 % bootstrap interval, n."""
    other, rng = {c["seed"]: c for c in done[first]}, np.random.default_rng(0)
    out = {}
    for key in SHOWN:
        pairs = [(other[c["seed"]].get(key), c.get(key)) for c in done[second] if c["seed"] in other]
        values = [b - a for a, b in pairs if a is not None and b is not None]
        median, low, high = bootstrap_median(values, rng)
        out[key] = {"median": median, "low": low, "high": high, "n": len(values)}
    return out


def markdown(
    summaries: dict[str, Any], pairs: dict[str, Any], seconds: float, facing: dict[str, float], struck: dict[str, Any]
) -> str:
    """The tables."""
    first = next(iter(summaries.values()))
    lines = [
        f"{first['n']} automatic bouts of {seconds:g} s for each arm, the same seeds. A planned bout ends with its first fall, one"
        " with feedback goes on. Medians over bouts, quartiles in brackets. Falls per minute are over both fighters.",
        "",
        f"| | {' | '.join(summaries)} |",
        f"| --- |{' --- |' * len(summaries)}",
    ]

    def row(name: str, cells: list[str]) -> None:
        lines.append(f"| {name} | {' | '.join(cells)} |")

    row("to the end / fell / diverged", [" / ".join(str(v) for v in s["ends"].values()) for s in summaries.values()])
    row("minutes simulated", [f"{s['minutes']:.2f}" for s in summaries.values()])
    for name, key in (
        ("falls without a blow per minute", "falls_unprovoked_per_min"),
        ("of these after another collision per minute", "falls_after_collision_per_min"),
    ):
        row(name, [f"{s[key]:.2f}" for s in summaries.values()])
    row("knock-downs per minute", [f"{s['knock_downs_per_min']:.2f}" for s in summaries.values()])
    row(
        "mean overlap cut by",
        ["-" if (v := s["overlap_cut_share"]) is None else f"{100 * v:.1f} %" for s in summaries.values()],
    )
    for key, name in SHOWN.items():
        cells = [s.get(key) for s in summaries.values()]
        row(name, ["-" if v is None else f"{v['median']:.3g} ({v['q25']:.3g} to {v['q75']:.3g})" for v in cells])
    row("largest assist N", [f"{s['assist_n']:g}" for s in summaries.values()])
    for title, found in pairs.items():
        lines += ["", f"{title}: median of the differences, 95 % bootstrap interval, n.", "", "| | |", "| --- | --- |"]
        for key, name in SHOWN.items():
            v = found[key]
            if v["low"] is not None:
                row(name, [f"{v['median']:.3g} ({v['low']:.3g} to {v['high']:.3g}), n {v['n']}"])
    for arm, of_arm in struck.items():
        lines += ["", f"{arm}: strikes that landed or were blocked, percentiles 5, 50, 95.", ""]
        heads = [f"{kind}, n {v['n']}" for kind, v in of_arm.items()]
        lines += [f"| | {' | '.join(heads)} |", "| --- | --- | --- |"]
        for key, name in STRIKES.items():
            row(name, [", ".join(f"{x:.3g}" for x in v.get(key, ())) or "-" for v in of_arm.values()])
    lines += [
        "",
        f"The held-out examples themselves: facing of the pelvis {facing['pelvis']:.1f} deg, of the head"
        f" {facing['head']:.1f} deg (medians).",
    ]
    lines += [
        "",
        f"A fall is a knock-down within {KNOCK_DOWN_S:g} s of a blow of {KNOCK_DOWN_NS:g} N s or more: what an attack of the other"
        " meant. A collision is any other contact of that impulse, such as that of one's own kick.",
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bouts", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--model", type=Path, help="folder of a model; default: of the built-in kickboxing stream")
    parser.add_argument("--arms", nargs="+", choices=ARMS, default=list(ARMS[:4]))
    parser.add_argument("--preset", choices=list(MPC_PRESETS), default="default")
    parser.add_argument("-o", "--out", type=Path, default=Path("results/fight_feedback"))
    options = parser.parse_args()
    done: dict[str, list[dict[str, Any]]] = {arm: [] for arm in options.arms}
    try:
        model = fight_model(options.model)
        if model.learned_until is None:
            model = learn_before(model, split_frame(model))
        examples, recorded, yardstick = ExampleMotions.of(model.stream, model.model), held_out(model), Yardstick()
        whole = repr((stream_digest(model.stream), options.seconds, MPC_PRESETS[options.preset], LiveSettings()))
        with Progress(console=Console(stderr=True)) as progress:
            for seed in range(options.first_seed, options.first_seed + options.bouts):
                for arm in options.arms:
                    task = progress.add_task(f"bout {seed} {arm}", total=1.0)

                    def make(arm: str = arm, seed: int = seed, task: Any = task) -> FightResults:
                        def tick(share: float) -> None:
                            progress.update(task, completed=share)

                        return bout(model, examples, recorded, arm, options, seed, tick)

                    key = hashlib.sha256(repr((whole, arm, seed)).encode()).hexdigest()[:16]
                    result = case(options.out / "cases" / f"{arm}_{seed:02d}.json", key, make, yardstick, arm, seed)
                    progress.remove_task(task)
                    done[arm].append(result)
                    progress.console.print(
                        f"{arm} {seed}: {result['end']} {result['end_s']:.2f} s, {result['falls_unprovoked']} falls,"
                        f" {result['knock_downs']} knock-downs, MPJPE {result.get('mpjpe_mm') or 0:.0f} mm,"
                        f" {result['s_per_s'] or 0:.1f} s per s"
                    )
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    facing = recorded_facing(model, model.learned_until or 0)
    summaries = {arm: summarise(cases) for arm, cases in done.items()}
    compared = (
        ("planned", "feedback"), ("planned_optimised", "feedback_optimised"), ("feedback", "feedback_optimised"),
        ("planned", "planned_optimised"), ("feedback_through", "feedback"),
    )  # fmt: skip
    pairs = {f"{b} minus {a}": differences(done, a, b) for a, b in compared if a in done and b in done}
    struck = {arm: strikes(cases) for arm, cases in done.items()}
    with_feedback = [one for arm, cases in done.items() if arm in ARMS[2:4] for one in cases]
    if with_feedback:
        struck["both arms with feedback"] = strikes(with_feedback)
    content = {
        "schema": SCHEMA, **provenance(sys.argv), "bouts": options.bouts, "seconds": options.seconds,
        "preset": options.preset, "live": asdict(LiveSettings()), "mpc": asdict(MPC_PRESETS[options.preset]),
        "held_out_facing_deg": facing, "summary": summaries, "paired": pairs, "strikes": struck,
        "cases": [kept(one) for cases in done.values() for one in cases],
    }  # fmt: skip
    text = markdown(summaries, pairs, options.seconds, facing, struck)
    print(text)
    save_study(options.out, "fight_physics", content, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
