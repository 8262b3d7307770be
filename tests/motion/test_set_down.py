"""Hovering is removed, flight is not."""

import numpy as np
import pytest

from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.kinematics import body_clearance
from simprep.motion.set_down import set_down


@pytest.mark.parametrize("cyclic", [False, True])
def test_a_body_that_hovers_is_set_down_and_never_into_the_floor(cyclic: bool) -> None:
    qpos = np.repeat(library_motion("stand").qpos[:1], 90, axis=0)
    bump = np.zeros(90)
    bump[20:70] = 0.03 * np.sin(np.linspace(0, np.pi, 50)) ** 2
    qpos[:, 2] += bump
    if cyclic:  # the span crosses the seam
        qpos = np.roll(qpos, 45, axis=0)
    before = body_clearance(qpos).min(axis=1)
    lowered = set_down(qpos, 60.0, humanoid(), cyclic)
    qpos[:, 2] -= lowered
    after = body_clearance(qpos).min(axis=1)
    assert before.max() > 0.029
    assert after.max() < 0.012
    assert (after >= np.minimum(before, 0.0) - 1e-12).all()
    assert np.abs(np.diff(lowered)).max() < 0.004


def test_flight_is_left_alone() -> None:
    jump = library_motion("jump")
    assert body_clearance(jump.qpos).min(axis=1).max() > 0.2
    assert set_down(jump.qpos, jump.fps, humanoid()).max() == 0.0
