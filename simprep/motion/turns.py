"""Turning: points on the floor about the vertical, and from one orientation to another."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


def turned(points: NDArray[np.float64], angle: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Points or vectors on the floor, turned about the vertical.

    Args:
        points: (..., 2).
        angle: (...) [rad], counter-clockwise seen from above.

    Returns:
        (..., 2).
    """
    c, s = np.cos(angle), np.sin(angle)
    x, y = points[..., 0], points[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def about_vertical(angle: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Quaternions (..., 4), wxyz, of turns (...) about the vertical [rad]."""
    zero = np.zeros_like(angle)
    return np.stack([np.cos(np.divide(angle, 2)), zero, zero, np.sin(np.divide(angle, 2))], axis=-1)


def rotation_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation vectors (..., 3), in world axes, that turn one orientation into another [rad].

    Args:
        a: (4,) or (N, 4) quaternions wxyz.
        b: of the same shape, the others.
    """
    turn = Rotation.from_quat(b, scalar_first=True) * Rotation.from_quat(a, scalar_first=True).inv()
    return np.asarray(turn.as_rotvec())
