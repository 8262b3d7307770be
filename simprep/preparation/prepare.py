"""Synthesise a preparation movement: locomotion in the style of what comes next (paper, section 5)."""

from dataclasses import dataclass, replace

import numpy as np

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.errors import MotionError, SettingError
from simprep.motion.edit import cut, loop_displacement, repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.support import polygons
from simprep.preparation.blending import split_heading
from simprep.preparation.posture_optimisation import OptimisedPostures
from simprep.preparation.reference_posture import ReferencePosture, reference_posture
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings
from simprep.preparation.synthesis import Locomotion, Style, synthesise
from simprep.preparation.trajectory import heading_trend


@dataclass(frozen=True)
class Record:
    """What happened in every frame.

    Attributes:
        alpha: (T,) level of preparation.
        root_weight: (T,) blending weight of the root.
        weights: (T, joints) blending weights of the hinges.
        costs_before: (T, 4) C_b [m], C_s [m], C_m [m per frame^2] and C of the blended posture; NaN where the
            optimisation did not run.
        costs_after: (T, 4) of the result.
        steps: (T,) descent steps.
        com_before: (T, 3) COM before the optimisation [m].
        com: (T, 3) COM of the result [m].
        support: T support polygons (M, 2) [m], M = 0 in flight.
        centre: (T, 2) centre of the support polygon (paper: COS) [m]; NaN in flight.
        goal: (T, 2) where C_b wanted the COM on the floor [m]; NaN where it was left out.
        locomotion_contacts: (T, 2) foot contacts of the locomotion.
        foot_error: (T, 2) distance of the ankle from where inverse kinematics should have put it [m].
        pelvis_drop: (T,) how far the pelvis was lowered for the legs to reach [m].
        reference: the reference posture.
        settings: every constant used.
    """

    alpha: FloatArray
    root_weight: FloatArray
    weights: FloatArray
    costs_before: FloatArray
    costs_after: FloatArray
    steps: IntArray
    com_before: FloatArray
    com: FloatArray
    support: tuple[FloatArray, ...]
    centre: FloatArray
    goal: FloatArray
    locomotion_contacts: BoolArray
    foot_error: FloatArray
    pelvis_drop: FloatArray
    reference: ReferencePosture
    settings: PreparationSettings


@dataclass(frozen=True)
class Preparation:
    """A prepared locomotion.

    Attributes:
        motion: its contacts are those of the locomotion and of feet that rest as the preparation has taken their swing away.
        record: what happened in every frame.
    """

    motion: Motion
    record: Record


def prepare(
    locomotion: Motion,
    target: Motion,
    alpha: float | FloatArray,
    *,
    settings: PreparationSettings = DEFAULT_SETTINGS,
    duration: float | None = None,
    optimise: bool = True,
) -> Preparation:
    """Synthesise locomotion, at its own frame rate, that prepares for a target motion.

    Args:
        locomotion: what the character does meanwhile; a loop is repeated as often as needed.
        target: what it prepares for; its event `target` marks the first frame of the target movement.
        alpha: level of preparation, 0 (not at all) to 1 (fully, standing still): constant, or one value per output frame.
        settings: every constant; the defaults are the paper's.
        duration: length of the output [s], for a constant alpha; None for the whole locomotion (one cycle of a loop).
        optimise: whether to run the posture optimisation.

    Raises:
        MotionError: no marked target movement, different bodies, or a locomotion that is too short and no loop.
        SettingError: alpha outside 0 to 1, or given both over time and with a duration.
    """
    reference = reference_posture(target, settings)
    if locomotion.character != target.character:
        raise MotionError(
            f"{locomotion.name} and {target.name} belong to different bodies: {locomotion.character}, {target.character}"
        )
    level = _levels(locomotion, alpha, duration)
    source = extend(locomotion, len(level))
    cycle = (len(locomotion), loop_displacement(locomotion)[0]) if locomotion.loop and len(locomotion) > 1 else None
    heading, _ = split_heading(source.qpos[:, 3:7])
    trend = heading_trend(np.unwrap(heading), source.fps, cycle)
    style = Style(reference.qpos, reference.sole_height, reference.contacts)
    result = synthesise(
        Locomotion(source.qpos, source.contacts, trend, source.fps, source.character), style, level, settings, optimise
    )
    qpos, com, n = result.qpos, result.kinematics.com, len(level)
    if result.optimised is not None:
        com = forward_kinematics(qpos, source.character).com
    missing = np.full((n, 4), np.nan)
    optimised = result.optimised or OptimisedPostures(
        qpos, missing, missing, np.zeros(n, dtype=np.int64), np.full((n, 2), np.nan)
    )
    motion = replace(
        source,
        qpos=qpos,
        contacts=result.contacts,
        events={},
        name=f"{locomotion.name}_preparing_{target.name}",
        source=f"prepared: {locomotion.source}; for {target.source}",
        loop=False,
    )
    record = Record(
        alpha=level,
        root_weight=result.root_weight,
        weights=result.weights,
        costs_before=optimised.before,
        costs_after=optimised.after,
        steps=optimised.steps,
        com_before=result.kinematics.com,
        com=com,
        support=tuple(polygons(*result.support)),
        centre=result.centre,
        goal=optimised.goals,
        locomotion_contacts=source.contacts,
        foot_error=result.foot_error,
        pelvis_drop=result.pelvis_drop,
        reference=reference,
        settings=settings,
    )
    return Preparation(motion, record)


def extend(locomotion: Motion, frames: int) -> Motion:
    """The first frames of a locomotion, a loop repeated as often as needed.

    Raises:
        MotionError: it is too short and no loop.
    """
    if locomotion.loop:
        locomotion = replace(repeat(locomotion, -(-frames // len(locomotion))), loop=False)
    if len(locomotion) < frames:
        raise MotionError(
            f"{locomotion.name}: {len(locomotion)} frames, {frames} needed, and it is no loop; "
            f"valid: at most {(len(locomotion) - 1) / locomotion.fps:.2f} s"
        )
    return cut(locomotion, 0, frames)


def _levels(locomotion: Motion, alpha: float | FloatArray, duration: float | None) -> FloatArray:
    level = np.asarray(alpha, dtype=np.float64)
    if level.ndim == 0:
        frames = len(locomotion) if duration is None else max(1, round(duration * locomotion.fps) + 1)
        level = np.full(frames, float(level))
    elif level.ndim != 1 or len(level) == 0:
        raise SettingError(f"alpha has shape {level.shape}; valid: a number, or one value per frame")
    elif duration is not None:
        raise SettingError("alpha is given per frame, so its length is the duration; leave out one of them")
    if not ((level >= 0) & (level <= 1)).all():  # NaN fails too
        raise SettingError(f"alpha runs from {level.min():g} to {level.max():g}; valid: 0 to 1")
    return level
