"""Posture optimisers side by side: quality against cost, and where the paper's steps, weights and threshold lie on the curve.

Motions only, nothing is simulated. A walk is prepared for several targets at several levels. Quality is what the motion metrics say, over
all frames at or above the threshold; cost is computing time, which only an idle machine tells. `paper` is the paper's cost, minimised
by Gauss-Newton steps as simprep does; `steepest` the same cost along its gradient, as near to the paper's descent as its text tells;
`dynamic` the optimiser of that name, without and with the pelvis.

python scripts/optimiser_study.py --targets punch_right kick_front crawl --alphas 0.3 0.6 1
"""

import argparse
import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from measuring.save import save_study
from simprep.library import library_motion
from simprep.metrics.balance import balance, plausibility_summary, posture_summary
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.preparation.dynamic_balance import DynamicBalance
from simprep.preparation.prepare import prepare
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings
from simprep.report.results import provenance

PAPER = DEFAULT_SETTINGS
STEEPEST = replace(PAPER, descent="steepest")
STILL = replace(PAPER, optimiser="dynamic", pelvis_reach=0.0)
DYNAMIC = replace(PAPER, optimiser="dynamic")
STEPS = (0, 1, 2, 3, 5, 10, 20, 40)
WEIGHTS = (0.5, 1.0, 2.0, 4.0, 8.0)
THRESHOLDS = (0.0, 0.15, 0.3, 0.5, 0.7)
MEASURES = {
    "cost": "cost C with the optimiser's own goal, as share of the blended posture's: not comparable between goals",
    "com_cos_mm": "COM to the centre of support [mm]",
    "xcom_mm": "XcoM to the coming support [mm]",
    "margin_of_stability_mm": "margin of stability [mm]",
    "zmp_to_edge_mm": "ZMP to the polygon's edge [mm], positive inside",
    "residual_force_n": "force that no floor contact could supply [N]",
    "style_mm": "mean distance of body centres from the blended posture [mm]",
    "feet_mm": "largest movement of a foot against the blended motion [mm]",
    "peak_acceleration_rad_s2": "largest joint acceleration [rad/s2]",
    "cpu_ms_per_frame": "computing time [ms a frame]",
}


@dataclass(frozen=True)
class Variant:
    """One way of optimising: the family it belongs to, what is varied, and its value."""

    family: str
    varied: str
    value: float
    settings: PreparationSettings


def variants() -> list[Variant]:
    found = [
        Variant(family, "steps", float(n), replace(base, max_steps=n))
        for family, base in (("paper", PAPER), ("steepest", STEEPEST), ("dynamic, pelvis still", STILL), ("dynamic", DYNAMIC))
        for n in STEPS
    ]  # fmt: skip
    found += [
        Variant(family, "balance_weight", weight, replace(base, balance_weight=weight))
        for family, base in (("paper", PAPER), ("dynamic", DYNAMIC))
        for weight in WEIGHTS
    ]
    found += [Variant("paper", "threshold", value, replace(PAPER, threshold=value)) for value in THRESHOLDS]
    return found


def measure(variant: Variant, walk: Motion, target: Motion, level: np.ndarray, blended: Motion) -> dict[str, float]:
    begin = process_time()
    made = prepare(walk, target, level, settings=variant.settings)
    cost_s = process_time() - begin
    record, motion = made.record, made.motion
    poses, before = (forward_kinematics(one.qpos, walk.character) for one in (motion, blended))
    ahead = DynamicBalance(poses.com, record.centre, motion.fps, DYNAMIC).distance(np.zeros((len(motion), 2)))
    series = balance(motion)
    style = np.linalg.norm(poses.xipos - before.xipos, axis=2)
    both = np.isfinite(record.costs_before[:, 3])
    share = record.costs_after[both, 3].sum() / record.costs_before[both, 3].sum() if both.any() else 1.0
    return {
        "cost": float(share),
        "xcom_mm": 1e3 * float(np.nanmean(ahead)),
        "style_mm": 1e3 * float(style.mean()),
        "feet_mm": 1e3 * float(np.abs(poses.foot_points - before.foot_points).max()),
        "peak_acceleration_rad_s2": float(np.abs(np.diff(motion.qpos[:, 7:], n=2, axis=0)).max()) * motion.fps**2,
        "cpu_ms_per_frame": 1e3 * cost_s / len(motion),
        **{key: value for key, value in posture_summary(series).items() if key in MEASURES},
        **{key: value for key, value in plausibility_summary(series).items() if key in MEASURES},
    }


