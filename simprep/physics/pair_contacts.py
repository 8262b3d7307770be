"""Contacts between two fighters: read at every step, merged into one event for every touch of two body parts."""

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.humanoid import BODIES
from simprep.physics.fighters import between_fighters, fighter_overlap, geom_owners
from simprep.physics.pair_run import FighterContact

TOLERANCE_S = 1 / 60
"""Touches of the same two parts that are less apart than this are one contact."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Touch:
    """Contact of one body part of A with one of B during one step.

    Attributes:
        step: index of the step.
        part_a: index in `simprep.humanoid.BODIES`.
        part_b: index in `simprep.humanoid.BODIES`.
        force: (3,) of A on B, world frame [N].
        position: (3,) where, world frame [m].
        closing_speed: along the normal of the deepest contact point [m/s].
        depth: of the deepest contact point [m].
    """

    step: int
    part_a: int
    part_b: int
    force: FloatArray
    position: FloatArray
    closing_speed: float
    depth: float


class ContactReader:
    """Reads contacts between two fighters from MjData; an observer of the simulation loop.

    Args:
        model: mujoco.MjModel of a scene with two fighters.
        steps: steps at most.

    Attributes:
        touches: in order of time.
        penetration: (steps,) deepest overlap between the fighters [m].
        unconverged: steps in which the contact solver ran out of iterations.
    """

    def __init__(self, model: Any, steps: int) -> None:
        self._model = model
        self._owner, self._segment = geom_owners(model)
        self._body = np.array(model.geom_bodyid)
        self._root = np.array(model.body_rootid)
        self._buffer = np.zeros(6)
        self.touches: list[Touch] = []
        self.penetration = np.zeros(steps)
        self.unconverged = 0

    def step(self, step: int, data: Any) -> None:
        """Read a step (see `simprep.physics.loop.Observer`)."""
        self.unconverged += bool(data.solver_niter.max() >= self._model.opt.iterations)
        if not data.ncon:
            return
        found = np.flatnonzero(between_fighters(data.contact.geom, self._owner))
        if not len(found):
            return
        self.penetration[step] = fighter_overlap(data, self._owner)
        pairs: dict[tuple[int, int], list[tuple[FloatArray, FloatArray, float, float]]] = {}
        for index in found:
            geoms = [int(geom) for geom in data.contact.geom[index]]
            frame = data.contact.frame[index].reshape(3, 3)
            mujoco.mj_contactForce(self._model, data, int(index), self._buffer)
            # the frame's first row points from geom 1 to geom 2, and the force acts on geom 2
            force, normal = frame.T @ self._buffer[:3], frame[0]
            if self._owner[geoms[0]] == 1:
                geoms, force, normal = geoms[::-1], -force, -normal
            position = np.array(data.contact.pos[index])
            first, second = (self._velocity(data, geom, position) for geom in geoms)
            key = int(self._segment[geoms[0]]), int(self._segment[geoms[1]])
            pairs.setdefault(key, []).append(
                (force, position, float(normal @ (first - second)), -float(data.contact.dist[index]))
            )
        for (part_a, part_b), points in pairs.items():
            deepest = max(points, key=lambda point: point[3])
            force = np.sum([point[0] for point in points], axis=0)
            self.touches.append(Touch(step, part_a, part_b, force, *deepest[1:]))

    def _velocity(self, data: Any, geom: int, position: FloatArray) -> FloatArray:
        """Velocity of a body's point at the begin of the step (3,)."""
        body = self._body[geom]
        spatial = data.cvel[body]  # about the COM of the whole fighter
        return np.asarray(spatial[3:] + np.cross(spatial[:3], position - data.subtree_com[self._root[body]]))


def merge_touches(
    touches: list[Touch], timestep: float, tolerance_s: float = TOLERANCE_S
) -> tuple[FighterContact, ...]:
    """One contact for every uninterrupted touch of the same two body parts.

    Args:
        touches: in order of time.
        timestep: duration of a step [s].
        tolerance_s: longest break within a contact [s].

    Returns:
        By time of the first touch.
    """
    longest = round(tolerance_s / timestep)
    chains: dict[tuple[int, int], list[list[Touch]]] = {}
    for touch in touches:
        own = chains.setdefault((touch.part_a, touch.part_b), [])
        if own and touch.step - own[-1][-1].step - 1 <= longest:
            own[-1].append(touch)
        else:
            own.append([touch])
    contacts = [_contact(chain, timestep) for own in chains.values() for chain in own]
    return tuple(sorted(contacts, key=lambda one: (one.start_s, one.part_a, one.part_b)))


def _contact(chain: list[Touch], timestep: float) -> FighterContact:
    force = np.array([touch.force for touch in chain])
    size = np.linalg.norm(force, axis=1)
    impulse, position = force.sum(axis=0) * timestep, chain[int(size.argmax())].position
    return FighterContact(
        start_s=chain[0].step * timestep,
        duration_s=(chain[-1].step - chain[0].step + 1) * timestep,
        part_a=BODIES[chain[0].part_a],
        part_b=BODIES[chain[0].part_b],
        impulse=(float(impulse[0]), float(impulse[1]), float(impulse[2])),
        peak_force_n=float(size.max()),
        closing_speed=chain[0].closing_speed,
        position=(float(position[0]), float(position[1]), float(position[2])),
        depth=max(touch.depth for touch in chain),
    )
