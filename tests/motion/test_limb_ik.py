"""The closed-form leg: exact round trips with forward kinematics, on three bodies, and a second derivation from the foot up."""

import numpy as np
import pytest

from simprep.character import SIDES
from simprep.humanoid_model import humanoid
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.limb_ik import ball_joint_angles, legs, solve_leg
from simprep.motion.rotations import axis_rotation, rotation_matrix


def _solve(qpos, character, move=0.0):
    kinematics = forward_kinematics(qpos, character)
    rotation = rotation_matrix(kinematics.xquat)
    found = []
    for side, leg in zip(SIDES, legs(character)):
        foot, shank = humanoid().segments.index(f"{side}_foot"), humanoid().segments.index(f"{side}_shank")
        goal = kinematics.xpos[:, foot] + move
        angles = solve_leg(
            leg, kinematics.xpos[:, 0], rotation[:, 0], goal, rotation[:, foot], rotation[:, shank, :, 1]
        )
        found.append((leg, angles, foot, goal, rotation[:, foot]))
    return found


@pytest.mark.parametrize("character", [humanoid(), humanoid(1.55, 50.0), humanoid(1.95, 100.0)])
def test_leg_angles_come_back_from_the_foot_pose(character):
    rng = np.random.default_rng(1)
    qpos = np.tile(character.standing_qpos.copy(), (400, 1))
    qpos[:, 3:7] = rng.normal(size=(400, 4))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    for leg in legs(character):
        low, high = np.maximum(leg.low, -0.6), np.minimum(leg.high, 1.5)
        low[3] = 0.05  # straight legs have no knee axis
        qpos[:, 7 + leg.hinges] = rng.uniform(low, high, (400, 6))
    for leg, angles, *_ in _solve(qpos, character):
        np.testing.assert_allclose(angles, qpos[:, 7 + leg.hinges], atol=1e-9)


@pytest.mark.parametrize("number", [0, 1])
def test_without_a_knee_axis_the_foot_tells_the_side_of_the_knee(number):
    """Over the whole ranges of the hinges: the ankle inverts by less than 90 degrees."""
    rng = np.random.default_rng(11)
    qpos = np.tile(humanoid().standing_qpos.copy(), (400, 1))
    qpos[:, 3:7] = rng.normal(size=(400, 4))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    leg = legs()[number]
    angles = leg.low + (leg.high - leg.low) * rng.uniform(0.1, 0.9, (400, 6))
    angles[:, 3] = np.abs(angles[:, 3])
    qpos[:, 7 + leg.hinges] = angles
    before = forward_kinematics(qpos)
    rotation = rotation_matrix(before.xquat)
    foot = humanoid().segments.index(f"{SIDES[number]}_foot")
    found = solve_leg(leg, before.xpos[:, 0], rotation[:, 0], before.xpos[:, foot], rotation[:, foot])
    np.testing.assert_allclose(found, angles, atol=1e-7)
    qpos[:, 7 + leg.hinges] = found
    after = forward_kinematics(qpos)
    np.testing.assert_allclose(after.xpos[:, foot], before.xpos[:, foot], atol=1e-9)
    np.testing.assert_allclose(rotation_matrix(after.xquat[:, foot]), rotation[:, foot], atol=1e-9)


def test_foot_reaches_a_moved_goal_with_its_orientation_kept():
    qpos = np.tile(humanoid().standing_qpos.copy(), (1, 1))
    for leg in legs():
        qpos[:, 7 + leg.hinges] = [0.5, 0.1, 0.05, 0.9, 0.2, 0.0]
    move = np.array([0.05, 0.03, -0.02])
    solved = qpos.copy()
    results = _solve(qpos, humanoid(), move)
    for leg, angles, *_ in results:
        solved[:, 7 + leg.hinges] = angles
    after = forward_kinematics(solved)
    for _, _, foot, goal, rotation in results:
        np.testing.assert_allclose(after.xpos[:, foot], goal, atol=1e-9)
        np.testing.assert_allclose(rotation_matrix(after.xquat[:, foot]), rotation, atol=1e-9)


def test_goal_out_of_reach_gives_a_straight_leg_towards_it():
    qpos = np.tile(humanoid().standing_qpos.copy(), (1, 1))
    _, angles, *_ = _solve(qpos, humanoid(), np.array([0.0, 0.0, -0.5]))[0]
    assert angles[0, 3] == pytest.approx(0.0, abs=1e-6)


def from_the_foot_up(leg, pelvis, pelvis_rotation, ankle, foot_rotation):
    """The same angles by another way: ankle first, then the chain up to the hip (Kajita et al. 2014, section 2.5.2)."""
    sign = leg.sign[2]
    to_hip = np.einsum("tji,tj->ti", foot_rotation, pelvis + pelvis_rotation @ leg.hip - ankle)
    a, b = leg.thigh, leg.shank
    knee = np.arccos(np.clip((np.linalg.norm(to_hip, axis=-1) ** 2 - a * a - b * b) / (2 * a * b), -1, 1))
    above = np.where(to_hip[:, 2] < 0, -1.0, 1.0)
    inversion = -np.arctan2(above * to_hip[:, 1], above * to_hip[:, 2])
    lean = np.arctan2(to_hip[:, 0], above * np.hypot(to_hip[:, 1], to_hip[:, 2]))
    dorsiflexion = lean - np.arctan2(-a * np.sin(knee), b + a * np.cos(knee))
    thigh = foot_rotation @ axis_rotation("x", inversion) @ axis_rotation("y", dorsiflexion - knee)
    hip = ball_joint_angles(np.swapaxes(pelvis_rotation, -1, -2) @ thigh)
    return np.column_stack([-hip[:, 0], -sign * hip[:, 1], sign * hip[:, 2], knee, dorsiflexion, -sign * inversion])


def test_agrees_with_the_solution_from_the_foot_up_wherever_the_pelvis_and_the_foot_are():
    rng = np.random.default_rng(7)
    count = 3000
    quats = rng.normal(size=(2, count, 4))
    pelvis_rotation, foot_rotation = rotation_matrix(quats / np.linalg.norm(quats, axis=-1, keepdims=True))
    pelvis = rng.normal(size=(count, 3))
    for leg in legs():
        way = rng.normal(size=(count, 3))
        way *= rng.uniform(0.3, 0.99, (count, 1)) * (leg.thigh + leg.shank) / np.linalg.norm(way, axis=1, keepdims=True)
        ankle = pelvis + pelvis_rotation @ leg.hip + way
        ours = solve_leg(leg, pelvis, pelvis_rotation, ankle, foot_rotation)
        theirs = from_the_foot_up(leg, pelvis, pelvis_rotation, ankle, foot_rotation)
        off = np.abs(np.remainder(ours - theirs + np.pi, 2 * np.pi) - np.pi)
        assert off.max() < 1e-8
        assert np.median(off) < 1e-14


def test_a_foot_in_line_with_its_leg_takes_the_knee_axis_of_the_foot():
    leg = legs()[0]
    down = np.array([[0.0, 0.0, -1.0]])
    ankle = leg.hip + 0.9 * (leg.thigh + leg.shank) * down
    pointed = axis_rotation("y", np.pi / 2)[None]  # toes straight down
    angles = solve_leg(leg, np.zeros((1, 3)), np.eye(3)[None], ankle, pointed)
    expected = from_the_foot_up(leg, np.zeros((1, 3)), np.eye(3)[None], ankle, pointed)
    np.testing.assert_allclose(angles, expected, atol=1e-12)
