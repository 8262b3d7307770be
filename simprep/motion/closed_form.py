"""Poses near the targets of a clip in closed form, from which the inverse kinematics starts."""

from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import ROLES, SIDES, Character
from simprep.motion.limb_paths import Limb, candidates, limb_path, worst_angle
from simprep.motion.targets import Targets, frame_from, unit


def closed_form(targets: Targets, character: Character) -> FloatArray:
    """Poses (T, nq) near the targets, in closed form and within the limits; no frame starts from another.

    Each spine joint takes an equal share of the rotation from pelvis to chest; neck and head half each of the one from
    chest to head. Feet and hands take Euler angles against shank and forearm. For the limbs see
    `simprep.motion.limb_paths`.

    Args:
        targets: where the joints should be.
        character: the body.
    """
    model = character.model
    at = {name: targets.positions[:, number] for number, name in enumerate(ROLES)}
    pelvis, thorax = _trunk(at)
    qpos = np.tile(model.qpos0, (len(targets.positions), 1))
    qpos[:, :3] = at["pelvis"]
    qpos[:, 3:7] = Rotation.from_matrix(pelvis).as_quat(scalar_first=True)

    def put(name: str, axis: int, angle: FloatArray) -> None:
        index = character.anatomical(name)
        if index is not None:
            sign = np.sign(character.reference_axes[index, axis])
            qpos[:, 7 + index] = np.clip(model.qpos0[7 + index] + sign * angle, *model.jnt_range[1 + index])

    spine = [name for name in ("lumbar", "thorax") if character.anatomical(f"{name}_flexion") is not None]
    turn = Rotation.from_matrix(np.swapaxes(pelvis, -1, -2) @ thorax).as_rotvec()
    flexion, bending, rotation = Rotation.from_rotvec(turn / max(len(spine), 1)).as_euler("YXZ").T
    for segment in spine:
        put(f"{segment}_flexion", 1, flexion)
        put(f"{segment}_bending", 0, bending)
        put(f"{segment}_rotation", 2, rotation)
    if targets.oriented[0]:
        head = np.swapaxes(thorax, -1, -2) @ targets.orientations[:, 0]
        flexion, bending, rotation = Rotation.from_matrix(head).as_euler("YXZ").T
        put("neck_bending", 0, bending)
        for segment in ("neck", "head"):
            put(f"{segment}_flexion", 1, flexion / 2)
            put(f"{segment}_rotation", 2, rotation / 2)
    for number, side in enumerate(SIDES):
        arm = _limb_into(qpos, character, targets, thorax, (f"{side}_upper_arm", f"{side}_forearm", f"{side}_hand"))
        if targets.oriented[1 + number]:
            hand = np.swapaxes(arm, -1, -2) @ targets.orientations[:, 1 + number]
            pronation, flexion, deviation = Rotation.from_matrix(hand).as_euler("ZXY").T
            put(f"{side}_forearm_pronation", 2, pronation)
            put(f"{side}_wrist_flexion", 0, flexion)
            put(f"{side}_wrist_deviation", 1, deviation)
        leg = _limb_into(qpos, character, targets, pelvis, (f"{side}_thigh", f"{side}_shank", f"{side}_foot"))
        if targets.oriented[3 + number]:
            foot = np.swapaxes(leg, -1, -2) @ targets.orientations[:, 3 + number]
            flexion, inversion, _ = Rotation.from_matrix(foot).as_euler("YXZ").T
            put(f"{side}_ankle_dorsiflexion", 1, flexion)
            put(f"{side}_ankle_inversion", 0, inversion)
    return qpos


def least_errors(targets: Targets, character: Character, limb: str) -> FloatArray:
    """Least angle (T,) to the directions of a limb's two bones, the larger of both, over all poses within the limits [rad].

    Args:
        targets: where the joints should be.
        character: the body.
        limb: `left_arm`, `right_arm`, `left_leg` or `right_leg`.
    """
    at = {name: targets.positions[:, number] for number, name in enumerate(ROLES)}
    side, _, kind = limb.partition("_")
    parts = ("thigh", "shank", "foot") if kind == "leg" else ("upper_arm", "forearm", "hand")
    names = (f"{side}_{parts[0]}", f"{side}_{parts[1]}", f"{side}_{parts[2]}")
    wanted = np.concatenate(_bones(at, names, _trunk(at)[kind == "arm"]), axis=-1)
    geometry = Limb.of_character(character, names)
    return np.asarray(worst_angle(geometry, candidates(geometry, wanted), wanted[:, None]).min(axis=1))


def _trunk(at: dict[str, FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Orientations of pelvis and chest (T, 3, 3)."""
    pelvis = frame_from(at["left_thigh"] - at["right_thigh"], at["abdomen"] - at["pelvis"])
    return pelvis, frame_from(at["left_upper_arm"] - at["right_upper_arm"], at["neck"] - at["thorax"])


def _bones(at: dict[str, FloatArray], names: tuple[str, str, str], parent: FloatArray) -> list[FloatArray]:
    """Directions of a limb's bones in the frame of its parent, (T, 3) each."""
    return [np.einsum("tji,tj->ti", parent, unit(at[b] - at[a])) for a, b in pairwise(names)]


def _limb_into(
    qpos: FloatArray, character: Character, targets: Targets, parent: FloatArray, names: tuple[str, str, str]
) -> FloatArray:
    """Fill in a limb's four hinges; returns the orientations of its second bone (T, 3, 3)."""
    limb = Limb.of_character(character, names)
    at = {name: targets.positions[:, ROLES.index(name)] for name in names}
    bones = _bones(at, names, parent)
    angles = limb_path(limb, bones[0], bones[1], targets.fps)
    qpos[:, 7 + limb.joints] = limb.zero + angles
    return np.asarray(parent @ limb.orientation(angles))
