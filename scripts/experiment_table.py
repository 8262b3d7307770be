"""Print the tables of the three experiments in docs/controller.md, as Markdown, from results/*/metrics.json.

Example: python scripts/experiment_table.py results
"""

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

EXPERIMENTS = {"ball": "ball_kick", "opponents": "two_opponents", "course": "obstacle_course"}
PEAKS = {
    "joint acceleration [rad/s²]": ("peak_acceleration_rad_s2", 1.0, 0),
    "jerk [10³ rad/s³]": ("peak_jerk_rad_s3", 1e-3, 1),
    "torque [N m]": ("peak_torque_nm", 1.0, 0),
}
"""Metric, factor and digits by what a row is called."""
COUNTS = {
    "goals reached": lambda arm: f"{arm['reached']}/{arm['cases']}",
    "launches survived": lambda arm: f"{arm['launches_survived']}/{arm['launches']}",
    "struck or cleared": lambda arm: f"{arm['met']}/{arm['to_meet']}" if "met" in arm else "-",
    "sole to the ball's centre [mm]": lambda arm: _number(arm.get("strike_miss_mm"), 1.0, 0),
    "clearance of the bars [mm]": lambda arm: _number(arm.get("clearance_mm"), 1.0, 0),
}


def tables(folder: Path) -> str:
    """Both tables: peaks at the launch, and what was struck or cleared."""
    found = {
        name: json.loads((folder / sub / "metrics.json").read_text(encoding="utf-8"))
        for name, sub in EXPERIMENTS.items()
        if (folder / sub / "metrics.json").exists()
    }
    lines = [
        "| | plain motion graph | with preparation | difference | posture optimisation, difference it makes |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, content in found.items():
        for number, (label, (metric, factor, digits)) in enumerate(PEAKS.items()):
            arms = [_number(content["arms"][arm][metric], factor, digits) for arm in ("none", "blended")]
            pairs = [
                _interval(content["paired"][pair].get(metric), factor, digits)
                for pair in ("blended_minus_none", "optimised_minus_blended")
            ]
            count = content["arms"]["none"]["launches"]
            first = f"**{name}** (n = {count}): {label}" if number == 0 else label
            lines.append(f"| {' | '.join([first, *arms, *pairs])} |")
    lines += ["", "| | plain motion graph | with preparation | and posture optimisation |", "| --- | --- | --- | --- |"]
    for name, content in found.items():
        for label, told in COUNTS.items():
            cells = [told(content["arms"][arm]) for arm in ("none", "blended", "optimised")]
            if set(cells) != {"-"}:
                lines.append(f"| {name}: {label} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _number(value: float | None, factor: float, digits: int) -> str:
    return "-" if value is None else f"{value * factor:.{digits}f}"


def _interval(item: Mapping[str, Any] | None, factor: float, digits: int) -> str:
    if not item or item["median"] is None:
        return "-"
    middle, low, high = (
        None if item[key] is None else f"{item[key] * factor:+.{digits}f}".replace("-", "−")
        for key in ("median", "low", "high")
    )
    return f"{middle}" if low is None else f"{middle} ({low} to {high})"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "folder", nargs="?", type=Path, default=Path("results"), help="with a folder of each experiment"
    )
    options = parser.parse_args()
    if not any((options.folder / sub / "metrics.json").exists() for sub in EXPERIMENTS.values()):
        parser.error(f"{options.folder}: no experiment in it; valid: a folder with {', '.join(EXPERIMENTS.values())}")
    print(tables(options.folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
