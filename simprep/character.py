"""A body as a value: its model, the names of its parts, their groups and roles.

A body has a free root, legs with feet, and hinges moved by position servos. A *segment* is one of its MuJoCo bodies;
the origin of its frame is the joint that moves it.
"""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import Any

import mujoco
import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.display import SelfShowing
from simprep.errors import SettingError, UnknownNameError

SIDES = ("left", "right")
ROLES = (
    "pelvis", "abdomen", "thorax", "neck", "head",
    *(f"{side}_{part}" for side in SIDES for part in ("upper_arm", "forearm", "hand")),
    *(f"{side}_{part}" for side in SIDES for part in ("thigh", "shank", "foot")),
)  # fmt: skip
"""Roles that a segment can play. A character needs the pelvis and the legs; it may lack others."""
_PARENT_ROLE = {
    "abdomen": "pelvis", "thorax": "abdomen", "neck": "thorax", "head": "neck", "upper_arm": "thorax",
    "forearm": "SIDE_upper_arm", "hand": "SIDE_forearm", "thigh": "pelvis", "shank": "SIDE_thigh", "foot": "SIDE_shank",
}  # fmt: skip


def parent_role(role: str) -> str:
    """The role one nearer to the pelvis than another one (not the pelvis)."""
    side, _, part = role.partition("_")
    return _PARENT_ROLE[part if side in SIDES else role].replace("SIDE", side)


Frame = tuple[str, tuple[float, float, float], tuple[float, float, float, float]]
"""A segment, and a place [m] and an orientation (wxyz) in its frame."""
NEEDED_ROLES = ("pelvis", *(f"{side}_{part}" for side in SIDES for part in ("thigh", "shank", "foot")))
SPEED_SHARE = 0.95
"""Share of a joint's largest speed that imports and motors use: a drive's limiter acts below what the drive can stand."""

_FRAME = "_frame"


def _with_frames(build: Callable[[], mujoco.MjSpec], frames: Mapping[str, Frame]) -> mujoco.MjSpec:
    """A model with a massless, unmoved segment in every frame."""
    spec = build()
    for role, (segment, place, turn) in frames.items():
        spec.body(segment).add_body(name=f"{role}{_FRAME}", pos=place, quat=turn)
    return spec


