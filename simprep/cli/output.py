"""What a command prints: tables for people on stdout, or one JSON value there and everything else on stderr."""

import contextlib
import json
import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import tyro
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from simprep.errors import SettingError

if TYPE_CHECKING:
    from simprep.motion.motion import Motion

PLAIN_WIDTH = 150

Json = Annotated[bool, tyro.conf.arg(help="Print one JSON object on stdout; everything else goes to stderr.")]
Quiet = Annotated[bool, tyro.conf.arg(help="Print no tables and no progress; warnings and errors stay.")]
"""The two options of every command."""
Preset = Annotated[
    Literal["live", "default", "bake"],
    tyro.conf.arg(help="How much mpc computes: live least, bake most. docs/tracking.md has cost and error of each."),
]
"""Names of `simprep.physics.mpc_settings.MPC_PRESETS`, which is slow to import."""
Robot = Annotated[
    str | None,
    tyro.conf.arg(
        metavar="NAME|PATH",
        help_behavior_hint="",
        help="Whose motion it becomes: a robot's name (`simprep robot list`) or its .xml or .toml file; default the humanoid. A motion of another body is retargeted.",
    ),
]
"""The body of every command that takes a motion."""

arguments: tuple[str, ...] = ()
"""The command line after `simprep`, for the record; `main` sets it."""


class Output:
    """Where a command writes.

    Args:
        as_json: stdout holds exactly one JSON value; tables and progress go to stderr.
        quiet: tables and progress go nowhere; warnings still go to stderr.
    """

    def __init__(self, as_json: bool, quiet: bool = False) -> None:
        self.as_json, self.quiet = as_json, quiet
        self._stdout = sys.stdout
        self.warnings: list[str] = []
        self.console = _console(sys.stderr if as_json else sys.stdout)
        self.progress_console = _console(sys.stderr)

    def say(self, what: Any) -> None:
        """Print text or a rich table for people, unless they want it quiet."""
        if not self.quiet:
            self.console.print(what, highlight=False)

    def warn(self, text: str) -> None:
        """Print one line of warning on stderr, and keep it for the record."""
        self.warnings.append(text)
        self.progress_console.print(f"warning: {text}", style="yellow", markup=False, highlight=False, soft_wrap=True)

    def result(self, content: Mapping[str, Any] | Sequence[Any]) -> None:
        """Print the machine-readable result, where it was asked for; NaN and infinity become null."""
        if self.as_json:
            from simprep.report.results import jsonable

            self._stdout.write(json.dumps(jsonable(content), allow_nan=False) + "\n")
            self._stdout.flush()

    def say_metrics(self, metrics: Mapping[str, Any]) -> None:
        """Print numbers by name as a table, whose floats have 4 digits."""
        table = Table()
        table.add_column("metric")
        table.add_column("value", justify="right")
        for name, value in metrics.items():
            table.add_row(name, "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value))
        self.say(table)

    @contextlib.contextmanager
    def stdout_reserved(self) -> Iterator[None]:
        """Send what libraries print to stdout to stderr instead, while JSON is expected there."""
        if not self.as_json:
            yield
            return
        with contextlib.redirect_stdout(sys.stderr):
            yield

    @contextlib.contextmanager
    def simulating(self, what: str, motion: "Motion") -> Iterator[Callable[[float], None]]:
        """Progress in seconds of a motion; gives a function to be told the share that is simulated."""
        with self.progress() as bar:
            task = bar.add_task(what, total=round(motion.duration, 1))
            yield lambda share: bar.update(task, completed=round(share * motion.duration, 1))

    def progress(self) -> Progress:
        """A progress bar on stderr; silent where that is wanted, or stderr is not a terminal."""
        return Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=self.progress_console,
            transient=True,
            disable=self.quiet or not self.progress_console.is_terminal,
        )


class BaseCommand(ABC):
    """A command of the command line, whose options are its fields."""

    OUT_IS_FILE: ClassVar[bool] = False
    """Whether the option `out` names a file; otherwise a folder."""

    json: bool
    quiet: bool

    def run(self) -> Any:
        """Do the work, print the machine-readable result where it was asked for, and return it.

        Raises:
            SettingError: a seed below 0, or no place to write to; said before the work, which may take hours.
        """
        seed, out = getattr(self, "seed", None), getattr(self, "out", None)
        if seed is not None and seed < 0:
            raise SettingError(f"--seed {seed}; valid: 0 or more")
        if out is not None:
            _check_place(out, self.OUT_IS_FILE)
        output = Output(self.json, self.quiet)
        with output.stdout_reserved():
            content = self._run(output)
        output.result(content)
        return content

    @abstractmethod
    def _run(self, output: Output) -> Mapping[str, Any] | Sequence[Any]:
        """What the command does; it prints for people itself, and returns what `--json` prints."""


def _check_place(out: Path, is_file: bool) -> None:
    """SettingError where a file or folder cannot be written, because a file is in its way or the folder is not ours."""
    if is_file and out.is_dir():
        raise SettingError(f"-o {out}: a folder; valid: a file")
    folder = out.parent if is_file else out
    there = next((one for one in (folder, *folder.parents) if one.exists()), Path("."))
    if not there.is_dir():
        raise SettingError(f"-o {out}: {there} is a file; valid: a folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise SettingError(f"-o {out}: {there} cannot be written to")


def _console(stream: Any) -> Console:
    console = Console(file=stream)
    return console if console.is_terminal else Console(file=stream, width=PLAIN_WIDTH)
