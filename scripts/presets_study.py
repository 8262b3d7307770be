"""What the presets of `mpc` cost, how near they come to the motion, and whether they fall: the table of docs/tracking.md.

Example: python scripts/presets_study.py walk.txt kick.txt --presets live default --seeds 10 -o results/presets

Each file is tracked once as it is, over several seeds. A run's row has root-relative and global MPJPE, how much the joints accelerate
(mean of all hinges at 30 frames/s, as a multiple of the reference's), and yardsticks (`scripts/bench.py`), as half of its processor
time. Runs are shared among processes with one thread each. Writes OUT/presets.json and OUT/presets.md.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from measuring.runs import lost_runs, measured_run, rows_of
from measuring.save import save_study
from simprep.arrays import FloatArray
from simprep.errors import SimprepError
from simprep.motion.edit import resample
from simprep.motion.load import load_motion
from simprep.motion.motion import Motion
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.settings import SimulationSettings
from simprep.physics.yardstick import Yardstick, yardsticks
from simprep.report.results import provenance

ACCELERATION_FPS = 30.0
KEPT = (
    "motion", "preset", "seed", "done", "tracked", "end_reason", "survived_s", "duration_s", "mpjpe_mm", "g_mpjpe_mm", "farthest_m",
    "acceleration_ratio", "assist_n", "yardsticks",
)  # fmt: skip
"""What is written of a run."""
Job = tuple[Motion, str, int]


def hinge_acceleration(qpos: FloatArray, motion: Motion) -> float:
    """Mean size of the hinges' accelerations in poses at the frame rate of a motion, read at 30 frames/s [rad/s^2]."""
    hinges = resample(
        replace(motion, qpos=qpos, contacts=motion.contacts[: len(qpos)], events={}, loop=False), ACCELERATION_FPS
    ).qpos[:, 7:]
    return float(np.abs(np.diff(hinges, n=2, axis=0)).mean() * ACCELERATION_FPS**2)


def measured(job: Job) -> dict[str, Any]:
    motion, preset, seed = job
    run, row = measured_run(motion, seed, SimulationSettings(mpc=replace(MPC_PRESETS[preset], threads=1)))
    reference = run.reference
    ratio = hinge_acceleration(run.qpos, reference) / hinge_acceleration(reference.qpos[: len(run.qpos)], reference)
    return {**row, "preset": preset, "acceleration_ratio": ratio}


def words(row: dict[str, Any]) -> str:
    return f"{row['motion']}, `{row['preset']}`, seed {row['seed']}"


def markdown(rows: list[dict[str, Any]]) -> str:
    lines = [
        "Root-relative MPJPE and yardsticks: median (least to largest); global MPJPE: median; acceleration: mean. Of runs that were done.",
        "",
        "| preset | motion | done | MPJPE mm | global mm | acceleration | yardsticks |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for preset, name in dict.fromkeys((row["preset"], row["motion"]) for row in rows):
        own = [row for row in rows if (row["preset"], row["motion"]) == (preset, name)]
        done = [row for row in own if row["done"]]
        words = ["-"] * 4
        if done:
            error, place, ratio, cost = (
                np.array([row[key] for row in done])
                for key in ("mpjpe_mm", "g_mpjpe_mm", "acceleration_ratio", "yardsticks")
            )
            words = [
                f"{np.median(error):.1f} ({error.min():.1f} to {error.max():.1f})", f"{np.median(place):.0f}", f"{ratio.mean():.2f}",
                f"{np.median(cost):.2f} ({cost.min():.2f} to {cost.max():.2f})",
            ]  # fmt: skip
        lines.append(f"| `{preset}` | {name} | {len(done)}/{len(own)} | {' | '.join(words)} |")
    return "\n".join([*lines, *lost_runs(rows, "Not done", words)]) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, help="motion files")
    parser.add_argument("--presets", nargs="+", choices=MPC_PRESETS, default=list(MPC_PRESETS))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/presets"))
    options = parser.parse_args()
    try:
        motions = [load_motion(file) for file in options.files]
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    yardstick_s = Yardstick().processor_seconds()
    jobs: list[Job] = [
        (motion, preset, seed) for preset in options.presets for motion in motions for seed in range(options.seeds)
    ]
    rows = rows_of(measured, jobs, options.processes, words)
    rows = [{**row, "yardsticks": yardsticks(row["cpu_s_per_s"], yardstick_s)} for row in rows]
    content = {"schema": "simprep.presets_study/1", **provenance(sys.argv), "yardstick_s": yardstick_s}
    content |= {"runs": [{key: row[key] for key in KEPT} for row in rows]}
    save_study(options.out, "presets", content, markdown(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
