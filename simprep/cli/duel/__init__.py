"""`simprep duel ...`: two fighters. One file per subcommand."""

from typing import Annotated

import tyro

from simprep.cli.duel.analyze import DuelAnalyze
from simprep.cli.duel.example import DuelExample
from simprep.cli.duel.import_pair import DuelImport
from simprep.cli.duel.join import DuelJoin
from simprep.cli.duel.label import DuelLabel

DESCRIPTION = """Two fighters: a recording of two people or a built-in stream, its actions, and a model of how one answers the other.

Example: simprep duel import a.bvh b.bvh -o pair.npz"""

Duel = (
    Annotated[DuelImport, tyro.conf.subcommand("import")]
    | Annotated[DuelJoin, tyro.conf.subcommand("join")]
    | Annotated[DuelLabel, tyro.conf.subcommand("label")]
    | Annotated[DuelExample, tyro.conf.subcommand("example")]
    | Annotated[DuelAnalyze, tyro.conf.subcommand("analyze")]
)
