"""Feet of robots stay where they stand, whatever the order of the hip's hinges, and with ankles that do not invert."""

from itertools import permutations
from pathlib import Path

import numpy as np
import pytest
from robot_models import robot_xml, toml_of, write_robot

import simprep
from simprep.character import SIDES, Character
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.leg_chain import LegChain
from simprep.motion.limb_ik import leg_of_each, legs, solve_leg
from simprep.motion.rotations import rotation_matrix
from simprep.motion.transfer import onto
from simprep.preparation import AlphaProfile, scenario
from simprep.robots.load import load_robot

ORDERS = list(permutations(("pitch", "roll", "yaw")))
SIGNS = np.array([-1, 1, 1, 1, 1, 1])  # thighs forward, knees bent


def robot_with(folder: Path, hips: tuple[str, ...], inverts: bool) -> Character:
    xml = robot_xml(hips=(hips[0], hips[1], hips[2]), inverts=inverts)
    return load_robot(write_robot(folder, xml, toml_of(inverts=inverts)))


def bent_legs(robot: Character, count: int = 200) -> np.ndarray:
    """Poses with legs bent as in kicks and lunges, pelvis anywhere."""
    rng = np.random.default_rng(5)
    qpos = np.tile(robot.standing_qpos, (count, 1))
    qpos[:, :7] = rng.normal(size=(count, 7))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    for leg in legs(robot):
        low, high = np.array([[-0.3, 1.3], [-0.4, 0.5], [-0.6, 0.6], [0.2, 1.6], [-0.5, 0.5], [-0.3, 0.3]]).T
        qpos[:, 7 + leg.hinges] += (SIGNS * rng.uniform(low, high, (count, 6)))[:, : len(leg.hinges)] * leg.sign
    return qpos


@pytest.mark.parametrize("inverts", [True, False])
@pytest.mark.parametrize("hips", ORDERS)
def test_a_foot_comes_back_to_its_pose(tmp_path: Path, hips: tuple[str, ...], inverts: bool) -> None:
    """With its knee bent forwards, also where the leg is nearly straight."""
    robot = robot_with(tmp_path, hips, inverts)
    qpos = bent_legs(robot)
    before = forward_kinematics(qpos, robot)
    rotation = rotation_matrix(before.xquat)
    found = []
    for side, leg, foot in zip(SIDES, legs(robot), robot.feet):
        knee_axis = rotation[:, robot.segment(f"{side}_shank"), :, 1]
        moved = qpos.copy()
        moved[:, 7 + leg.hinges] = solve_leg(
            leg, before.xpos[:, 0], rotation[:, 0], before.xpos[:, foot], rotation[:, foot], knee_axis
        )
        after = forward_kinematics(moved, robot)
        np.testing.assert_allclose(after.xpos[:, foot], before.xpos[:, foot], atol=1e-8)
        np.testing.assert_allclose(rotation_matrix(after.xquat[:, foot]), rotation[:, foot], atol=1e-7)
        assert (moved[:, 7 + leg.hinges[3]] * leg.sign[3] > 0).all()
        found.append(moved[:, 7 + leg.hinges])
    # both legs in one call, row by row
    sides, rows = np.tile([0, 1], 200), np.repeat(np.arange(200), 2)
    feet = np.array(robot.feet)[sides]
    shanks = np.array([robot.segment(f"{side}_shank") for side in SIDES])[sides]
    together = solve_leg(
        leg_of_each(robot, sides), before.xpos[rows, 0], rotation[rows, 0], before.xpos[rows, feet], rotation[rows, feet],
        rotation[rows, shanks, :, 1],
    )  # fmt: skip
    np.testing.assert_allclose(together, np.stack(found, axis=1).reshape(400, -1), atol=1e-9)


def test_the_jacobian_is_the_derivative(tmp_path: Path) -> None:
    chain = LegChain.of_character(robot_with(tmp_path, ("yaw", "roll", "pitch"), True), "left")
    angles = np.random.default_rng(2).uniform(-1, 1, (5, 6))
    _, turn, jacobian = chain.foot_poses(angles)
    step = 1e-6
    for hinge in range(6):
        (ahead, ahead_turn, _), (behind, behind_turn, _) = (
            chain.foot_poses(angles + sign * step * np.eye(6)[hinge]) for sign in (1, -1)
        )
        np.testing.assert_allclose(jacobian[:, :3, hinge], (ahead - behind) / (2 * step), atol=1e-8)
        spin = (ahead_turn - behind_turn) / (2 * step) @ np.swapaxes(turn, -1, -2)
        np.testing.assert_allclose(jacobian[:, 3:, hinge], spin[:, [2, 0, 1], [1, 2, 0]], atol=1e-8)


def test_a_foot_drawn_out_of_reach_moves_without_a_jump(tmp_path: Path) -> None:
    robot = robot_with(tmp_path, ("yaw", "roll", "pitch"), True)
    leg = legs(robot)[0]
    down = np.linspace(0.9, 1.15, 400) * (leg.thigh + leg.shank)
    ankle = leg.hip - np.column_stack([0.2 * down, 0 * down, down])
    still = np.tile(np.eye(3), (len(down), 1, 1))
    angles = solve_leg(leg, np.zeros_like(ankle), still, ankle, still)
    assert np.abs(np.diff(angles, axis=0)).max() < 0.15
    assert np.abs(angles).max() < 1.5


@pytest.mark.parametrize("inverts", [True, False])
def test_a_robot_built_as_the_h1_prepares(tmp_path: Path, inverts: bool) -> None:
    """Its hips turn about z, x, y; its ankles do not invert."""
    robot = robot_with(tmp_path, ("yaw", "roll", "pitch"), inverts)
    walk, kick = (onto(simprep.library_motion(name), robot) for name in ("walk", "kick_front"))
    motion = scenario(walk, kick, AlphaProfile(lead=0.2, rise=0.6, hold=0.3), "optimised")
    kinematics = forward_kinematics(motion.qpos, robot)
    points = kinematics.foot_points
    assert points[..., 2].min() > -0.004
    stands = motion.contacts[1:] & motion.contacts[:-1]
    slip = np.linalg.norm(np.diff(points[..., :2], axis=0), axis=-1).min(axis=-1) * motion.fps
    assert np.median(slip[stands]) < 0.02