def study(options: argparse.Namespace) -> list[dict[str, Any]]:
    walk = library_motion("walk")
    cases = []
    for name in options.targets:
        for alpha in options.alphas:
            level = np.full(options.frames, alpha)
            target = library_motion(name)
            cases.append((name, alpha, target, level, prepare(walk, target, level, optimise=False).motion))
    # a rising level shows what the threshold does
    rising = np.linspace(0.0, 1.0, options.frames)
    ramps = [
        (name, None, target, rising, prepare(walk, target, rising, optimise=False).motion)
        for name, target in ((name, library_motion(name)) for name in options.targets)
    ]
    rows: list[dict[str, Any]] = []
    for number, variant in enumerate(variants()):
        print(f"{number + 1}/{len(variants())} {variant.family} {variant.varied} {variant.value:g}", file=sys.stderr)
        used = ramps if variant.varied == "threshold" else cases
        measured = [measure(variant, walk, target, level, blended) for _, _, target, level, blended in used]
        medians = {key: float(np.median([one[key] for one in measured])) for key in MEASURES}
        rows.append({
            "family": variant.family, "varied": variant.varied, "value": variant.value, "n": len(used), **medians,
            "cases": [{"target": name, "alpha": alpha, **one} for (name, alpha, *_), one in zip(used, measured)],
        })  # fmt: skip
    return rows


def markdown(rows: list[dict[str, Any]], content: dict[str, Any]) -> str:
    lines = [
        "# Posture optimisers: quality against cost", "",
        f"`{content['command']}`, {content['created_utc']}. Medians over {rows[0]['n']} motions ({', '.join(content['targets'])}; levels "
        f"{', '.join(f'{a:g}' for a in content['alphas'])}), nothing simulated. docs/optimiser.md says what is compared.", "",
        *(f"- `{key}`: {text}" for key, text in MEASURES.items()), "",
    ]  # fmt: skip
    for varied, paper in (("steps", 10), ("balance_weight", 2), ("threshold", 0.3)):
        lines += [f"## {varied} (the paper's: {paper:g})", "", f"| optimiser | {varied} | {' | '.join(MEASURES)} |", "| --- " * (len(MEASURES) + 2) + "|"]  # fmt: skip
        lines += [
            f"| {row['family']} | {row['value']:g} | {' | '.join(f'{row[key]:.3g}' for key in MEASURES)} |"
            for row in rows
            if row["varied"] == varied
        ]
        lines.append("")
    return "\n".join(lines)


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    from matplotlib.figure import Figure

    from simprep.files import atomic_path

    figure = Figure(figsize=(13, 8), layout="constrained")
    panels = (
        ("steps", "cost", "cost C with its own goal, share"), ("steps", "xcom_mm", "XcoM to coming support [mm]"),
        ("steps", "cpu_ms_per_frame", "computing time [ms a frame]"), ("balance_weight", "com_cos_mm", "COM to centre of support [mm]"),
        ("balance_weight", "style_mm", "change of posture [mm]"), ("threshold", "com_cos_mm", "COM to centre of support [mm], level rising"),
    )  # fmt: skip
    paper = {"steps": 10, "balance_weight": 2, "threshold": 0.3}
    for axes, (varied, key, label) in zip(figure.subplots(2, 3).flat, panels):
        for family in dict.fromkeys(row["family"] for row in rows if row["varied"] == varied):
            points = [(row["value"], row[key]) for row in rows if (row["family"], row["varied"]) == (family, varied)]
            axes.plot(*zip(*points), "o-", label=family)
        axes.axvline(paper[varied], color="grey", linestyle=":", label="the paper's")
        axes.set(xlabel=varied, ylabel=label)
        if varied == "steps":
            steps = sorted({row["value"] for row in rows if row["varied"] == varied})
            axes.set_xscale("symlog", linthresh=1)
            axes.set_xticks(steps, [f"{value:g}" for value in steps])
            axes.minorticks_off()
            axes.set_xlim(-0.1, None)
        axes.legend(fontsize=7)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png", dpi=120)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--targets", nargs="+", default=["punch_right", "kick_front", "crawl"])
    parser.add_argument("--alphas", nargs="+", type=float, default=[0.3, 0.6, 1.0])
    parser.add_argument("--frames", type=int, default=150)
    parser.add_argument("-o", "--out", type=Path, default=Path("results/optimiser"))
    parser.add_argument("--redraw", action="store_true", help="draw the stored numbers again; run nothing")
    options = parser.parse_args()
    if options.redraw:
        stored = json.loads((options.out / "optimiser.json").read_text(encoding="utf-8"))
        draw(stored["rows"], options.out / "optimiser.png")
        return 0
    rows = study(options)
    content = {
        "schema": "simprep.optimiser_study/1", **provenance(sys.argv), "targets": options.targets, "alphas": options.alphas,
        "frames": options.frames, "measures": MEASURES, "rows": rows,
    }  # fmt: skip
    draw(rows, options.out / "optimiser.png")
    save_study(options.out, "optimiser", content, markdown(rows, content))
    return 0


if __name__ == "__main__":
    sys.exit(main())
