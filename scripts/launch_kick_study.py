"""Who stays up if he is kicked when he launches a target? Every built-in target, from every side.

Example: python scripts/launch_kick_study.py --targets punch_right kick_front --processes 2 -o results/launch_kicks

It takes a minute for a target, as bodies that catch themselves get the most simulations. Each target is prepared while walking (level 0.5, posture optimised), and simulated from 1.5 s before the launch with `mpc`. At the
launch the root's velocity changes by 1 m/s, in 8 directions. Writes OUT/launch_kicks.json and OUT/launch_kicks.md. With --add, runs of
other targets that are there stay, and the file says when they were made.
"""

import argparse
import json
import sys
from collections.abc import Collection
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from measuring.runs import lost_runs, measured_run, rows_of
from measuring.save import save_study
from simprep.errors import SettingError, SimprepError
from simprep.library import library_motion, library_names
from simprep.motion.edit import cut
from simprep.motion.motion import Motion
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.pushes import Kick
from simprep.physics.settings import SimulationSettings
from simprep.physics.yardstick import Yardstick, yardsticks
from simprep.preparation.scenario import scenario
from simprep.report.results import provenance

LEVEL, BEFORE_S, DIRECTIONS = 0.5, 1.5, 8
KEPT = (
    "motion", "direction_deg", "seed", "done", "end", "end_reason", "survived_s", "duration_s", "mpjpe_mm", "g_mpjpe_mm", "farthest_m",
    "assist_n", "kick_mps", "yardsticks",
)  # fmt: skip
"""What is written of a run."""
Job = tuple[str, float, int, float, str]


@cache
def prepared(target: str) -> Motion:
    """From BEFORE_S before the launch to the end."""
    motion = scenario(library_motion("walk"), library_motion(target), LEVEL)
    return cut(motion, max(0, motion.events["launch"] - round(BEFORE_S * motion.fps)), len(motion.qpos))


def measured(job: Job) -> dict[str, Any]:
    target, direction, seed, speed, preset = job
    motion = prepared(target)
    launch = motion.events["launch"]
    # the direction is relative to where the body goes at the launch: 0 forward, 90 to the left
    way = motion.qpos[launch, :2] - motion.qpos[launch - round(0.5 * motion.fps), :2]
    angle = np.arctan2(way[1], way[0]) + np.radians(direction)
    kick = Kick(launch / motion.fps, (float(speed * np.cos(angle)), float(speed * np.sin(angle)), 0.0))
    settings = SimulationSettings(mpc=replace(MPC_PRESETS[preset], threads=1), kicks=(kick,))
    _, row = measured_run(motion, seed, settings)
    return {**row, "motion": target, "direction_deg": direction, "kick_mps": speed}


def words(row: dict[str, Any]) -> str:
    return f"{row['motion']}, {row['direction_deg']:.0f} degrees, seed {row['seed']}"


def markdown(rows: list[dict[str, Any]], preset: str, speed: float) -> str:
    lines = [
        f"`mpc`, preset `{preset}`, a kick of {speed:g} m/s at the launch: {sum(row['done'] for row in rows)} of {len(rows)} runs "
        "stay up.",
        "",
        "| target | stay up | MPJPE mm | global mm | farthest m | yardsticks |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for target in dict.fromkeys(row["motion"] for row in rows):
        own = [row for row in rows if row["motion"] == target]
        middle = {
            key: float(np.median([row[key] for row in own if row[key] is not None]))
            for key in ("mpjpe_mm", "g_mpjpe_mm", "farthest_m", "yardsticks")
        }
        lines.append(
            f"| {target} | {sum(row['done'] for row in own)}/{len(own)} | {middle['mpjpe_mm']:.0f} | {middle['g_mpjpe_mm']:.0f} | "
            f"{middle['farthest_m']:.2f} | {middle['yardsticks']:.2f} |"
        )
    return "\n".join([*lines, *lost_runs(rows, "Fallen", words)]) + "\n"


def runs_of_others(
    folder: Path, targets: Collection[str], preset: str, speed: float
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Runs in a folder of targets that are not measured now, and how and when those were made.

    Raises:
        SettingError: no study there, or one with another preset or change of velocity.
    """
    path = folder / "launch_kicks.json"
    if not path.is_file():
        raise SettingError(f"--add: no {path}; valid: a folder with an earlier study")
    earlier = json.loads(path.read_text(encoding="utf-8"))
    if earlier["preset"] != preset or any(run["kick_mps"] != speed for run in earlier["runs"]):
        raise SettingError(f"--add: {path} is of another preset or speed; valid: the same")
    runs = [run for run in earlier["runs"] if run["motion"] not in targets]
    made = [*earlier.get("kept", []), {key: earlier[key] for key in ("command", "created_utc", "yardstick_s")}]
    return runs, made


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", nargs="+", help="default: every built-in motion with the event `target`")
    parser.add_argument("--speed", type=float, default=1.0, help="change of the root's velocity [m/s]")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--preset", choices=MPC_PRESETS, default="default")
    parser.add_argument("--add", action="store_true", help="keep the runs of other targets that OUT holds")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/launch_kicks"))
    options = parser.parse_args()
    try:
        targets = options.targets or [name for name in library_names() if "target" in library_motion(name).events]
        for target in targets:
            prepared(target)
        others, kept = runs_of_others(options.out, targets, options.preset, options.speed) if options.add else ([], [])
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    yardstick_s = Yardstick().processor_seconds()
    jobs: list[Job] = [
        (target, 360.0 * number / DIRECTIONS, seed, options.speed, options.preset)
        for target in targets
        for number in range(DIRECTIONS)
        for seed in range(options.seeds)
    ]
    rows = rows_of(measured, jobs, options.processes, words)
    rows = [{**row, "yardsticks": yardsticks(row["cpu_s_per_s"], yardstick_s)} for row in rows]
    rows = [*others, *({key: row[key] for key in KEPT} for row in rows)]
    rows.sort(key=lambda row: library_names().index(row["motion"]))
    content = {
        "schema": "simprep.launch_kick_study/1",
        **provenance(sys.argv),
        "preset": options.preset,
        "yardstick_s": yardstick_s,
        **({"kept": kept} if kept else {}),
        "runs": rows,
    }
    save_study(options.out, "launch_kicks", content, markdown(rows, options.preset, options.speed))
    return 0


if __name__ == "__main__":
    sys.exit(main())
