"""A comparison for people: a table of what moved, one line of summary, and what differs besides."""

import io
import math
from collections import Counter
from collections.abc import Iterator, Sequence

from rich.console import Console
from rich.table import Table

from simprep.regression.baseline import Baseline
from simprep.regression.compare import BETTER, GONE, MOVED, NEW, SAME, WORSE, Comparison, Row

STYLES = {WORSE: "red", MOVED: "red", GONE: "red", BETTER: "green", NEW: "dim", SAME: ""}
WIDTH, SHOWN = 150, 40


def table_of(rows: Sequence[Row]) -> Table:
    """A table with a line for each row: before, now, and between what the number may lie."""
    table = Table()
    for heading in ("case", "metric"):
        table.add_column(heading, overflow="fold")
    for heading in ("before", "now", "change", "allowed", "seeds"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    for row in rows:
        table.add_row(row.case, row.metric, *cells(row), row.verdict, style=STYLES[row.verdict])
    return table


def told(comparison: Comparison) -> tuple[Row, ...]:
    """Rows to show first: failures, then what is better or new."""
    failures = set(map(id, comparison.failures))
    return (*comparison.failures, *(row for row in comparison.changes if id(row) not in failures))


def cells(row: Row) -> tuple[str, str, str, str, str]:
    """Before, now, change, what is allowed and numbers of seeds, as text."""
    seeds = f"{row.seeds[0]}, {row.seeds[1]}"
    return _number(row.before), _number(row.now), _change(row), _allowed(row), seeds


def summary(comparison: Comparison) -> str:
    """How many numbers of how many cases have which verdict, in one line."""
    counts = Counter(row.verdict for row in comparison.rows)
    known = {WORSE: "worse", MOVED: "moved", GONE: "gone", BETTER: "better", SAME: "within", NEW: "new"}
    found = ", ".join(f"{counts[verdict]} {word}" for verdict, word in known.items() if counts[verdict])
    return f"{len(comparison.rows)} numbers of {len({row.case for row in comparison.rows})} cases: {found or 'none'}"


def reasons(comparison: Comparison, baseline: Baseline) -> Iterator[str]:
    """What differs besides the numbers, a line each; of the baseline, when it was made and why."""
    if comparison.failures:
        found = comparison.differences
        if not found:
            yield "versions, processor and seeds are those of the baseline: the program or its input has changed"
        elif all(line.startswith("seeds ") for line in found):
            yield "versions and processor are those of the baseline; chance of the seeds is in the bands (*)"
    yield from (f"differs: {line}" for line in comparison.differences)
    yield from (f"note: {note}" for note in comparison.notes)
    if baseline.history:
        last = baseline.history[-1]
        yield f"baseline of {last.date_utc[:10]}: {last.reason}"


def as_text(comparison: Comparison, baseline: Baseline) -> str:
    """Table of changes, summary and reasons as plain text."""
    stream = io.StringIO()
    console = Console(file=stream, width=WIDTH, no_color=True)
    rows = told(comparison)
    if rows:
        console.print(table_of(rows[:SHOWN]))
    if len(rows) > SHOWN:
        console.print(f"and {len(rows) - SHOWN} more", highlight=False)
    for line in (summary(comparison), *reasons(comparison, baseline)):
        console.print(line, highlight=False, markup=False)
    if any(row.chance for row in rows):
        console.print(f"* by chance alone, one check in {1 / baseline.false_alarm:.0f} alarms", highlight=False)
    return stream.getvalue().rstrip()


def _allowed(row: Row) -> str:
    if row.before is None or row.low is None or row.high is None:
        return "-"
    even = math.isclose(row.high - row.before, row.before - row.low, rel_tol=1e-6, abs_tol=1e-12)
    text = f"± {(row.high - row.low) / 2:.3g}" if even else f"{_number(row.low)} to {_number(row.high)}"
    return text + (" *" if row.chance else "")


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.5g}"


def _change(row: Row) -> str:
    if row.before is None or row.now is None:
        return "-"
    difference = row.now - row.before
    share = f" ({difference / abs(row.before):+.1%})" if row.before else ""
    return f"{difference:+.3g}{share}"
