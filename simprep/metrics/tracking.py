"""Tracking: how closely a simulated body follows its reference, and what the servos spend on it."""

import numpy as np

from simprep.arrays import FloatArray
from simprep.motion.kinematics import forward_kinematics
from simprep.physics.run import DONE, Run

SUCCESS_DISTANCE_M = 0.5
ERROR_HZ = 30.0
SATURATED_SHARE = 0.99
_STATES_HZ = 60.0


def body_positions(run: Run) -> tuple[FloatArray, FloatArray, float]:
    """Origins of all segments at about 60 Hz: simulated and reference (n, segments, 3) [m], and their rate [1/s]."""
    stride = max(1, round(1 / run.timestep / _STATES_HZ))
    body = run.reference.character
    simulated = forward_kinematics(run.qpos[::stride], body).xpos
    reference = forward_kinematics(run.reference_qpos[::stride], body).xpos
    return simulated, reference, 1 / (run.timestep * stride)


def position_errors(simulated: FloatArray, reference: FloatArray) -> dict[str, float]:
    """Mean position errors over frames and segments by name.

    - `g_mpjpe_mm`: of world positions. Captures drift as well as pose; a perfect walk half a metre astray scores 500.
    - `mpjpe_mm`: after subtracting each pose's root position; headings are not aligned, as is standard. Captures the
      pose; hides drift and falling straight down. Distal errors weigh as much as proximal ones.
    - `max_body_distance_mm`: largest over time of the mean distance of all segments, which `success` bounds by 500.

    Args:
        simulated: (n, segments, 3) [m].
        reference: (n, segments, 3) [m].
    """
    distance = np.linalg.norm(simulated - reference, axis=2)
    relative = (simulated - simulated[:, :1]) - (reference - reference[:, :1])
    return {
        "g_mpjpe_mm": 1e3 * float(distance.mean()),
        "mpjpe_mm": 1e3 * float(np.linalg.norm(relative, axis=2).mean()),
        "max_body_distance_mm": 1e3 * float(distance.mean(axis=1).max()),
    }


def derivative_errors(simulated: FloatArray, reference: FloatArray, rate: float) -> dict[str, float]:
    """Velocity and acceleration errors of body positions by name: first and second differences at 30 Hz.

    `velocity_error_m_s` and `acceleration_error_m_s2` are mean norms over frames and segments; NaN for motions under
    two 30 Hz intervals. They capture jitter and bad timing that position errors forgive; they hide vibration above 15
    Hz.

    Args:
        simulated: (n, segments, 3) [m].
        reference: (n, segments, 3) [m].
        rate: samples per second [1/s].
    """
    difference = simulated - reference
    count = len(difference)
    position = np.arange(int(np.floor((count - 1) / rate * ERROR_HZ + 1e-6)) + 1) * (rate / ERROR_HZ)
    low = np.clip(np.floor(position + 1e-9).astype(int), 0, max(count - 2, 0))
    weight = (position - low)[:, None, None]
    sampled = (1 - weight) * difference[low] + weight * difference[np.minimum(low + 1, count - 1)]
    if len(sampled) < 3:
        return {"velocity_error_m_s": np.nan, "acceleration_error_m_s2": np.nan}
    velocity = np.diff(sampled, axis=0) * ERROR_HZ
    acceleration = np.diff(velocity, axis=0) * ERROR_HZ
    return {
        "velocity_error_m_s": float(np.linalg.norm(velocity, axis=2).mean()),
        "acceleration_error_m_s2": float(np.linalg.norm(acceleration, axis=2).mean()),
    }


def succeeded(run: Run, max_body_distance_mm: float) -> bool:
    """Whether the run ended `done` and the mean body distance never exceeded 0.5 m (Luo et al. 2021, 2023)."""
    return run.end == DONE and max_body_distance_mm <= 1e3 * SUCCESS_DISTANCE_M


def peak_speed_share(run: Run) -> float | None:
    """Largest joint speed of the only body as share of that joint's limit; None where no limits are known."""
    limits = run.reference.character.velocity_limits
    return float((np.abs(run.qvel[:, 6:]) / np.array(limits)).max()) if limits else None


def effort(
    torque: FloatArray, torque_limit: FloatArray, hinge_velocity: FloatArray, timestep: float
) -> dict[str, float]:
    """What the servos spend, by name.

    - `torque_rms_nm`, `torque_rms_share`: root mean square over time and hinges, in N m and as share of each hinge's
      limit. Legs and trunk dominate the first; in the second a wrist counts as much as a hip.
    - `saturation_share`: share of hinges and steps at 99 % of the limit or more.
    - `positive_work_j`, `absolute_work_j`: sum over hinges of the servo power's positive part, and of its size. Neither
      is metabolic cost: muscles pay for holding still and get little back from negative work.

    Args:
        torque: (N, joints) servo torques [N m].
        torque_limit: (joints,) [N m].
        hinge_velocity: (N + 1, joints) at the states before and after each step [rad/s].
        timestep: [s].
    """
    share = np.abs(torque) / torque_limit
    power = torque * (hinge_velocity[:-1] + hinge_velocity[1:]) / 2
    return {
        "torque_rms_nm": float(np.sqrt(np.mean(torque**2))),
        "torque_rms_share": float(np.sqrt(np.mean(share**2))),
        "saturation_share": float(np.mean(share >= SATURATED_SHARE)),
        "positive_work_j": float(np.maximum(power, 0).sum() * timestep),
        "absolute_work_j": float(np.abs(power).sum() * timestep),
    }
