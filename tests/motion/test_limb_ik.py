"""The closed-form leg: exact round trips with forward kinematics, on three bodies."""

import numpy as np
import pytest

from simprep.humanoid import BODIES, SIDES, Body, standing_qpos
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.limb_ik import legs, solve_leg
from simprep.motion.rotations import rotation_matrix


def _solve(qpos, body, move=0.0):
    kinematics = forward_kinematics(qpos, body)
    rotation = rotation_matrix(kinematics.xquat)
    found = []
    for side, leg in zip(SIDES, legs(body)):
        foot, shank = BODIES.index(f"{side}_foot"), BODIES.index(f"{side}_shank")
        goal = kinematics.xpos[:, foot] + move
        angles = solve_leg(
            leg, kinematics.xpos[:, 0], rotation[:, 0], goal, rotation[:, foot], rotation[:, shank, :, 1]
        )
        found.append((leg, angles, foot, goal, rotation[:, foot]))
    return found


@pytest.mark.parametrize("body", [Body(), Body(1.55, 50.0), Body(1.95, 100.0)])
def test_leg_angles_come_back_from_the_foot_pose(body):
    rng = np.random.default_rng(1)
    qpos = np.tile(standing_qpos(body), (400, 1))
    qpos[:, 3:7] = rng.normal(size=(400, 4))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    for leg in legs(body):
        low, high = np.maximum(leg.low, -0.6), np.minimum(leg.high, 1.5)
        low[3] = 0.05  # straight legs have no knee axis
        qpos[:, 7 + leg.hinges] = rng.uniform(low, high, (400, 6))
    for leg, angles, *_ in _solve(qpos, body):
        np.testing.assert_allclose(angles, qpos[:, 7 + leg.hinges], atol=1e-9)


def test_foot_reaches_a_moved_goal_with_its_orientation_kept():
    qpos = np.tile(standing_qpos(), (1, 1))
    for leg in legs():
        qpos[:, 7 + leg.hinges] = [0.5, 0.1, 0.05, 0.9, 0.2, 0.0]
    move = np.array([0.05, 0.03, -0.02])
    solved = qpos.copy()
    results = _solve(qpos, Body(), move)
    for leg, angles, *_ in results:
        solved[:, 7 + leg.hinges] = angles
    after = forward_kinematics(solved)
    for _, _, foot, goal, rotation in results:
        np.testing.assert_allclose(after.xpos[:, foot], goal, atol=1e-9)
        np.testing.assert_allclose(rotation_matrix(after.xquat[:, foot]), rotation, atol=1e-9)


def test_goal_out_of_reach_gives_a_straight_leg_towards_it():
    qpos = np.tile(standing_qpos(), (1, 1))
    leg, angles, *_ = _solve(qpos, Body(), np.array([0.0, 0.0, -0.5]))[0]
    assert angles[0, 3] == pytest.approx(0.0, abs=1e-6)
    assert (angles >= leg.low).all()
    assert (angles <= leg.high).all()
