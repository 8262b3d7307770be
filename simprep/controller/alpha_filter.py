"""Gaussian filter on the level of preparation at run time (paper, section 6.1)."""

import numpy as np
from numpy.typing import ArrayLike

from simprep.arrays import FloatArray


def filter_kernel(smoothing: float, fps: float) -> FloatArray:
    """Weights (K,) of the last commands, newest first: a Gaussian cut off at 3 standard deviations, delayed by as much.

    Args:
        smoothing: standard deviation [s].
        fps: frames per second [1/s].
    """
    reach = max(1, int(3 * smoothing * fps))
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (smoothing * fps)) ** 2)
    return np.asarray(weights / weights.sum())


def smooth_alpha(commands: ArrayLike, kernel: FloatArray, before: float | None = None) -> FloatArray:
    """Filtered level of preparation (T,), every frame from its own and earlier commands only.

    Args:
        commands: (T,) level commanded in every frame, piecewise constant.
        kernel: from `filter_kernel`.
        before: level commanded before the first frame; None for the first command.
    """
    commands = np.asarray(commands, dtype=np.float64)
    past = np.full(len(kernel) - 1, commands[0] if before is None else before)
    smoothed = np.convolve(np.concatenate([past, commands]), kernel, mode="valid")
    return np.asarray(np.clip(smoothed, 0.0, 1.0))
