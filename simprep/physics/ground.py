"""What the floor and the obstacles do to the body: forces, centre of pressure, penetration, touching trunk."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.humanoid import BODIES, FEET
from simprep.physics.fighters import Fighter

LEAST_LOAD_N = 20.0
_TRUNK = ("pelvis", "abdomen", "thorax", "neck", "head")


@dataclass(frozen=True)
class GroundReading:
    """Contact of the body with the world at one step.

    Attributes:
        force: (3,) total force on the body, world frame [N].
        foot_force: (2, 3) on the left and right foot [N].
        centre_of_pressure: (2,) on the floor, NaN below `LEAST_LOAD_N` of vertical floor force [m].
        penetration: deepest overlap with the floor [m].
    """

    force: NDArray[np.float64]
    foot_force: NDArray[np.float64]
    centre_of_pressure: NDArray[np.float64]
    penetration: float


class GroundReader:
    """Reads contacts between one humanoid and the world from MjData; holds index maps only.

    Args:
        model: mujoco.MjModel of the scene.
        fighter: which humanoid of the scene.
    """

    def __init__(self, model: Any, fighter: Fighter) -> None:
        self._model = model
        self._floor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "floor")
        self._body_of_geom = np.array(model.geom_bodyid)
        first = fighter.bodies.start
        self._own = range(first, fighter.bodies.stop)
        self._foot = {first + body: side for side, body in enumerate(FEET)}
        self._trunk = {first + BODIES.index(name): (BODIES.index(name), name) for name in _TRUNK}
        self._buffer = np.zeros(6)

    def read(self, data: Any) -> GroundReading:
        """Forces of all world contacts of the last step.

        Args:
            data: mujoco.MjData after mj_step.
        """
        total = np.zeros(3)
        foot_force = np.zeros((2, 3))
        moment, load, depth = np.zeros(2), 0.0, 0.0
        contact = data.contact
        bodies = self._body_of_geom[contact.geom] if data.ncon else np.zeros((0, 2), int)
        for index in range(data.ncon):
            first, second = int(bodies[index, 0]), int(bodies[index, 1])
            body = first or second  # the world is 0
            if (first and second) or body not in self._own:
                continue
            mujoco.mj_contactForce(self._model, data, index, self._buffer)
            # the frame's first row is the normal, pointing from geom 1 to geom 2; the force acts on geom 2
            force = contact.frame[index].reshape(3, 3).T @ self._buffer[:3]
            if second == 0:
                force = -force
            total += force
            if body in self._foot:
                foot_force[self._foot[body]] += force
            if self._floor in contact.geom[index]:
                load += force[2]
                moment += contact.pos[index][:2] * force[2]
                depth = max(depth, -float(contact.dist[index]))
        centre = moment / load if load > LEAST_LOAD_N else np.full(2, np.nan)
        return GroundReading(total, foot_force, centre, depth)

    def trunk_contacts(self, data: Any) -> list[tuple[int, str]]:
        """Trunk and head bodies that touch the floor: (index in `BODIES`, name)."""
        touching = []
        for pair in data.contact.geom if data.ncon else ():
            if self._floor in pair:
                body = int(self._body_of_geom[pair[0] if pair[1] == self._floor else pair[1]])
                if body in self._trunk:
                    touching.append(self._trunk[body])
        return touching
