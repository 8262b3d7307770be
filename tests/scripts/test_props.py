"""The miss is the distance between the surfaces, and so is what a bar is cleared by."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.props import clearance_m, nearest_pass
from simprep import humanoid, library_motion
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.scene import Obstacle


@pytest.fixture(scope="module")
def kick():
    return library_motion("kick_front")


def ball_at(position, radius=0.11):
    return Obstacle("ball", tuple(float(value) for value in position), (radius,) * 3, ball=True)


def foot_at_impact(kick):
    frame = kick.events["impact"]
    return forward_kinematics(kick.qpos[frame : frame + 1]).xpos[0, humanoid().segments.index("right_foot")]


def test_a_ball_in_the_way_of_the_foot_is_struck_about_at_the_impact(kick):
    ball = ball_at(foot_at_impact(kick) + np.array([0.1, 0, 0]))
    meets = nearest_pass(kick, "right_foot", ball)
    assert meets.touches
    assert meets.miss_m == 0
    assert abs(meets.frame - kick.events["impact"]) < 15
    assert meets.velocity @ meets.normal > 1


def test_a_ball_beside_the_way_stays_and_the_miss_is_told():
    still = np.repeat(humanoid().standing_qpos[None], 5, axis=0)
    motion = Motion(still, 30.0, np.ones((5, 2), bool))
    hand = forward_kinematics(still[:1]).xpos[0, humanoid().segments.index("right_hand")]
    ball = ball_at(hand + np.array([1.0, 0, 0]))
    near, far = (nearest_pass(motion, "right_hand", one) for one in (ball, replace(ball, half_size=(0.05,) * 3)))
    assert far.miss_m - near.miss_m == pytest.approx(0.06, abs=1e-3)
    assert 0.7 < near.miss_m < 0.89
    assert near.normal @ [1, 0, 0] > 0.95


def test_a_bar_over_the_head_is_cleared_by_what_is_between_and_one_at_the_head_is_not():
    still = np.repeat(humanoid().standing_qpos[None], 3, axis=0)
    motion = Motion(still, 30.0, np.ones((3, 2), bool))
    high, higher, low = (Obstacle("bar", (0.0, 0.0, z), (0.03, 0.68, 0.03)) for z in (2.0, 2.1, 1.6))
    cleared = [clearance_m(motion, bar, 0, 3) for bar in (high, higher, low)]
    assert cleared[1] - cleared[0] == pytest.approx(0.1, abs=2e-3)
    assert 0.1 < cleared[0] < 0.4
    assert cleared[2] < 0
