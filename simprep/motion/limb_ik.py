"""Inverse kinematics of a leg in closed form: pelvis and foot pose in, hinge angles out, all frames at once.

The foot's six degrees of freedom determine the six hinges (Kajita et al. 2014, Introduction to Humanoid Robotics,
section 2.5.2). The knee angle follows from the hip-ankle distance. The knee axis is normal to the hip-ankle line and to
the foot's long axis, about which the ankle inverts; an ankle that does not invert brings the foot's place and its long
axis right, and the foot rolls about that as it comes. The three hinges of the hip may come in any order. Where axes lean
or miss each other, as those of robots do, `simprep.motion.leg_chain` goes on from there. Frames do not depend on each
other: a still foot stays still to rounding.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.character import SIDES, Character
from simprep.errors import SettingError
from simprep.humanoid_model import humanoid
from simprep.motion.leg_chain import LegChain
from simprep.motion.rotations import axis_rotation, cross


@dataclass(frozen=True)
class Leg:
    """Constants of one leg, from the model; of several (see `leg_of_each`), every attribute has one row for each.

    Attributes:
        hinges: (6,) or (5,) hinge indices in the order of the character's group `left_leg` or `right_leg`; an ankle that
            does not invert has five.
        hip_order: (3,) the axis, 0 to 2, that each hinge of the hip turns about, from the pelvis outwards.
        hip: (3,) hip centre in the pelvis frame [m].
        thigh: length from hip to knee [m].
        shank: length from knee to ankle [m].
        sign: as `hinges`, +1 or -1: hinge axis against the positive y, x, z, y, y, x axis.
        zero: as `hinges`, angles in the reference pose [rad].
        low: as `hinges`, lower limits [rad].
        high: as `hinges`, upper limits [rad].
        points: (4, 3) centres of the foot spheres in the foot frame [m].
        radii: (4,) of the spheres [m].
        chain: its exact kinematics, where the closed form is not exact.
    """

    hinges: IndexArray
    hip_order: IndexArray
    hip: FloatArray
    thigh: FloatArray | float
    shank: FloatArray | float
    sign: FloatArray
    zero: FloatArray
    low: FloatArray
    high: FloatArray
    points: FloatArray
    radii: FloatArray
    chain: LegChain | None


_AXES = (1, 0, 2, 1, 1, 0)
LEVEL_FOOT = 1 - 1e-5
"""Real part of the quaternion of a foot that is level in the reference pose; below it, it leans by half a degree."""


@lru_cache(maxsize=16)
def legs(character: Character = humanoid()) -> tuple[Leg, Leg]:
    """Left and right leg of a body.

    Raises:
        SettingError: the joints of a leg are not one about each axis at the hip, a knee, and an ankle about y and perhaps x;
            or the legs differ in their number or order.
    """
    left, right = (_leg(character, *one) for one in zip(SIDES, character.soles))
    if left.hip_order.tolist() != right.hip_order.tolist() or len(left.hinges) != len(right.hinges):
        raise SettingError(
            f"character {character.name!r}: the joints of its legs differ in number or order; valid: the same on both sides"
        )
    return left, right


def _leg(character: Character, side: str, soles: tuple[str, ...]) -> Leg:
    model, body = character.model, character.skeleton
    names = character.groups[f"{side}_leg"]
    hinges = character.joint_indices(names)
    axes = character.reference_axes[hinges]
    turns = np.abs(axes).argmax(axis=1)
    known = len(turns) in (5, 6) and turns.tolist() == list(_AXES[: len(turns)])
    if not known or (hinges[:3] > hinges[3]).any() or (np.diff(hinges[3:]) < 0).any():
        raise SettingError(
            f"character {character.name!r}: the joints of its {side} leg are {', '.join(names)}; the inverse kinematics "
            "needed here is for hip joints about y, x and z in any order, then a knee, then an ankle about y, or y and x"
        )
    foot = character.frames.get(f"{side}_foot")
    if foot is not None and abs(foot[2][0]) < LEVEL_FOOT:
        raise SettingError(
            f"character {character.name!r}: the frame of its {side} foot is not level when it stands, which is needed here"
        )
    joints = [model.joint(name) for name in names]
    geoms = [model.geom(name) for name in soles]
    hip = body.rest_offset(f"{side}_thigh")
    if body is not character:
        hip = hip + body.rest_offset("pelvis") - body.standing_qpos[:3]
    thigh, shank = (float(-body.rest_offset(f"{side}_{part}")[2]) for part in ("shank", "foot"))
    chain = LegChain.of_character(character, side)
    return Leg(
        hinges=hinges,
        hip_order=turns[np.argsort(hinges[:3])],
        hip=np.array(hip),
        thigh=thigh,
        shank=shank,
        sign=np.sign(axes[range(len(turns)), turns]),
        zero=np.array(model.qpos0[7 + hinges]),
        low=np.array([joint.range[0] for joint in joints]),
        high=np.array([joint.range[1] for joint in joints]),
        points=np.array([geom.pos for geom in geoms]),
        radii=np.array([geom.size[0] for geom in geoms]),
        chain=None if chain.is_ideal(hip, thigh, shank) else chain,
    )


def leg_of_each(character: Character, sides: IndexArray) -> Leg:
    """Legs by side, 0 left and 1 right: `sides` (N,) may name them in any order and again and again."""
    rows, chain = _rows_of_legs(character)
    return Leg(**{name: values[sides] for name, values in rows.items()}, chain=chain and chain.rows(sides))


@lru_cache(maxsize=16)
def _rows_of_legs(character: Character) -> tuple[dict[str, Any], LegChain | None]:
    left, right = legs(character)
    names = [field.name for field in fields(Leg) if field.name != "chain"]
    rows = {name: np.stack([getattr(left, name), getattr(right, name)]) for name in names}
    if left.chain is None and right.chain is None:
        return rows, None
    return rows, LegChain.of_both(*(LegChain.of_character(character, side) for side in SIDES))


def two_bar_bend(distance: FloatArray, a: FloatArray | float, b: FloatArray | float) -> FloatArray:
    """Bend (0 = straight) of a two-bar linkage that spans a distance; straight where it is out of reach [rad].

    Args:
        distance: (...) between its ends [m].
        a: length of one bar, also by distance [m].
        b: of the other [m].
    """
    return np.asarray(np.arccos(np.clip((distance**2 - a * a - b * b) / (2 * a * b), -1.0, 1.0)))


def ball_joint_angles(rotation: FloatArray, order: Sequence[int] = (1, 0, 2)) -> FloatArray:
    """Angles (..., 3) about y, x and z of a hip or shoulder [rad], whatever the order in which its hinges come.

    Args:
        rotation: (..., 3, 3) in the parent.
        order: the axes, 0 to 2, from the parent outwards; by default R = Ry Rx Rz.
    """
    i, j, k = order
    sign = 1.0 if (j - i) % 3 == 1 else -1.0
    angles = {
        i: np.arctan2(-sign * rotation[..., j, k], rotation[..., k, k]),
        j: np.arcsin(np.clip(sign * rotation[..., i, k], -1.0, 1.0)),
        k: np.arctan2(-sign * rotation[..., i, j], rotation[..., i, i]),
    }
    return np.stack([angles[1], angles[0], angles[2]], axis=-1)


def solve_leg(
    leg: Leg,
    pelvis: FloatArray,
    pelvis_rotation: FloatArray,
    ankle: FloatArray,
    foot_rotation: FloatArray,
    knee_axis: FloatArray | None = None,
    steep: float = 0.0,
) -> FloatArray:
    """Hinge angles (T, 6), or (T, 5), that put the foot where it should be, in the order of its group, limits ignored [rad].

    A leg that is too short stays straight and points at it.

    Args:
        leg: constants of the leg, or of the leg of every row.
        pelvis: (T, 3) pelvis origin, world [m].
        pelvis_rotation: (T, 3, 3).
        ankle: (T, 3) wanted origin of the foot, world [m].
        foot_rotation: (T, 3, 3) wanted orientation of the foot.
        knee_axis: (T, 3) about where the knee axis (y of the shank) points, world; tells the two solutions apart. None:
            where y of the foot points, so that the ankle inverts by less than 90 degrees.
        steep: below this sine of the angle between foot and leg, the knee axis tends to `knee_axis` and the foot turns
            with it: a foot in line with its leg does not tell where the knee points.
    """
    line = np.einsum("tji,tj->ti", pelvis_rotation, ankle - pelvis) - leg.hip  # in the pelvis frame
    foot = np.einsum("tji,tjk->tik", pelvis_rotation, foot_rotation)
    distance = np.maximum(np.linalg.norm(line, axis=1), 1e-9)
    a, b = leg.thigh, leg.shank
    knee = two_bar_bend(distance, a, b)
    down = line / distance[:, None]
    toe = foot[:, :, 0]
    axis = cross(toe, down)
    hint = foot[:, :, 1].copy() if knee_axis is None else np.einsum("tji,tj->ti", pelvis_rotation, knee_axis)
    axis *= np.where((axis * hint).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis /= np.maximum(length, 1e-9)
    hint -= (hint * down).sum(axis=1, keepdims=True) * down
    hint /= np.maximum(np.linalg.norm(hint, axis=1, keepdims=True), 1e-9)
    axis = np.where(length < 1e-9, hint, axis)  # a foot in line with its leg
    if steep > 0:
        share = np.maximum(1 - (length / steep) ** 2, 0.0) ** 2
        axis += share * (hint - axis)
        axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-9)
    forward = cross(down, axis)
    # angle from the hip-ankle line to the thigh, in the leg's plane
    lean = np.arctan2(b * np.sin(knee), a + b * np.cos(knee))
    thigh_down = np.cos(lean)[:, None] * down + np.sin(lean)[:, None] * forward
    thigh = np.stack([cross(axis, -thigh_down), axis, -thigh_down], axis=-1)  # columns x, y, z
    hip = ball_joint_angles(thigh, leg.hip_order.reshape(-1, 3)[0].tolist() if len(line) else (1, 0, 2))
    # knee about y, then ankle: R = Ry(d) Rx(i)
    ankle_rotation = np.einsum("tji,tjk->tik", thigh @ axis_rotation("y", knee), foot)
    dorsiflexion = np.arctan2(-ankle_rotation[:, 2, 0], ankle_rotation[:, 0, 0])
    inversion = np.arctan2(-ankle_rotation[:, 1, 2], ankle_rotation[:, 1, 1])
    turns = np.column_stack([hip, knee, dorsiflexion, inversion])[:, : leg.sign.shape[-1]] * leg.sign
    if leg.chain is not None:
        turns = leg.chain.reach(np.einsum("tji,tj->ti", pelvis_rotation, ankle - pelvis), foot, turns)
    return np.asarray(leg.zero + turns)
