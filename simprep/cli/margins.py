"""`simprep margins`: margins of stability for each step, left and right, sideways and fore-aft apart."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from simprep.cli import output as output_module
from simprep.cli.library import LibraryFolder
from simprep.cli.output import BaseCommand, Json, Output, Quiet, Robot

if TYPE_CHECKING:
    from simprep.arrays import FloatArray
    from simprep.metrics.margins import Margins
    from simprep.motion.motion import Motion
    from simprep.physics.run import Run


@dataclass(frozen=True)
class MarginsCommand(BaseCommand):
    """Margins of stability for each step of a motion or a simulated run: left and right, sideways and fore-aft apart.

    Prints what the numbers are: COM model, base of support, pendulum length, sign, event. Writes metrics.json, steps.csv,
    and the margins over 0 to 100 % of each step as curves.csv and curves.mot; where plots can be drawn, curves.png and
    report.html, a page with a replay that opens from disk. docs/margins.md says more.

    Example: simprep margins walk --seconds 10 -o out/margins
    """

    motion: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="MOTION|RUN", help_behavior_hint="")]
    """A motion of the library, a motion file, or the run.npz of `simprep track` (or its folder)."""

    robot: Robot = None

    cycle: bool = False
    """Curves over whole gait cycles, to the next touch-down of the same foot, instead of steps."""

    seconds: Annotated[float | None, tyro.conf.arg(metavar="FLOAT", help_behavior_hint="")] = None
    """Length [s]: a loop is repeated up to it (default 6), any other motion cut. Not of a run."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="DIR", help_behavior_hint="")] = None
    """Folder for the results; default results/margins/MOTION."""

    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    no_pictures: bool = False
    """Draw nothing."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from simprep.motion.motion import Motion

        subject = self._subject(output)
        simulated = not isinstance(subject, Motion)
        from simprep.metrics.balance import balance
        from simprep.metrics.margins import definitions, normalised_curves, step_margin_summary, step_margins
        from simprep.report.margin_files import save_curves_csv, save_curves_mot, save_steps
        from simprep.report.results import provenance, save_json

        motion = subject if isinstance(subject, Motion) else subject.simulated_motion()
        margins = step_margins(motion, balance(motion))
        about = definitions(motion)
        curves = normalised_curves(margins, self.cycle)
        folder = self.out or Path("results") / "margins" / motion.name
        if not margins.steps:
            output.warn(f"{motion.name}: no foot lands, so there are no steps")
        files = [
            folder / "metrics.json",
            save_steps(margins.steps, folder / "steps.csv"),
            save_curves_csv(curves, folder / "curves.csv"),
            save_curves_mot(curves, folder / "curves.mot", about),
        ]
        made, table = provenance(output_module.arguments), _table(margins)
        if not self.no_pictures:
            files += self._pictures(subject, margins, curves, table, about, folder, made, output)
        content = {
            "schema": "simprep.margins/1",
            **made,
            "motion": motion.name,
            "simulated": simulated,
            "n_steps": {side: sum(one.side == side for one in margins.steps) for side in ("left", "right")},
            "definitions": about,
            **step_margin_summary(margins.steps),
            "steps": [asdict(one) for one in margins.steps],
            "curves_over": "cycle" if self.cycle else "step",
            "n_curves": len(curves) // 3,
            "warnings": output.warnings,
            "files": [path.name for path in files],
        }
        save_json(files[0], content)
        for name, text in about.items():
            output.say(f"{name}: {text}")
        output.say(table)
        output.say(f"written: {', '.join(map(str, files))}")
        return content

    def _pictures(
        self,
        subject: "Motion | Run",
        margins: "Margins",
        curves: "Mapping[str, FloatArray]",
        table: Any,
        about: Mapping[str, str],
        folder: Path,
        made: Mapping[str, Any],
        output: Output,
    ) -> list[Path]:
        """Plot and report page, where they can be drawn."""
        from simprep.report.gl import pictures_or_warning
        from simprep.report.margin_figure import plot_step_margins
        from simprep.report.margin_page import margin_page
        from simprep.report.page import write_report

        files: list[Path] = []
        if curves:
            title, over = "Margins of stability", "cycle" if self.cycle else "step"
            with pictures_or_warning("no plot", output.warn):
                files.append(plot_step_margins(curves, folder / "curves.png", title, over))
        page = partial(margin_page, subject, margins.steps, table, about, files, made, output.warnings)
        return files + write_report(folder, page, output.warn)

    def _subject(self, output: Output) -> "Motion | Run":
        """What is measured."""
        from simprep.cli.resolve import resolve_motion, select
        from simprep.errors import SettingError

        if (path := _run_file(self.motion)) is not None:
            if self.seconds is not None or self.robot is not None:
                raise SettingError("--seconds and --robot are for motions; a run is measured as it is")
            from simprep.physics.store import read_run

            run = read_run(path)
            if len(run.bodies) != 1:
                raise SettingError(f"{path}: a run of {len(run.bodies)} bodies; valid: of one")
            return run
        motion = resolve_motion(self.motion, output.warn, self.library, self.robot)
        return select(motion, None, self.seconds, output.warn)


def _run_file(text: str) -> Path | None:
    """The run that a path means; None if it means no run."""
    from simprep.archive import schema_of
    from simprep.physics.store import RUN_FILE

    path = Path(text)
    path = path / RUN_FILE if path.is_dir() else path
    is_run = path.suffix == ".npz" and path.is_file() and (schema_of(path) or "").startswith("simprep.run/")
    return path if is_run else None


def _table(margins: "Margins") -> Any:
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text("Margins of stability [mm]"), title_justify="left")
    names = ("touch-down [s]", "ml", "ml, least in stance", "front", "back", "pendulum [m]")
    table.add_column("foot")
    for name in names:
        table.add_column(Text(name), justify="right")
    for one in margins.steps:
        lengths = (one.ml_m, one.ml_least_m, one.front_m, one.back_m)
        table.add_row(
            one.side, f"{one.touchdown_s:.2f}", *(f"{1e3 * value:.0f}" for value in lengths), f"{one.pendulum_m:.3f}"
        )
    for side in ("left", "right"):
        own = [one for one in margins.steps if one.side == side]
        if own:
            columns = ([getattr(one, name) for one in own] for name in ("ml_m", "ml_least_m", "front_m", "back_m"))
            table.add_row(f"{side}, mean ± SD of {len(own)}", "", *(_mean_sd(values) for values in columns), "")
    return table


def _mean_sd(values: list[float]) -> str:
    import numpy as np

    return f"{1e3 * np.mean(values):.0f} ± {1e3 * np.std(values, ddof=1) if len(values) > 1 else 0:.0f}"
