"""What imports onto a robot are like: errors, smoothness, limits, contact with itself and the floor, time.

Example: python scripts/retarget_study.py ../shared/data/cmu --robot path/to/g1.xml -o results/retarget

Folders are searched for .bvh, .amc and .txt files. Writes OUT/retarget.json and OUT/retarget.md.
"""

import argparse
import sys
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from measuring.save import save_study
from simprep.characters import character_of_name
from simprep.errors import SimprepError
from simprep.motion.contacts import stances
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import ImportResult, import_motion
from simprep.motion.self_contact import own_overlap
from simprep.report.results import provenance

EDGE_S = 0.03
"""Both ends of a stance are left out: contacts are not known more closely [s]."""
COLUMNS = {
    "residual_mm": ("joint distance mm", ".1f"),
    "worst_limb_p95_deg": ("worst limb deg", ".1f"),
    "acceleration_rms_radps2": ("acceleration rms rad/s2", ".0f"),
    "acceleration_max_radps2": ("largest", ".0f"),
    "beyond_range_rad": ("beyond range rad", ".3f"),
    "peak_speed_share": ("speed / limit", ".2f"),
    "self_mm": ("in itself mm", ".1f"),
    "slip_median_mmps": ("slip mm/s", ".1f"),
    "tilt_p95_mm": ("sole off level mm", ".1f"),
    "penetration_mm": ("in the floor mm", ".1f"),
    "ms_per_frame": ("ms a frame", ".1f"),
}


def measured(result: ImportResult, seconds: float) -> dict[str, Any]:
    """The row of an import that took so long; stances count from their first to their last 0.03 s."""
    motion, check = result.motion, result.report.check
    assert check is not None
    robot = motion.character
    angles = motion.qpos[:, 7:]
    speed = np.diff(angles, axis=0) * motion.fps
    acceleration = np.diff(speed, axis=0) * motion.fps
    low, high = robot.limits.T
    points = forward_kinematics(motion.qpos, robot).foot_points  # (T, 2, soles, 3)
    slip, tilt = [], []
    edge = max(1, round(EDGE_S * motion.fps))
    for side in range(2):
        for first, after in stances(motion.contacts[:, side]):
            stance = points[first + edge : after - edge, side]
            if len(stance) > 1:
                slip += (np.linalg.norm(np.diff(stance[..., :2], axis=0), axis=-1).min(axis=-1) * motion.fps).tolist()
                tilt += np.ptp(stance[..., 2], axis=-1).tolist()
    return {
        "clip": motion.name,
        "frames": len(motion),
        "residual_mm": check.residual_mm,
        "limbs_p95_deg": {name: limb.p95_deg for name, limb in check.limbs.items()},
        "worst_limb_p95_deg": max(limb.p95_deg for limb in check.limbs.values()),
        "acceleration_rms_radps2": float(np.sqrt((acceleration**2).mean())),
        "acceleration_max_radps2": float(np.abs(acceleration).max()),
        "beyond_range_rad": float(max(0.0, (low - angles).max(), (angles - high).max())),
        "peak_speed_share": float((np.abs(speed) / np.array(robot.velocity_limits)).max())
        if robot.velocity_limits
        else None,
        "self_mm": 1e3 * float(own_overlap(motion.qpos, robot).max()),
        "slip_median_mmps": 1e3 * float(np.median(slip)) if slip else None,
        "slip_p95_mmps": 1e3 * float(np.percentile(slip, 95)) if slip else None,
        "tilt_p95_mm": 1e3 * float(np.percentile(tilt, 95)) if tilt else None,
        "penetration_mm": 1e3 * max(0.0, -float(points[..., 2].min())),
        "ms_per_frame": 1e3 * seconds / len(motion),
    }


def markdown(rows: list[dict[str, Any]]) -> str:
    lines = [
        "| clip | frames | " + " | ".join(title for title, _ in COLUMNS.values()) + " |",
        "| --- | --- |" + " --- |" * len(COLUMNS),
    ]
    medians = {
        key: float(np.median(known)) if (known := [row[key] for row in rows if row[key] is not None]) else None
        for key in COLUMNS
    }
    for row in [*rows, {"clip": "median", "frames": "", **medians}]:
        cells = ["-" if row[key] is None else format(row[key], form) for key, (_, form) in COLUMNS.items()]
        lines.append(f"| {row['clip']} | {row['frames']} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, help="motion files of people, or folders of them")
    parser.add_argument("--robot", required=True)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/retarget"))
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    try:
        robot = character_of_name(options.robot)
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    for given in options.files:
        inside = sorted(path for path in given.rglob("*") if path.suffix in (".bvh", ".amc", ".txt"))
        for file in inside if given.is_dir() else [given]:
            begin = process_time()
            try:
                result = import_motion(file, character=robot)
            except SimprepError as error:  # a text that is no motion
                print(f"left out: {error}", file=sys.stderr)
                continue
            rows.append(measured(result, process_time() - begin))
            print(f"{len(rows)}: {file.name}", file=sys.stderr, flush=True)
    if not rows:
        print("no motion file was read", file=sys.stderr)
        return 2
    text = markdown(rows)
    content = {"schema": "simprep.retarget_study/1", **provenance(tuple(sys.argv)), "robot": robot.name, "clips": rows}
    save_study(options.out, "retarget", content, text)
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
