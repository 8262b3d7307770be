"""A body that hovers without flying is set down: what captured crawls leave between their hands, knees and the floor."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from simprep.character import Character
from simprep.humanoid import GRAVITY
from simprep.motion.contacts import stances
from simprep.motion.kinematics import body_clearance, forward_kinematics

HOVER_M = 0.005
"""A body whose lowest point is higher than this touches nothing."""
LEAST_S = 0.1
"""Shorter gaps tell nothing about the acceleration in them."""
FALL_SHARE = 0.5
"""A body that accelerates downward with more than this share of gravity is in flight, not hovering."""
SMOOTHING_S = 0.04


def set_down(qpos: NDArray[np.float64], fps: float, character: Character, cyclic: bool = False) -> NDArray[np.float64]:
    """Lower the root in the spans in which nothing touches the floor although the body does not fall freely.

    Whether a span is flight is read from the parabola that fits its COM height best. Nothing is lowered below the floor.

    Args:
        qpos: (T, 44) poses.
        fps: frames per second [1/s].
        character: the humanoid.
        cyclic: the last frame is followed by the first.

    Returns:
        (T,) by how much each frame is to be lowered [m], 0 or more.
    """
    n = len(qpos)
    shown = np.arange(-n, 2 * n) % n if cyclic else np.arange(n)
    clearance = body_clearance(qpos, character).min(axis=1)[shown]
    height = forward_kinematics(qpos, character).com[shown, 2]
    hovering = np.zeros(len(shown))
    for first, after in stances(clearance > HOVER_M):
        if after - first >= LEAST_S * fps and _acceleration(height[first:after], fps) > -FALL_SHARE * GRAVITY:
            hovering[first:after] = clearance[first:after]
    sigma = SMOOTHING_S * fps
    smooth = gaussian_filter1d(minimum_filter1d(hovering, 2 * int(2 * sigma) + 1), sigma, mode="nearest")
    lowered = np.minimum(smooth, hovering)
    return np.asarray(lowered[n : 2 * n] if cyclic else lowered)


def _acceleration(height: NDArray[np.float64], fps: float) -> float:
    return float(2 * np.polyfit(np.arange(len(height)) / fps, height, 2)[0])
