import mujoco
import numpy as np
import pytest
from metric_cases import rigid_motion, run_of, swaying_motion

from simprep.humanoid_model import GRAVITY, humanoid
from simprep.metrics.balance import balance, extrapolated_com, plausibility_summary, posture_summary
from simprep.metrics.dynamics import residual_wrench
from simprep.metrics.identified import identify_motion, identify_pendulum, identify_run
from simprep.motion.edit import move
from simprep.physics.whole_body import whole_body, zero_moment_point

BOX = mujoco.MjModel.from_xml_string(
    """<mujoco><option gravity="0 0 -9.81"/><worldbody><body pos="0 0 0.5"><freejoint/>
    <geom type="box" size="0.1 0.2 0.5" mass="20"/></body></worldbody></mujoco>"""
)
ROD = mujoco.MjModel.from_xml_string(
    """<mujoco><option gravity="0 0 -9.81"/><worldbody><body pos="0 0 1"><freejoint/>
    <inertial pos="0 0 0.3" mass="3" diaginertia="0.25 0.25 1e-6"/></body></worldbody></mujoco>"""
)


def box_wrench(acceleration, angular=(0.0, 0.0, 0.0)):
    qacc = np.array([[*acceleration, *angular]])
    return whole_body(BOX, BOX.qpos0[None], np.zeros((1, 6)), qacc)


def test_box_pushed_sideways():
    # a box of 20 kg, 1 m high, sliding with acceleration a: the ZMP lags by h a / g; the base reaches 0.1 m
    for a, residual_torque in ((1.0, 0.0), (4.0, None)):
        box = box_wrench((a, 0.0, 0.0))
        assert box.force[0] == pytest.approx([20 * a, 0, 20 * GRAVITY])
        assert box.torque[0] == pytest.approx([0, 0, 0], abs=1e-9)
        zmp = zero_moment_point(box.com, box.force, box.torque, 20 * GRAVITY)[0]
        assert zmp == pytest.approx([-0.5 * a / GRAVITY, 0])
        corners = np.array([[[x, y, 0.0] for x in (-0.1, 0.1) for y in (-0.2, 0.2)]])
        force, torque = residual_wrench(box.com, box.force, box.torque, corners, np.ones((1, 4), dtype=bool))
        if residual_torque is not None:
            assert zmp[0] > -0.1
            assert (force[0], torque[0]) == pytest.approx((0, 0), abs=1e-9)
        else:
            # tipping: least squares between the force missing and the moment missing, about the edge x = -0.1:
            # pushes there make (-0.5 fx - -0.1 fz) of moment for (fx, fz); solve the 2-variable problem by hand
            arm = np.array([[1.0, 0.0], [0.0, 1.0], [-0.5, 0.1]])
            needed = np.array([20 * a, 20 * GRAVITY, 0.0])
            push, *_ = np.linalg.lstsq(arm, needed, rcond=None)
            assert abs(push[0]) < push[1]  # inside the friction cone, so the solution by hand is the constrained one
            missing = needed - arm @ push
            assert force[0] == pytest.approx(np.linalg.norm(missing[:2]), rel=1e-6)
            assert torque[0] == pytest.approx(abs(missing[2]), rel=1e-6)
            assert torque[0] > 1


def test_friction_cone_bounds_the_push():
    # a point at the COM is asked for twice its weight sideways: the nearest point of |fx| <= fz to (2, 1) is (1.5, 1.5)
    force, torque = residual_wrench(
        np.zeros((1, 3)),
        np.array([[2.0, 0.0, 1.0]]),
        np.zeros((1, 3)),
        np.zeros((1, 1, 3)),
        np.ones((1, 1), dtype=bool),
    )
    assert (force[0], torque[0]) == pytest.approx((np.sqrt(0.5), 0.0))


def test_rod_turned_up_and_dropped():
    # COM 0.3 m above the root; turning about it by alpha needs the moment I alpha, so the ZMP moves by I alpha / (m g)
    alpha = 4.0
    qacc = np.array([[-alpha * 0.3, 0.0, 0.0, 0.0, alpha, 0.0]])  # the root's acceleration that keeps the COM still
    rod = whole_body(ROD, ROD.qpos0[None], np.zeros((1, 6)), qacc)
    assert rod.force[0] == pytest.approx([0, 0, 3 * GRAVITY], abs=1e-9)
    assert rod.torque[0] == pytest.approx([0, 0.25 * alpha, 0], abs=1e-9)
    zmp = zero_moment_point(rod.com, rod.force, rod.torque, 3 * GRAVITY)[0]
    assert zmp == pytest.approx([-0.25 * alpha / (3 * GRAVITY), 0], abs=1e-12)
    spinning = whole_body(ROD, ROD.qpos0[None], np.array([[0, 0, 0, 0, 2.0, 0]]), np.zeros((1, 6)))
    assert spinning.angular_momentum[0] == pytest.approx([0, 0.5, 0])
    assert spinning.com_velocity[0] == pytest.approx([0.6, 0, 0])
    falling = whole_body(ROD, ROD.qpos0[None], np.zeros((1, 6)), np.array([[0, 0, -GRAVITY, 0, 0, 0]]))
    assert falling.force[0] == pytest.approx([0, 0, 0], abs=1e-9)
    assert np.isnan(zero_moment_point(falling.com, falling.force, falling.torque, 3 * GRAVITY)).all()


