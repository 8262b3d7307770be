"""Displacement of the character over one action, measured on the synthesised preparation."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from simprep.arrays import FloatArray
from simprep.controller.alpha_filter import filter_kernel, smooth_alpha
from simprep.controller.settings import ControllerSettings
from simprep.controller.spaces import ALPHA_LEVELS, ALPHA_STEP, relative
from simprep.errors import MotionError
from simprep.motion.edit import loop_displacement
from simprep.motion.motion import Motion
from simprep.motion.turns import turned
from simprep.preparation.blending import split_heading
from simprep.preparation.prepare import extend, prepare
from simprep.preparation.trajectory import heading_trend

PHASES = 4
"""Evenly spread frames of the cycle at which the measured actions begin; the displacement is their mean."""


@dataclass(frozen=True)
class DisplacementTable:
    """Path of the root over one action.

    Attributes:
        path: (node, level before, level commanded, frames + 1, 3) forward, left [m] and turn [rad] since the action
            began, in the heading at its beginning; NaN for changes of more than one level. The first frame is 0.
        fps: frames per second [1/s].
    """

    path: FloatArray
    fps: float

    @property
    def frames(self) -> int:
        """Frames per action."""
        return int(self.path.shape[3]) - 1


def displacement_table(cores: Sequence[Motion], target: Motion, settings: ControllerSettings) -> DisplacementTable:
    """Measure every change of level in every core node.

    Each core node is synthesised with `prepare` once per phase, with a filtered alpha that goes through all 16 changes
    of at most one level. Steps are in the frame of the heading's trend; their mean over the phases is taken.

    Args:
        cores: the core nodes, loops of one frame rate and body.
        target: any target motion; the displacement does not depend on it, only on the root's blending curve.
        settings: action duration, alpha filter and preparation.

    Raises:
        MotionError: a core node is no loop, or their frame rates differ.
    """
    fps = cores[0].fps
    frames = round(settings.action_s * fps)
    schedule = level_schedule()
    commands = np.repeat(np.array(schedule[1:]) * ALPHA_STEP, frames)
    alpha = smooth_alpha(commands, filter_kernel(settings.smoothing, fps), before=0.0)
    path = np.full((len(cores), ALPHA_LEVELS, ALPHA_LEVELS, frames + 1, 3), np.nan)
    for node, core in enumerate(cores):
        if not core.loop:
            raise MotionError(f"{core.name} is not a loop; core nodes are cyclic")
        if abs(core.fps - fps) > 1e-6:
            raise MotionError(
                f"{core.name} has {core.fps:g} frames/s, {cores[0].name} {fps:g}; valid: one rate for all"
            )
        starts = [round(len(core) * phase / PHASES) for phase in range(PHASES)]
        steps = np.mean([_steps(core, start, target, alpha, settings) for start in starts], axis=0)
        for number, (before, after) in enumerate(pairwise(schedule)):
            path[node, before, after] = integrate(steps[number * frames : (number + 1) * frames])
    return DisplacementTable(path, fps)


def level_schedule() -> list[int]:
    """Levels that pass through every change by at most one exactly once: 0 0 1 1 ... 5 5 4 ... 0."""
    up = [level for level in range(ALPHA_LEVELS) for _ in (0, 1)]
    return up + list(range(ALPHA_LEVELS - 2, -1, -1))


def integrate(steps: FloatArray) -> FloatArray:
    """Path (T + 1, 3) of steps (T, 3) forward, left [m] and turn [rad] per frame, given in the moving frame, from 0.

    A step is taken in the heading half way through its turn.
    """
    heading = np.concatenate([[0.0], np.cumsum(steps[:, 2])])
    middle = (heading[1:] + heading[:-1]) / 2
    walked = np.cumsum(turned(steps[:, :2], middle), axis=0)
    return np.column_stack([np.concatenate([np.zeros((1, 2)), walked]), heading])


def _steps(core: Motion, start: int, target: Motion, alpha: FloatArray, settings: ControllerSettings) -> FloatArray:
    """(T, 3) steps of the prepared core, begun at a frame of its cycle, in the frame of the heading's trend."""
    prepared = prepare(
        core, target, np.concatenate([np.zeros(start + 1), alpha]), settings=settings.preparation, optimise=False
    )
    root, weight = prepared.motion.qpos[:, :7], prepared.record.root_weight
    original = np.unwrap(split_heading(extend(core, len(root)).qpos[:, 3:7])[0])
    swing = original - heading_trend(original, core.fps, (len(core), loop_displacement(core)[0]))
    heading = (
        np.unwrap(split_heading(root[:, 3:7])[0]) - (1 - weight) * swing
    )  # the pelvis turns to and fro at every step
    walked = relative(np.diff(root[:, :2], axis=0), 0.0, (heading[1:] + heading[:-1]) / 2)
    return np.column_stack([walked, np.diff(heading)])[start:]
