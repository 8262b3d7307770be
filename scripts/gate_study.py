"""Does the regression gate find faults, and does it keep quiet without one? Six faults, and 20 re-runs with other seeds.

Example: python scripts/gate_study.py --processes 2 -o results/gate

Three kinds of check: metrics of a prepared kick before physics; states of servos alone after 50 to 80 steps, within 1e-6;
ensembles under `mpc` (preset `live`), whose bands come from the seeds of the baseline. The baseline of the ensembles is
OUT/baseline.json: kept where it exists, written anew with --update TEXT. Writes OUT/gate.json and OUT/gate.md; finished
runs stand in OUT/runs.jsonl, which a second call goes on with and --update begins anew.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from gating.checks import ENSEMBLES, GOLDEN_STEPS, GOLDENS, before_physics, tracked
from gating.faults import FAULTS, NO_FAULT, Fault
from measuring.processes import each_result
from measuring.save import save_study
from simprep.errors import SimprepError
from simprep.regression.baseline import Baseline, new_baseline, read_baseline, save_baseline
from simprep.regression.compare import Comparison, Row, compare
from simprep.regression.environment import here
from simprep.regression.measured import Case, cases_of, numbers
from simprep.regression.states import states_of
from simprep.regression.tolerance import Tolerance
from simprep.report.results import jsonable, provenance

NONE = "no fault"
RERUNS = 20
FAULT_SEEDS, RERUN_SEEDS = 500, 1000
"""Where seeds of faults and of re-runs begin; the baseline's begin at 0."""
Job = tuple[str, str, int]


def fault_of(name: str) -> Fault:
    return NO_FAULT if name == NONE else FAULTS[name]


def measured(job: Job) -> dict[str, Any]:
    fault, case, seed = job
    return {"fault": fault, "case": case, "seed": seed, "metrics": jsonable(tracked(fault_of(fault), case, seed))}


def finished(jobs: Sequence[Job], file: Path, processes: int) -> dict[Job, dict[str, Any]]:
    """Metrics of all jobs: those that the file has, and the others, which are added to it one by one."""
    done: dict[Job, dict[str, Any]] = {}
    if file.exists():
        for line in file.read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            done[row["fault"], row["case"], row["seed"]] = row["metrics"]
    left = [job for job in jobs if job not in done]
    with file.open("a", encoding="utf-8") as stream:
        for number, (_, row) in enumerate(each_result(measured, left, processes), 1):
            stream.write(json.dumps(row) + "\n")
            stream.flush()
            done[row["fault"], row["case"], row["seed"]] = row["metrics"]
            if number % 20 == 0 or number == len(left):
                print(f"{number}/{len(left)} {row['fault']}, {row['case']}", file=sys.stderr, flush=True)
    return done


def ensemble(
    done: dict[Job, dict[str, Any]], fault: str, cases: Iterable[str], seeds: Sequence[int]
) -> dict[str, Case]:
    return cases_of((case, seed, numbers(done[fault, case, seed])) for case in cases for seed in seeds)


def strongest(comparison: Comparison) -> Row | None:
    """The failure that is farthest outside of what is allowed, in widths of that."""

    def excess(row: Row) -> float:
        if row.before is None or row.now is None or row.low is None or row.high is None:
            return float("inf")
        return abs(row.now - row.before) / max((row.high - row.low) / 2, 1e-12)

    return max(comparison.failures, key=excess, default=None)


def told(comparison: Comparison) -> dict[str, Any]:
    """What a check found, for the record."""
    row = strongest(comparison)
    return {
        "failures": len(comparison.failures),
        "numbers": len(comparison.rows),
        "strongest": None if row is None else {
            "case": row.case, "metric": row.metric, "before": row.before, "now": row.now, "verdict": row.verdict,
        },
    }  # fmt: skip


def deterministic(measure: Callable[[Fault], dict[str, Case]], tolerances: tuple[Tolerance, ...]) -> dict[str, Any]:
    """A check whose numbers need no seeds, for every fault and without one; its baseline is the program as it is."""
    baseline = new_baseline(here(measure(NO_FAULT)), "the program as it is", None, tolerances)
    strict = bool(tolerances)
    return {
        name: told(compare(here(measure(fault)), baseline, strict))
        for name, fault in {NONE: NO_FAULT, **FAULTS}.items()
    }


