"""Automatic bouts under physics, with and without posture optimisation of both fighters, on the same seeds.

Example: python scripts/fight_physics_study.py --bouts 10 --seconds 10 -o results/fight_physics

Every case (bout, arm) is written to OUT/cases as soon as it is done; a study that is started again goes on where it
was. Writes OUT/fight_physics.json and OUT/fight_physics.md. Computing times mean something only if nothing else runs.
"""

import argparse
import hashlib
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from measuring.save import save_study
from simprep.duel.fight.default_model import fight_model
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.duel.fight.fight import Fight
from simprep.duel.fight.hits import judge
from simprep.duel.fight.modes import begin_fight
from simprep.duel.fight.posture import optimise_fight_posture
from simprep.errors import SimprepError
from simprep.metrics.evaluate import evaluate_run
from simprep.metrics.interaction.run import run_metrics
from simprep.metrics.interaction.stream import falls_per_minute
from simprep.physics.run import Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import simulate
from simprep.physics.store import save_run
from simprep.report.results import provenance, save_json

SCHEMA = "simprep.fight_physics_study/2"
ARMS = ("plain", "optimised")
SHOWN = {
    "mpjpe_mm": "MPJPE mm",
    "g_mpjpe_mm": "G-MPJPE mm",
    "foot_slip_ratio": "foot slip ratio",
    "overlap_before_mean_mm": "overlap before, mean mm",
    "overlap_before_max_mm": "overlap before, max mm",
    "overlap_after_mean_mm": "overlap after, mean mm",
    "overlap_after_max_mm": "overlap after, max mm",
    "hits_intended": "attacks landed",
    "hits_blocked": "attacks blocked",
    "hits_unintended": "unintended contacts",
    "largest_impulse_ns": "largest impulse N s",
    "largest_peak_force_n": "largest contact force N",
    "torque_rms_nm": "torque RMS N m",
    "com_cos_mm": "COM to support centre mm",
    "end_s": "simulated s",
    "s_per_s": "s per s",
}
"""What the table shows, and how it is called."""
PER_FIGHTER = ("torque_rms_nm", "com_cos_mm", "saturation_share")
HITS = ("intended", "blocked", "unintended")


def bouts(count: int, seconds: float, model: Path | None) -> list[Fight]:
    """Automatic bouts, one for each seed."""
    whole = fight_model(model)
    examples = ExampleMotions.of(whole.stream, whole.model)
    made = [begin_fight(whole, seed=seed, examples=examples) for seed in range(count)]
    for one in made:
        one.run(seconds)
    return [one.fight(seconds) for one in made]


def numbers(run: Run, fight: Fight) -> dict[str, Any]:
    """Metrics of a simulated bout; None where one does not exist."""
    found = run_metrics(run, fight)
    simulated = found.simulated
    own = [evaluate_run(run.body(number)) for number in (0, 1)]
    both = {}
    for key in PER_FIGHTER:
        values = [value for one in own if isinstance(value := one[key], float)]
        both[key] = float(np.mean(values)) if values else None
    return {
        "end": found.end,
        "end_s": found.end_s,
        "end_reason": run.end_reason,
        "fallen": run.fallen,
        "mpjpe_mm": simulated and simulated.mpjpe_mm,
        "g_mpjpe_mm": simulated and simulated.g_mpjpe_mm,
        "foot_slip_ratio": found.foot_slip_ratio if simulated else None,
        "overlap_before_mean_mm": found.penetration_before.mean_mm,
        "overlap_before_max_mm": found.penetration_before.max_mm,
        "overlap_after_mean_mm": simulated and simulated.penetration.mean_mm,
        "overlap_after_max_mm": simulated and simulated.penetration.max_mm,
        **{f"hits_{name}": simulated and getattr(simulated.hits, name) for name in HITS},
        **both,
        "largest_impulse_ns": max((one.impulse_ns for one in run.contacts), default=0.0),
        "largest_peak_force_n": max((one.peak_force_n for one in run.contacts), default=0.0),
        "unconverged_steps": run.unconverged_steps,
        "rejected_samples": run.settings["rejected_samples"],
        "assist_n": found.assist_n,
        "s_per_s": found.s_per_s,
        "contacts": [asdict(one) for one in judge(run.contacts, fight)],
    }


def digest(fight: Fight, arm: str, settings: SimulationSettings) -> str:
    """What a case depends on, so that a stale file is not taken for it."""
    parts = [motion.qpos.tobytes() for motion in fight.stream.players]
    return hashlib.sha256(b"".join([*parts, repr((arm, settings, fight.actions)).encode()])).hexdigest()[:16]


def case(fight: Fight, arm: str, seed: int, folder: Path, settings: SimulationSettings, tick: Any) -> dict[str, Any]:
    """One bout, from its file if that is of this very case."""
    path, key = folder / f"{arm}_{seed:02d}.json", digest(fight, arm, settings)
    if path.exists() and (known := json.loads(path.read_text(encoding="utf-8"))).get("case") == key:
        return dict(known)
    posture = None
    if arm == "optimised":
        fight, changes = optimise_fight_posture(fight)
        posture = [asdict(one) for one in changes]
    run = simulate(fight.stream.players, "mpc", seed, settings, tick)
    save_run(run, folder / f"{arm}_{seed:02d}.npz")
    content = {"case": key, "arm": arm, "seed": seed, "posture": posture, **numbers(run, fight)}
    save_json(path, content)
    return content


