"""The best policy without learning: value iteration on the quantised model."""

from simprep.controller.cores import core_motions
from simprep.controller.displacement import DisplacementTable, displacement_table
from simprep.controller.model import build_model
from simprep.controller.policy import Policy
from simprep.controller.settings import ControllerSettings
from simprep.controller.value_iteration import backup, value_iteration
from simprep.library import library_motion
from simprep.motion.motion import Motion

ANY_TARGET = "punch_right"
"""Synthesis needs a target; the displacement is the same for all."""


def measure(settings: ControllerSettings, target: Motion | None = None) -> DisplacementTable:
    """Displacements of a controller's core nodes, measured with a target; None: one of the library."""
    return displacement_table(core_motions(settings), target or library_motion(ANY_TARGET), settings)


def best_policy(settings: ControllerSettings | None = None, table: DisplacementTable | None = None) -> Policy:
    """A policy that earns the largest return in the quantised model; displacements are measured if None are given."""
    settings = settings or ControllerSettings()
    table = table or measure(settings)
    _, actions = value_iteration(backup(build_model(table, settings)))
    return Policy(actions, table, settings, {"method": "value iteration"})