@dataclass(frozen=True, eq=False)
class Character(SelfShowing):
    """Everything that a function needs to know of a body. Characters with the same name and digest are equal.

    Attributes:
        name: of the kind of body, as files state it.
        build: makes an editable model of the body alone, without a floor; a module-level function, so it can be
            pickled.
        roles: the segment of each role (see `ROLES`).
        soles: names of the spheres under the left and the right foot, equally many; their lowest points bear load.
        upper: joints of the upper body, lower: of the lower body; together all, each in model order.
        groups: further named groups of joints. Limbs have a fixed order: `left_leg` hip flexion, abduction and
            rotation, knee, ankle dorsiflexion and inversion; `left_arm` shoulder flexion, abduction and rotation,
            elbow, forearm pronation, wrist flexion and deviation, as far as the body has them.
        anatomy: the joint of each anatomical movement, such as `lumbar_flexion`, where the joint has another name.
        mirror: by joint, the joint on the other side and the sign with which its angle mirrors in the sagittal plane.
        balancing: joints that posture optimisation (2013 paper) may move.
        fused: joints that a planner may leave out, and fused_segments: the segments they would move.
        height_m: stature [m], mass_kg: mass [kg], as far as they apply.
        frames: where imports find a role's joint centre, if not at the origin of a segment: a segment, a place [m] and
            an orientation (wxyz) in its frame. In the reference pose they are parallel to the world.
        velocity_limits: largest speed of each joint, in model order [rad/s]; empty where none is known.
        origin: how a reader of files finds the body again, where its name alone does not tell it.

    Raises:
        SettingError: a role, sole or joint that the model lacks, or a needed one that is missing.
    """

    name: str
    build: Callable[[], mujoco.MjSpec]
    roles: Mapping[str, str]
    soles: tuple[tuple[str, ...], tuple[str, ...]]
    upper: tuple[str, ...]
    lower: tuple[str, ...]
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    mirror: Mapping[str, tuple[str, float]] = field(default_factory=dict)
    anatomy: Mapping[str, str] = field(default_factory=dict)
    balancing: tuple[str, ...] = ()
    fused: tuple[str, ...] = ()
    fused_segments: tuple[str, ...] = ()
    height_m: float | None = None
    mass_kg: float | None = None
    frames: Mapping[str, Frame] = field(default_factory=dict)
    velocity_limits: tuple[float, ...] = ()
    origin: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for attribute in ("roles", "groups", "mirror", "anatomy", "frames", "origin"):
            object.__setattr__(self, attribute, MappingProxyType(dict(getattr(self, attribute))))
        missing = [role for role in NEEDED_ROLES if role not in self.roles]
        if missing:
            raise SettingError(
                f"character {self.name!r} has no {', '.join(missing)}; needed: {', '.join(NEEDED_ROLES)}"
            )
        unknown = [role for role in self.roles if role not in ROLES]
        if unknown:
            raise SettingError(f"character {self.name!r}: unknown role {unknown[0]!r}; valid: {', '.join(ROLES)}")

    def __repr__(self) -> str:
        size = f", {self.height_m:g} m, {self.mass_kg:g} kg" if self.height_m and self.mass_kg else ""
        return f"<Character {self.name}{size}, {len(self.joints)} joints, {self.digest}>"

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(character)` and Jupyter show."""
        return self.name, {
            "joints": len(self.joints),
            "segments": len(self.segments),
            "height [m]": self.height_m,
            "mass [kg]": self.mass_kg,
            "groups": ", ".join(self.groups) or None,
            "digest": self.digest,
        }

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Character) and (self.name, self.digest) == (other.name, other.digest)

    def __hash__(self) -> int:
        return hash((self.name, self.digest))

    def __reduce__(self) -> tuple[object, ...]:
        plain = (
            dict(self.roles),
            self.soles,
            self.upper,
            self.lower,
            dict(self.groups),
            dict(self.mirror),
            dict(self.anatomy),
        )
        rest = (self.balancing, self.fused, self.fused_segments, self.height_m, self.mass_kg)
        of_robots = (dict(self.frames), self.velocity_limits, dict(self.origin))
        return Character, (self.name, self.build, *plain, *rest, *of_robots)

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled model of the body alone, for kinematics. It is shared: do not write to it."""
        return self.build().compile()

    @cached_property
    def skeleton(self) -> "Character":
        """The same body with a segment in every one of `frames`, for imports; itself without any. Poses mean the same."""
        if not self.frames:
            return self
        roles = {role: f"{role}{_FRAME}" for role in self.frames}
        return replace(
            self, build=partial(_with_frames, self.build, dict(self.frames)), roles={**self.roles, **roles}, frames={}
        )

    @cached_property
    def digest(self) -> str:
        """Twelve hexadecimal digits that change with the model or its description."""
        about: list[object] = [
            self.name, dict(self.roles), self.soles, self.upper, self.lower, dict(self.groups), dict(self.mirror),
            dict(self.anatomy), self.balancing, self.fused, self.fused_segments, self.height_m, self.mass_kg,
        ]  # fmt: skip
        if self.frames or self.velocity_limits:  # else as before there were any
            about += [dict(self.frames), self.velocity_limits]
        sha = hashlib.sha256(json.dumps(about, sort_keys=True).encode())
        sha.update(self.build().to_xml().encode())
        return sha.hexdigest()[:12]

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Names of the hinges in model order: joint k is qpos[7 + k] and qvel[6 + k]."""
        return tuple(self.model.joint(index).name for index in range(1, self.model.njnt))

    @cached_property
    def segments(self) -> tuple[str, ...]:
        """Names of the segments in model order: segment k is model body k + 1."""
        return tuple(self.model.body(index).name for index in range(1, self.model.nbody))

    @cached_property
    def limits(self) -> FloatArray:
        """Lower and upper limits of the joints (joints, 2) [rad]."""
        return np.array(self.model.jnt_range[1:])

    @cached_property
    def gains(self) -> FloatArray:
        """Stiffness [N m/rad] and damping [N m s/rad] of each actuator's servo (actuators, 2)."""
        return np.stack([self.model.actuator_gainprm[:, 0], -self.model.actuator_biasprm[:, 2]], axis=1)

    @cached_property
    def torque_limits(self) -> FloatArray:
        """Largest torque of each actuator (actuators,) [N m]."""
        return np.array(self.model.actuator_forcerange[:, 1])

    @property
    def nq(self) -> int:
        """Entries of a pose."""
        return int(self.model.nq)

    @property
    def nv(self) -> int:
        """Entries of a velocity."""
        return int(self.model.nv)

    @cached_property
    def _joint_index(self) -> dict[str, int]:
        return {name: index for index, name in enumerate(self.joints)}

    @cached_property
    def _segment_index(self) -> dict[str, int]:
        return {name: index for index, name in enumerate(self.segments)}

    def joint(self, name: str) -> int:
        """Index of a joint in `joints`; its qpos index is 7 more, its qvel index 6 more.

        Raises:
            UnknownNameError: no such joint.
        """
        if name not in self._joint_index:
            raise UnknownNameError("joint", name, self.joints)
        return self._joint_index[name]

    def anatomical(self, movement: str) -> int | None:
        """Index of the joint of an anatomical movement, such as `lumbar_flexion`; None if there is none."""
        return self._joint_index.get(self.anatomy.get(movement, movement))

    def movement(self, joint: str) -> str:
        """Anatomical movement of a joint; the joint's own name if none is known."""
        return next((movement for movement, name in self.anatomy.items() if name == joint), joint)

    def joint_indices(self, names: Sequence[str]) -> IndexArray:
        """Indices of several joints in `joints` (N,).

        Raises:
            UnknownNameError: no such joint.
        """
        return np.array([self.joint(name) for name in names], dtype=np.intp)

    def has(self, role: str) -> bool:
        """Whether a segment plays a role of `ROLES`."""
        return role in self.roles

    def segment(self, role: str) -> int:
        """Index in `segments` of the segment that plays a role of `ROLES`; its model body id is 1 more.

        Raises:
            SettingError: the character lacks it.
        """
        if role not in self.roles:
            raise SettingError(
                f"character {self.name!r} has no {role!r}, which is needed here; it has {', '.join(self.roles)}"
            )
        return self._segment_index[self.roles[role]]

    def rest_offset(self, role: str) -> FloatArray:
        """Vector from the parent role's segment to a role's, from origin to origin, in the reference pose (3,) [m].

        Args:
            role: one of `ROLES`. The pelvis has its place in the world; a role whose parent is lacking hangs on the one
                before.

        Raises:
            SettingError: the character lacks it.
        """
        own = 1 + self.segment(role)
        above = 0
        if role != "pelvis":
            parent = parent_role(role)
            while parent not in self.roles:
                parent = parent_role(parent)
            above = 1 + self.segment(parent)
        if self.model.body_parentid[own] == above:
            return np.array(self.model.body_pos[own])
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        return np.asarray(data.xpos[own] - data.xpos[above])

    @cached_property
    def feet(self) -> tuple[int, int]:
        """Left and right foot as indices into `segments`."""
        return self.segment("left_foot"), self.segment("right_foot")

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """Part of the body of each segment: its role, else that of the next segment towards the root, else `pelvis`."""
        role_of = {name: role for role, name in self.roles.items()}
        found: list[str] = []
        for index, name in enumerate(self.segments):  # a parent comes before its children
            parent = int(self.model.body_parentid[index + 1]) - 1
            found.append(role_of.get(name) or (found[parent] if parent >= 0 else "pelvis"))
        return tuple(found)

    @cached_property
    def mirror_segments(self) -> IndexArray:
        """Segment on the other side (segments,), as `mirror` exchanges their joints; itself if it has no joints."""
        found = np.arange(len(self.segments), dtype=np.intp)
        for joint, other in enumerate(self.mirror_map[0]):
            found[self.model.jnt_bodyid[joint + 1] - 1] = self.model.jnt_bodyid[other + 1] - 1
        return found

    def group(self, name: str) -> tuple[str, ...]:
        """Joints of a group.

        Raises:
            UnknownNameError: no such group.
        """
        if name not in self.groups:
            raise UnknownNameError(f"group of joints of {self.name}", name, self.groups)
        return self.groups[name]

    @cached_property
    def upper_joints(self) -> IndexArray:
        """Indices of the upper body's joints."""
        return self.joint_indices(self.upper)

    @cached_property
    def lower_joints(self) -> IndexArray:
        """Indices of the lower body's joints."""
        return self.joint_indices(self.lower)

    @cached_property
    def sole_geoms(self) -> IndexArray:
        """Geom ids in `model` of the soles (2, N): left, right."""
        ids = np.array([[self.model.geom(name).id for name in side] for side in self.soles], dtype=np.intp)
        if (self.model.geom_type[ids] != mujoco.mjtGeom.mjGEOM_SPHERE).any():
            raise SettingError(f"character {self.name!r}: soles {', '.join(sum(self.soles, ()))}; valid: spheres")
        return ids

    @cached_property
    def reference_axes(self) -> FloatArray:
        """Axes of the joints in the reference pose (joints, 3)."""
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        return np.array(data.xaxis[1:])

    @cached_property
    def mirror_map(self) -> tuple[IndexArray, FloatArray]:
        """How joints mirror in the sagittal plane: mirrored[k] = sign[k] * angle[index[k]], both (joints,)."""
        pairs = [self.mirror.get(name, (name, 1.0)) for name in self.joints]
        return self.joint_indices([other for other, _ in pairs]), np.array([sign for _, sign in pairs])

    @cached_property
    def standing_qpos(self) -> FloatArray:
        """The model's reference pose (nq,), upright on the floor at the origin, facing x. Read-only."""
        qpos = np.array(self.model.qpos0)
        qpos.setflags(write=False)
        return qpos
