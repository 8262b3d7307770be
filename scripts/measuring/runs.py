"""One simulated run of a study, and what every study of tracking says of it."""

import sys
from collections.abc import Callable, Sequence
from time import process_time
from typing import Any, TypeVar

import numpy as np

from measuring.clips import FARTHEST_M
from measuring.processes import each_result
from simprep.metrics.evaluate import evaluate_run
from simprep.motion.motion import Motion
from simprep.physics.run import DONE, Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track

Job = TypeVar("Job")


def rows_of(
    measured: Callable[[Job], dict[str, Any]],
    jobs: Sequence[Job],
    processes: int,
    words: Callable[[dict[str, Any]], str] = lambda row: f"{row['motion']}, seed {row['seed']}",
) -> list[dict[str, Any]]:
    """One row for each job, made in several processes, in the order of the jobs; each is said on stderr.

    Args:
        measured: makes the row of a job; a function of a module.
        jobs: what to measure.
        processes: how many at a time.
        words: what a row is about.
    """
    rows: dict[int, dict[str, Any]] = {}
    for number, row in each_result(measured, jobs, processes):
        rows[number] = row
        end = "done" if row["done"] else row["end_reason"]
        print(f"{len(rows)}/{len(jobs)} {words(row)}: {end}", file=sys.stderr, flush=True)
    return [rows[number] for number in range(len(jobs))]


def lost_runs(rows: Sequence[dict[str, Any]], heading: str, words: Callable[[dict[str, Any]], str]) -> list[str]:
    """Lines of Markdown that tell the runs that were not done: a heading, and when and why each ended.

    Args:
        rows: of `measured_run`.
        heading: `Fallen`.
        words: what a row is about.
    """
    lost = [row for row in rows if not row["done"]]
    told = [f"- {words(row)}: {row['survived_s']:.2f} s ({row['end_reason']})" for row in lost]
    return ["", f"{heading}:", "", *told] if lost else ["", f"{heading}: none."]


def measured_run(motion: Motion, seed: int, settings: SimulationSettings) -> tuple[Run, dict[str, Any]]:
    """Track a motion with `mpc`; the run, and the row of a study about it.

    A row has all metrics, the name and length [s] of the motion, seed, `done`, `tracked` (done, and the pelvis never
    farther than `FARTHEST_M` from its place on the floor), `farthest_m`, `cpu_s_per_s` (processor time for each second that
    was simulated; None if none was) and why the run ended.
    """
    begin = process_time()
    run = track(motion, "mpc", seed, settings)
    cost = process_time() - begin
    farthest = float(np.linalg.norm(run.qpos[:, :2] - run.reference_qpos[:, :2], axis=1).max())
    done = run.end == DONE
    return run, {
        "motion": motion.name,
        "duration_s": motion.duration,
        "seed": seed,
        "done": done,
        "tracked": done and farthest < FARTHEST_M,
        "farthest_m": farthest,
        "cpu_s_per_s": cost / run.end_s if run.end_s > 0 else None,
        "end_reason": run.end_reason,
        **evaluate_run(run),
    }
