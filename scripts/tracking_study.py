"""Does `mpc` keep the humanoid on its feet? Every built-in motion, and captured clips where given, over several seeds.

Example: python scripts/tracking_study.py --clips FOLDER --motions walk jump --seeds 5 -o results/tracking

The built-in motions (loops for 3 s, the walk for 20 s); with --clips also every motion file in that folder and below
(cyclic ones for 6 s; what is longer than 20 s is cut there). A run counts as tracked if it is completed and the pelvis is
never 0.5 m from where it should be on the floor. Runs are shared among processes with one thread each; yardsticks
(`scripts/bench.py`) are half of their processor time, as if two cores had shared it. Writes OUT/tracking.json and
OUT/tracking.md.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from measuring.clips import motions
from measuring.runs import measured_run, rows_of
from measuring.save import save_study
from simprep.errors import SimprepError
from simprep.library import library_names
from simprep.motion.motion import Motion
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.settings import SimulationSettings
from simprep.physics.yardstick import Yardstick, yardsticks
from simprep.report.results import provenance

KEYS = ("mpjpe_mm", "g_mpjpe_mm", "farthest_m", "foot_slip_ratio", "penetration_mm", "yardsticks")
DIGITS = (1, 0, 2, 1, 1, 2)


Job = tuple[str, Motion, str, int]


def measured(job: Job) -> dict[str, Any]:
    name, motion, preset, seed = job
    _, row = measured_run(motion, seed, SimulationSettings(mpc=replace(MPC_PRESETS[preset], threads=1)))
    return {**row, "motion": name}


def markdown(summaries: list[dict[str, Any]], rows: list[dict[str, Any]], preset: str) -> str:
    whole = sum(s["tracked"] == s["n"] for s in summaries)
    lines = [
        f"`mpc`, preset `{preset}`, {len(summaries)} motions, {len(rows)} runs: {sum(r['tracked'] for r in rows)} tracked, "
        f"{sum(r['end'] == 'done' for r in rows)} completed; {whole} motions tracked with every seed.",
        "",
        "| motion | tracked | MPJPE mm | global mm | farthest m | slip ratio | penetration mm | yardsticks |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for s in summaries:
        lines.append(f"| {s['motion']} | {s['tracked']}/{s['n']} | {' | '.join(shown(s['median']))} |")
    lost = [r for r in rows if not r["tracked"]]
    lines += ["", "Not tracked:" if lost else "Not tracked: none.", ""]
    for r in lost:
        how = f"{r['farthest_m']:.2f} m away" if r["end"] == "done" else f"{r['end']} at {r['survived_s']:.2f} s"
        lines.append(f"- {r['motion']}, seed {r['seed']}: {how} ({r['end_reason']})")
    return "\n".join(lines) + "\n"


def shown(numbers: dict[str, float | None]) -> list[str]:
    values = [(numbers[key], digits) for key, digits in zip(KEYS, DIGITS, strict=True)]
    return ["-" if value is None else f"{value:.{digits}f}" for value, digits in values]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", type=Path, help="folder with capture files")
    parser.add_argument("--motions", nargs="*", default=list(library_names()), help="built-in motions; default all")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--preset", choices=MPC_PRESETS, default="default")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/tracking"))
    options = parser.parse_args()
    table = Table("motion", "s", "tracked", *KEYS)
    summaries = []
    try:
        chosen = motions(options.motions, options.clips)
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    yardstick_s = Yardstick().processor_seconds()
    jobs: list[Job] = [
        (name, motion, options.preset, seed) for name, motion in chosen.items() for seed in range(options.seeds)
    ]
    rows = rows_of(measured, jobs, options.processes)
    rows = [{**row, "yardsticks": yardsticks(row["cpu_s_per_s"], yardstick_s)} for row in rows]
    for name, motion in chosen.items():
        results = [row for row in rows if row["motion"] == name]
        numbers = {key: [float(r[key]) for r in results if r[key] is not None] for key in KEYS}
        median = {key: float(np.median(values)) if values else None for key, values in numbers.items()}
        worst = {key: max(values) if values else None for key, values in numbers.items()}
        tracked = sum(result["tracked"] for result in results)
        summaries.append({"motion": name, "n": len(results), "tracked": tracked, "median": median, "worst": worst})
        table.add_row(name, f"{motion.duration:.1f}", f"{tracked}/{len(results)}", *shown(median))
    content = {
        "schema": "simprep.tracking_study/2",
        **provenance(sys.argv),
        "preset": options.preset,
        "yardstick_s": yardstick_s,
    }
    content |= {"summary": summaries, "runs": rows}
    Console(width=130).print(table)
    save_study(options.out, "tracking", content, markdown(summaries, rows, options.preset))
    return 0


if __name__ == "__main__":
    sys.exit(main())
