"""Does `mpc` keep the humanoid on its feet? Every built-in motion, and captured clips where given, over several seeds.

Example: python scripts/tracking_study.py --clips FOLDER --motions walk jump --seeds 5 -o results/tracking

The built-in motions (loops for 3 s, the walk for 20 s); with --clips also the DeepMimic files
humanoid3d_{walk,run,punch,kick,jump,crawl}.txt of that folder (cyclic ones for 6 s). Writes OUT/tracking.json and
OUT/tracking.md. Run it alone, since it times.
"""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from simprep.errors import SimprepError
from simprep.files import atomic_path
from simprep.library import library_motion, library_names
from simprep.metrics.evaluate import evaluate_run
from simprep.motion.edit import repeat
from simprep.motion.load import load_motion
from simprep.motion.motion import Motion
from simprep.physics.simulate import track
from simprep.report.results import provenance, save_json

CLIPS = ("walk", "run", "punch", "kick", "jump", "crawl")
LOOPED_S = 6.0
WALK_S = 20.0
KEYS = ("mpjpe_mm", "g_mpjpe_mm", "max_body_distance_mm", "foot_slip_ratio", "penetration_mm", "s_per_s")


def looped(motion: Motion, seconds: float) -> Motion:
    return repeat(motion, int(np.ceil(seconds / motion.duration - 1e-9))) if motion.loop else motion


def motions(names: list[str], clips: Path | None) -> dict[str, Motion]:
    chosen = {f"built-in {name}": looped(library_motion(name), WALK_S if name == "walk" else 3.0) for name in names}
    if clips is not None:
        for name in CLIPS:
            clip = load_motion(clips / f"humanoid3d_{name}.txt")
            # a jump repeated at once is another motion than the one captured
            chosen[f"captured {name}"] = clip if name == "jump" else looped(clip, LOOPED_S)
    return chosen


def markdown(summaries: list[dict[str, Any]]) -> str:
    runs, good = sum(s["n"] for s in summaries), sum(s["success"] for s in summaries)
    whole = sum(s["success"] == s["n"] for s in summaries)
    failed = [f"{s['motion']} ({s['n'] - s['success']} of {s['n']})" for s in summaries if s["success"] < s["n"]]
    lines = [
        f"`mpc`, {len(summaries)} motions, {runs} runs: {good} succeeded; {whole} motions succeeded with every seed.",
        f"Failed: {', '.join(failed) or 'none'}.",
        "",
        "| motion | success | MPJPE mm | worst | global mm | slip ratio | penetration mm |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for s in summaries:
        m, w = s["median"], s["worst"]
        cells = [m["mpjpe_mm"], w["mpjpe_mm"], m["g_mpjpe_mm"], m["foot_slip_ratio"], w["penetration_mm"]]
        shown = ["-" if v is None else f"{v:.1f}" if n == 3 else f"{v:.0f}" for n, v in enumerate(cells)]
        lines.append(f"| {s['motion']} | {s['success']}/{s['n']} | {' | '.join(shown)} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--clips", type=Path, help="folder with DeepMimic clips")
    parser.add_argument("--motions", nargs="*", default=list(library_names()), help="built-in motions; default all")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/tracking"))
    options = parser.parse_args()
    table = Table(
        "motion", "s", "done", "success", "MPJPE mm", "worst", "global mm", "slip ratio", "penetration mm", "s per s"
    )
    rows, summaries = [], []
    try:
        chosen = motions(options.motions, options.clips)
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    for name, motion in chosen.items():
        results = []
        for seed in range(options.seeds):
            result = evaluate_run(track(motion, "mpc", seed))
            results.append(result)
            rows.append({"motion": name, "seed": seed, **result})
            print(name, seed, result["end"], *(f"{key}={result[key]}" for key in KEYS), file=sys.stderr, flush=True)
        done = sum(result["end"] == "done" for result in results)
        success = sum(bool(result["success"]) for result in results)
        numbers = {key: [float(r[key]) for r in results if r[key] is not None] for key in KEYS}
        median = {key: float(np.median(values)) if values else None for key, values in numbers.items()}
        worst = {key: max(values) if values else None for key, values in numbers.items()}
        summaries.append(
            {"motion": name, "n": len(results), "done": done, "success": success, "median": median, "worst": worst}
        )
        cells = [
            median["mpjpe_mm"],
            worst["mpjpe_mm"],
            median["g_mpjpe_mm"],
            median["foot_slip_ratio"],
            worst["penetration_mm"],
            median["s_per_s"],
        ]
        table.add_row(
            name, f"{motion.duration:.1f}", f"{done}/{len(results)}", f"{success}/{len(results)}",
            *("-" if value is None else f"{value:.2f}" if index in (3, 5) else f"{value:.0f}" for index, value in enumerate(cells)),
        )  # fmt: skip
    content = {"schema": "simprep.tracking_study/1", **provenance(sys.argv), "summary": summaries, "runs": rows}
    path = save_json(options.out / "tracking.json", content)
    Console(width=130).print(table)
    text = markdown(summaries)
    with atomic_path(options.out / "tracking.md") as temporary:
        temporary.write_text(text, encoding="utf-8")
    print(f"written: {path}, {options.out / 'tracking.md'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