def kinematic(fault: Fault) -> dict[str, Case]:
    return cases_of([("prepared kick", 0, numbers(before_physics(fault)))])


def golden(fault: Fault) -> dict[str, Case]:
    return {
        f"{name} {step}": case
        for name, run in GOLDENS.items()
        for step, case in states_of(run(fault), GOLDEN_STEPS[name]).items()
    }


def _shown(value: float | None) -> str:
    return "nothing" if value is None else f"{value:.4g}"  # a metric that only one side has


def markdown(content: dict[str, Any], baseline: Baseline) -> str:
    layers = content["checks"]
    lines = [
        f"Numbers that failed, of those that were compared. Ensembles: {content['seeds']} seeds on both sides, one false "
        f"alarm in {1 / baseline.false_alarm:.0f} checks wanted.",
        "",
        f"| fault | {' | '.join(layers)} |",
        f"| --- |{' --- |' * len(layers)}",
    ]
    for fault in (NONE, *FAULTS):
        cells = []
        for check in layers.values():
            found = check[fault]
            top = found["strongest"]
            cells.append(
                f"{found['failures']}/{found['numbers']}" + (f" ({top['case']}: {top['metric']})" if top else "")
            )
        lines.append(f"| {fault} | {' | '.join(cells)} |")
    alarms = content["alarms"]
    lines += [
        "",
        f"{content['reruns']} re-runs with {content['rerun_seeds']} other seeds and no fault: {len(alarms)} alarms.",
    ]
    lines += [
        f"- re-run {one['rerun']}: {one['case']}, {one['metric']}, {_shown(one['before'])} to {_shown(one['now'])}"
        for one in alarms
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", choices=ENSEMBLES, default=list(ENSEMBLES))
    parser.add_argument(
        "--seeds", type=int, default=8, help="size of the baseline's ensembles and of those with a fault"
    )
    parser.add_argument("--rerun-seeds", type=int, default=5, help="size of a re-run's ensembles")
    parser.add_argument("--reruns", type=int, default=RERUNS)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--update", metavar="TEXT", help="write the baseline anew, for this reason")
    parser.add_argument("-o", "--out", type=Path, default=Path("results/gate"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    runs, file = options.out / "runs.jsonl", options.out / "baseline.json"
    if options.update:
        runs.unlink(missing_ok=True)
    seeds = {NONE: range(options.seeds), **{name: range(FAULT_SEEDS, FAULT_SEEDS + options.seeds) for name in FAULTS}}
    size = options.rerun_seeds
    others = [range(RERUN_SEEDS + k * size, RERUN_SEEDS + (k + 1) * size) for k in range(options.reruns)]
    try:
        former = read_baseline(file) if file.exists() else None
        jobs = [(name, case, seed) for name in seeds for case in options.cases for seed in seeds[name]]
        jobs += [(NONE, case, seed) for again in others for case in options.cases for seed in again]
        done = finished(jobs, runs, options.processes)
        if former is None or options.update:
            own = here(ensemble(done, NONE, options.cases, seeds[NONE]))
            former = new_baseline(own, options.update or "first baseline", former)
            save_baseline(former, file)
    except SimprepError as error:
        print(error, file=sys.stderr)
        return 2
    alarms: list[dict[str, Any]] = []
    for number, again in enumerate(others):
        found = compare(here(ensemble(done, NONE, options.cases, again)), former)
        alarms += [
            {"rerun": number, "case": row.case, "metric": row.metric, "before": row.before, "now": row.now}
            for row in found.failures
        ]
    ensembles = {name: told(compare(here(ensemble(done, name, options.cases, seeds[name])), former)) for name in seeds}
    content = {
        "schema": "simprep.gate_study/1",
        **provenance(sys.argv),
        "seeds": options.seeds,
        "reruns": options.reruns,
        "rerun_seeds": options.rerun_seeds,
        "false_alarm": former.false_alarm,
        "checks": {
            "before physics": deterministic(kinematic, ()),
            "states": deterministic(golden, (Tolerance("*", 1e-6, 1e-6),)),
            "ensembles": ensembles,
        },
        "alarms": alarms,
    }
    text = markdown(content, former)
    print(text)
    save_study(options.out, "gate", content, text)
    caught = all(any(check[name]["failures"] for check in content["checks"].values()) for name in FAULTS)
    return 0 if caught and not alarms else 1


if __name__ == "__main__":
    sys.exit(main())
