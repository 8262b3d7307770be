"""Derivatives that do not depend on the frame rate: every signal is low-passed by the same Gaussian, in seconds.

Finite differences amplify noise by a power of the frame rate. Here a cubic spline of at least 240 Hz is convolved with
derivatives of a Gaussian of standard deviation `SIGMA_S` (-3 dB at 13 Hz; gait analysis uses 6 to 15 Hz). Angular
frequency w keeps exp(-(w * SIGMA_S)^2 / 2) of its amplitude; impacts under about 20 ms are hidden. Inverse dynamics
uses `DYNAMICS_SIGMA_S` (-3 dB at 6.6 Hz; Winter 2009 takes 6 Hz): masses turn noise above it into large forces.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import BoolArray, FloatArray
from simprep.motion.motion import Motion
from simprep.motion.rotations import continuous_quat, multiply_quat

SIGMA_S = 0.010
GRID_HZ = 240.0
ANALYSIS_HZ = 60.0
DYNAMICS_SIGMA_S = 0.020
EDGE_S = 4 * DYNAMICS_SIGMA_S
"""Accelerations this close to an end of a motion rest on extrapolation; statistics leave them out."""

_TRUNCATE = 8.0  # a shorter kernel of second order has a constant gain: 4 cm/s^2 per metre at 5 sigma


def gaussian_derivatives(
    values: FloatArray, fps: float, orders: Sequence[int] = (0, 1, 2), rate: float = ANALYSIS_HZ, sigma: float = SIGMA_S
) -> tuple[FloatArray, list[FloatArray]]:
    """Low-passed signal and its time derivatives on a uniform time grid.

    Returns times (n,) [s] from the first sample, and one (n, k) array per order, in the unit of values per s^order.
    Both ends are continued by point reflection, which keeps the velocity and lets the acceleration go to zero there.

    Args:
        values: (T, k) samples, T >= 2.
        fps: their rate [1/s].
        orders: derivatives wanted, 0 to 3.
        rate: rate of the result [1/s].
        sigma: standard deviation of the Gaussian [s].
    """
    count = len(values)
    factor = max(1, int(np.ceil(GRID_HZ / fps - 1e-9)))
    fine = np.asarray(values, dtype=np.float64)
    if factor > 1:
        fine = CubicSpline(np.arange(count), fine, axis=0)(np.arange((count - 1) * factor + 1) / factor)
    step = 1.0 / (fps * factor)
    pad = int(np.ceil(_TRUNCATE * sigma / step)) + 1
    padded = np.pad(fine, ((pad, pad), (0, 0)), mode="reflect", reflect_type="odd")
    times = np.arange(int(np.floor((count - 1) / fps * rate + 1e-6)) + 1) / rate
    position = np.clip(times / step, 0, len(fine) - 1)
    low = np.minimum(position.astype(int), len(fine) - 2)
    weight = (position - low)[:, None]
    results = []
    for order in orders:
        smooth = gaussian_filter1d(padded, sigma / step, axis=0, order=order, truncate=_TRUNCATE) / step**order
        smooth = smooth[pad:-pad]
        results.append((1 - weight) * smooth[low] + weight * smooth[low + 1])
    return times, results


@dataclass(frozen=True)
class SmoothMotion:
    """A motion and its derivatives at `ANALYSIS_HZ`, whatever its frame rate.

    Attributes:
        time: (n,) seconds from the first frame.
        qpos: (n, nq) low-passed poses.
        qvel: (n, nv) velocities in MuJoCo's convention (root rotation in the body frame).
        qacc: (n, nv) accelerations, the time derivative of qvel's components.
        contacts: (n, 2) foot contacts of the nearest frame.
    """

    time: FloatArray
    qpos: FloatArray
    qvel: FloatArray
    qacc: FloatArray
    contacts: BoolArray

    @property
    def interior(self) -> BoolArray:
        """(n,) frames whose accelerations do not rest on extrapolation."""
        return np.asarray((self.time > EDGE_S - 1e-9) & (self.time < self.time[-1] - EDGE_S + 1e-9))


def smooth_motion(motion: Motion, rate: float = ANALYSIS_HZ, sigma: float = DYNAMICS_SIGMA_S) -> SmoothMotion:
    """Low-passed poses, velocities and accelerations.

    Args:
        motion: at least 2 frames.
        rate: frames per second of the result [1/s].
        sigma: standard deviation of the Gaussian [s].
    """
    qpos = motion.qpos.copy()
    qpos[:, 3:7] = continuous_quat(qpos[:, 3:7])
    times, (value, first, second) = gaussian_derivatives(qpos, motion.fps, (0, 1, 2), rate, sigma)
    quat, quat_rate, quat_acceleration = value[:, 3:7], first[:, 3:7], second[:, 3:7]
    norm = np.sum(quat**2, axis=1, keepdims=True)
    norm_rate = 2 * np.sum(quat * quat_rate, axis=1, keepdims=True)
    conjugate = quat * [1.0, -1.0, -1.0, -1.0]
    # w = 2 vec(q* q') / |q|^2 holds for the normalised quaternion whatever |q| does; the second line is its derivative
    omega = 2 * multiply_quat(conjugate, quat_rate)[:, 1:] / norm
    alpha = 2 * multiply_quat(conjugate, quat_acceleration)[:, 1:] / norm - omega * norm_rate / norm
    value[:, 3:7] = quat / np.sqrt(norm)
    nearest = np.clip(np.round(times * motion.fps).astype(int), 0, len(motion) - 1)
    return SmoothMotion(
        time=times,
        qpos=value,
        qvel=np.concatenate([first[:, :3], omega, first[:, 7:]], axis=1),
        qacc=np.concatenate([second[:, :3], alpha, second[:, 7:]], axis=1),
        contacts=motion.contacts[nearest],
    )
