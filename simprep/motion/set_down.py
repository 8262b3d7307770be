"""Setting down a body that hovers without flying. Captured crawls leave gaps between hands, knees and the floor."""

import numpy as np
from scipy.ndimage import gaussian_filter1d, minimum_filter1d

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.humanoid_model import GRAVITY
from simprep.motion.contacts import stances
from simprep.motion.kinematics import body_clearance, forward_kinematics

HOVER_M = 0.005
"""A body whose lowest point is higher than this touches nothing [m]."""
LEAST_S = 0.1
"""Shorter gaps do not tell the acceleration in them [s]."""
FEWEST = 3
"""Frames through which a parabola can be laid."""
FALL_SHARE = 0.5
"""A body is in flight if it accelerates downward with more than this share of gravity; else it hovers."""
SMOOTHING_S = 0.04


def set_down(qpos: FloatArray, fps: float, character: Character, cyclic: bool = False) -> FloatArray:
    """Distance (T,) by which each frame is to be lowered, 0 or more and never into the floor [m].

    Frames are lowered in the spans in which nothing touches the floor although the body does not fall freely. The
    parabola that fits its COM height best tells whether it falls.

    Args:
        qpos: (T, nq) poses.
        fps: frames per second [1/s].
        character: the body.
        cyclic: the last frame is followed by the first.
    """
    n = len(qpos)
    shown = np.arange(-n, 2 * n) % n if cyclic else np.arange(n)
    clearance = body_clearance(qpos, character).min(axis=1)[shown]
    height = forward_kinematics(qpos, character).com[shown, 2]
    hovering = np.zeros(len(shown))
    for first, after in stances(clearance > HOVER_M):
        if (
            after - first >= max(FEWEST, LEAST_S * fps)
            and _acceleration(height[first:after], fps) > -FALL_SHARE * GRAVITY
        ):
            hovering[first:after] = clearance[first:after]
    sigma = SMOOTHING_S * fps
    smooth = gaussian_filter1d(minimum_filter1d(hovering, 2 * int(2 * sigma) + 1), sigma, mode="nearest")
    lowered = np.minimum(smooth, hovering)
    return np.asarray(lowered[n : 2 * n] if cyclic else lowered)


def _acceleration(height: FloatArray, fps: float) -> float:
    return float(2 * np.polyfit(np.arange(len(height)) / fps, height, 2)[0])
