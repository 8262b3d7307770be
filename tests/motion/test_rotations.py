"""Rotations agree with scipy's."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simprep.motion.rotations import axis_rotation, in_heading, multiply_quat, rotation_matrix

RNG = np.random.default_rng(5)


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_about_an_axis(axis):
    angle = RNG.uniform(-4, 4, (3, 5))
    turns = angle.ravel()[:, None] * np.eye(3)["xyz".index(axis)]
    expected = Rotation.from_rotvec(turns).as_matrix().reshape(3, 5, 3, 3)
    np.testing.assert_allclose(axis_rotation(axis, angle), expected, atol=1e-15)
    np.testing.assert_array_equal(axis_rotation(axis, 0.0), np.eye(3))


def test_quaternions():
    a, b = Rotation.random(20, random_state=1), Rotation.random(20, random_state=2)
    quat_a, quat_b = a.as_quat(scalar_first=True), b.as_quat(scalar_first=True)
    np.testing.assert_allclose(rotation_matrix(quat_a), a.as_matrix(), atol=1e-14)
    np.testing.assert_allclose(rotation_matrix(multiply_quat(quat_a, quat_b)), (a * b).as_matrix(), atol=1e-14)


def test_axes_turned_to_a_heading():
    heading, vectors = RNG.uniform(-4, 4, 7), RNG.normal(size=(7, 3, 3))
    expected = np.einsum("tji,tnj->tni", axis_rotation("z", heading), vectors)
    np.testing.assert_allclose(in_heading(vectors, heading), expected, atol=1e-14)
