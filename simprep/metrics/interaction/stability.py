"""How steadily pelvis and trunk are carried: tilt against the vertical, and how fast it changes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.metrics.smoothing import DYNAMICS_SIGMA_S, EDGE_S, gaussian_derivatives
from simprep.motion.rotations import continuous_quat, multiply_quat, rotation_matrix

MEASURED = ("pelvis", "thorax")


@dataclass(frozen=True)
class Stability:
    """Tilt of pelvis and trunk; all fighters together.

    Attributes:
        pelvis_tilt_deg: root mean square angle of the pelvis's long axis from the vertical [deg].
        trunk_tilt_deg: the same of the thorax.
        pelvis_rate_deg_s: root mean square angular velocity of the pelvis about horizontal axes [deg/s].
        trunk_rate_deg_s: the same of the thorax.
    """

    pelvis_tilt_deg: float
    trunk_tilt_deg: float
    pelvis_rate_deg_s: float
    trunk_rate_deg_s: float


def tilt(quat: FloatArray) -> FloatArray:
    """Angle (...) between a body's z axis and the vertical, 0 to pi [rad], of orientations (..., 4) wxyz."""
    return np.asarray(np.arccos(np.clip(rotation_matrix(quat)[..., 2, 2], -1.0, 1.0)))


def tilt_rate(quat: FloatArray, fps: float) -> FloatArray:
    """Size of the angular velocity about horizontal axes (n,), at 60 frames per second [rad/s].

    It passes a Gaussian of 20 ms; the 80 ms at both ends that rest on extrapolation are left out.

    Args:
        quat: (T, 4) orientations of a body, wxyz.
        fps: frames per second [1/s].
    """
    times, (value, rate) = gaussian_derivatives(continuous_quat(quat), fps, (0, 1), sigma=DYNAMICS_SIGMA_S)
    conjugate = value * [1.0, -1.0, -1.0, -1.0]
    omega = 2 * multiply_quat(rate, conjugate)[:, 1:] / np.sum(value**2, axis=1, keepdims=True)
    inner = (times > EDGE_S - 1e-9) & (times < times[-1] - EDGE_S + 1e-9)
    return np.asarray(np.linalg.norm(omega[inner, :2], axis=1))


def stability(
    quats: Sequence[FloatArray], characters: Sequence[Character], bounds: NDArray[np.integer], fps: float
) -> Stability:
    """Steadiness of the fighters.

    Captures staggering and leaning. Kicks and dodges tilt a trunk on purpose, so compare it with the examples'.

    Args:
        quats: (T, segments, 4) orientations of each fighter's segments.
        characters: the fighters.
        bounds: (clips, 2) first frame of every clip and the frame after its last.
        fps: frames per second [1/s].

    Raises:
        SettingError: a fighter has no pelvis or thorax.
    """
    numbers: list[float] = []
    measured = [[quat[:, one.segment(role)] for quat, one in zip(quats, characters, strict=True)] for role in MEASURED]
    for those in measured:
        numbers.append(_rms_deg([tilt(quat) for quat in those]))
    for those in measured:
        parts = [quat[first:after] for quat in those for first, after in bounds if after - first > 2]
        numbers.append(_rms_deg([tilt_rate(part, fps) for part in parts]))
    return Stability(*numbers)


def _rms_deg(parts: Sequence[FloatArray]) -> float:
    values = np.concatenate(parts) if parts else np.empty(0)
    return float(np.degrees(np.sqrt(np.mean(values**2)))) if len(values) else float("nan")
