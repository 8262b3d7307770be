"""The `simprep` command: choose a subcommand, run it, turn errors into one line and an exit code."""

import os
import sys
from collections.abc import Sequence
from typing import Annotated, Any

import tyro

from simprep import __version__
from simprep.cli import duel, library, output, robot
from simprep.cli.app import AppCommand
from simprep.cli.approach import Approach
from simprep.cli.check import Check
from simprep.cli.check_motion import CheckMotion
from simprep.cli.convert import Convert
from simprep.cli.fight import FightCommand
from simprep.cli.graph import Graph
from simprep.cli.import_motion import Import
from simprep.cli.margins import MarginsCommand
from simprep.cli.push import PushCommand
from simprep.cli.render import Render
from simprep.cli.stability import StabilityCommand
from simprep.cli.sweep import SweepCommand
from simprep.cli.track import Track
from simprep.cli.train import Train
from simprep.cli.validate import Validate
from simprep.cli.view import View
from simprep.errors import SimprepError
from simprep.report import gl

OK, FAILED, USAGE, INTERRUPTED = 0, 1, 2, 130

Command = (
    Annotated[Validate, tyro.conf.subcommand("validate")]
    | Annotated[Track, tyro.conf.subcommand("track")]
    | Annotated[PushCommand, tyro.conf.subcommand("push")]
    | Annotated[MarginsCommand, tyro.conf.subcommand("margins")]
    | Annotated[SweepCommand, tyro.conf.subcommand("sweep")]
    | Annotated[StabilityCommand, tyro.conf.subcommand("stability")]
    | Annotated[Import, tyro.conf.subcommand("import")]
    | Annotated[Convert, tyro.conf.subcommand("convert")]
    | Annotated[CheckMotion, tyro.conf.subcommand("check-motion")]
    | Annotated[Check, tyro.conf.subcommand("check")]
    | Annotated[duel.Duel, tyro.conf.subcommand("duel", description=duel.DESCRIPTION)]
    | Annotated[FightCommand, tyro.conf.subcommand("fight")]
    | Annotated[Graph, tyro.conf.subcommand("graph")]
    | Annotated[Train, tyro.conf.subcommand("train")]
    | Annotated[Approach, tyro.conf.subcommand("approach")]
    | Annotated[View, tyro.conf.subcommand("view")]
    | Annotated[Render, tyro.conf.subcommand("render")]
    | Annotated[AppCommand, tyro.conf.subcommand("app")]
    | Annotated[robot.Robot, tyro.conf.subcommand("robot", description=robot.DESCRIPTION)]
    | Annotated[library.Library, tyro.conf.subcommand("library", description=library.DESCRIPTION)]
)

FORMER_NAMES = {("duel", "analyze"): "analyse", ("duel", "example"): "synthetic"}
"""Subcommands that had another name, which still works."""

DESCRIPTION = """Preparation motions and interactions for simulated humanoids, validated by physics in MuJoCo.

Example: simprep validate"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: arguments without the program name; None for the process's own.

    Returns:
        Exit code: 0 done, 2 bad usage or input (one line on stderr), 130 interrupted.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments == ["--version"]:
        print(f"simprep {__version__}")
        return OK
    output.arguments = tuple(arguments)
    _keep_gl_out_of_import()
    try:
        parse(arguments).run()
    except SystemExit as stop:  # tyro: --help is 0, a wrong argument 2
        return stop.code if isinstance(stop.code, int) else USAGE
    except SimprepError as error:
        print(f"simprep: {' '.join(str(error).split())}", file=sys.stderr)
        return USAGE
    except KeyboardInterrupt as stop:
        print(f"simprep: interrupted; {str(stop) or 'nothing was written'}", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output closed it, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except OSError as error:  # a full disk, a folder that is not ours
        print(f"simprep: {error.filename or 'input or output'}: {error.strerror or error}", file=sys.stderr)
        return USAGE
    return OK


def parse(arguments: list[str]) -> Any:
    """The command that arguments ask for, not yet run.

    Raises:
        SystemExit: after the help text (0), or a wrong argument (2).
    """
    return tyro.cli(
        Command,  # type: ignore[arg-type]
        prog="simprep",
        description=DESCRIPTION,
        args=_with_present_names(arguments) or ["--help"],
        config=(tyro.conf.OmitSubcommandPrefixes, tyro.conf.FlagCreatePairsOff),
    )


def _with_present_names(arguments: list[str]) -> list[str]:
    for (command, former), present in FORMER_NAMES.items():
        if arguments[:2] == [command, former]:
            return [command, present, *arguments[2:]]
    return arguments


def _keep_gl_out_of_import() -> None:
    """Let `import mujoco` succeed on a machine whose MUJOCO_GL names a missing library; `report.gl` gets the wish.

    mujoco loads the library that MUJOCO_GL names while it is imported, and fails with it; pictures are optional here.
    """
    if "mujoco" not in sys.modules:
        os.environ.setdefault(gl.WISH, os.environ.get("MUJOCO_GL", ""))
        os.environ["MUJOCO_GL"] = "disable"


if __name__ == "__main__":
    sys.exit(main())
