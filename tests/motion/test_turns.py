"""Turns on the floor and between orientations against scipy's rotations; fades against their end conditions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simprep.motion.curves import dying_away, smooth_step
from simprep.motion.turns import about_vertical, rotation_between, turned


def test_turns_agree_with_rotations():
    rng = np.random.default_rng(0)
    points, angle = rng.normal(size=(5, 7, 2)), rng.uniform(-9, 9, (5, 7))
    whole = np.concatenate([points, np.zeros((5, 7, 1))], axis=-1).reshape(-1, 3)
    quats = about_vertical(angle)
    expected = Rotation.from_quat(quats.reshape(-1, 4), scalar_first=True).apply(whole)
    np.testing.assert_allclose(turned(points, angle).reshape(-1, 2), expected[:, :2], atol=1e-14)
    np.testing.assert_allclose(about_vertical(0.4), [np.cos(0.2), 0, 0, np.sin(0.2)], rtol=0, atol=0)


def test_the_rotation_between_turns_one_into_the_other():
    rng = np.random.default_rng(1)
    for _ in range(20):
        a, b = Rotation.random(2, rng=rng).as_quat(scalar_first=True)
        again = Rotation.from_rotvec(rotation_between(a, b)) * Rotation.from_quat(a, scalar_first=True)
        assert abs(again.as_quat(scalar_first=True) @ b) == pytest.approx(1, abs=1e-12)


def test_fades_start_and_end_as_they_say():
    h, ends = 1e-6, np.array([0.0, 1.0])
    np.testing.assert_allclose(dying_away(ends, 2.0, -3.0), [2.0, 0.0], atol=1e-15)
    slope = (dying_away(ends + np.array([h, 0]), 2.0, -3.0) - dying_away(ends - np.array([0, h]), 2.0, -3.0)) / h
    np.testing.assert_allclose(slope, [-3.0, 0.0], atol=2e-5)
    assert smooth_step(np.array([0.0, 0.5, 1.0])).tolist() == [0.0, 0.5, 1.0]
