"""Contacts between bodies: read at every step, merged into one contact for every touch of two segments."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.physics.bodies import SceneBody, geom_owners
from simprep.physics.overlap import between_bodies, deepest_overlap

TOLERANCE_S = 1 / 60
"""Touches of the same two segments within this time are one contact."""


@dataclass(frozen=True)
class BodyContact:
    """A segment of a body touching one of another, from the first step of contact to the last.

    Attributes:
        start_s: time of the first touch [s].
        duration_s: until the last step of contact [s]; breaks shorter than the tolerance do not end it.
        bodies: numbers of the two bodies, the lower one first.
        parts: the segment of the first body and that of the second.
        impulse: (x, y, z) of the first body on the second over the contact, world frame [N s].
        peak_force_n: largest contact force [N].
        closing_speed: of the surfaces along the contact normal at the first touch [m/s]; negative when they part.
        position: (x, y, z) where they touch, at the peak, world frame [m].
        depth: deepest overlap [m].
    """

    start_s: float
    duration_s: float
    bodies: tuple[int, int]
    parts: tuple[str, str]
    impulse: tuple[float, float, float]
    peak_force_n: float
    closing_speed: float
    position: tuple[float, float, float]
    depth: float

    @property
    def impulse_ns(self) -> float:
        """Magnitude of the impulse [N s]."""
        return float(np.linalg.norm(self.impulse))


@dataclass(frozen=True)
class Touch:
    """Contact of a segment of one body with one of another during one step.

    Attributes:
        step: index of the step.
        bodies: numbers of the two bodies, the lower one first.
        parts: the segment of the first body and that of the second.
        force: (3,) of the first body on the second, world frame [N].
        position: (3,) where, world frame [m].
        closing_speed: along the normal of the deepest contact point [m/s].
        depth: of the deepest contact point [m].
    """

    step: int
    bodies: tuple[int, int]
    parts: tuple[str, str]
    force: FloatArray
    position: FloatArray
    closing_speed: float
    depth: float


class ContactReader:
    """Reads contacts between the bodies of a scene.

    Attributes:
        touches: in order of time.
        overlap: of every step, the deepest overlap between two bodies [m].
        unconverged: of every step, whether the contact solver ran out of iterations.
    """

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[SceneBody]) -> None:
        self._model, self._bodies = model, bodies
        self._owner, self._segment = geom_owners(model, bodies)
        self._body = np.array(model.geom_bodyid)
        self._root = np.array(model.body_rootid)
        self._buffer = np.zeros(6)
        self.touches: list[Touch] = []
        self.overlap: list[float] = []
        self.unconverged: list[bool] = []

    def step(self, step: int, data: mujoco.MjData) -> None:
        """Read a step. `data`, taken after it, holds contacts and positions of its beginning."""
        self.unconverged.append(bool(data.solver_niter.max() >= self._model.opt.iterations))
        self.overlap.append(0.0)
        if len(self._bodies) == 1 or not data.ncon:
            return
        found = np.flatnonzero(between_bodies(data.contact.geom, self._owner))
        if not len(found):
            return
        self.overlap[-1] = deepest_overlap(data, self._owner)
        pairs: dict[tuple[int, int, int, int], list[tuple[FloatArray, FloatArray, float, float]]] = {}
        for index in found:
            geoms = [int(geom) for geom in data.contact.geom[index]]
            frame = data.contact.frame[index].reshape(3, 3)
            mujoco.mj_contactForce(self._model, data, int(index), self._buffer)
            # the frame's first row points from geom 1 to geom 2, and the force acts on geom 2
            force, normal = frame.T @ self._buffer[:3], frame[0]
            if self._owner[geoms[0]] > self._owner[geoms[1]]:
                geoms, force, normal = geoms[::-1], -force, -normal
            position = np.array(data.contact.pos[index])
            first, second = (self._velocity(data, geom, position) for geom in geoms)
            owners, segments = self._owner[geoms], self._segment[geoms]
            key = int(owners[0]), int(owners[1]), int(segments[0]), int(segments[1])
            pairs.setdefault(key, []).append(
                (force, position, float(normal @ (first - second)), -float(data.contact.dist[index]))
            )
        for (a, b, part_a, part_b), points in pairs.items():
            parts = self._bodies[a].segment_names[part_a], self._bodies[b].segment_names[part_b]
            deepest = max(points, key=lambda point: point[3])
            total = np.sum([point[0] for point in points], axis=0)
            self.touches.append(Touch(step, (a, b), parts, total, *deepest[1:]))

    def _velocity(self, data: mujoco.MjData, geom: int, position: FloatArray) -> FloatArray:
        """Velocity (3,) of a segment's point at the beginning of the step [m/s]."""
        segment = self._body[geom]
        spatial = data.cvel[segment]  # about the COM of the whole body
        return np.asarray(spatial[3:] + np.cross(spatial[:3], position - data.subtree_com[self._root[segment]]))


def merge_touches(
    touches: Sequence[Touch], timestep: float, tolerance_s: float = TOLERANCE_S
) -> tuple[BodyContact, ...]:
    """One contact for every uninterrupted touch of the same two segments, by time of the first touch.

    Args:
        touches: in order of time.
        timestep: duration of a step [s].
        tolerance_s: longest break within a contact [s].
    """
    longest = round(tolerance_s / timestep)
    chains: dict[tuple[tuple[int, int], tuple[str, str]], list[list[Touch]]] = {}
    for touch in touches:
        own = chains.setdefault((touch.bodies, touch.parts), [])
        if own and touch.step - own[-1][-1].step - 1 <= longest:
            own[-1].append(touch)
        else:
            own.append([touch])
    contacts = [_contact(chain, timestep) for own in chains.values() for chain in own]
    return tuple(sorted(contacts, key=lambda one: (one.start_s, one.bodies, one.parts)))


def _contact(chain: list[Touch], timestep: float) -> BodyContact:
    force = np.array([touch.force for touch in chain])
    size = np.linalg.norm(force, axis=1)
    impulse, position = force.sum(axis=0) * timestep, chain[int(size.argmax())].position
    return BodyContact(
        start_s=chain[0].step * timestep,
        duration_s=(chain[-1].step - chain[0].step + 1) * timestep,
        bodies=chain[0].bodies,
        parts=chain[0].parts,
        impulse=(float(impulse[0]), float(impulse[1]), float(impulse[2])),
        peak_force_n=float(size.max()),
        closing_speed=chain[0].closing_speed,
        position=(float(position[0]), float(position[1]), float(position[2])),
        depth=max(touch.depth for touch in chain),
    )
