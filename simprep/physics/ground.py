"""What floor and obstacles do to a body: forces, centre of pressure, penetration, contacts of the trunk."""

from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.physics.bodies import SceneBody

LEAST_LOAD_N = 20.0


@dataclass(frozen=True)
class GroundReading:
    """Contact of a body with the world at one step.

    Attributes:
        force: (3,) total force on the body, world frame [N].
        foot_force: (2, 3) on the left and right foot [N].
        centre_of_pressure: (2,) on the floor, NaN below `LEAST_LOAD_N` of vertical floor force [m].
        penetration: deepest overlap with the floor [m].
    """

    force: FloatArray
    foot_force: FloatArray
    centre_of_pressure: FloatArray
    penetration: float


class GroundReader:
    """Reads contacts between one body of a scene and the world."""

    def __init__(self, model: mujoco.MjModel, body: SceneBody) -> None:
        self._model = model
        self._floor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "floor")
        self._body_of_geom = model.geom_bodyid.tolist()
        first = body.segments.start
        self._own = range(first, body.segments.stop)
        self._foot = {first + foot: side for side, foot in enumerate(body.feet)}
        self._trunk = {first + index: (index, body.segment_names[index]) for index in body.trunk}
        self._buffer = np.zeros(6)

    def read(self, data: mujoco.MjData) -> GroundReading:
        """Forces of all world contacts of the last step; `data` is taken after it."""
        foot_force = np.zeros((2, 3))
        # in plain numbers, as arrays of three cost more than what is reckoned with them
        total, moment, load, depth = [0.0, 0.0, 0.0], [0.0, 0.0], 0.0, 0.0
        contact = data.contact
        frames, places, distances = contact.frame.reshape(-1, 3, 3), contact.pos.tolist(), contact.dist.tolist()
        for index, geoms in enumerate(contact.geom.tolist()):
            first, second = self._body_of_geom[geoms[0]], self._body_of_geom[geoms[1]]
            body = first or second  # 0 is the world
            if (first and second) or body not in self._own:
                continue
            mujoco.mj_contactForce(self._model, data, index, self._buffer)
            # the frame's first row is the normal, pointing from geom 1 to geom 2; the force acts on geom 2
            force = frames[index].T @ self._buffer[:3]
            if second == 0:
                force = -force
            if body in self._foot:
                foot_force[self._foot[body]] += force
            x, y, z = force.tolist()
            total = [total[0] + x, total[1] + y, total[2] + z]
            if self._floor in geoms:
                load += z
                moment = [moment[0] + places[index][0] * z, moment[1] + places[index][1] * z]
                depth = max(depth, -distances[index])
        centre = np.array(moment) / load if load > LEAST_LOAD_N else np.full(2, np.nan)
        return GroundReading(np.array(total), foot_force, centre, depth)

    def trunk_contacts(self, data: mujoco.MjData) -> list[tuple[int, str]]:
        """Segments of trunk and head that touch the floor: (index in the body's segments, name)."""
        touching = []
        for pair in data.contact.geom.tolist():
            if self._floor in pair:
                body = self._body_of_geom[pair[0] if pair[1] == self._floor else pair[1]]
                if body in self._trunk:
                    touching.append(self._trunk[body])
        return touching
