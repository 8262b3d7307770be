"""Identified dynamics: laws of the COM in tracked runs, and the largest push that they predict against the measured one.

For each motion: some runs with small random pushes, the laws found in them, and then the largest push survived, direction by
direction. Motions are built-in ones by name, or `TARGET@LEVEL` for a walk prepared for a target at a level of preparation, in the
arms given. Every run of the script goes on where the last one stopped: each motion's laws and each measured limit is a file in
OUT/records, written whole. A record of other settings is refused.

python scripts/identified_study.py --controller balance --seeds 1
"""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import pearsonr, spearmanr

from measuring.save import save_study
from simprep.library import library_motion
from simprep.motion.edit import cut, repeat
from simprep.motion.motion import Motion
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.settings import SimulationSettings
from simprep.preparation.prepare import prepare
from simprep.preparation.settings import PreparationSettings
from simprep.report.results import jsonable, provenance, save_json
from simprep.study.identified import ExcitationSettings, identify, laws_record, predicted_pushes, pushed_runs
from simprep.study.push_limits import PushSettings, push_limits

MOTIONS = ("stand", "punch_right@1", "punch_left@1", "kick_front@1", "crawl@1", "duck@1", "jump@1")
ARMS = ("blended", "optimised", "dynamic")
PREDICTIONS = ("closed_loop_n", "capture_n", "steps_n", "pendulum_n", "pendulum_steps_n")
DURATION_S, PUSHED_AT_S = 5.0, 1.2


