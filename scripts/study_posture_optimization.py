"""Does posture optimisation make the motion more stable? At least 2000 simulated cases, compared in pairs.

Example: python scripts/study_posture_optimization.py --processes 2 -o results/posture_optimization

Locomotions × targets × levels × arms × controllers × three statures × seeds × disturbances, run as a sweep (docs/sweep.md) into
--store. Stopped at any moment, the same command goes on; if all cases are recorded, only the report is made anew. --plan
says what is left and what it will take. Writes OUT/report.md, summary.json, figures, report.html with a few arms side by side
(they are simulated again), and table.parquet with every case.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from posture_optimization.compared import MIN_CLUSTERS, OUTCOMES, STABILITY, by_target, compared, rows_of
from posture_optimization.figures import plot_effects, plot_worse
from posture_optimization.grid import ARMS, STATURES_M, study_cases
from posture_optimization.page import posture_page
from posture_optimization.report import answer, report_text
from simprep.errors import SimprepError
from simprep.files import atomic_path
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.named_controllers import CONTROLLERS
from simprep.report.page import write_report
from simprep.report.replay.actor import Replay
from simprep.report.results import provenance, save_json
from simprep.study.compare import WITH, WITHOUT
from simprep.study.plan import BEFORE_PHYSICS
from simprep.study.sweep.engines import in_processes, in_this_process, on_dask
from simprep.study.sweep.estimate import costs, plan_text, sample
from simprep.study.sweep.replays import sweep_replays
from simprep.study.sweep.run import Progress, run_sweep
from simprep.study.sweep.store import SweepStore
from simprep.study.sweep.table import save_table

SAID_EVERY_S = 10.0


def arms_table(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """What was simulated, by controller, disturbance and arm; a run that counts for several levels counts once."""
    groups: dict[tuple[str, str, str], dict[tuple[Any, ...], Mapping[str, Any]]] = {}
    keys = ("locomotion", "target", "height_m", "seed")
    for row in rows:
        if row["controller"] != BEFORE_PHYSICS:
            level = None if row["arm"] == "none" else row["alpha"]
            group = groups.setdefault((row["controller"], row["disturbance"], row["arm"]), {})
            group[(level, *(row[key] for key in keys))] = row
    return [
        {
            "controller": controller, "disturbance": disturbance, "arm": arm, "n": len(group),
            "n_success": sum(bool(row["success"]) for row in group.values()),
            "median_survived_s": float(np.median([row["survived_s"] for row in group.values()])),
        }
        for (controller, disturbance, arm), group in sorted(groups.items(), key=lambda item: (item[0][:2], ARMS.index(item[0][2])))
    ]  # fmt: skip


def write_results(
    records: Sequence[Mapping[str, Any]],
    planned: int,
    out: Path,
    about: Mapping[str, Any],
    replays: Callable[[], Sequence[Replay]] = tuple,
) -> dict[str, Any]:
    """Reports, figures and summary.json; returns the last.

    Args:
        records: of the store.
        planned: how many cases the study has.
        out: folder.
        about: `command`, `preset`, `seeds` and what else repeats it.
        replays: makes what the page shows.
    """
    rows, ends = rows_of(records)
    simulated = sum(record["case"]["controller"] != BEFORE_PHYSICS for record in records)
    parts = {"whole": compared(rows), "strata": compared(rows, strata=True)}
    parts |= {arm: compared(rows, arm) for arm in ARMS if arm not in (WITH, WITHOUT)}
    figures = [plot_effects(parts["whole"], out / "effects.png")]
    # a bar of one pair would look as sure as one of 192
    names = {outcome.name for outcome in STABILITY}
    enough = [one for one in parts["whole"] if one.outcome.name in names and one.effect.clusters >= MIN_CLUSTERS]
    figures.append(plot_worse(enough, out / "worse.png"))
    content: dict[str, Any] = {
        "schema": "simprep.posture_optimization/1", **about, "n_cases": len(records), "n_planned": planned, "n_simulated": simulated, "ends": dict(ends),
        "processors": dict(Counter(record["cost"]["processor"] for record in records)),
        "smallest": {outcome.name: outcome.smallest for outcome in OUTCOMES},
        "arms": arms_table(rows), "by_target": by_target(rows, STABILITY[2]), "answer": answer(parts["whole"]),
        "effects": [one.record() for some in parts.values() for one in some],
    }  # fmt: skip
    text = report_text(content, parts, [path.name for path in figures])
    with atomic_path(out / "report.md") as temporary:
        temporary.write_text(text, encoding="utf-8")
    save_json(out / "summary.json", content)
    write_report(
        out, lambda: posture_page(content, parts["whole"], figures, replays()), partial(print, file=sys.stderr)
    )
    return content


def told(begin: float) -> "Any":
    """Says now and then how far the study is, and when it will be done."""
    said = 0.0

    def tell(progress: Progress) -> None:
        nonlocal said
        now, run = time.monotonic(), progress.done - progress.recorded
        if now - said < SAID_EVERY_S and progress.done < progress.total:
            return
        said = now
        left = f", {(now - begin) / run * (progress.total - progress.done) / 60:.0f} min left" if run else ""
        ends = ", ".join(f"{count} {end}" for end, count in sorted(progress.ends.items()))
        print(f"{progress.done}/{progress.total} cases{left}: {ends}", file=sys.stderr, flush=True)

    return tell


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--controllers", nargs="+", choices=CONTROLLERS, default=list(CONTROLLERS))
    parser.add_argument("--seeds", type=int, default=1, help="of controllers with random numbers")
    parser.add_argument(
        "--preset", choices=MPC_PRESETS, default="live", help="of mpc; live leaves it least to compensate"
    )
    parser.add_argument(
        "--statures", nargs="+", type=float, choices=STATURES_M, default=list(STATURES_M), help="of the bodies [m]"
    )
    parser.add_argument(
        "--arms", nargs="+", choices=ARMS, default=list(ARMS), help="mpc runs without traditional and dynamic"
    )
    parser.add_argument("--small", action="store_true", help="two targets only, to see that it works")
    parser.add_argument("--plan", action="store_true", help="say what it will take, and stop")
    parser.add_argument("--report", action="store_true", help="run nothing; report on what is recorded so far")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--scheduler", help="run on this Dask cluster, such as tcp://host:8786")
    parser.add_argument("--store", type=Path, default=Path("out/posture_optimization"), help="folder of the records")
    parser.add_argument("-o", "--out", type=Path, default=Path("results/posture_optimization"))
    options = parser.parse_args()
    cases = study_cases(
        options.controllers, options.seeds, options.preset, options.small, options.statures, options.arms
    )
    store = SweepStore(options.store)
    if options.scheduler:
        engine = partial(on_dask, address=options.scheduler)
    else:
        engine = in_this_process if options.processes == 1 else partial(in_processes, processes=options.processes)
    wanted = {case.id for case in cases}
    try:
        if not options.report:
            run_sweep(sample(cases, store) if options.plan else cases, store, engine, told(time.monotonic()))
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print(f"interrupted; what is recorded is kept in {options.store}; the same command goes on", file=sys.stderr)
        return 130
    if options.plan:
        pairs = len({(case.locomotion, case.target) for case in cases})
        print(plan_text(costs(cases, store), pairs, pairs))
        return 0
    records = sorted(store.records(wanted.__contains__), key=lambda record: record["id"])
    about = {
        **provenance(sys.argv),
        "preset": options.preset,
        "seeds": options.seeds,
        "controllers": options.controllers,
    }
    content = write_results(
        records, len(wanted), options.out, about, lambda: sweep_replays(cases, records, options.processes)
    )
    try:
        save_table(store.folder, options.out / "table.parquet", wanted.__contains__)
    except SimprepError as error:
        print(error, file=sys.stderr)
    print(content["answer"])
    print(
        f"{content['n_cases']} cases, {content['n_simulated']} simulated; written: {options.out / 'report.md'}, report.html, summary.json, figures"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
