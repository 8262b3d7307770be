"""Identified dynamics: the law of motion of the centre of mass that a sparse regression finds in the data."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from simprep.arrays import BoolArray, FloatArray
from simprep.humanoid_model import GRAVITY
from simprep.metrics.smoothing import DYNAMICS_SIGMA_S, SmoothMotion, smooth_motion
from simprep.motion.motion import Motion
from simprep.physics.run import Run
from simprep.physics.whole_body import FLIGHT_SHARE, WholeBody, whole_body, zero_moment_point

SPARSITY_THRESHOLD = 0.05


@dataclass(frozen=True)
class PendulumLaw:
    """Identified law: acceleration = offset + omega^2 (com - cop) + damping * velocity, one for both floor axes.

    Attributes:
        omega_squared_per_s2: coefficient of com - cop [1/s^2]; NaN where nothing could be fitted.
        damping_per_s: coefficient of the velocity [1/s]; 0 where the sparse regression dropped it.
        offset_m_s2: constant term [m/s^2]; 0 where dropped.
        r_squared: share of the variance of the acceleration that the law explains.
        expected_per_s2: g / mean COM height [1/s^2], the linear inverted pendulum's value.
        ratio: identified over expected.
        sample_count: frames used.
    """

    omega_squared_per_s2: float
    damping_per_s: float
    offset_m_s2: float
    r_squared: float
    expected_per_s2: float
    ratio: float
    sample_count: int


def identify_pendulum(
    com: FloatArray,
    velocity: FloatArray,
    acceleration: FloatArray,
    centre_of_pressure: FloatArray,
    gravity: float = GRAVITY,
) -> PendulumLaw:
    """Fit the linear inverted pendulum by SINDy (Brunton et al. 2016; `pysindy`).

    Sequentially thresholded least squares (threshold 0.05 in SI units) on the library 1, velocity, com - cop, over both
    floor axes together. Captures whether the body balances like a pendulum on its centre of pressure: ratio and
    r_squared are near 1, the other terms 0. Another ratio tells of angular momentum or of a COM that moves vertically.
    With the ZMP of a kinematic motion as `centre_of_pressure`, the law is partly true by construction, and only the
    deviation says something. Hides causes and flight. The coefficients are NaN with under 10 usable frames or no
    motion.

    Args:
        com: (n, 3) [m].
        velocity: (n, 3) [m/s].
        acceleration: (n, 3) [m/s^2].
        centre_of_pressure: (n, 2) [m]; NaN where nothing presses.
        gravity: [m/s^2].
    """
    usable = np.isfinite(centre_of_pressure).all(axis=1)
    lever = (com[usable, :2] - centre_of_pressure[usable]).T.reshape(-1, 1)  # x axis, then y axis
    speed = velocity[usable, :2].T.reshape(-1, 1)
    response = acceleration[usable, :2].T.reshape(-1, 1)
    count = int(usable.sum())
    height = float(com[usable, 2].mean()) if count else float("nan")
    nothing = float("nan")
    expected = gravity / height
    if count < 10 or np.ptp(lever) < 1e-6 or np.ptp(response) < 1e-6:
        return PendulumLaw(nothing, nothing, nothing, nothing, expected, nothing, count)
    import pysindy  # 3 s to import

    model = pysindy.SINDy(
        optimizer=pysindy.STLSQ(threshold=SPARSITY_THRESHOLD, alpha=0.0),
        feature_library=pysindy.PolynomialLibrary(degree=1, include_bias=True),
    )
    model.fit(speed, t=np.arange(len(speed), dtype=float), x_dot=response, u=lever, feature_names=["v", "lever"])
    names = model.get_feature_names()
    coefficients = dict(zip(names, model.coefficients()[0], strict=True))
    predicted = coefficients["1"] + coefficients["v"] * speed + coefficients["lever"] * lever
    r_squared = 1.0 - float(((response - predicted) ** 2).sum() / ((response - response.mean()) ** 2).sum())
    omega_squared = float(coefficients["lever"])
    return PendulumLaw(
        omega_squared_per_s2=omega_squared,
        damping_per_s=float(coefficients["v"]),
        offset_m_s2=float(coefficients["1"]),
        r_squared=r_squared,
        expected_per_s2=expected,
        ratio=omega_squared / expected,
        sample_count=count,
    )


def identify_motion(motion: Motion) -> PendulumLaw:
    """`identify_pendulum` at 60 Hz of a motion of at least 0.5 s, with its zero moment point as centre of pressure."""
    smooth, body = _dynamics(motion)
    weight = _mass(motion) * GRAVITY
    return _identify(motion, smooth, body, zero_moment_point(body.com, body.force, body.torque, weight))


def identify_run(run: Run) -> PendulumLaw:
    """`identify_pendulum` at 60 Hz of a run of at least 0.5 s, not diverged, with its measured centre of pressure.

    The pressure passes the same low-pass as the poses (weighted by the vertical force, as the moment would be).
    """
    motion = run.simulated_motion()
    smooth, body = _dynamics(motion)
    _, pressure = smooth_pressure(run)
    nearest = np.clip(np.round(smooth.time / run.timestep).astype(int), 0, len(pressure) - 1)
    return _identify(motion, smooth, body, pressure[nearest])


def smooth_pressure(run: Run) -> tuple[FloatArray, FloatArray]:
    """Vertical force (N,) [N] and centre of pressure (N, 2) [m] of a run's steps, low-passed; NaN while nothing bears.

    The pressure is weighted by the force, as the moment would be.
    """
    pressed: BoolArray = np.asarray(np.isfinite(run.centre_of_pressure).all(axis=1))
    vertical = np.where(pressed, run.ground_force[:, 2], 0.0)
    moment = vertical[:, None] * np.where(pressed[:, None], run.centre_of_pressure, 0.0)
    samples = DYNAMICS_SIGMA_S / run.timestep
    force, moment = gaussian_filter1d(vertical, samples), gaussian_filter1d(moment, samples, axis=0)
    bears = force > FLIGHT_SHARE * _mass(run.reference) * GRAVITY
    pressure = np.full_like(moment, np.nan)
    pressure[bears] = moment[bears] / force[bears, None]
    return np.asarray(force), pressure


def _mass(motion: Motion) -> float:
    return float(motion.character.model.body_mass.sum())


def _dynamics(motion: Motion) -> tuple[SmoothMotion, WholeBody]:
    smooth = smooth_motion(motion)
    return smooth, whole_body(motion.character.model, smooth.qpos, smooth.qvel, smooth.qacc)


def _identify(motion: Motion, smooth: SmoothMotion, body: WholeBody, centre_of_pressure: FloatArray) -> PendulumLaw:
    acceleration = body.force / _mass(motion) - [0.0, 0.0, GRAVITY]
    keep = smooth.interior
    return identify_pendulum(body.com[keep], body.com_velocity[keep], acceleration[keep], centre_of_pressure[keep])
