"""Captured walks to a captured punch and kick: `simprep validate` on real input, summed up in one table.

Example: python scripts/captured_study.py --data ../shared/data -o results/captured

Three walks (CMU 02_01, Bandai-Namco walk_normal_001, DeepMimic walk) times two targets (DeepMimic punch from frame 11, kick from
frame 9, the first frames of the step into the strike), levels of preparation 0.5 and 1, all arms, `mpc` and `pd`. Each
combination is one run of the command; its folder holds the whole result, OUT/captured.json the summary.
"""

import argparse
import json
import sys
from pathlib import Path
from statistics import median
from typing import Any

from rich.console import Console
from rich.table import Table

from simprep.cli.main import main as simprep
from simprep.report.results import provenance, save_json

WALKS = {
    "cmu": "cmu/bvh/002_01.bvh",
    "bandai": "bandai-namco/walk_normal_001.bvh",
    "deepmimic": "deepmimic/humanoid3d_walk.txt",
}
TARGETS = {"punch": ("deepmimic/humanoid3d_punch.txt", 11), "kick": ("deepmimic/humanoid3d_kick.txt", 9)}
SHOWN = (
    "mpjpe_mm",
    "com_cos_mm",
    "prepared_com_cos_mm",
    "margin_of_stability_mm",
    "peak_acceleration_rad_s2",
    "peak_torque_nm",
)
PAIRED = (
    "prepared_com_cos_mm",
    "margin_of_stability_mm",
    "peak_acceleration_rad_s2",
    "peak_torque_nm",
    "torque_rms_nm",
)


def cell(values: list[Any]) -> str:
    numbers = [value for value in values if isinstance(value, float)]
    return f"{median(numbers):.0f}" if numbers else "-"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, default=Path("../shared/data"))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--alpha", nargs="+", default=["0.5", "1"])
    parser.add_argument("-o", "--out", type=Path, default=Path("results/captured"))
    options = parser.parse_args()
    cases: list[dict[str, Any]] = []
    paired: dict[str, Any] = {}
    for walk, walk_file in WALKS.items():
        for target, (target_file, frame) in TARGETS.items():
            folder = options.out / f"{walk}_{target}"
            command = [
                "validate", "--locomotion", str(options.data / walk_file), "--target", str(options.data / target_file),
                "--target-frame", str(frame), "--seeds", str(options.seeds), "--alpha", *options.alpha, "--no-pictures", "-o", str(folder),
            ]  # fmt: skip
            code = simprep(command)
            if code:
                return code
            result = json.loads((folder / "metrics.json").read_text())
            cases += [{"walk": walk, **case, "target": target} for case in result["cases"]]
            paired[f"{walk}_{target}"] = result["paired"]["mpc"]
    table = Table("controller", "arm", "success", *SHOWN)
    for controller in ("pd", "mpc"):
        for arm in dict.fromkeys(case["arm"] for case in cases):
            chosen = [case for case in cases if case["arm"] == arm and case["controller"] == controller]
            good = [case for case in chosen if case["success"]]
            table.add_row(
                controller, arm, f"{len(good)}/{len(chosen)}", *(cell([c[key] for c in good]) for key in SHOWN)
            )
    effect = Table("with minus without optimisation, mpc (median)", *PAIRED)
    for name, numbers in paired.items():
        medians = [numbers.get(key, {}).get("median") if numbers.get(key) else None for key in PAIRED]
        effect.add_row(name, *("-" if value is None else f"{value:+.1f}" for value in medians))
    keep = ("walk", "target", "alpha", "arm", "controller", "seed", "success", "end", "fell_at_s", *SHOWN)
    summary = [{key: case.get(key) for key in keep} for case in cases]
    path = save_json(
        options.out / "captured.json",
        {"schema": "simprep.captured_study/1", **provenance(sys.argv), "cases": summary, "paired": paired},
    )
    Console(width=150).print(table)
    Console(width=150).print(effect)
    print(f"written: {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
