"""A ball that is kicked flies, one that is passed stays; the miss is the distance between the surfaces."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.props import GRAVITY, RESTITUTION, flight, nearest_pass
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


def test_a_ball_in_the_way_of_the_foot_is_struck_and_flies_forward(kick):
    ball = ball_at(foot_at_impact(kick) + np.array([0.1, 0, 0]))
    meets = nearest_pass(kick, "right_foot", ball)
    assert meets.touches
    assert meets.miss_m == 0
    assert abs(meets.frame - kick.events["impact"]) < 15
    assert meets.velocity @ meets.normal > 1
    way = flight(kick, "right_foot", ball)
    np.testing.assert_array_equal(way.positions[: meets.frame + 1], [ball.position] * (meets.frame + 1))
    assert way.positions[-1, 0] - ball.position[0] > 0.5
    begin = (way.positions[meets.frame + 1] - way.positions[meets.frame]) * kick.fps
    expected = (1 + RESTITUTION) * (meets.velocity @ meets.normal) * meets.normal - [0, 0, GRAVITY / kick.fps / 2]
    assert begin == pytest.approx(expected, abs=1e-9)
    assert way.positions[:, 2].min() >= 0.11 - 1e-9  # never below the floor


def test_a_ball_beside_the_way_stays_and_the_miss_is_told():
    still = np.repeat(humanoid().standing_qpos[None], 5, axis=0)
    motion = Motion(still, 30.0, np.ones((5, 2), bool))
    hand = forward_kinematics(still[:1]).xpos[0, humanoid().segments.index("right_hand")]
    ball = ball_at(hand + np.array([1.0, 0, 0]))
    near, far = (nearest_pass(motion, "right_hand", one) for one in (ball, replace(ball, half_size=(0.05,) * 3)))
    assert far.miss_m - near.miss_m == pytest.approx(0.06, abs=1e-3)
    assert 0.7 < near.miss_m < 0.89
    assert near.normal @ [1, 0, 0] > 0.95
    np.testing.assert_array_equal(flight(motion, "right_hand", ball).positions, [ball.position] * 5)
