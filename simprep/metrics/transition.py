"""Transition: how violent the launch of the target movement is."""

import numpy as np

from simprep.arrays import FloatArray
from simprep.metrics.smoothing import gaussian_derivatives

TRANSITION_KEYS = (
    "peak_acceleration_rad_s2", "peak_jerk_rad_s3", "peak_rms_acceleration_rad_s2", "peak_torque_nm", "peak_torque_share",
)  # fmt: skip
"""Names of the numbers, in order."""
WINDOW_S = 0.25
_PEAK_HZ = 240.0


def transition_peaks(
    hinges: FloatArray,
    fps: float,
    launch_s: float,
    torque: FloatArray | None = None,
    torque_limit: FloatArray | None = None,
) -> dict[str, float]:
    """Peaks over all hinges within 0.25 s before and after the launch of the target, by name.

    NaN without torque, or where the motion does not cover the window (a fall must not look gentle). All signals pass
    the Gaussian of `simprep.metrics.smoothing` (sigma 10 ms), so frame rate and timestep do not matter.
    - `peak_acceleration_rad_s2`, `peak_jerk_rad_s3`: second and third derivative of the fastest hinge. They capture the
      jolt of an unprepared transition, and the target's own snap, which all arms share. A singular shoulder adds to
      them.
    - `peak_rms_acceleration_rad_s2`: peak over time of the root mean square over hinges; depends less on one joint.
    - `peak_torque_nm`, `peak_torque_share`: largest servo torque and largest share of a limit (simulated runs only).

    Args:
        hinges: (T, joints) hinge angles [rad].
        fps: [1/s].
        launch_s: time of the launch from the first frame [s].
        torque: (T - 1, joints) servo torques of the steps between the frames [N m]; None for a kinematic motion.
        torque_limit: (joints,) [N m], with `torque`.
    """
    missing = dict.fromkeys(TRANSITION_KEYS, float("nan"))
    duration = (len(hinges) - 1) / fps
    if not (launch_s - WINDOW_S >= -1e-9 and launch_s + WINDOW_S <= duration + 1e-9):  # also when launch_s is NaN
        return missing
    times, (acceleration, jerk) = gaussian_derivatives(hinges, fps, (2, 3), _PEAK_HZ)
    near = np.abs(times - launch_s) <= WINDOW_S + 1e-9
    peaks = missing | {
        "peak_acceleration_rad_s2": float(np.abs(acceleration[near]).max()),
        "peak_jerk_rad_s3": float(np.abs(jerk[near]).max()),
        "peak_rms_acceleration_rad_s2": float(np.sqrt(np.mean(acceleration[near] ** 2, axis=1)).max()),
    }
    if torque is not None and len(torque) >= 2:
        times, (smooth,) = gaussian_derivatives(torque, fps, (0,), _PEAK_HZ)
        near = np.abs(times + 0.5 / fps - launch_s) <= WINDOW_S + 1e-9
        peaks["peak_torque_nm"] = float(np.abs(smooth[near]).max())
        if torque_limit is not None:
            peaks["peak_torque_share"] = float((np.abs(smooth[near]) / torque_limit).max())
    return peaks
