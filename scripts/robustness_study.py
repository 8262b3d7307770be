"""What a wrong model costs `mpc`: clips tracked in worlds that differ from what the controller knows.

Example: python scripts/robustness_study.py --clips FOLDER --seeds 1 -o results/robustness

Conditions: a body 10 % lighter or heavier, motors 15 % weaker or stronger, friction 0.6 or 1.2 (believed: 1), states 10 ms
old, noisy states, and, with --kicks, kicks of the root every 1 to 3 s. Clips and the rule for *tracked* are those of
`scripts/tracking_study.py`. Runs are shared among processes with one thread each; yardsticks are half of their processor
time, as if two cores had shared it. Writes OUT/robustness.json and OUT/robustness.md.
"""

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from measuring.clips import motions
from measuring.runs import measured_run, rows_of
from measuring.save import save_study
from simprep.errors import SimprepError
from simprep.motion.motion import Motion
from simprep.physics.mismatch import Mismatch
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.pushes import random_kicks
from simprep.physics.settings import SimulationSettings
from simprep.physics.yardstick import Yardstick, yardsticks
from simprep.report.results import provenance

CONDITIONS = {
    "nominal": Mismatch(),
    "mass -10 %": Mismatch(mass_scale=0.9),
    "mass +10 %": Mismatch(mass_scale=1.1),
    "motors -15 %": Mismatch(strength=0.85),
    "motors +15 %": Mismatch(strength=1.15),
    "friction 0.6": Mismatch(friction=0.6),
    "friction 1.2": Mismatch(friction=1.2),
    "delay 10 ms": Mismatch(delay_s=0.01),
    "noise 1": Mismatch(noise=1.0),
}
Job = tuple[str, str, Motion, int, str, bool]


def measured(job: Job) -> dict[str, Any]:
    condition, name, motion, seed, preset, kicked = job
    kicks = random_kicks(seed, motion.duration) if kicked else ()
    settings = SimulationSettings(
        mpc=replace(MPC_PRESETS[preset], threads=1), kicks=kicks, mismatch=CONDITIONS[condition]
    )
    _, row = measured_run(motion, seed, settings)
    return {**row, "condition": condition, "motion": name, "kicks": len(kicks)}


def summary(rows: list[dict[str, Any]], yardstick_s: float) -> Iterator[dict[str, Any]]:
    for condition in CONDITIONS:
        own = [row for row in rows if row["condition"] == condition]
        if own:
            medians = {
                key: float(np.median([row[key] for row in own if row[key] is not None]))
                for key in ("mpjpe_mm", "g_mpjpe_mm", "cpu_s_per_s")
            }
            yield {
                "condition": condition,
                "n": len(own),
                "done": sum(row["done"] for row in own),
                "tracked": sum(row["tracked"] for row in own),
                "mpjpe_mm": medians["mpjpe_mm"],
                "g_mpjpe_mm": medians["g_mpjpe_mm"],
                "yardsticks": yardsticks(medians["cpu_s_per_s"], yardstick_s),
            }


def markdown(table: list[dict[str, Any]], rows: list[dict[str, Any]]) -> str:
    lines = [
        "| world | done | tracked | MPJPE mm | global mm | yardsticks |",
        "| --- | --- | --- | --- | --- | --- |",
        *(
            f"| {one['condition']} | {one['done']}/{one['n']} | {one['tracked']}/{one['n']} | {one['mpjpe_mm']:.0f} | "
            f"{one['g_mpjpe_mm']:.0f} | {one['yardsticks']:.2f} |"
            for one in table
        ),
        "",
        "Not completed:",
        "",
    ]
    lost = [row for row in rows if not row["done"]]
    for row in sorted(lost, key=lambda row: (row["motion"], row["condition"])):
        lines.append(
            f"- {row['motion']}, {row['condition']}, seed {row['seed']}: {row['survived_s']:.2f} s ({row['end_reason']})"
        )
    return "\n".join(lines if lost else [*lines[:-2], "All were completed."]) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", type=Path, help="folder with capture files")
    parser.add_argument("--motions", nargs="*", default=[], help="built-in motions; default none")
    parser.add_argument("--conditions", nargs="+", choices=CONDITIONS, default=list(CONDITIONS))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--kicks", action="store_true", help="kick the root as well")
    parser.add_argument("--preset", choices=MPC_PRESETS, default="default")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/robustness"))
    options = parser.parse_args()
    try:
        chosen = motions(options.motions, options.clips)
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    if not chosen:
        parser.error("no clip and no motion; valid: --clips FOLDER, --motions NAME ...")
    jobs: list[Job] = [
        (condition, name, motion, seed, options.preset, options.kicks)
        for condition in options.conditions
        for name, motion in chosen.items()
        for seed in range(options.first_seed, options.first_seed + options.seeds)
    ]
    yardstick_s = Yardstick().processor_seconds()
    rows = rows_of(
        measured, jobs, options.processes, lambda row: f"{row['condition']}, {row['motion']}, seed {row['seed']}"
    )
    table = list(summary(rows, yardstick_s))
    content = {
        "schema": "simprep.robustness_study/1",
        **provenance(sys.argv),
        "preset": options.preset,
        "kicks": options.kicks,
        "yardstick_s": yardstick_s,
        "summary": table,
        "runs": rows,
    }
    text = markdown(table, rows)
    print(text)
    save_study(options.out, "robustness", content, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
