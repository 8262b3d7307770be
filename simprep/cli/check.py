"""`simprep check`: have numbers moved away from a baseline?"""

import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from simprep.cli import output as output_module
from simprep.cli.output import BaseCommand, Json, Output, Quiet
from simprep.errors import MotionFileError, SettingError

if TYPE_CHECKING:
    from simprep.regression.baseline import Baseline
    from simprep.regression.compare import Comparison
    from simprep.regression.measured import Measured

REGRESSION = 1
"""Exit code of a check that found one."""


@dataclass(frozen=True)
class Check(BaseCommand):
    """Compare results with a baseline, and print what moved by more than its tolerance and by more than chance allows.

    Exit code 1 if something got worse, moved where no direction is known to be better, or is missing. docs/regression.md has
    the rules. Writes report.html, a page that opens from disk, with a replay where RESULTS have a run.

    Example: simprep check results/validate --baseline baseline.json --update --reason "first" && simprep check results/validate --baseline baseline.json
    """

    results: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(metavar="RESULTS", help_behavior_hint="")]
    """What simprep's commands wrote: folders, metrics.json, output of --json; or .jsonl or .csv with a record on each line,
    or a run (.npz). Several are taken together, such as runs of several seeds."""

    baseline: Annotated[Path, tyro.conf.arg(metavar="FILE", help_behavior_hint="")]
    """The baseline, a JSON file to be kept beside the code."""

    update: bool = False
    """Accept the results: write them to the baseline, with --reason."""

    reason: Annotated[str | None, tyro.conf.arg(metavar="TEXT", help_behavior_hint="")] = None
    """Why the baseline changes; kept in it with date and versions."""

    tolerance: Annotated[tuple[str, ...], tyro.conf.arg(metavar="METRIC=...", help_behavior_hint="")] = ()
    """What a metric may move: mpjpe_mm=2, 'peak_*=5%', '*_mm=1+2%' (the larger holds). --update keeps them in the baseline."""

    false_alarm: Annotated[float | None, tyro.conf.arg(metavar="FLOAT", help_behavior_hint="")] = None
    """Probability that a check alarms where nothing has changed; default that of the baseline, 0.001."""

    by: Annotated[tuple[str, ...], tyro.conf.arg(metavar="KEY", help_behavior_hint="")] = ()
    """Numbers that tell cases apart, besides texts and alpha."""

    strict: bool = False
    """A change for the better fails too."""

    junit: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Write the outcome as JUnit XML too."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = None
    """Folder for the report; default results/check."""

    no_pictures: bool = False
    """Write no report."""

    all: bool = False
    """Print every metric, not only what moved (the first 40 of it)."""

    json: Json = False
    quiet: Quiet = False

    def run(self) -> Any:
        """As every command; exit code 1 where there is a regression."""
        content = super().run()
        if content.get("verdict") == "fail" and not self.update:
            sys.exit(REGRESSION)
        return content

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.regression.compare import compare
        from simprep.regression.junit import save_junit
        from simprep.regression.read_results import read_results
        from simprep.regression.tables import SHOWN, reasons, summary, table_of, told

        if not self.results:
            raise SettingError("no RESULTS; valid: one or more files or folders")
        if self.update != (self.reason is not None):
            raise SettingError("--update and --reason TEXT belong together: a baseline is not changed without a reason")
        measured = read_results(self.results, self.by)
        former = None if self.update and not self.baseline.exists() else self._former()
        baseline = former or self._accepted(measured, None)
        comparison = compare(measured, baseline, self.strict)
        rows = comparison.rows if self.all else told(comparison)
        shown = rows if self.all else rows[:SHOWN]
        if rows:
            output.say(table_of(shown))
        if len(shown) < len(rows):
            output.say(f"and {len(rows) - len(shown)} more; --all prints them")
        output.say(summary(comparison))
        for line in reasons(comparison, baseline):
            output.say(line)
        files = []
        if self.junit:
            files.append(save_junit(comparison, self.junit))
        if self.update:
            from simprep.regression.baseline import save_baseline

            files.append(save_baseline(self._accepted(measured, former), self.baseline))
        from simprep.report.results import provenance

        made = provenance(output_module.arguments)
        if not self.no_pictures:
            files += self._report(comparison, baseline, made, output)
        if files:
            output.say(f"written: {', '.join(map(str, files))}")
        return {
            "schema": "simprep.regression/1",
            **made,
            "baseline": str(self.baseline),
            "verdict": "fail" if comparison.failures else "pass",
            "failures": len(comparison.failures),
            "false_alarm": baseline.false_alarm,
            "differences": comparison.differences,
            "notes": comparison.notes,
            "history": [asdict(change) for change in baseline.history],
            "rows": [asdict(row) for row in comparison.rows],
            "files": list(map(str, files)),
        }

    def _report(
        self, comparison: "Comparison", baseline: "Baseline", made: Mapping[str, Any], output: Output
    ) -> list[Path]:
        from simprep.regression.page import check_page
        from simprep.report.page import write_report

        page = partial(check_page, comparison, baseline, self.results, made, output.warnings)
        return write_report(self.out or Path("results") / "check", page, output.warn)

    def _former(self) -> "Baseline":
        """The baseline as it is, with the wishes of the command line."""
        from dataclasses import replace

        from simprep.regression.baseline import read_baseline
        from simprep.regression.tolerance import parse_tolerance

        if self.baseline.is_dir():
            raise MotionFileError(self.baseline, "a folder; valid: a baseline's JSON file")
        kept = read_baseline(self.baseline)
        wishes = tuple(map(parse_tolerance, self.tolerance))
        rate = kept.false_alarm if self.false_alarm is None else self.false_alarm
        return replace(kept, tolerances=(*wishes, *kept.tolerances), false_alarm=rate)

    def _accepted(self, measured: "Measured", former: "Baseline | None") -> "Baseline":
        from simprep.regression.baseline import new_baseline
        from simprep.regression.tolerance import parse_tolerance

        wishes = tuple(map(parse_tolerance, self.tolerance))
        return new_baseline(measured, self.reason or "", former, wishes, self.false_alarm)
