"""Synthesise a preparation movement: locomotion in the style of what comes next (paper, section 5)."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from simprep.errors import MotionError, SettingError
from simprep.humanoid import FEET
from simprep.motion.contacts import stances
from simprep.motion.edit import cut, loop_displacement, repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.support import polygons, support_centre, support_points
from simprep.preparation.blending import blend_hinges, joint_weights
from simprep.preparation.planting import plant_feet
from simprep.preparation.posture_optimisation import optimise_postures
from simprep.preparation.reference_posture import ReferencePosture, reference_posture
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings
from simprep.preparation.trajectory import blend_root, mean_root_height, support_root_height, support_share

Array = NDArray[np.float64]

_RESTING_HEIGHT_M = 0.01
_RESTING_SPEED = 0.1  # m/s
_RESTING_TIME_S = 0.1


@dataclass(frozen=True)
class Record:
    """What happened in every frame.

    Attributes:
        alpha: (T,) level of preparation.
        root_weight: (T,) blending weight of the root.
        weights: (T, 37) blending weights of the hinges.
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

    alpha: Array
    root_weight: Array
    weights: Array
    costs_before: Array
    costs_after: Array
    steps: NDArray[np.int64]
    com_before: Array
    com: Array
    support: tuple[Array, ...]
    centre: Array
    goal: Array
    locomotion_contacts: NDArray[np.bool_]
    foot_error: Array
    pelvis_drop: Array
    reference: ReferencePosture
    settings: PreparationSettings


@dataclass(frozen=True)
class Preparation:
    """A prepared locomotion.

    Attributes:
        motion: the motion. Its contacts are those of the locomotion, and those of feet that rest on the floor because the
            preparation has taken their swing away.
        record: what happened in every frame.
    """

    motion: Motion
    record: Record


def prepare(
    locomotion: Motion,
    target: Motion,
    alpha: float | Array,
    *,
    settings: PreparationSettings = DEFAULT_SETTINGS,
    duration: float | None = None,
    optimise: bool = True,
) -> Preparation:
    """Synthesise locomotion that prepares for a target motion.

    Args:
        locomotion: what the character does meanwhile; a loop is repeated as often as needed.
        target: what it prepares for; its event `target` marks the first frame of the target movement.
        alpha: level of preparation, 0 (not at all) to 1 (fully, standing still): constant, or one value per output frame.
        settings: every constant; the defaults are the paper's.
        duration: length of the output [s], for a constant alpha; None for the whole locomotion (one cycle of a loop).
        optimise: whether to run the posture optimisation.

    Returns:
        The motion, at the locomotion's frame rate, and the record.

    Raises:
        MotionError: no marked target movement, different bodies, or a locomotion that is too short and no loop.
        SettingError: alpha outside 0 to 1, or given both over time and with a duration.
    """
    reference = reference_posture(target, settings)
    if locomotion.body != target.body:
        raise MotionError(
            f"{locomotion.name} and {target.name} belong to different bodies: {locomotion.body}, {target.body}"
        )
    level = _levels(locomotion, alpha, duration)
    source = extend(locomotion, len(level))
    root_weight, weights = joint_weights(level, settings)
    kinematics = forward_kinematics(source.qpos, source.body)

    qpos = source.qpos.copy()
    qpos[:, 7:] = blend_hinges(source.qpos[:, 7:], reference.qpos[7:], weights)
    cycle = (len(locomotion), loop_displacement(locomotion)[0]) if locomotion.loop and len(locomotion) > 1 else None
    path = blend_root(source.qpos[:, :7], reference.qpos[:7], root_weight, source.fps, cycle)
    qpos[:, :2], qpos[:, 3:7] = path.position, path.quat
    touched = (root_weight > 0) | (weights > 0).any(axis=1)
    if touched.any():
        blended = forward_kinematics(qpos, source.body)  # at the locomotion's root height
        if settings.root_height == "mean":
            height = mean_root_height(
                source.qpos[:, 2],
                kinematics.xpos[:, FEET, 2] - source.qpos[:, 2:3],
                blended.xpos[:, FEET, 2] - source.qpos[:, 2:3],
            )
        else:
            sole = kinematics.foot_points[..., 2].min(axis=2)
            sole_goal = (1 - root_weight)[:, None] * sole + root_weight[:, None] * reference.sole_height
            soles_after = blended.foot_points[..., 2].min(axis=2) - source.qpos[:, 2:3]
            height = support_root_height(sole_goal, soles_after, support_share(source.contacts, source.fps))
        qpos[:, 2] = np.where(touched, height, source.qpos[:, 2])
        planted = plant_feet(
            qpos, kinematics, source.contacts, root_weight, reference.sole_height, source.fps, source.body, settings
        )
        qpos, kinematics = planted.qpos, planted.kinematics
        foot_error, drop = planted.foot_error, planted.pelvis_drop
    else:
        foot_error, drop = np.zeros((len(qpos), 2)), np.zeros(len(qpos))

    contacts = source.contacts
    if touched.any():
        contacts = contacts | resting_feet(kinematics.foot_points, root_weight, reference, source.fps)
    floor, mask = support_points(kinematics.foot_points, contacts)
    centre = support_centre(floor, mask)
    goal = np.full((len(qpos), 2), np.nan)
    com = com_before = kinematics.com
    costs_before = costs_after = np.full((len(qpos), 4), np.nan)
    steps = np.zeros(len(qpos), dtype=np.int64)
    if optimise and (level >= settings.threshold).any():
        optimised = optimise_postures(
            qpos, com, centre, change_share(level, source.fps, settings), source.fps, source.body, settings
        )
        qpos, steps, goal = optimised.qpos, optimised.steps, optimised.goals
        costs_before, costs_after = optimised.before, optimised.after
        com = forward_kinematics(qpos, source.body).com
    motion = replace(
        source,
        qpos=qpos,
        contacts=contacts,
        events={},
        name=f"{locomotion.name}_preparing_{target.name}",
        source=f"prepared: {locomotion.source}; for {target.source}",
        loop=False,
    )
    record = Record(
        alpha=level,
        root_weight=root_weight,
        weights=weights,
        costs_before=costs_before,
        costs_after=costs_after,
        steps=steps,
        com_before=com_before,
        com=com,
        support=tuple(polygons(floor, mask)),
        centre=centre,
        goal=goal,
        locomotion_contacts=source.contacts,
        foot_error=foot_error,
        pelvis_drop=drop,
        reference=reference,
        settings=settings,
    )
    return Preparation(motion, record)


