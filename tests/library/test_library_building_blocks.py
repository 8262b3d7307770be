"""The mathematics under the built-in motions: curves, limbs, foot paths, zero-moment point, COM planning."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from simprep.character import SIDES
from simprep.humanoid_model import GRAVITY, humanoid
from simprep.library.parts.balance import cart_table_zmp, com_from_zmp, ground_reaction
from simprep.library.parts.feet import FootPath, Stance, foot_spheres
from simprep.library.parts.limbs import arm_angles
from simprep.library.parts.movement import degrees_curve
from simprep.motion.curves import key_curve, minimum_jerk
from simprep.motion.kinematics import forward_kinematics


def random_poses(count: int, seed: int = 3) -> np.ndarray:
    rng = np.random.default_rng(seed)
    low, high = humanoid().model.jnt_range[1:].T
    qpos = np.tile(humanoid().standing_qpos.copy(), (count, 1))
    qpos[:, 7:] = low + (high - low) * rng.uniform(0.1, 0.9, (count, len(humanoid().joints)))
    quat = rng.normal(size=(count, 4))
    qpos[:, 3:7] = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    return qpos


def rotations(quat: np.ndarray) -> np.ndarray:
    out = np.zeros((len(quat), 9))
    for row, q in zip(out, quat):
        mujoco.mju_quat2Mat(row, q)
    return out.reshape(-1, 3, 3)


@pytest.mark.parametrize("side", SIDES)
def test_arm_angles_put_the_fist_at_the_point(side):
    rng = np.random.default_rng(5)
    sign = 1.0 if side == "left" else -1.0
    fist = np.array([0.35, sign * 0.18, 0.1]) + rng.uniform(-0.2, 0.2, (100, 3))  # within reach
    pole = np.tile([-0.2, sign * 0.6, -1.0], (100, 1))
    qpos = np.tile(humanoid().standing_qpos.copy(), (100, 1))
    start = 7 + humanoid().joint(f"{side}_shoulder_flexion")
    qpos[:, start : start + 4] = arm_angles(side, fist, pole)
    model, data = humanoid().model, mujoco.MjData(humanoid().model)
    for row, goal in zip(qpos, fist):
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        reached = data.site(f"{side}_hand").xpos - data.body("thorax").xpos
        assert np.abs(reached - goal).max() < 1e-9


def test_curves_pass_their_keys_and_have_no_jump_in_acceleration():
    assert minimum_jerk([0.0, 0.5, 1.0, 2.0]).tolist() == [0.0, 0.5, 1.0, 1.0]
    times, values = [0.0, 0.3, 0.5, 1.1, 1.4], [0.0, 1.0, 1.5, 1.5, -0.5]
    path = key_curve(times, values)
    assert path(np.array(times)) == pytest.approx(values)
    fine = np.arange(-0.2, 1.6, 1e-4)
    velocity = np.gradient(path(fine), 1e-4)
    acceleration = np.gradient(velocity, 1e-4)[2:-2]
    assert np.abs(np.diff(acceleration)).max() < 0.02 * np.abs(acceleration).max()
    assert (path(fine) <= 1.5 + 1e-12).all()  # no overshoot
    wave = key_curve([0.0, 0.4], [0.0, 1.0], period=1.0)
    assert wave(fine + 3.0) == pytest.approx(wave(fine), abs=1e-9)


FEWER_POINTS = replace(
    humanoid(), soles=tuple((f"{side}_toe", f"{side}_ball_medial", f"{side}_heel") for side in SIDES)
)
"""The humanoid with other points under its soles, in another order."""


@pytest.mark.parametrize("character", [humanoid(), FEWER_POINTS])
@pytest.mark.parametrize("side", SIDES)
def test_foot_rolls_over_heel_and_toe_without_slipping(side, character):
    path = FootPath(
        side, (Stance(0.0, 1.0, 0.3, 0.1, 0.2),),
        pitch=degrees_curve((0.0, 20), (0.3, 0), (0.5, 0), (1.0, -50)), pivot=degrees_curve((0.6, 0), (1.0, -30)),
        character=character,
    )  # fmt: skip
    times = np.linspace(0, 1, 201)
    position, rotation, contact = path.at(times)
    assert contact.all()
    centres, radii = foot_spheres(side, character)
    heel, toe = (character.soles[SIDES.index(side)].index(f"{side}_{part}") for part in ("heel", "toe"))
    points = position[:, None] + centres @ np.swapaxes(rotation, 1, 2)
    points[..., 2] -= radii
    assert points[..., 2].min() == pytest.approx(0.0, abs=1e-12)
    assert points[..., 2].min(axis=1).max() == pytest.approx(0.0, abs=1e-12)
    for part, frames in ((heel, times < 0.3), (toe, times > 0.5)):
        assert np.ptp(points[frames, part, :2], axis=0).max() < 1e-12


def test_swing_joins_its_stances_smoothly():
    path = FootPath(
        "left", (Stance(0.0, 0.5, 0.0, 0.1, 0.1), Stance(0.9, 1.5, 0.6, 0.1, 0.1)),
        pitch=degrees_curve((0.3, 0), (0.5, -40), (0.7, -30), (0.9, 15), (1.0, 0)), via=((0.7, 2, 0.2),),
    )  # fmt: skip
    step = 1e-4
    times = np.arange(0.3, 1.1, step)
    position, _, contact = path.at(times)
    velocity = np.diff(position, axis=0) / step
    acceleration = np.diff(velocity, axis=0) / step
    assert np.abs(np.diff(velocity, axis=0)).max() < 2 * np.abs(np.median(np.abs(acceleration))) * step + 0.02
    assert position[np.searchsorted(times, 0.7), 2] == pytest.approx(0.2, abs=1e-3)
    assert not contact[(times > 0.51) & (times < 0.89)].any()


def test_com_of_a_periodic_zmp_is_the_analytic_pendulum():
    fps, height, period = 60.0, 0.9, 2.0
    times = np.arange(int(period * fps)) / fps
    omega = 2 * np.pi / period
    zmp = np.column_stack([0.05 * np.sin(omega * times) + 0.5 * times, 0.1 * np.cos(omega * times)])
    com = com_from_zmp(zmp, np.full(len(times), height), fps, shift=np.array([0.5 * period, 0.0]))
    gain = 1 / (1 + omega**2 * height / GRAVITY)  # of x = p * gain, since p = x - (z/g) x''
    exact = np.column_stack([0.05 * gain * np.sin(omega * times) + 0.5 * times, 0.1 * gain * np.cos(omega * times)])
    assert np.abs(com - exact).max() < 1e-4


def test_com_of_a_weight_shift_rests_at_both_ends_and_gives_back_its_zmp():
    fps = 60.0
    times = np.arange(181) / fps
    zmp = np.column_stack([0.1 * minimum_jerk((times - 1.2) / 0.4), np.zeros(181)])
    height = 0.9 - 0.1 * minimum_jerk((times - 1.0) / 0.6)
    com = np.column_stack([com_from_zmp(zmp, height, fps), height])
    assert np.abs(com[1] - com[0])[:2].max() < 1e-12
    assert np.abs(com[-1] - com[-2])[:2].max() < 1e-12
    settled = (times > 0.5) & (times < 2.5)
    assert np.abs(cart_table_zmp(com, fps) - zmp)[settled].max() < 1e-9


def test_flight_is_ballistic():
    fps = 60.0
    times = np.arange(121) / fps
    height = 0.9 + np.where((times > 0.8) & (times < 1.2), 0.5 * GRAVITY * (0.04 - (times - 1.0) ** 2), 0.0)
    com = com_from_zmp(np.column_stack([0.2 * times, 0 * times]), height, fps)
    inside = (times > 0.84) & (times < 1.16)
    assert np.abs(np.diff(com[inside, 0], 2)).max() < 1e-12


def test_ground_reaction_agrees_with_inverse_dynamics():
    # an unrelated smooth motion of every joint and of the root, against mj_inverse with analytic derivatives by differences
    fps, frames = 200.0, 60
    times = np.arange(frames) / fps
    model, data = humanoid().model, mujoco.MjData(humanoid().model)
    rng, joints = np.random.default_rng(0), len(humanoid().joints)
    qpos = np.tile(humanoid().standing_qpos.copy(), (frames, 1))
    qpos[:, 7:] += 0.3 + 0.2 * np.sin(np.outer(times, rng.uniform(2, 8, joints)) + rng.uniform(0, 6, joints))
    qpos[:, :3] += 0.05 * np.sin(np.outer(times, [5.0, 6.0, 7.0]))
    force, point = ground_reaction(forward_kinematics(qpos, humanoid()), fps)
    for frame in range(2, frames - 2, 7):
        before, after = np.zeros(model.nv), np.zeros(model.nv)
        mujoco.mj_differentiatePos(model, before, 1 / fps, qpos[frame - 1], qpos[frame])
        mujoco.mj_differentiatePos(model, after, 1 / fps, qpos[frame], qpos[frame + 1])
        data.qpos[:], data.qvel[:], data.qacc[:] = qpos[frame], (before + after) / 2, (after - before) * fps
        mujoco.mj_inverse(model, data)
        root, torque = data.qfrc_inverse[:3], data.qfrc_inverse[3:6]  # the root does not turn here: body axes = world
        x = qpos[frame, 0] - (torque[1] + qpos[frame, 2] * root[0]) / root[2]
        y = qpos[frame, 1] + (torque[0] - qpos[frame, 2] * root[1]) / root[2]
        assert force[frame] == pytest.approx(root, abs=2.0)
        assert point[frame] == pytest.approx([x, y], abs=2e-3)
