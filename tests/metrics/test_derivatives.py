import numpy as np
import pytest
from metric_cases import rigid_motion, swaying_motion

from simprep.metrics.smoothing import SIGMA_S, gaussian_derivatives, smooth_motion
from simprep.metrics.transition import transition_peaks
from simprep.motion.motion import Motion
from simprep.motion.rotations import multiply_quat


@pytest.mark.parametrize("fps", [60.0, 100.0, 240.0, 480.0])
def test_sinusoid_has_its_analytic_derivatives(fps):
    omega, size = 2 * np.pi * 4, 0.3
    time = np.arange(int(2 * fps) + 1) / fps
    times, results = gaussian_derivatives(size * np.sin(omega * time)[:, None], fps, (0, 1, 2, 3))
    kept = size * np.exp(-((omega * SIGMA_S) ** 2) / 2)  # what a Gaussian leaves of a sinusoid
    inside = (times > 0.1) & (times < 1.9)
    for order, result in enumerate(results):
        exact = kept * omega**order * np.sin(omega * times + order * np.pi / 2)
        assert np.abs(result[:, 0] - exact)[inside].max() < 0.01 * kept * omega**order


@pytest.mark.parametrize("fps", [60.0, 120.0, 480.0])
def test_peaks_of_one_swinging_joint(fps):
    omega, size = 2 * np.pi * 3, 0.4
    time = np.arange(int(2 * fps) + 1) / fps
    hinges = np.zeros((len(time), 37))
    hinges[:, 5] = size * np.sin(omega * time)
    torque = np.zeros((len(time) - 1, 37))
    torque[:, 7] = 50 * np.sin(omega * (time[:-1] + 0.5 / fps))
    peaks = transition_peaks(hinges, fps, 1.0, torque, np.full(37, 200.0))
    kept = np.exp(-((omega * SIGMA_S) ** 2) / 2)
    assert peaks["peak_acceleration_rad_s2"] == pytest.approx(kept * size * omega**2, rel=0.01)
    assert peaks["peak_jerk_rad_s3"] == pytest.approx(kept * size * omega**3, rel=0.01)
    assert peaks["peak_rms_acceleration_rad_s2"] == pytest.approx(kept * size * omega**2 / np.sqrt(37), rel=0.01)
    assert peaks["peak_torque_nm"] == pytest.approx(kept * 50, rel=0.01)
    assert peaks["peak_torque_share"] == pytest.approx(kept * 0.25, rel=0.01)


def test_only_the_window_counts_and_a_cut_window_has_no_peak():
    fps, time = 120.0, np.arange(361) / 120.0
    hinges = np.zeros((361, 37))
    hinges[:, 0] = np.where(time > 2, 0.5 * (1 - np.cos(20 * (time - 2))), 0.0)
    assert transition_peaks(hinges, fps, 1.0)["peak_acceleration_rad_s2"] == pytest.approx(0, abs=1e-9)
    assert transition_peaks(hinges, fps, 2.3)["peak_acceleration_rad_s2"] > 100
    assert all(np.isnan(value) for value in transition_peaks(hinges, fps, 2.9).values())


def test_spinning_root():
    fps, spin, growth = 120.0, 3.0, 2.0  # rad/s at the start, rad/s^2, about an axis fixed in body and world
    time = np.arange(241) / fps
    angle = spin * time + growth * time**2 / 2
    axis = np.array([1.0, 2.0, 2.0]) / 3
    motion = rigid_motion(np.zeros((241, 3)), fps)
    qpos = motion.qpos.copy()
    qpos[:, 3:7] = np.concatenate([np.cos(angle / 2)[:, None], np.sin(angle / 2)[:, None] * axis], axis=1)
    qpos[100:, 3:7] *= -1  # the same rotations
    smooth = smooth_motion(Motion(qpos, fps, motion.contacts))
    inside = (smooth.time > 0.1) & (smooth.time < 1.9)
    assert smooth.qvel[inside, 3:6] == pytest.approx((spin + growth * smooth.time[inside])[:, None] * axis, abs=1e-3)
    assert smooth.qacc[inside, 3:6] == pytest.approx(np.tile(growth * axis, (inside.sum(), 1)), abs=0.02)
    identity = multiply_quat(smooth.qpos[:, 3:7], smooth.qpos[:, 3:7] * [1, -1, -1, -1])
    assert identity == pytest.approx(np.tile([1.0, 0, 0, 0], (len(identity), 1)))


def test_acceleration_is_the_derivative_of_velocity():
    smooth = smooth_motion(swaying_motion(120.0))
    difference = np.gradient(smooth.qvel, smooth.time, axis=0)
    inside = slice(5, -5)
    assert np.abs(difference - smooth.qacc)[inside].max() < 0.02 * np.abs(smooth.qacc).max()
