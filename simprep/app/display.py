"""The model that is drawn: the simulated bodies, a ghost of each where its reference is, and the things around."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.app.moments import Moment
from simprep.app.stage import Stage
from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.physics.bodies import scene_bodies
from simprep.report.replay.meshes import segment_hulls
from simprep.scene import SceneSettings, body_prefix, scene_spec

COLOURS = ((0.86, 0.45, 0.25), (0.25, 0.5, 0.8), (0.4, 0.65, 0.4))
"""Of the bodies, in order."""
GHOST_COLOUR, GHOST_OPACITY = (77, 90, 230), 0.25
"""Of what is drawn of references; colours from 0 to 255."""
SIDES, GHOST_SIDES = 8, 6
"""Of the bodies' limbs, and of the ghosts': a browser without a graphics card takes a microsecond for a triangle."""
GHOST_SIZE = 0.95
"""Of its segments: a ghost that stands where its body is lies within it, so that the body is seen, and grabbed."""


class Display:
    """Poses of one moment for drawing; nothing is simulated with it.

    Args:
        characters: the simulated bodies.
        stage: with the things around.

    Attributes:
        model: bodies first, then their ghosts.
        data: in which a moment is posed.
        ghosts: vertices (V, 3) [m] and triangles (F, 3) of each segment of a ghost, in its frame, by the number of its body
            in the model. The model has no geoms there, as mjviser draws nothing that one can see through.
    """

    def __init__(self, characters: tuple[Character, ...], stage: Stage) -> None:
        self._count = len(characters)
        bodies = (*characters, *characters)
        self.model = _drawn(scene_spec(SceneSettings(bodies=bodies, obstacles=stage.obstacles)), bodies).compile()
        self.data = mujoco.MjData(self.model)
        self._bodies = scene_bodies(self.model, bodies)
        self._things = [int(self.model.jnt_qposadr[self.model.joint(one.name).id]) for one in stage.moving]
        self.ghosts = {
            number: (_smaller(vertices), faces)
            for body in self._bodies[self._count :]
            for number, (vertices, faces) in enumerate(segment_hulls(body.character, GHOST_SIDES), body.segments.start)
            if len(vertices)
        }
        for body in self._bodies[: self._count]:
            own = np.isin(self.model.geom_bodyid, np.arange(body.segments.start, body.segments.stop))
            self.model.geom_rgba[own] = (*COLOURS[body.number % len(COLOURS)], 1.0)
            self.model.geom_matid[own] = -1

    def grabbed(self, number: int) -> tuple[int, int] | None:
        """Which body and segment a body of the model belongs to, by its number there; None for ghosts and things."""
        for body in self._bodies[: self._count]:
            if body.segments.start <= number < body.segments.stop:
                return body.number, number - body.segments.start
        return None

    def pose(self, moment: Moment, after: Moment | None = None, share: float = 0.0) -> mujoco.MjData:
        """The data, with everything where it is at a moment, or a share of the way from it to another."""
        data = self.data
        data.qpos[:] = self._qpos(moment)
        if after is not None and share > 0:
            way = np.zeros(self.model.nv)
            mujoco.mj_differentiatePos(self.model, way, 1.0, data.qpos, self._qpos(after))
            mujoco.mj_integratePos(self.model, data.qpos, way, share)
        mujoco.mj_kinematics(self.model, data)
        return data

    def _qpos(self, moment: Moment) -> FloatArray:
        qpos: FloatArray = self.data.qpos.copy()
        for body, pose in zip(self._bodies, (*moment.bodies, *moment.references)):
            qpos[body.qpos] = pose
        for at, place in zip(self._things, moment.things):
            qpos[at : at + 7] = place
        return qpos


def _drawn(spec: mujoco.MjSpec, characters: tuple[Character, ...]) -> mujoco.MjSpec:
    """The scene with one coarse mesh for each segment, which browsers draw several times faster than its geoms.

    Args:
        spec: of the scene; changed, and returned.
        characters: its bodies; the second half are ghosts, which get none.
    """
    for pair in list(spec.pairs):
        spec.delete(pair)
    for number, character in enumerate(characters):
        for segment, (vertices, faces) in zip(character.segments, segment_hulls(character, SIDES)):
            body = spec.body(body_prefix(number, len(characters)) + segment)
            for geom in list(body.geoms):
                spec.delete(geom)
            body.explicitinertial, body.mass, body.inertia = True, 1.0, np.ones(3)  # it is not simulated
            if len(vertices) and number < len(characters) // 2:
                mesh = spec.add_mesh(
                    name=f"shape {number} {segment}", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
                )
                mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
                body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name)
    return spec


def _smaller(vertices: NDArray[np.float32]) -> NDArray[np.float32]:
    """Vertices (V, 3), shrunk to `GHOST_SIZE` about their middle."""
    centre = vertices.mean(axis=0)
    return np.asarray(centre + GHOST_SIZE * (vertices - centre))
