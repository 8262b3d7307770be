"""Limbs whose three hinges come in any order, and whose axes lean: two bone directions are reached in closed form and a search."""

from itertools import permutations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simprep.motion.limb_paths import Limb, candidates, worst_angle


def limb(order: tuple[int, ...], lean_deg: float) -> Limb:
    axes = np.eye(3)[[*order, 1]]
    if lean_deg:
        rng = np.random.default_rng(4)
        axes[:3] = [Rotation.from_rotvec(np.radians(lean_deg) * v / np.linalg.norm(v)).apply(axis)
                    for axis, v in zip(axes[:3], np.cross(axes[:3], rng.normal(size=(3, 3))))]  # fmt: skip
    down = np.array([0.0, 0.0, -1.0])
    return Limb(
        joints=np.arange(4), axes=axes, zero=np.zeros(4), low=np.array([-2.9, -2.9, -2.9, 0.0]),
        high=np.array([2.9, 2.9, 2.9, 2.6]), upper=down, lower=down,
    )  # fmt: skip


@pytest.mark.parametrize("order", list(permutations(range(3))))
@pytest.mark.parametrize("lean_deg", [0.0, 16.0])
def test_directions_are_reached_in_every_order(order: tuple[int, ...], lean_deg: float) -> None:
    one = limb(order, lean_deg)
    rng = np.random.default_rng(11)
    angles = rng.uniform([-1.2, -1.2, -1.2, 0.1], [1.2, 1.2, 1.2, 2.4], (300, 4))
    upper, lower, _ = one.directions(angles)
    wanted = np.concatenate([upper, lower], axis=-1)
    found = candidates(one, wanted)
    assert (found >= one.low).all()
    assert (found <= one.high).all()
    error = worst_angle(one, found, wanted[:, None]).min(axis=1)
    assert np.percentile(error, 98) < 5e-3
    assert error.max() < 0.3


@pytest.mark.parametrize("lean_deg", [0.0, 16.0])
def test_the_jacobian_is_the_derivative(lean_deg: float) -> None:
    one = limb((2, 0, 1), lean_deg)
    angles = np.random.default_rng(3).uniform(-1, 1, (5, 4))
    *_, jacobian = one.directions(angles)
    step = 1e-6
    for hinge in range(4):
        plus, minus = (angles + sign * step * np.eye(4)[hinge] for sign in (1, -1))
        ahead, behind = (np.concatenate(one.directions(at)[:2], axis=-1) for at in (plus, minus))
        np.testing.assert_allclose(jacobian[..., hinge], (ahead - behind) / (2 * step), atol=1e-8)


def test_the_orientation_is_a_rotation_that_turns_the_bones() -> None:
    one = limb((0, 2, 1), 16.0)
    angles = np.random.default_rng(8).uniform(-2, 2, (20, 4))
    turn = one.orientation(angles)
    np.testing.assert_allclose(turn @ np.swapaxes(turn, -1, -2), np.tile(np.eye(3), (20, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(turn @ one.lower, one.directions(angles)[1], atol=1e-12)