def change_share(alpha: Array, fps: float, settings: PreparationSettings = DEFAULT_SETTINGS) -> Array:
    """How much of the posture change is used at each level of preparation.

    Args:
        alpha: (T,).
        fps: frames per second [1/s].
        settings: threshold and ramp.

    Returns:
        (T,) 0 below the threshold; above it, smoothly rising and falling in time where alpha passes the threshold.
    """
    share = np.zeros(len(alpha))
    ramp = settings.threshold_ramp * fps
    for first, after in stances(np.asarray(alpha >= settings.threshold)):
        frames = np.arange(first, after)
        since = np.inf if first == 0 else frames - first + 1.0
        until = np.inf if after == len(alpha) else after - frames + 0.0
        x = np.minimum(np.minimum(since, until) / (ramp + 1), 1.0)
        share[first:after] = x * x * (3 - 2 * x)
    return share


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


def resting_feet(foot_points: Array, weight: Array, reference: ReferencePosture, fps: float) -> NDArray[np.bool_]:
    """Feet that rest on the floor although the locomotion has them in the air, since blending has taken their swing away.

    A foot rests where it supports in the reference posture too, and its lowest point is within 1 cm of the height it has
    there and slower than 0.1 m/s, for at least 0.1 s.

    Args:
        foot_points: (T, 2, 4, 3) of the blended motion [m].
        weight: (T,) blending weight of the root.
        reference: the reference posture.
        fps: frames per second [1/s].

    Returns:
        (T, 2).
    """
    resting = np.zeros(foot_points.shape[:2], dtype=bool)
    if len(foot_points) < 2:
        return resting
    speed = np.linalg.norm(np.gradient(foot_points, 1 / fps, axis=0), axis=-1)  # (T, 2, 4)
    height = foot_points[..., 2] - weight[:, None, None] * reference.sole_height[:, None]
    still = ((height < _RESTING_HEIGHT_M) & (speed < _RESTING_SPEED)).any(axis=2)
    still &= (weight > 0)[:, None] & reference.contacts
    for side in (0, 1):
        for first, after in stances(still[:, side]):
            resting[first:after, side] = after - first >= _RESTING_TIME_S * fps
    return resting


def _levels(locomotion: Motion, alpha: float | Array, duration: float | None) -> Array:
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
