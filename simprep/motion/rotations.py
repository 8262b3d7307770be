"""Rotation matrices and quaternions over all frames at once."""

import numpy as np
from numpy.typing import NDArray


def axis_rotation(axis: str, angle: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """Rotation matrices about a coordinate axis.

    Args:
        axis: `x`, `y` or `z`.
        angle: (...) [rad].

    Returns:
        (..., 3, 3).
    """
    angle = np.asarray(angle, dtype=np.float64)
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    out = np.zeros((*angle.shape, 3, 3))
    out[..., i, i] = 1.0
    out[..., j, j] = out[..., k, k] = np.cos(angle)
    out[..., k, j] = np.sin(angle)
    out[..., j, k] = -out[..., k, j]
    return out


def rotation_matrix(quat: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotation matrices of unit quaternions.

    Args:
        quat: (..., 4) wxyz.

    Returns:
        (..., 3, 3).
    """
    w, x, y, z = np.moveaxis(quat, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def in_heading(vectors: NDArray[np.float64], heading: NDArray[np.float64]) -> NDArray[np.float64]:
    """World vectors in axes turned about z: forward, left, up as seen from a heading.

    Args:
        vectors: (T, N, 3).
        heading: (T,) angle of the forward axis from world x [rad].

    Returns:
        (T, N, 3).
    """
    c, s = np.cos(heading)[:, None], np.sin(heading)[:, None]
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x + s * y, c * y - s * x, vectors[..., 2]], axis=-1)


def multiply_quat(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Hamilton product of quaternions, wxyz, broadcast over leading axes.

    Args:
        a: (..., 4).
        b: (..., 4).
    """
    aw, ax, ay, az = np.moveaxis(np.asarray(a), -1, 0)
    bw, bx, by, bz = np.moveaxis(np.asarray(b), -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def wrap_angle(angle: NDArray[np.float64] | float) -> NDArray[np.float64]:
    """The same angles (...) from -pi to pi [rad]."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)
