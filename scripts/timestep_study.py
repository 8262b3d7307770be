"""Do the study's results hang on the timestep? The default validation study at the default step and at half of it.

Example: python scripts/timestep_study.py --seeds 3 -o results/timestep

Per metric, the median over all `mpc` cases that succeeded at both steps and how far halving moves it, over all and per
target; and the median of the paired differences (same scenario, same seed) with its bootstrap interval. Medians over
targets as different as a punch and a crawl lie between two heaps and jump when one case changes sides, pairs do not.
An interval that holds zero says that the change is the sampling's, not the step's.
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
from simprep.metrics.paired import paired_differences
from simprep.physics.settings import SimulationSettings
from simprep.report.results import provenance, save_json
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
    default = SimulationSettings()
    settings = replace(default, scene=replace(default.scene, timestep=timestep))

    def tell(what: str, done: float) -> None:
        if done == int(done):
            print(f"{timestep:.5f} s: {int(done)}/{len(plan.cases())} {what}", file=sys.stderr, flush=True)

    result = run_study(plan, tell, settings=settings)
    return {(item.case.condition.slug, item.case.seed): dict(item.metrics) for item in result.results}


def median(values: list[Any]) -> float | None:
    numbers = [float(value) for value in values if isinstance(value, float)]
    return float(np.median(numbers)) if numbers else None


def share(change: float | None, size: float | None) -> float | None:
    return None if change is None or size is None else abs(change) / max(abs(size), 1e-12)


def compare(whole: Cases, half: Cases, targets: list[str]) -> list[dict[str, Any]]:
    """Per metric: medians at both steps, per target too, and the median of the paired differences with its interval."""
    good = sorted(key for key in whole if whole[key]["success"] and half[key]["success"])
    rows = []
    cases = [
        {**metrics[key], "arm": step, "target": key[0], "alpha": 0, "seed": key[1], "controller": "mpc"}
        for step, metrics in (("whole", whole), ("half", half))
        for key in good
    ]
    paired = paired_differences(cases, "half", "whole", np.random.default_rng(0))["mpc"]
    for metric, difference in paired.items():
        one, two = ([cases[key][metric] for key in good] for cases in (whole, half))
        a, b = median(one), median(two)
        if a is None or b is None:
            continue
        spread = median([abs(x - a) for x in one if isinstance(x, float)])
        of_target = {}
        for target in targets:
            keys = [key for key in good if key[0].startswith(target)]
            x, y = median([whole[key][metric] for key in keys]), median([half[key][metric] for key in keys])
            of_target[target] = {"n": len(keys), "median": x, "half": y, "change_share": None if x is None or y is None else share(y - x, x)}  # fmt: skip
        rows.append({
            "metric": metric, "n": difference["n"], "median": a, "half": b, "change_share": share(b - a, a),
            "median_absolute_deviation": spread, "paired_median": difference["median"], "paired_low": difference["low"],
            "paired_high": difference["high"], "paired_share": share(difference["median"], a), "targets": of_target,
        })  # fmt: skip
    return rows


def show(rows: list[dict[str, Any]], targets: list[str]) -> Table:
    def percent(value: float | None) -> str:
        return "-" if value is None else f"{100 * value:.1f} %"

    table = Table("metric", "median", "half step", "change", "paired", "95 % interval", *targets)
    for row in rows:
        interval = "-" if row["paired_low"] is None else f"{row['paired_low']:+.3g} to {row['paired_high']:+.3g}"
        table.add_row(
            row["metric"], f"{row['median']:.4g}", f"{row['half']:.4g}", percent(row["change_share"]),
            percent(row["paired_share"]), interval, *(percent(row["targets"][t]["change_share"]) for t in targets),
        )  # fmt: skip
    return table


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--targets", nargs="+", default=list(TARGETS))
    parser.add_argument("--timestep", type=float, default=DEFAULT_TIMESTEP_S)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/timestep"))
    options = parser.parse_args()
    whole = study(options.timestep, range(options.seeds), options.targets)
    half = study(options.timestep / 2, range(options.seeds), options.targets)
    rows = compare(whole, half, options.targets)
    content = {
        "schema": "simprep.timestep_study/2", **provenance(sys.argv), "timestep_s": options.timestep, "seeds": options.seeds,
        "targets": options.targets, "n_cases": len(whole), "failed": sum(not c["success"] for c in whole.values()),
        "failed_half": sum(not c["success"] for c in half.values()), "metrics": rows,
        "cases": [{"scenario": key[0], "seed": key[1], "whole": whole[key], "half": half[key]} for key in sorted(whole)],
    }  # fmt: skip
    path = save_json(options.out / "timestep.json", content)
    Console(width=170).print(show(rows, options.targets))
    print(f"{rows[0]['n']} of {len(whole)} cases succeeded at both steps; written: {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
