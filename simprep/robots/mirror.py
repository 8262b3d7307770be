"""Which joint is on the other side of a robot, and with which sign its angle mirrors."""

import mujoco
import numpy as np

from simprep.character import SIDES
from simprep.robots.description import RobotDescription

_OTHER = {"left": "right", "right": "left"}


def mirrored_joints(model: mujoco.MjModel, description: RobotDescription) -> dict[str, tuple[str, float]]:
    """Joint on the other side and sign of every joint (`Character.mirror`).

    Mirrored in the sagittal plane, a turn about an axis a becomes one about (-a_x, a_y, -a_z): the sign is that of its
    product with the axis on the other side, in the reference pose.

    Args:
        model: of `simprep.robots.model.build_robot`.
        description: what its joints do; its own entries come first.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found: dict[str, tuple[str, float]] = {}
    for movement, joint in description.movements.items():
        if joint in description.mirror:
            found[joint] = description.mirror[joint]
            continue
        side, _, rest = movement.partition("_")
        other = description.movements.get(f"{_OTHER[side]}_{rest}", joint) if side in SIDES else joint
        one, two = (data.xaxis[model.joint(name).id] for name in (joint, other))
        found[joint] = (other, 1.0 if float(one @ (np.array([-1.0, 1.0, -1.0]) * two)) > 0 else -1.0)
    return found
