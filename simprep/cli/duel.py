"""`simprep duel ...`: two fighters. One file per subcommand."""

from typing import Annotated

import tyro

from simprep.cli.duel_import import DuelImport
from simprep.cli.duel_join import DuelJoin
from simprep.cli.duel_label import DuelLabel

DESCRIPTION = """Two fighters: import a recording of two people, join clips, label their actions.

Example: simprep duel import a.bvh b.bvh -o pair.npz"""

Duel = (
    Annotated[DuelImport, tyro.conf.subcommand("import")]
    | Annotated[DuelJoin, tyro.conf.subcommand("join")]
    | Annotated[DuelLabel, tyro.conf.subcommand("label")]
)
