"""The blended root: a lap more or less of the trend changes nothing."""

import numpy as np
import pytest

from simprep.library import library_motion
from simprep.motion.edit import repeat
from simprep.preparation.blending import split_heading
from simprep.preparation.trajectory import blend_root, heading_trend


@pytest.mark.parametrize("laps", [-3, -1, 1, 2])
def test_full_turns_before_the_first_frame_do_not_count(laps: int) -> None:
    """Who has turned round once walks as who has not; else part of a full turn would be blended away."""
    walk = repeat(library_motion("walk"), 2)
    heading = np.unwrap(split_heading(walk.qpos[:, 3:7])[0])
    trend = heading_trend(heading, walk.fps)
    weight = np.linspace(0.0, 1.0, len(walk)) ** 2
    reference = library_motion("punch_right").qpos[0, :7]
    path = blend_root(walk.qpos[:, :7], reference, weight, trend)
    turned = blend_root(walk.qpos[:, :7], reference, weight, trend + 2 * np.pi * laps)
    np.testing.assert_allclose(turned.position, path.position, atol=1e-9)
    np.testing.assert_allclose(turned.heading - 2 * np.pi * laps, path.heading, atol=1e-9)
    np.testing.assert_allclose(np.abs(np.sum(turned.quat * path.quat, axis=1)), 1.0, atol=1e-9)
