"""Which states, segments, geoms and actuators of a scene belong to which body."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from simprep.arrays import IndexArray
from simprep.character import Character
from simprep.errors import SettingError
from simprep.scene import body_prefix

WORLD = -1
"""Owner of geoms that belong to no body."""
_TRUNK_ROLES = ("pelvis", "abdomen", "thorax", "neck", "head")


@dataclass(frozen=True, eq=False)
class SceneBody:
    """Where one body's quantities are in the arrays of a model, and how its parts are called.

    A *body* is everything that moves with one free root; what MuJoCo calls bodies are its *segments*.

    Attributes:
        character: who it is.
        number: its position among the scene's bodies.
        prefix: what the names of its parts begin with in the model.
        qpos: its entries of qpos; the root's 7 are the first.
        qvel: its entries of qvel; the root's 6 are the first.
        controls: its actuators.
        segments: its model bodies; the root is the first.
        segment_names: of each segment, without prefix.
        joint_names: of the joint of each actuator, without prefix.
        joint_qpos: (controls,) entry of each actuator's joint in the body's own qpos.
        joint_qvel: (controls,) the same in its own qvel.
    """

    character: Character
    number: int
    prefix: str
    qpos: slice
    qvel: slice
    controls: slice
    segments: slice
    segment_names: tuple[str, ...]
    joint_names: tuple[str, ...]
    joint_qpos: IndexArray
    joint_qvel: IndexArray

    def segment(self, name: str) -> int:
        """Index of a segment in `segment_names`, by its name without prefix.

        Raises:
            SettingError: the body has no such segment.
        """
        if name not in self.segment_names:
            raise SettingError(f"body {self.number} has no segment {name!r}; its own: {', '.join(self.segment_names)}")
        return self.segment_names.index(name)

    @cached_property
    def feet(self) -> tuple[int, int]:
        """Left and right foot as indices into `segment_names`."""
        return self.character.feet

    @cached_property
    def trunk(self) -> tuple[int, ...]:
        """Trunk, neck and head, as far as the character has them, as indices into `segment_names`."""
        return tuple(self.character.segment(role) for role in _TRUNK_ROLES if self.character.has(role))


def scene_bodies(model: mujoco.MjModel, characters: Sequence[Character]) -> tuple[SceneBody, ...]:
    """The bodies of a scene, in its order, without what else moves freely. The model may lack some of their joints and actuators.

    Args:
        model: of a scene made by `simprep.scene.build_scene`.
        characters: who is in it.
    """
    # things that move freely stand behind the bodies
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)[: len(characters)]
    return tuple(
        _scene_body(model, character, number, int(joint), len(free))
        for number, (joint, character) in enumerate(zip(free, characters, strict=True))
    )


def _scene_body(model: mujoco.MjModel, character: Character, number: int, free: int, count: int) -> SceneBody:
    prefix = body_prefix(number, count)
    segments = np.flatnonzero(model.body_rootid == model.jnt_bodyid[free])
    joints = np.flatnonzero(np.isin(model.jnt_bodyid, segments))
    controls = np.flatnonzero(np.isin(model.actuator_trnid[:, 0], joints))
    moved = model.actuator_trnid[controls, 0]
    qpos, qvel = int(model.jnt_qposadr[free]), int(model.jnt_dofadr[free])
    dofs = np.flatnonzero(np.isin(model.dof_bodyid, segments))
    # every joint but the root's is a hinge: as many coordinates as velocities
    n_qpos = 7 + len(dofs) - 6
    return SceneBody(
        character=character,
        number=number,
        prefix=prefix,
        qpos=slice(qpos, qpos + n_qpos),
        qvel=slice(qvel, qvel + len(dofs)),
        controls=slice(int(controls[0]), int(controls[-1]) + 1) if len(controls) else slice(0, 0),
        segments=slice(int(segments[0]), int(segments[-1]) + 1),
        segment_names=tuple(model.body(int(index)).name.removeprefix(prefix) for index in segments),
        joint_names=tuple(model.joint(int(index)).name.removeprefix(prefix) for index in moved),
        joint_qpos=np.asarray(model.jnt_qposadr[moved] - qpos, dtype=np.intp),
        joint_qvel=np.asarray(model.jnt_dofadr[moved] - qvel, dtype=np.intp),
    )


def geom_owners(model: mujoco.MjModel, bodies: Sequence[SceneBody]) -> tuple[IndexArray, IndexArray]:
    """Owner and segment of every geom of a scene, both (ngeom,); `WORLD` if there is none.

    The owner is the number of a body, the segment an index in its `segment_names`.

    Args:
        model: of the scene.
        bodies: its bodies.
    """
    owner = np.full(model.nbody, WORLD, dtype=np.intp)
    segment = np.full(model.nbody, WORLD, dtype=np.intp)
    for body in bodies:
        owner[body.segments] = body.number
        segment[body.segments] = np.arange(len(body.segment_names))
    return owner[model.geom_bodyid], segment[model.geom_bodyid]
