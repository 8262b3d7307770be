"""`simprep duel ...`: two fighters. One file per subcommand."""

from dataclasses import dataclass
from typing import Annotated

import tyro

from simprep.cli.duel_import import DuelImport
from simprep.cli.duel_label import DuelLabel


@dataclass(frozen=True)
class Duel:
    """Two fighters: import a recording, label its actions.

    Example: simprep duel import a.bvh b.bvh -o pair.npz
    """

    command: Annotated[DuelImport, tyro.conf.subcommand("import")] | Annotated[DuelLabel, tyro.conf.subcommand("label")]

    def run(self) -> None:
        """Run the subcommand."""
        self.command.run()
