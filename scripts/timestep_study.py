"""Do the study's results hang on the timestep? The default validation study at the default step and at half of it.

Example: python scripts/timestep_study.py --seeds 2 -o results/timestep

Per metric, the median over all `mpc` cases that succeeded at both steps, and how far halving moves it. The spread between
two sets of seeds at the same step is given beside it: a change below that spread is the sampling's, not the step's.
Only the world's step is halved; the planner's simulations keep theirs (they are part of the controller).
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from simprep.library import library_motion
from simprep.physics.track import TrackSettings
from simprep.report.record import provenance, write_json
from simprep.scene import DEFAULT_TIMESTEP_S
from simprep.study.plan import StudyPlan
from simprep.study.validate import run_study

TARGETS = ("punch_right", "kick_front", "crawl")
Cases = dict[tuple[str, int], dict[str, Any]]


def study(timestep: float, seeds: range, targets: list[str]) -> Cases:
    plan = StudyPlan(
        library_motion("walk"),
        tuple(library_motion(name) for name in targets),
        controllers=("mpc",),
        seeds=tuple(seeds),
    )
    default = TrackSettings()
    settings = replace(default, scene=replace(default.scene, timestep=timestep))

    def tell(what: str, done: float) -> None:
        if done == int(done):
            print(f"{timestep:.5f} s: {int(done)}/{len(plan.cases())} {what}", file=sys.stderr, flush=True)

    result = run_study(plan, tell, settings=settings)
    return {(item.case.scenario.slug, item.case.seed): dict(item.metrics) for item in result.results}


def medians(cases: Cases, keys: set[tuple[str, int]]) -> dict[str, float]:
    out = {}
    for metric in next(iter(cases.values())):
        values = [cases[key][metric] for key in sorted(keys)]
        if all(isinstance(value, float) for value in values):
            out[metric] = float(np.median(values))
    return out


def change(a: float, b: float) -> float:
    return abs(b - a) / max(abs(a), 1e-12)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--targets", nargs="+", default=list(TARGETS))
    parser.add_argument("--timestep", type=float, default=DEFAULT_TIMESTEP_S)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/timestep"))
    options = parser.parse_args()
    whole = study(options.timestep, range(options.seeds), options.targets)
    half = study(options.timestep / 2, range(options.seeds), options.targets)
    good = {key for key in whole if whole[key]["success"] and half[key]["success"]}
    a, b = medians(whole, good), medians(half, good)
    first = {key for key in good if key[1] % 2 == 0}
    second = {key for key in good if key[1] % 2 == 1}
    spread = {}
    if first and second:
        one, two = medians(whole, first), medians(whole, second)
        spread = {metric: change(one[metric], two[metric]) for metric in one if metric in two}
    table = Table("metric", "median", "half step", "change", "between seeds")
    rows = []
    for metric in a:
        if metric not in b:
            continue
        rows.append({"metric": metric, "median": a[metric], "half": b[metric], "change": change(a[metric], b[metric]), "between_seeds": spread.get(metric)})  # fmt: skip
        table.add_row(metric, f"{a[metric]:.4g}", f"{b[metric]:.4g}", f"{100 * rows[-1]['change']:.1f} %",
                      "-" if metric not in spread else f"{100 * spread[metric]:.1f} %")  # fmt: skip
    content = {
        "schema": "simprep.timestep_study/1", **provenance(sys.argv), "timestep_s": options.timestep, "seeds": options.seeds,
        "targets": options.targets,
        "n": len(good), "n_cases": len(whole), "failed": sum(not c["success"] for c in whole.values()),
        "failed_half": sum(not c["success"] for c in half.values()), "metrics": rows,
    }  # fmt: skip
    path = write_json(options.out / "timestep.json", content)
    Console(width=110).print(table)
    print(f"{len(good)} of {len(whole)} cases succeeded at both steps; written: {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