def test_extrapolated_com_of_an_inverted_pendulum():
    # a pendulum whose XcoM is on its pivot comes to rest above it: x = x0 exp(-omega t)
    height, x0 = 0.9, 0.2
    omega = np.sqrt(GRAVITY / height)
    time = np.linspace(0, 2, 50)
    com = np.stack([x0 * np.exp(-omega * time), 0 * time, np.full(50, height)], axis=1)
    velocity = np.stack([-omega * com[:, 0], 0 * time, 0 * time], axis=1)
    assert extrapolated_com(com, velocity) == pytest.approx(np.zeros((50, 2)), abs=1e-12)
    assert extrapolated_com(np.array([[0.0, 0.0, 9.81]]), np.array([[1.0, 2.0, 0.0]])) == pytest.approx(
        np.array([[1, 2]])
    )


def test_standing_still():
    motion = rigid_motion(np.zeros((60, 3)), 60.0)
    series = balance(motion)
    com = humanoid_com()
    # corners of the sole from the model file; both feet span a hexagon that is symmetric in y
    right = np.array([[-0.040, 0.0], [0.125, 0.036], [0.105, -0.042], [0.175, 0.012]])
    right[:, 1] -= 0.085
    left = right * [1, -1]
    assert series.foot_points[30] == pytest.approx(np.concatenate([left, right]), abs=1e-5)
    # heel, lateral ball and toe are the corners, the half width y(x) is linear between: first moment over area
    x, y = np.array([-0.040, 0.105, 0.175]), np.array([0.085, 0.127, 0.073])
    h, a, b = np.diff(x), y[:-1], y[1:]
    area = (h * (a + b) / 2).sum()
    moment = (x[:-1] * h * (a + b) / 2 + h**2 * (a + 2 * b) / 6).sum()
    assert series.support_centre[30] == pytest.approx([moment / area, 0], abs=1e-5)
    numbers = posture_summary(series) | plausibility_summary(series)
    assert numbers["com_cos_mm"] == pytest.approx(1e3 * np.hypot(com[0] - moment / area, com[1]), abs=0.01)
    to_edge = com[0] + 0.040  # the nearest edge is the line through both heels
    assert numbers["com_to_edge_mm"] == pytest.approx(1e3 * to_edge, abs=0.01)
    for name in ("margin_of_stability_mm", "margin_of_stability_p5_mm", "zmp_to_edge_mm"):
        assert numbers[name] == pytest.approx(numbers["com_to_edge_mm"], abs=1e-3)  # nothing moves
    assert numbers["com_inside_share"] == numbers["zmp_inside_share"] == 1
    assert numbers["residual_force_p95_n"] == pytest.approx(0, abs=1e-6)
    assert numbers["residual_torque_p95_nm"] == pytest.approx(0, abs=1e-6)
    assert numbers["unsupported_share"] == 0


def humanoid_com():
    model = humanoid().model
    data = mujoco.MjData(model)
    data.qpos[:] = humanoid().standing_qpos.copy()
    mujoco.mj_forward(model, data)
    return data.subtree_com[1].copy()


def test_accelerated_like_a_box():
    a = 1.5
    time = np.arange(121) / 120.0
    motion = rigid_motion(np.stack([a * time**2 / 2, 0 * time, 0 * time], axis=1), 120.0)
    series = balance(motion)
    com = humanoid_com()
    inside = np.isfinite(series.zmp[:, 0])
    assert inside.sum() == len(series.time) - 10  # 80 ms at either end
    lag = series.com[inside, 0] - series.zmp[inside, 0]
    assert lag[5:-5] == pytest.approx(np.full(inside.sum() - 10, com[2] * a / GRAVITY), rel=1e-3)
    velocity = (series.xcom - series.com[:, :2])[20:-20, 0] * np.sqrt(GRAVITY / com[2])
    assert velocity == pytest.approx(a * series.time[20:-20], rel=1e-3)


def test_free_fall_needs_no_hand_and_floating_needs_all_of_it():
    time = np.arange(61) / 60.0
    fall = rigid_motion(np.stack([time, 0 * time, 5 - GRAVITY * time**2 / 2], axis=1), 60.0, contact=False)
    series = balance(fall)
    assert np.abs(series.residual_force[2:-2]).max() < 1e-3 * 75 * GRAVITY
    assert np.isnan(posture_summary(series)["com_cos_mm"])
    assert posture_summary(series)["unsupported_share"] == 1
    floating = plausibility_summary(balance(rigid_motion(np.tile([0, 0, 1.0], (60, 1)), 60.0, contact=False)))
    mass = humanoid().model.body_mass.sum()
    assert floating["residual_force_n"] == pytest.approx(mass * GRAVITY, rel=1e-6)