def summarise(cases: list[dict[str, Any]]) -> dict[str, Any]:
    """Medians and quartiles over bouts, and what is pooled over all of them."""
    out: dict[str, Any] = {
        "n": len(cases),
        "ends": {end: sum(c["end"] == end for c in cases) for end in ("done", "fell", "diverged")},
    }
    out["falls_per_min"] = falls_per_minute([(c["end"], c["end_s"]) for c in cases])
    measured = [c for c in cases if c["overlap_after_mean_mm"] is not None]
    seconds = np.array([c["end_s"] for c in measured])
    means = {}
    for when in ("before", "after"):
        per_bout = np.array([c[f"overlap_{when}_mean_mm"] for c in measured])
        means[when] = float((per_bout * seconds).sum() / seconds.sum()) if measured else 0.0
    out["overlap_mean_mm"] = means
    out["overlap_cut_share"] = 1 - means["after"] / means["before"] if means["before"] else None
    out["unconverged_steps"] = sum(c["unconverged_steps"] for c in cases)
    out["assist_n"] = max(c["assist_n"] for c in cases)
    for key in SHOWN:
        values = [c[key] for c in cases if c[key] is not None]
        if values:
            low, middle, high = np.percentile(values, (25, 50, 75))
            out[key] = {
                "median": middle,
                "q25": low,
                "q75": high,
                "min": min(values),
                "max": max(values),
                "n": len(values),
            }
    return out


def markdown(summaries: dict[str, Any], seconds: float) -> str:
    """The table."""
    first = next(iter(summaries.values()))
    lines = [
        f"{first['n']} automatic bouts of {seconds:g} s for each arm, the same seeds; a bout ends with its first fall. Medians"
        " over bouts, quartiles in brackets.",
        "",
        f"| | {' | '.join(summaries)} |",
        f"| --- |{' --- |' * len(summaries)}",
    ]

    def row(name: str, cells: list[str]) -> None:
        lines.append(f"| {name} | {' | '.join(cells)} |")

    row("to the end / fell / diverged", [" / ".join(str(v) for v in s["ends"].values()) for s in summaries.values()])
    row("falls per minute", [f"{s['falls_per_min']:.1f}" for s in summaries.values()])
    for key, name in SHOWN.items():
        cells = []
        for s in summaries.values():
            v = s.get(key)
            cells.append("-" if v is None else f"{v['median']:.3g} ({v['q25']:.3g} to {v['q75']:.3g})")
        row(name, cells)
    row(
        "overlap, mean over all frames mm: before, after, cut",
        [
            "-"
            if s["overlap_cut_share"] is None
            else f"{s['overlap_mean_mm']['before']:.2f}, {s['overlap_mean_mm']['after']:.3f}, {100 * s['overlap_cut_share']:.1f} %"
            for s in summaries.values()
        ],
    )
    row("steps in which the contact solver did not converge", [str(s["unconverged_steps"]) for s in summaries.values()])
    row("largest assist N", [f"{s['assist_n']:g}" for s in summaries.values()])
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bouts", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--model", type=Path, help="folder of a model; default: of the built-in kickboxing stream")
    parser.add_argument("--arms", nargs="+", choices=ARMS, default=list(ARMS))
    parser.add_argument("-o", "--out", type=Path, default=Path("results/fight_physics"))
    options = parser.parse_args()
    settings = SimulationSettings()
    folder = options.out / "cases"
    done: dict[str, list[dict[str, Any]]] = {arm: [] for arm in options.arms}
    try:
        fights = bouts(options.bouts, options.seconds, options.model)
        with Progress(console=Console(stderr=True)) as progress:
            for seed, fight in enumerate(fights):
                for arm in options.arms:
                    task = progress.add_task(f"bout {seed} {arm}", total=1.0)
                    result = case(
                        fight,
                        arm,
                        seed,
                        folder,
                        settings,
                        lambda share, task=task: progress.update(task, completed=share),
                    )
                    progress.remove_task(task)
                    done[arm].append(result)
                    progress.console.print(
                        f"{arm} {seed}: {result['end']} {result['end_s']:.2f} s, MPJPE {result['mpjpe_mm'] or 0:.0f} mm, overlap "
                        f"{result['overlap_before_mean_mm']:.2f} to {result['overlap_after_mean_mm'] or 0:.3f} mm, "
                        f"{result['hits_intended']} landed, {result['s_per_s'] or 0:.1f} s per s"
                    )
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    summaries = {arm: summarise(cases) for arm, cases in done.items()}
    content = {
        "schema": SCHEMA, **provenance(sys.argv), "bouts": options.bouts, "seconds": options.seconds,
        "settings": {
            "timestep_s": settings.scene.timestep,
            "friction": settings.scene.friction,
            **{name: asdict(getattr(settings, name)) for name in ("reference", "mpc", "fall")},
        },
        "summary": summaries, "cases": [one for cases in done.values() for one in cases],
    }  # fmt: skip
    text = markdown(summaries, options.seconds)
    print(text)
    save_study(options.out, "fight_physics", content, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
