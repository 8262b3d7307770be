"""How well `mpc` tracks clips on a robot: falls, errors, torque and speed limits.

Example: python scripts/robot_study.py --robot path/to/g1.xml --file-fps 60 walk.txt karate.csv --seeds 5 -o results/robot

Files of people are retargeted; loops are repeated to 6 s. Runs are shared among processes with one thread each;
yardsticks are half of their processor time, as if two cores had shared it. Writes OUT/robot.json and OUT/robot.md.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from measuring.runs import measured_run, rows_of
from measuring.save import save_study
from simprep.characters import character_of_name
from simprep.cli.resolve import select
from simprep.errors import SimprepError
from simprep.motion.load import import_motion
from simprep.motion.motion import Motion
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.settings import SimulationSettings
from simprep.physics.yardstick import Yardstick, yardsticks
from simprep.report.results import provenance

Job = tuple[Motion, int, str]


def measured(job: Job) -> dict[str, Any]:
    motion, seed, preset = job
    run, row = measured_run(motion, seed, SimulationSettings(mpc=replace(MPC_PRESETS[preset], threads=1)))
    peak = float((np.abs(run.torque) / run.torque_limit).max()) if run.steps else None
    return {**row, "peak_torque_share": peak}


def markdown(rows: list[dict[str, Any]], yardstick_s: float) -> str:
    keys = ("mpjpe_mm", "g_mpjpe_mm", "penetration_mm", "cpu_s_per_s")
    lines = [
        "| clip | length | without a fall | MPJPE mm | global mm | deepest mm | largest speed / limit | yardsticks |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name in dict.fromkeys(row["motion"] for row in rows):
        own = [row for row in rows if row["motion"] == name]
        own_medians = [float(np.median([row[key] for row in own if row[key] is not None])) for key in keys]
        peaks = [row["peak_speed_share"] for row in own if row["peak_speed_share"] is not None]
        speed = f"{max(peaks):.2f}" if peaks else "-"
        done = sum(row["done"] for row in own)
        lines.append(
            f"| {name} | {own[0]['duration_s']:.1f} s | {done}/{len(own)} | {own_medians[0]:.0f} | {own_medians[1]:.0f} | "
            f"{own_medians[2]:.0f} | {speed} | {yardsticks(own_medians[3], yardstick_s):.2f} |"
        )
    lost = [row for row in rows if not row["done"]]
    lines += [
        "",
        *(f"- {row['motion']}, seed {row['seed']}: {row['survived_s']:.2f} s, {row['end_reason']}" for row in lost),
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--robot", required=True)
    parser.add_argument("--file-fps", type=float, help="frame rate of .csv files, which do not state it")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--preset", choices=MPC_PRESETS, default="default")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/robot"))
    options = parser.parse_args()
    motions = []
    try:
        robot = character_of_name(options.robot)
        for file in options.files:
            rate = options.file_fps if file.suffix == ".csv" else None
            result = import_motion(file, fps=rate, character=robot, file_fps=rate)
            motions.append(select(result.motion, None, None if not result.motion.loop else 6.0, print))
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    yardstick_s = Yardstick().processor_seconds()
    jobs: list[Job] = [(motion, seed, options.preset) for motion in motions for seed in range(options.seeds)]
    rows = rows_of(measured, jobs, options.processes)
    content = {"schema": "simprep.robot_study/1", **provenance(tuple(sys.argv)), "robot": robot.name, "runs": rows}
    text = markdown(rows, yardstick_s)
    save_study(options.out, "robot", content | {"yardstick_s": yardstick_s}, text)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