def test_angular_momentum_agrees_with_the_moment():
    # Euler's law on the whole body: the moment about the COM is the rate of the angular momentum that MuJoCo reports
    from simprep.metrics.smoothing import smooth_motion

    smooth = smooth_motion(swaying_motion(240.0), rate=240.0)
    body = whole_body(humanoid().model, smooth.qpos, smooth.qvel, smooth.qacc)
    inside = slice(20, -20)
    rate = np.gradient(body.angular_momentum, smooth.time, axis=0)
    assert np.abs(body.torque - rate)[inside].max() < 0.02 * np.abs(rate).max()
    mass = humanoid().model.body_mass.sum()
    push = mass * np.gradient(body.com_velocity, smooth.time, axis=0)
    push[:, 2] += mass * GRAVITY
    assert np.abs(body.force - push)[inside].max() < 0.01 * np.abs(push - [0, 0, mass * GRAVITY]).max()


def test_numbers_do_not_depend_on_place_heading_or_frame_rate():
    motion = swaying_motion(120.0)
    first = posture_summary(balance(motion)) | plausibility_summary(balance(motion))
    moved = balance(move(motion, translation=(40.0, -20.0), turn=2.0))
    for name, value in (posture_summary(moved) | plausibility_summary(moved)).items():
        # the friction pyramid stands along the world axes, so only the residual may move, and hardly
        assert value == pytest.approx(first[name], rel=0.1 if "residual" in name else 1e-6, abs=1e-6), name
    slow = balance(swaying_motion(60.0))
    for name, value in (posture_summary(slow) | plausibility_summary(slow)).items():
        assert value == pytest.approx(first[name], rel=0.03, abs=0.05 * abs(value) + 0.01), name


def test_sindy_finds_the_pendulum_it_was_given():
    rng = np.random.default_rng(3)
    height, dt = 0.92, 1 / 60
    omega2 = GRAVITY / height
    state, rows = np.array([0.01, 0.0, 0.0, 0.1]), []
    for step in range(600):
        cop = 1.4 * state[:2] + 0.5 * state[2:] + 0.02 * np.sin([0.11 * step, 0.07 * step])
        acceleration = omega2 * (state[:2] - cop)
        rows.append(np.concatenate([state[:2], [height], state[2:], [0.0], acceleration, [0.0], cop]))
        state = state + dt * np.concatenate([state[2:], acceleration])
    data = np.array(rows)
    com, velocity, acceleration, cop = data[:, :3], data[:, 3:6], data[:, 6:9], data[:, 9:]
    exact = identify_pendulum(com, velocity, acceleration, cop)
    assert exact.omega_squared_per_s2 == pytest.approx(omega2, rel=1e-6)
    assert (exact.ratio, exact.r_squared) == pytest.approx((1, 1), rel=1e-6)
    assert (exact.damping_per_s, exact.offset_m_s2, exact.sample_count) == (0, 0, 600)
    noisy = identify_pendulum(com, velocity, acceleration + rng.normal(0, 0.02, com.shape), cop)
    assert noisy.ratio == pytest.approx(1, abs=0.05)
    assert 0.5 < noisy.r_squared < 1
    damped = identify_pendulum(com, velocity, acceleration - 0.8 * velocity, cop)
    assert (damped.damping_per_s, damped.ratio) == pytest.approx((-0.8, 1), rel=1e-6)
    cop[5:] = np.nan
    assert np.isnan(identify_pendulum(com, velocity, acceleration, cop).ratio)


def test_stiff_body_is_a_pendulum_and_a_simulated_one_agrees():
    # a body carried rigidly at constant height has no angular momentum: the law holds exactly
    time = np.arange(361) / 120.0
    path = np.stack([0.05 * np.sin(4 * time), 0.03 * np.sin(5 * time), 0 * time], axis=1)
    motion = rigid_motion(path, 120.0)
    law = identify_motion(motion)
    assert (law.ratio, law.r_squared) == pytest.approx((1, 1), abs=1e-3)
    assert law.expected_per_s2 == pytest.approx(GRAVITY / humanoid_com()[2], rel=1e-4)
    height = humanoid_com()[2]
    pressure = humanoid_com()[:2] + path[:, :2] * (1 + np.array([16.0, 25.0]) * height / GRAVITY)
    run = run_of(motion, motion, centre_of_pressure=pressure[:-1])
    measured = identify_run(run)
    assert (measured.ratio, measured.r_squared) == pytest.approx((1, 1), abs=2e-3)
    swaying = identify_motion(swaying_motion(120.0))  # turning trunk and swinging arms: the pendulum explains less
    assert swaying.r_squared < 0.999
