"""What ends a simulated run before its time: falls and divergence."""

from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.physics.bodies import SceneBody
from simprep.physics.ground import GroundReader
from simprep.physics.reference import Reference


@dataclass(frozen=True)
class FallRule:
    """When a run counts as a fall.

    Attributes:
        drop: the pelvis or head is lower than the reference's by more than this [m].
        clearance: or pelvis, trunk, neck or head touch the floor while the reference's is higher than this [m].
    """

    drop: float = 0.35
    clearance: float = 0.10


def fall(
    data: mujoco.MjData, body: SceneBody, reference: Reference, step: int, ground: GroundReader, rule: FallRule
) -> str:
    """The rule by which a body has fallen, in words; empty if it has not.

    Args:
        data: after the step.
        body: which body.
        reference: what it tracks.
        step: index of the state in the reference.
        ground: of this body.
        rule: what counts as a fall.
    """
    heights = data.xpos[body.segments, 2]
    goal = reference.kinematics.xpos[step - 1, :, 2]  # data.xpos belongs to the state before the step
    for name in [role for role in ("pelvis", "head") if body.character.has(role)]:
        index = body.character.segment(name)
        if heights[index] < goal[index] - rule.drop:
            return f"the {name} is {goal[index] - heights[index]:.2f} m lower than the reference's"
    for index, name in ground.trunk_contacts(data):
        if reference.clearance[step - 1, index] > rule.clearance:
            return f"the {name} touches the floor"
    return ""


_BAD_WARNINGS = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
    mujoco.mjtWarning.mjWARN_BADCTRL,
)


def divergence(data: mujoco.MjData) -> str:
    """Why the last step of `data` is invalid, in words; empty if it is valid."""
    # MuJoCo resets a state that turned NaN, so finite numbers alone prove nothing
    if any(data.warning.number):
        for kind in _BAD_WARNINGS:
            if data.warning[kind].number:
                return f"MuJoCo warning {mujoco.mjtWarning(kind).name}"
    if not np.isfinite(data.qpos).all():
        return "NaN in qpos"
    return ""
