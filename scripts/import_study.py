"""How far imported limbs point from those of their files: real clips and forty generated ones, against an own reading.

Example: python scripts/import_study.py ../shared/data --json results/import.json

Beyond the bar is a clip with a limb whose 95th percentile exceeds 5 deg, or whose worst frame exceeds 15 deg, over the
frames in which the pose is reachable; of most generated clips every frame is. Frames/s are of this run's process time.
"""

import argparse
import os
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "motion"))

from generated_clips import KINDS, LIMBS, generate
from limb_errors import BAR_P95_DEG, BAR_WORST_DEG, angles_deg, limb_errors, read

from simprep.errors import SimprepError
from simprep.motion.load import import_motion
from simprep.report.results import provenance, save_json

PATTERNS = ("cmu/bvh/*.bvh", "cmu/asfamc/*.amc", "bandai-namco/*.bvh", "deepmimic/*.txt", "pairs/*.bvh", "faults/*.bvh")


def study(
    path: Path, name: str, up: str | None = None, inserted: bool | None = None, exact: bool = False
) -> dict[str, Any]:
    """One clip's row; `exact`: every frame is reachable."""
    start = time.process_time()
    try:
        result = import_motion(path)
    except SimprepError as error:
        return {"clip": name, "refused": str(error).removeprefix(f"{path}: ")}
    except Exception as error:  # a crash is a result of the study, too
        return {"clip": name, "refused": f"crash: {type(error).__name__}: {error}"}
    seconds = time.process_time() - start
    motion, report = result.motion, result.report
    row: dict[str, Any] = {
        "clip": name, "frames": len(motion), "fps": motion.fps, "residual_mm": report.residual_mm,
        "frames_per_s": len(motion) / seconds, "doubtful": getattr(report, "doubtful", None),
        "warnings": list(report.warnings),
    }  # fmt: skip
    try:
        source = read(path, up, inserted)
    except ValueError as error:
        return row | {"unread": str(error)}
    errors = limb_errors(source, motion)
    hips = angles_deg(source, motion)["hip_line"]
    keys = ("p95_deg", "max_deg") if exact else ("reachable_p95_deg", "reachable_max_deg")
    found = {limb: [getattr(error, key) for key in keys] for limb, error in errors.items()}
    beyond = [limb for limb, (p95, worst) in found.items() if p95 > BAR_P95_DEG or worst > BAR_WORST_DEG]
    plain = [limb for limb, error in errors.items() if error.p95_deg > BAR_P95_DEG or error.max_deg > BAR_WORST_DEG]
    return row | {
        "limbs": {limb: asdict(error) for limb, error in errors.items()},
        "hip_line_deg": {"median": float(np.median(hips)), "p95": float(np.percentile(hips, 95)), "max": float(hips.max())},
        "worst_limb": max(errors, key=lambda limb: errors[limb].max_deg),
        "beyond": beyond,
        "beyond_with_unreachable": plain,
    }  # fmt: skip


def table(rows: list[dict[str, Any]]) -> Table:
    out = Table("clip", "frames", "fps", "mm", *(limb.replace("left", "L").replace("right", "R") for limb in LIMBS),
                "hips", "worst limb", "frames/s", "beyond", title="p95 / max [deg]; of reachable frames in brackets")  # fmt: skip
    for row in rows:
        if "limbs" not in row:
            out.add_row(row["clip"], row.get("refused") or row["unread"])
            continue
        cells = []
        for error in row["limbs"].values():
            text = f"{error['p95_deg']:.0f}/{error['max_deg']:.0f}"
            if error["reachable_share"] < 1:
                text += f" ({error['reachable_p95_deg']:.0f}/{error['reachable_max_deg']:.0f})"
            cells.append(text)
        out.add_row(
            row["clip"], str(row["frames"]), f"{row['fps']:g}", f"{row['residual_mm']:.0f}", *cells,
            f"{row['hip_line_deg']['p95']:.0f}/{row['hip_line_deg']['max']:.0f}", row["worst_limb"],
            f"{row['frames_per_s']:.0f}", ", ".join(row["beyond"]),
        )  # fmt: skip
    return out


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    default = os.environ.get("SIMPREP_TEST_DATA", "../shared/data")
    parser.add_argument("folder", type=Path, nargs="?", default=Path(default), help="folder with motion capture")
    parser.add_argument("--only", default="", help="clips whose name contains this text")
    parser.add_argument("--seed", type=int, default=9, help="of the generated clips")
    parser.add_argument("--beyond", action="store_true", help="show only clips beyond the bar")
    parser.add_argument("--json", type=Path, help="write all numbers to this file")
    options = parser.parse_args()
    rows = []
    files = [path for pattern in PATTERNS for path in sorted(options.folder.glob(pattern))]
    for path in files:
        name = str(path.relative_to(options.folder))
        if options.only in name and path.stem != "humanoid3d_character" and not path.stem.startswith("LICENSE"):
            rows.append(study(path, name))
            print(name, rows[-1].get("beyond", "-"), file=sys.stderr, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for number in range(len(KINDS)):
            clip = generate(number, options.seed)
            if options.only in f"generated/{clip.name}":
                path = clip.write(Path(folder))
                rows.append(study(path, f"generated/{clip.name}", clip.up, clip.inserted, exact=clip.reachable))
                print(rows[-1]["clip"], rows[-1].get("beyond", "-"), file=sys.stderr, flush=True)
    measured = [row for row in rows if "limbs" in row]
    beyond = [row for row in measured if row["beyond"]]
    unreachable = [row for row in measured if row["beyond_with_unreachable"] and not row["beyond"]]
    Console(width=250).print(table(beyond if options.beyond else rows))
    wrong = [row["clip"] for row in measured if row["doubtful"] is not None and row["doubtful"] != bool(row["beyond"])]
    summary = (
        f"{len(beyond)} of {len(measured)} clips are beyond p95 {BAR_P95_DEG:g} deg / worst {BAR_WORST_DEG:g} deg "
        f"where the pose is reachable; {len(unreachable)} more only where it is not; {len(rows) - len(measured)} not measured"
    )
    print(summary)
    if any(row["doubtful"] is not None for row in measured):
        print(f"flagged wrongly as doubtful or not: {', '.join(wrong) or 'none'}")
    if options.json:
        content = {"schema": "simprep.import_study/1", **provenance(sys.argv), "summary": summary, "clips": rows}
        save_json(options.json, content)
    return 0


if __name__ == "__main__":
    sys.exit(main())
