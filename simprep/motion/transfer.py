"""From one body to another: a motion of a character retargeted as if it came from a file."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from simprep.arrays import FloatArray
from simprep.character import ROLES, SIDES, Character, parent_role
from simprep.errors import MotionError
from simprep.humanoid_model import humanoid
from simprep.motion.edit import loop_displacement
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import ImportResult, import_motion, retarget_clip
from simprep.motion.motion import Motion
from simprep.motion.rotations import rotation_matrix

HAND_M = 0.08
"""How far beyond the wrist the points lie that tell where a hand points [m]."""
LEAST_TURN = 0.01
"""A loop that turns by more than this in a cycle is moved as a plain motion [rad]."""


def transferred(motion: Motion, character: Character) -> ImportResult:
    """A motion on another body, with the report of its retargeting; events and frame rate stay.

    Args:
        motion: of any character with arms, legs and a thorax.
        character: the other body.

    Raises:
        SettingError: one of the bodies lacks a part that is needed.
        MotionError: it cannot be retargeted.
    """
    result = retarget_clip(clip_of_motion(motion), fps=motion.fps, character=character)
    moved = result.motion
    if len(moved) != len(motion):
        raise MotionError(f"{motion.name}: {len(moved)} frames on {character.name} instead of {len(motion)}")
    source = f"{motion.source}, moved from {motion.character.name}".removeprefix(", ")
    return replace(result, motion=replace(moved, name=motion.name, source=source, events=motion.events))


def onto(motion: Motion, character: Character, warn: Callable[[str], None] = lambda line: None) -> Motion:
    """A motion on a body, as it is if it is that body's already.

    Args:
        motion: of any character with arms, legs and a thorax.
        character: the body.
        warn: receives what the retargeting says, a line each.

    Raises:
        SimprepError: as `transferred`.
    """
    if motion.character == character:
        return motion
    result = transferred(motion, character)
    for line in result.report.warnings:
        warn(line)
    return result.motion


def import_onto(path: str | Path, body: Character | None, **reading: Any) -> ImportResult:
    """A motion file on a body, with one report of all that was done.

    Args:
        path: the file.
        body: whose motion it becomes; None for the one whose motion the file holds, or the humanoid.
        reading: further arguments of `simprep.motion.load.import_motion`.

    Raises:
        MotionFileError: it cannot be read or retargeted.
    """
    result = import_motion(path, character=body or humanoid(), **reading)
    if body is None or result.motion.character == body:
        return result
    moved = transferred(result.motion, body)
    report = replace(
        moved.report, recognised=result.report.recognised, warnings=(*result.report.warnings, *moved.report.warnings)
    )
    return ImportResult(moved.motion, report)


def clip_of_motion(motion: Motion) -> SourceClip:
    """The joints of a motion's body as those of a foreign skeleton, named by their roles.

    Args:
        motion: of any character.
    """
    body = motion.character.skeleton
    roles = [role for role in ROLES if body.has(role)]
    segments = [body.segment(role) for role in roles]
    positions, rotations = _poses(motion.qpos, body, segments)
    rest_positions, rest_rotations = _poses(body.standing_qpos[None], body, segments)
    parents = [-1 if role == "pelvis" else roles.index(_carrier(role, roles)) for role in roles]
    names = list(roles)

    def add(name: str, parent: str, offset: FloatArray) -> None:
        """A point fixed to a role's segment, `offset` (3,) away in the reference pose [m]."""
        nonlocal positions, rotations, rest_positions, rest_rotations
        at = roles.index(parent)
        local = rest_rotations[0, at].T @ offset
        names.append(name)
        parents.append(at)
        positions = np.concatenate([positions, positions[:, at, None] + rotations[:, at, None] @ local], axis=1)
        rest_positions = np.concatenate([rest_positions, rest_positions[:, at, None] + offset], axis=1)
        rotations = np.concatenate([rotations, rotations[:, at, None]], axis=1)
        rest_rotations = np.concatenate([rest_rotations, rest_rotations[:, at, None]], axis=1)

    if "neck" not in roles:
        shoulders = [
            rest_positions[0, roles.index(f"{side}_upper_arm")] for side in SIDES if f"{side}_upper_arm" in roles
        ]
        thorax = rest_positions[0, roles.index("thorax")]
        add("neck", "thorax", np.mean(shoulders, axis=0) - thorax)
    soles = forward_kinematics(body.standing_qpos[None], body).foot_points[0]  # (2, N, 3)
    for side, points in zip(SIDES, soles):
        foot = rest_positions[0, roles.index(f"{side}_foot")]
        add(f"{side}_toe", f"{side}_foot", np.array([points[:, 0].max() - foot[0], 0.0, points[:, 2].min() - foot[2]]))
        if f"{side}_hand" in roles:
            add(f"{side}_index", f"{side}_hand", np.array([0.0, 0.0, -HAND_M]))
    step: FloatArray | None = None
    notes: tuple[str, ...] = ()
    if motion.loop:
        turn, shift = loop_displacement(motion)
        if abs(turn) < LEAST_TURN:
            step = np.array([*shift, 0.0])
        else:
            notes = ("a loop that turns: moved as a motion that ends",)
    return SourceClip(
        path=Path(motion.name),
        format="simprep",
        names=tuple(names),
        parents=np.array(parents, dtype=np.intp),
        positions=positions,
        rotations=rotations,
        rest_positions=rest_positions[0],
        rest_rotations=rest_rotations[0],
        fps=motion.fps,
        unit_m=1.0,
        up="z",
        step=step,
        notes=notes,
    )


def _poses(qpos: FloatArray, body: Character, segments: list[int]) -> tuple[FloatArray, FloatArray]:
    """Positions (T, J, 3) [m] and orientations (T, J, 3, 3) of some segments."""
    kinematics = forward_kinematics(qpos, body)
    return kinematics.xpos[:, segments], rotation_matrix(kinematics.xquat[:, segments])


def _carrier(role: str, roles: list[str]) -> str:
    """The nearest role towards the pelvis that the body has."""
    role = parent_role(role)
    while role not in roles:
        role = parent_role(role)
    return role
