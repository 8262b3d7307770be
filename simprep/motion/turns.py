"""Turns about the vertical, and from one orientation to another."""

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray


def turned(points: FloatArray, angle: FloatArray | float) -> FloatArray:
    """Floor points or vectors (..., 2), turned about the vertical by (...) [rad], counter-clockwise seen from above."""
    c, s = np.cos(angle), np.sin(angle)
    x, y = points[..., 0], points[..., 1]
    out = np.empty((*np.broadcast_shapes(np.shape(angle), x.shape), 2))
    out[..., 0], out[..., 1] = c * x - s * y, s * x + c * y
    return out


def about_vertical(angle: FloatArray | float) -> FloatArray:
    """Quaternions (..., 4), wxyz, of turns (...) about the vertical [rad]."""
    zero = np.zeros_like(angle)
    return np.stack([np.cos(np.divide(angle, 2)), zero, zero, np.sin(np.divide(angle, 2))], axis=-1)


def rotation_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Rotation vectors (..., 3), world axes, that turn quaternions `a` into `b`, both (4,) or (N, 4) wxyz [rad]."""
    turn = Rotation.from_quat(b, scalar_first=True) * Rotation.from_quat(a, scalar_first=True).inv()
    return np.asarray(turn.as_rotvec())
