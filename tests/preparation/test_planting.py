"""Standing feet where limits are in the way: the point that carries stays put, and steep feet have a heading."""

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.character import SIDES
from simprep.humanoid_model import humanoid
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.limb_ik import legs, solve_leg
from simprep.motion.rotations import axis_rotation
from simprep.preparation.planting import Standing, foot_heading, plant_feet


def test_heading_is_what_is_left_of_a_foot_without_its_tilt():
    rng = np.random.default_rng(0)
    turn = np.cumsum(rng.uniform(-0.5, 0.5, 200))
    lying = rng.normal(size=(200, 2))
    axis = np.column_stack([lying / np.linalg.norm(lying, axis=1, keepdims=True), np.zeros(200)])
    # past the vertical, where the toe's direction on the floor turns round
    tilt = Rotation.from_rotvec(axis * rng.uniform(-2.5, 2.5, (200, 1))).as_matrix()
    found = foot_heading(axis_rotation("z", turn) @ tilt)
    np.testing.assert_allclose(found - found[0], turn - turn[0], atol=1e-9)


def test_a_foot_that_an_ankle_limit_tilts_keeps_the_point_that_carries_it():
    """On tiptoe the pelvis sways sideways until ankles meet their inversion limit: ankles could stay, toes would not."""
    fps, count = 60.0, 60
    character = humanoid()
    qpos = np.tile(character.standing_qpos, (count, 1))
    for side in SIDES:
        for name, angle in (("hip_flexion", 0.6), ("knee_flexion", 1.3), ("ankle_dorsiflexion", -0.7)):
            qpos[:, 7 + character.joint(f"{side}_{name}")] = angle
    qpos[:, 2] -= forward_kinematics(qpos, character).foot_points[..., 2].min()
    qpos[:, 1] += 0.2 * np.sin(np.pi * np.arange(count) / (count - 1)) ** 2
    contacts = np.ones((count, 2), dtype=bool)
    spread = []
    for yielding in (False, True):
        standing = Standing(turning=np.zeros((count, 2)), yielding=yielding)
        made = plant_feet(qpos, None, contacts, np.ones(count), np.zeros(2), fps, character, standing=standing)
        for leg in legs(character):
            angles = made.qpos[:, 7 + leg.hinges]
            assert (angles >= leg.low).all()
            assert (angles <= leg.high).all()
        toes = made.kinematics.foot_points[:, :, 3, :2]
        spread.append(np.linalg.norm(toes - toes[0], axis=-1).max())
    assert spread[0] > 0.01, "no limit is met"
    assert spread[1] < 0.001


def test_a_knee_does_not_swing_round_where_foot_and_leg_are_in_line():
    """A toe that circles about the line of the leg would take the knee axis with it; the hint holds it."""
    leg = legs(humanoid())[0]
    count = 90
    angle = np.linspace(0, 2 * np.pi, count)
    tilt = np.stack([0.05 * np.cos(angle), 0.05 * np.sin(angle), np.zeros(count)], axis=-1)
    foot = Rotation.from_rotvec(tilt).as_matrix() @ axis_rotation("y", np.full(count, np.pi / 2))
    still = np.tile(np.eye(3), (count, 1, 1))
    ankle = leg.hip + np.tile([0.0, 0.0, -0.8 * (leg.thigh + leg.shank)], (count, 1))
    hint = np.tile([0.0, 1.0, 0.0], (count, 1))
    free, held = (solve_leg(leg, np.zeros((count, 3)), still, ankle, foot, hint, steep) for steep in (0.0, 0.5))
    rotation = [np.ptp(one[:, 2]) for one in (free, held)]
    assert rotation[0] > 0.5
    assert rotation[1] < 0.1
