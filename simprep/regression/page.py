"""The report of `simprep check`: what moved, by how much of what is allowed, and the runs where there are some."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from simprep.physics.run import Run
from simprep.physics.store import read_run
from simprep.regression.baseline import Baseline
from simprep.regression.compare import BETTER, SAME, Comparison
from simprep.regression.figure import judged, plot_comparison
from simprep.regression.read_results import RUN_FILE
from simprep.regression.tables import SHOWN, reasons, summary, table_of, told
from simprep.report.figures import COLOURS
from simprep.report.page import Page, figure_picture
from simprep.report.replay.actor import Replay, run_actor, side_by_side

RUNS = 4
"""Most runs that are shown, side by side."""


def check_page(
    comparison: Comparison,
    baseline: Baseline,
    results: Sequence[Path],
    details: Mapping[str, Any],
    warnings: Sequence[str] = (),
) -> Page:
    """A comparison with a baseline.

    Args:
        comparison: what came out.
        baseline: what was compared with.
        results: files and folders that were compared; runs among them are shown.
        details: how it was made.
        warnings: what was said about it.
    """
    rows = told(comparison)
    same = [row for row in comparison.rows if row.verdict == SAME]
    tables = [table_of(rows[:SHOWN])] if rows else []
    tables += [table_of(same[:SHOWN])] if same else []
    left = max(0, len(rows) - SHOWN) + max(0, len(same) - SHOWN)
    runs = runs_of(results)
    return Page(
        title="Check against a baseline",
        headline=check_headline(comparison),
        replays=[runs_replay(runs)] if runs else [],
        tables=tables,
        pictures=[figure_picture("how far numbers moved", plot_comparison(comparison.rows))]
        if judged(comparison.rows)
        else [],
        details={**details, "numbers": summary(comparison), "numbers not shown": left or None},
        warnings=[*warnings, *reasons(comparison, baseline)],
    )


def check_headline(comparison: Comparison) -> str:
    """Pass or fail, and what moved most, in a sentence."""
    rows = comparison.rows
    failures = comparison.failures
    if not failures:
        better = sum(row.verdict == BETTER for row in rows)
        more = f" {better} are better than before." if better else ""
        return f"Passed: none of {len(rows)} numbers got worse than its tolerance and chance allow.{more}"
    first, *others = failures
    change = "" if None in (first.before, first.now) else f", {first.before:.4g} before and {first.now:.4g} now"
    rest = f", and {len(others)} more" if others else ""
    return (
        f"Failed: {first.metric} of {first.case} is {first.verdict}{change}{rest}. {len(rows)} numbers were compared."
    )


def runs_of(results: Sequence[Path]) -> list[Run]:
    """Runs of one body among results and beside them, `RUNS` at most."""
    found: dict[Path, Run] = {}
    for path in results:
        file = path if path.suffix == ".npz" else (path if path.is_dir() else path.parent) / RUN_FILE
        if len(found) < RUNS and file.resolve() not in found and file.is_file():
            run = read_run(file)
            if len(run.bodies) == 1:
                found[file.resolve()] = run
    return list(found.values())


def runs_replay(runs: Sequence[Run]) -> Replay:
    """Runs side by side."""
    actors = [
        run_actor(run, f"{run.reference.name}, {run.controller}, seed {run.seed}", colour)
        for run, colour in zip(runs, COLOURS[2:])
    ]
    return Replay("what was checked", side_by_side(actors))
