"""`simprep robot ...`: the robots that simprep knows, and a first description of one that it does not know."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from simprep.cli.output import BaseCommand, Json, Output, Quiet


@dataclass(frozen=True)
class List(BaseCommand):
    """List the robots whose descriptions are shipped, and whether their models are here.

    Example: simprep robot list
    """

    json: bool = False
    """Print one JSON list on stdout; everything else goes to stderr."""

    quiet: Quiet = False

    def _run(self, output: Output) -> list[dict[str, Any]]:
        from rich.markup import escape
        from rich.table import Table

        from simprep.robots.description import read_description
        from simprep.robots.download import state_of_model
        from simprep.robots.resolve import shipped_robots

        table = Table()
        for title in ("robot", "joints", "model", "description"):
            table.add_column(title, justify="right" if title == "joints" else "left", no_wrap=title == "robot")
        content = []
        for name, path in shipped_robots().items():
            description = read_description(path)
            row = {
                "name": name,
                "joints": len(description.movements),
                "model": state_of_model(description),
                "toml": str(path),
            }
            content.append(row)
            table.add_row(name, str(row["joints"]), escape(str(row["model"])), path.name)
        output.say(table)
        output.say("a robot of your own: --robot PATH, with its .toml beside the .xml ('simprep robot describe')")
        return content


@dataclass(frozen=True)
class Describe(BaseCommand):
    """Write a first TOML description of a robot from its model: roles, joints, standing pose, mirror signs, soles.

    It prints what to check and what to fill in.

    Example: simprep robot describe my_robot.xml -o my_robot.toml
    """

    OUT_IS_FILE = True

    model: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="MJCF", help_behavior_hint="")]
    """The robot's model file, .xml, looking along x with z up."""

    out: Annotated[Path | None, tyro.conf.arg(aliases=("-o",), metavar="FILE", help_behavior_hint="")] = None
    """The .toml to write; default: the text on stdout. Beside the model and of its name it is found by itself."""

    json: Json = False
    quiet: Quiet = False

    def _run(self, output: Output) -> dict[str, Any]:
        from rich.markup import escape

        from simprep.errors import RobotFileError
        from simprep.files import atomic_path
        from simprep.robots.describe import describe_robot, try_description

        found = describe_robot(self.model)
        checks = list(found.checks)
        if self.out is None:
            if not self.json:
                print(found.text)
        else:
            try:
                with atomic_path(self.out) as temporary:
                    temporary.write_text(found.text, encoding="utf-8")
            except OSError as error:
                raise RobotFileError(self.out, f"cannot be written ({error.strerror})") from None
            checks = [*try_description(self.model, self.out), *checks]
            output.say(f"written: {self.out}")
        for check in checks:
            output.warn(check) if self.out is None else output.say(f"- {escape(check)}")
        return {"toml": found.text, "checks": checks, "out": None if self.out is None else str(self.out)}


Robot = Annotated[List, tyro.conf.subcommand("list")] | Annotated[Describe, tyro.conf.subcommand("describe")]
DESCRIPTION = """Robots: those that simprep knows, and a first description of one that it does not know.

Example: simprep robot list"""
