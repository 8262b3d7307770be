"""`simprep view`: look at any motion or result in the browser."""

import os
import sys
import tempfile
import webbrowser
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from simprep.cli import output as output_module
from simprep.cli.library import LibraryFolder
from simprep.cli.output import BaseCommand, Json, Output, Quiet, Robot


@dataclass(frozen=True)
class View(BaseCommand):
    """Open a motion or a result as a page with a 3-D replay, tables and plots.

    The page is one HTML file that opens from disk and needs no network. The folder of a result that has a report.html is
    shown by that.

    Example: simprep view results/track/walk_mpc
    """

    OUT_IS_FILE = True

    file: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="FILE", help_behavior_hint="")]
    """A run (run.npz), a motion or a stream of people; the folder or the metrics.json of a result; any motion file
    (docs/formats.md); or the name of a motion of the library."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="HTML", help_behavior_hint="")] = None
    """The page to write; default: a file in a new temporary folder."""

    no_open: bool = False
    """Only write the page; open no browser."""

    robot: Robot = None
    library: LibraryFolder = None
    """Folder of your own clips; default SIMPREP_LIBRARY, where set."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        kind, path = self._page(output)
        opened = not self.no_open and _has_screen() and webbrowser.open(path.resolve().as_uri())
        output.say(f"{kind}: {path}" + ("" if opened else " (open it in a browser)"))
        return {"schema": "simprep.view/1", "kind": kind, "file": str(path), "opened": opened}

    def _page(self, output: Output) -> tuple[str, Path]:
        from simprep.cli.shown import REPORT_FILE, read_shown, result_folder

        folder = result_folder(Path(self.file)) or Path(self.file)
        if self.out is None and (folder / REPORT_FILE).is_file():
            return "report", folder / REPORT_FILE
        shown = read_shown(self.file, output.warn, self.library, self.robot)
        from simprep.metrics.evaluate import evaluate_motion, evaluate_run
        from simprep.report.page import save_page
        from simprep.report.results import provenance
        from simprep.report.run_page import motion_page, pair_page, run_page

        made = provenance(output_module.arguments)
        if shown.run is not None:
            single = len(shown.run.bodies) == 1
            page = run_page(shown.run, evaluate_run(shown.run) if single else {}, made, output.warnings)
        elif shown.stream is not None:
            page = pair_page(shown.name, shown.stream.players, made)
        else:
            assert shown.motion is not None
            page = motion_page(shown.motion, evaluate_motion(shown.motion), made, output.warnings)
        path = self.out or Path(tempfile.mkdtemp(prefix="simprep_view_")) / f"{shown.name}.html"
        return shown.kind, save_page(page, path)


def _has_screen() -> bool:
    """Whether a browser would have somewhere to open; without, Python may start one that fills the terminal."""
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
