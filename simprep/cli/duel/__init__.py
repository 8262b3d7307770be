"""`simprep duel ...`: two fighters. One file per subcommand."""

from typing import Annotated

import tyro

from simprep.cli.duel.analyse import DuelAnalyse
from simprep.cli.duel.import_pair import DuelImport
from simprep.cli.duel.join import DuelJoin
from simprep.cli.duel.label import DuelLabel
from simprep.cli.duel.synthetic import DuelSynthetic

DESCRIPTION = """Two fighters: a recording of two people or a built-in stream, its actions, and a model of how one answers the other.

Example: simprep duel import a.bvh b.bvh -o pair.npz"""

Duel = (
    Annotated[DuelImport, tyro.conf.subcommand("import")]
    | Annotated[DuelJoin, tyro.conf.subcommand("join")]
    | Annotated[DuelLabel, tyro.conf.subcommand("label")]
    | Annotated[DuelSynthetic, tyro.conf.subcommand("synthetic")]
    | Annotated[DuelAnalyse, tyro.conf.subcommand("analyse")]
)