def motions(names: list[str], arms: list[str]) -> Iterator[tuple[str, Motion]]:
    """Motions of `DURATION_S` by the names of their records."""
    walk = library_motion("walk")
    for name in names:
        target, at, level = name.partition("@")
        if not at:
            motion = library_motion(name)
            frames = round(DURATION_S * motion.fps) + 1
            if motion.loop:
                motion = repeat(motion, -(-frames // len(motion)))
            yield name, cut(motion, 0, min(frames, len(motion)))
            continue
        for arm in arms:
            made = prepare(
                walk,
                library_motion(target),
                float(level),
                settings=PreparationSettings(optimiser="dynamic" if arm == "dynamic" else "paper"),
                duration=DURATION_S,
                optimise=arm != "blended",
            )
            yield f"{target}_a{round(100 * float(level)):03d}_{arm}", made.motion


def record(path: Path, settings: dict[str, Any]) -> dict[str, Any] | None:
    """What a record holds; None where there is none yet."""
    if not path.is_file():
        return None
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    if content["settings"] != jsonable(settings):
        sys.exit(f"{path}: made with other settings; give another --out, or the same settings")
    return content


def study(options: argparse.Namespace) -> list[dict[str, Any]]:
    simulation = SimulationSettings(mpc=MPC_PRESETS[options.preset])
    excitation = ExcitationSettings(runs=options.runs)
    directions = tuple(360.0 * k / options.directions for k in range(options.directions))
    common = {"controller": options.controller, "preset": options.preset}
    rows = []
    for name, motion in motions(options.motions, options.arms):
        push = PushSettings(
            PUSHED_AT_S, directions, options.duration, "pelvis", options.largest, options.tolerance, tuple(range(options.seeds))
        )  # fmt: skip
        path = options.out / "records" / f"{name}.json"
        settings = {**common, **asdict(excitation), "push": asdict(push)}
        known = record(path, settings)
        if known is None:
            print(f"{name}: {excitation.runs} runs with small pushes", file=sys.stderr, flush=True)
            signals = pushed_runs(motion, excitation, options.controller, simulation)
            laws = identify(signals)
            known = jsonable({
                "settings": settings, "motion": name, "laws": laws_record(laws),
                "predictions": predicted_pushes(motion, laws, signals, push),
            })  # fmt: skip
            save_json(path, known)
        for prediction in known["predictions"]:
            degrees = prediction["direction_deg"]
            one = PushSettings(
                PUSHED_AT_S, (degrees,), options.duration, "pelvis", options.largest, options.tolerance, push.seeds
            )
            path = options.out / "records" / f"{name}_{degrees:03.0f}.json"
            settings = {**common, "push": asdict(one)}
            measured = record(path, settings)
            if measured is None:
                print(f"{name}: largest push at {degrees:g} degrees", file=sys.stderr, flush=True)
                limits = push_limits(motion, one, options.controller, simulation)
                measured = jsonable({
                    "settings": settings, "force_n": limits.force_n[0], "fell_unpushed": limits.fell_unpushed,
                    "assist_n": limits.assist_n,
                })  # fmt: skip
                save_json(path, measured)
            rows.append({
                "motion": name, **prediction, "measured_n": float(np.median(measured["force_n"])), **measured,
                "laws": known["laws"],
            })  # fmt: skip
    return rows


def prepared_for(name: str) -> str:
    """A motion without its arm: the arms of one target differ by little, so they are not independent."""
    return next((name.removesuffix(f"_{arm}") for arm in ARMS if name.endswith(f"_{arm}")), name)


def agreement(rows: list[dict[str, Any]], prediction: str) -> dict[str, Any]:
    """How well one prediction agrees with what was measured, over the pairs that have both, of motions that stay up unpushed."""
    used = [row for row in rows if row[prediction] is not None and not any(row["fell_unpushed"])]
    names = sorted({prepared_for(row["motion"]) for row in used})
    result: dict[str, Any] = {
        "n": len(used),
        "n_motions": len({row["motion"] for row in used}),
        "n_independent": len(names),
    }
    if len(used) < 3:
        return result
    x, y = np.array([(row[prediction], row["measured_n"]) for row in used]).T
    if np.ptp(x) < 1e-9 or np.ptp(y) < 1e-9:
        return result
    low, high = interval_of_r(x, y, np.array([names.index(prepared_for(row["motion"])) for row in used]))
    return result | {
        "r": float(pearsonr(x, y)[0]),
        "r_low": low,
        "r_high": high,
        "rho": float(spearmanr(x, y)[0]),
        "median_measured_over_predicted": float(np.median(y / np.maximum(x, 1e-9))),
        "median_error_n": float(np.median(np.abs(y - x))),
    }


def interval_of_r(x: np.ndarray, y: np.ndarray, cluster: np.ndarray) -> tuple[float | None, float | None]:
    """95 % percentile interval of Pearson's r: whole clusters are drawn, as the directions and arms of one motion are not independent."""
    count, generator, found = int(cluster.max()) + 1, np.random.default_rng(0), []
    if count < 5:
        return None, None
    for _ in range(2000):
        rows = np.concatenate([np.flatnonzero(cluster == one) for one in generator.integers(0, count, count)])
        if np.ptp(x[rows]) > 0 and np.ptp(y[rows]) > 0:
            found.append(np.corrcoef(x[rows], y[rows])[0, 1])
    low, high = np.percentile(found, [2.5, 97.5])
    return float(low), float(high)


def arms(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Optimised minus blended, for each target and level: medians over the directions of what was predicted and measured."""
    table = []
    for name in sorted(
        {row["motion"].removesuffix("_optimised") for row in rows if row["motion"].endswith("_optimised")}
    ):
        pairs = [
            (next((b for b in rows if b["motion"] == f"{name}_blended" and b["direction_deg"] == a["direction_deg"]), None), a)
            for a in rows if a["motion"] == f"{name}_optimised"
        ]  # fmt: skip
        line: dict[str, Any] = {"motion": name}
        for key in ("measured_n", "capture_n", "closed_loop_n"):
            change = [a[key] - b[key] for b, a in pairs if b is not None and a[key] is not None and b[key] is not None]
            line[key] = float(np.median(change)) if change else None
            line["n"] = len([1 for b, _ in pairs if b is not None])
        table.append(line)
    return table


def markdown(rows: list[dict[str, Any]], content: dict[str, Any]) -> str:
    def number(value: float | None, form: str = ".2f") -> str:
        return "-" if value is None else format(value, form)

    lines = [
        "# Identified dynamics of the COM", "",
        f"`{content['command']}`, {content['created_utc']}, controller {content['controller']}, preset {content['preset']}.",
        f"{content['n_pairs']} motion-direction pairs of {content['n_motions']} motions. docs/identified.md says what the numbers are.", "",
        "## Laws: R² on runs held out", "",
        "| motion | plant, forward: sparse / least squares / pendulum | plant, left | closed loop, forward: sparse / least squares | closed loop, left |",
        "| --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    laws = {row["motion"]: row["laws"] for row in rows}
    for name, law in laws.items():
        cells = [
            " / ".join(
                number(law[kind][axis][key], ".3f")
                for key in ("held_out_r2", "least_squares_r2", "pendulum_r2")
                if kind == "plant" or key != "pendulum_r2"
            )
            for kind in ("plant", "loop")
            for axis in ("forward", "left")
        ]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    lines += ["", "## Terms of the laws with R² of at least 0.8", "", "| motion | law | term | value (95 % interval) | unit |", "| --- | --- | --- | --- | --- |"]  # fmt: skip
    for name, law in laws.items():
        for kind in ("plant", "loop"):
            for axis in ("forward", "left"):
                for term in law[kind][axis].get("terms", ()):
                    value = f"{term['value']:.3g} ({term['low']:.3g} to {term['high']:.3g})"
                    lines.append(f"| {name} | {kind}, {axis} | {term['term']} | {value} | {term['unit']} |")
    lines += ["", "## Eigenvalues of the closed loop [1/s], with 95 % intervals", "", "| motion | real | imaginary |", "| --- | --- | --- |"]  # fmt: skip
    for name, law in laws.items():
        for value in law["eigenvalues_per_s"]:
            if value["imaginary"] >= -1e-9:
                real, imaginary = (
                    f"{value[part]:.2f} ({value[f'{part}_interval'][0]:.2f} to {value[f'{part}_interval'][1]:.2f})" for part in ("real", "imaginary")
                )  # fmt: skip
                lines.append(f"| {name} | {real} | {imaginary} |")
    lines += ["", "## Largest push: predicted against measured", "", "| prediction | n | motions | r (95 % interval) | rho | measured / predicted, median |", "| --- | --- | --- | --- | --- | --- |"]  # fmt: skip
    for name, one in content["agreement"].items():
        interval = (
            f" ({number(one.get('r_low'))} to {number(one.get('r_high'))})" if one.get("r_low") is not None else ""
        )
        lines.append(
            f"| {name} | {one['n']} | {one['n_motions']} | {number(one.get('r'))}{interval} | {number(one.get('rho'))} | {number(one.get('median_measured_over_predicted'))} |"
        )
    lines += ["", "## Posture optimisation: with minus without, median over directions [N]", "", "| motion | measured | capture | closed loop | directions |", "| --- | --- | --- | --- | --- |"]  # fmt: skip
    lines += [
        f"| {one['motion']} | {number(one['measured_n'], '+.0f')} | {number(one['capture_n'], '+.1f')} | {number(one['closed_loop_n'], '+.1f')} | {one['n']} |"
        for one in content["arms"]
    ]
    return "\n".join(lines) + "\n"


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    from matplotlib.figure import Figure

    from simprep.files import atomic_path

    figure = Figure(figsize=(10, 4.8), layout="constrained")
    # a colour for each posture, a marker for each arm
    looks = {
        name: next((arm for arm in ARMS if name.endswith(f"_{arm}")), "") for name in (row["motion"] for row in rows)
    }
    postures = list(dict.fromkeys(name.removesuffix(f"_{arm}") for name, arm in looks.items()))
    markers = dict(zip(dict.fromkeys(looks.values()), "os^Dv"))
    for axes, key, title in zip(
        figure.subplots(1, 2), ("closed_loop_n", "steps_n"), ("closed loop, feet in place", "plant, with steps")
    ):
        for name, arm in looks.items():
            pairs = [(row[key], row["measured_n"]) for row in rows if row["motion"] == name and row[key] is not None]
            if pairs:
                colour = f"C{postures.index(name.removesuffix(f'_{arm}'))}"
                axes.plot(*zip(*pairs), markers[arm], color=colour, markersize=5, alpha=0.8, label=name)
        most = 1.05 * max([row["measured_n"] for row in rows] + [row[key] for row in rows if row[key] is not None])
        axes.plot([0, most], [0, most], color="grey", lw=0.8, label="measured as predicted")
        axes.set(
            xlabel=f"predicted ({title}) [N]", ylabel="measured [N]", xlim=(0, most), ylim=(0, most), aspect="equal"
        )
        axes.legend(fontsize=6)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motions", nargs="+", default=list(MOTIONS))
    parser.add_argument("--arms", nargs="+", default=["blended", "optimised"], choices=ARMS)
    parser.add_argument("--directions", type=int, default=8)
    parser.add_argument(
        "--seeds", type=int, default=2, help="of the measured pushes; balance has no random numbers, so 1 will do"
    )
    parser.add_argument("--runs", type=int, default=6, help="with small pushes, of each motion")
    parser.add_argument("--duration", type=float, default=0.2, help="of the largest push [s]")
    parser.add_argument("--largest", type=float, default=1200.0, help="largest force tried [N]")
    parser.add_argument("--tolerance", type=float, default=40.0, help="of the largest force [N]")
    parser.add_argument("--controller", default="mpc")
    parser.add_argument("--preset", default="live", choices=sorted(MPC_PRESETS))
    parser.add_argument("-o", "--out", type=Path, default=Path("results/identified"))
    options = parser.parse_args()
    rows = study(options)
    content = {
        "schema": "simprep.identified/1", **provenance(sys.argv), "controller": options.controller, "preset": options.preset,
        "n_pairs": len(rows), "n_motions": len({row["motion"] for row in rows}),
        "agreement": {name: agreement(rows, name) for name in PREDICTIONS}, "arms": arms(rows), "pairs": rows,
    }  # fmt: skip
    draw(rows, options.out / "identified.png")
    save_study(options.out, "identified", content, markdown(rows, content))
    for name, one in content["agreement"].items():
        print(name, one)
    return 0


if __name__ == "__main__":
    sys.exit(main())
