"""The planner's cheaper model of the bodies: light joints, such as a humanoid's wrists and neck, are fixed.

They are near their servo targets, so a look-ahead of less than a second loses little, and a step gets a third cheaper.
The character names them (`fused`). Nor does an arm collide with its own body. The simulated world always has all joints.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import mujoco
import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.character import SIDES
from simprep.physics.bodies import SceneBody, scene_bodies
from simprep.scene import SceneSettings, scene_spec

ARMS = tuple(f"{side}_{part}" for side in SIDES for part in ("upper_arm", "forearm", "hand"))
"""Roles of segments whose contacts with their own body a plan leaves out."""
CONTACT_SWEEPS = 5
"""Iterations of the planner's contact solver (projected Gauss-Seidel); the world's Newton solver costs twice as much."""


@dataclass(frozen=True)
class Planner:
    """A reduced model and which entries of the full state it has.

    Attributes:
        model: the reduced model.
        qpos: indices into the full qpos.
        qvel: indices into the full qvel.
        controls: indices of its actuators among the world's.
        dofs: of each body, indices into its own full qvel that it keeps.
        bodies: where each body's quantities are in the reduced model.
        fused: model ids of the fixed segments; every plan copies their posture from the world.
    """

    model: mujoco.MjModel
    qpos: IndexArray
    qvel: IndexArray
    controls: IndexArray
    dofs: tuple[IndexArray, ...]
    bodies: tuple[SceneBody, ...]
    fused: tuple[int, ...]

    def fused_orientations(self, data: mujoco.MjData) -> Iterator[tuple[int, FloatArray]]:
        """Model id of each fixed segment, and its orientation (4,) wxyz in its parent's frame in the world's state."""
        inverse, relative = np.zeros(4), np.zeros(4)
        for segment in self.fused:
            mujoco.mju_negQuat(inverse, data.xquat[self.model.body_parentid[segment]])
            mujoco.mju_mulQuat(relative, inverse, data.xquat[segment])
            yield segment, relative


def build_planner(world: mujoco.MjModel, scene: SceneSettings, timestep: float) -> Planner:
    """Planner model of a scene.

    Args:
        world: the simulated world.
        scene: what it was built from.
        timestep: step of the planner [s].
    """
    spec = scene_spec(replace(scene, timestep=timestep))
    full = scene_bodies(world, scene.bodies)
    fused = {body.prefix + name for body in full for name in body.character.fused}
    for part in [*spec.actuators, *spec.joints]:
        if part.name in fused:
            spec.delete(part)
    # arms that graze their own trunk hardly move the body; looking for it is a twentieth of the time of a step
    arms = {body.prefix + body.character.roles[role] for body in full for role in ARMS if body.character.has(role)}
    for pair in list(spec.pairs):
        if any(spec.geom(name).parent.name in arms for name in (pair.geomname1, pair.geomname2)):
            spec.delete(pair)
    _pair_with_floor(spec)
    model = spec.compile()
    # a few sweeps over the contacts are right to some millirad at the end of a look-ahead; from scratch they converge
    # no worse than from the last step's forces
    model.opt.solver, model.opt.iterations = mujoco.mjtSolver.mjSOL_PGS, CONTACT_SWEEPS
    model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC  # three rows for a contact instead of four
    # looking for separate groups of contacts to solve costs more than it saves
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_WARMSTART | mujoco.mjtDisableBit.mjDSBL_ISLAND
    joints = [world.joint(model.joint(index).name) for index in range(model.njnt)]
    qvel = np.concatenate([_entries(joint.dofadr[0], 6 if _is_free(joint) else 1) for joint in joints])
    bodies = scene_bodies(model, scene.bodies)
    return Planner(
        model=model,
        qpos=np.concatenate([_entries(joint.qposadr[0], 7 if _is_free(joint) else 1) for joint in joints]),
        qvel=qvel,
        controls=np.array([world.actuator(model.actuator(index).name).id for index in range(model.nu)], dtype=np.intp),
        dofs=tuple(qvel[reduced.qvel] - body.qvel.start for body, reduced in zip(full, bodies)),
        bodies=bodies,
        fused=tuple(model.body(body.prefix + name).id for body in bodies for name in body.character.fused_segments),
    )


def _is_free(joint: Any) -> bool:
    return bool(joint.type[0] == mujoco.mjtJoint.mjJNT_FREE)


def _entries(first: int, count: int) -> IndexArray:
    return np.arange(first, first + count, dtype=np.intp)


def _pair_with_floor(spec: mujoco.MjSpec) -> None:
    """Name each contact with the floor that can be, which gives the same forces as looking for it, and is cheaper.

    Where then no two geoms are left that could meet otherwise (one body, no objects), nothing is looked for.
    """
    floor = spec.geom("floor")
    for number, geom in enumerate(spec.geoms):
        if geom.parent != floor.parent and _meet(geom, floor):
            geom.name = geom.name or f"geom {number}"
            spec.add_pair(geomname1=floor.name, geomname2=geom.name, **_contact(floor, geom))
    floor.contype = floor.conaffinity = 0
    if not any(_meet(one, other) for one, other in combinations(spec.geoms, 2)):
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 0


def _contact(one: Any, other: Any) -> dict[str, Any]:
    """Parameters of a pair as MuJoCo combines those of two geoms."""
    if one.priority != other.priority:
        first = second = max(one, other, key=lambda geom: geom.priority)
    else:
        first, second = one, other
    share = first.solmix / (first.solmix + second.solmix)
    a, b = np.asarray(first.solref), np.asarray(second.solref)
    sliding, spinning, rolling = np.maximum(first.friction, second.friction)
    return {
        "condim": max(first.condim, second.condim),
        # one of them in direct form (negative) cannot be averaged
        "solref": share * a + (1 - share) * b if min(a[0], b[0]) > 0 else np.minimum(a, b),
        "solimp": share * np.asarray(first.solimp) + (1 - share) * np.asarray(second.solimp),
        "friction": [sliding, sliding, spinning, rolling, rolling],
        "margin": max(one.margin, other.margin),
        "gap": max(one.gap, other.gap),
    }


def _meet(one: Any, other: Any) -> bool:
    return bool(one.contype & other.conaffinity or other.contype & one.conaffinity)
