"""The controller `balance`: what it holds, what it lets fall, and the program that it solves."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import simprep
from simprep.errors import SettingError
from simprep.humanoid_model import GRAVITY, humanoid
from simprep.motion.edit import cut, repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.transfer import onto
from simprep.physics.balance import BalanceController
from simprep.physics.balance_goals import BalanceSettings, balance_reference
from simprep.physics.balance_preview import ComPlan
from simprep.physics.balance_steps import ExtraStep, foot_to_move, lacking
from simprep.physics.bodies import scene_bodies
from simprep.physics.contact_forces import EquationsOfMotion, Tasks, best_motion
from simprep.physics.pushes import Push
from simprep.physics.reference import make_reference
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import simulate, track
from simprep.preparation.scenario import scenario
from simprep.primitive_robot import primitive_robot
from simprep.study.plan import QUICK_PROFILE


def standing(seconds: float, lean: float = 0.0, character: simprep.Character = humanoid()) -> Motion:
    """Standing, leant forward about the ankles by an angle [rad]."""
    pose = character.standing_qpos.copy()
    ankles = [character.anatomical(f"{side}_ankle_dorsiflexion") for side in ("left", "right")]
    if lean:
        before = forward_kinematics(pose[None], character).foot_points
        pose[7 + np.array(ankles)] += lean
        pose[3:7] = np.cos(lean / 2), 0.0, np.sin(lean / 2), 0.0
        pose[:3] += (before - forward_kinematics(pose[None], character).foot_points).mean(axis=(0, 1, 2))
    frames = round(60 * seconds) + 1
    return Motion(np.repeat(pose[None], frames, axis=0), 60.0, np.ones((frames, 2), bool), character=character)


def pushed(newtons: float) -> SimulationSettings:
    return SimulationSettings(pushes=(Push("pelvis", 0.5, 0.2, (newtons, 0.0, 0.0)),))


def test_a_standing_body_holds_and_takes_a_push_that_servos_alone_do_not() -> None:
    run = track(standing(5.0), "balance", settings=pushed(60.0))
    assert (run.end, run.assist.force_n) == ("done", 60.0)
    np.testing.assert_allclose(run.qpos[-1, :3], run.reference_qpos[-1, :3], atol=0.02)
    assert (np.abs(run.torque) <= run.torque_limit + 1e-9).all()
    assert run.settings["unsolved_programs"] == 0
    assert track(standing(5.0), "pd", settings=pushed(60.0)).end == "fell"
    assert track(standing(2.0), "balance", settings=pushed(400.0)).end == "fell"


@pytest.mark.parametrize(("lean", "end"), [(0.08, "done"), (0.25, "fell")])
def test_a_body_holds_while_its_com_is_over_its_feet(lean: float, end: str) -> None:
    motion = standing(2.0, lean)
    kinematics = forward_kinematics(motion.qpos[:1], humanoid())
    assert kinematics.foot_points[..., 2].max() < 0.002
    over = kinematics.com[0, 0] < kinematics.foot_points[..., 0].max()
    assert over == (end == "done")
    assert track(motion, "balance").end == end


def test_walking_holds_in_the_same_bits_and_running_out_of_balance_falls() -> None:
    walk = cut(repeat(simprep.library_motion("walk"), 3), 0, 130)
    run = track(walk, "balance", seed=0)
    assert run.end == "done"
    other = track(walk, "balance", seed=5)
    np.testing.assert_array_equal(run.qpos, other.qpos)
    np.testing.assert_array_equal(run.target, other.target)
    assert track(simprep.library_motion("jump_far"), "balance").end == "fell"


def plan_of(motion: Motion) -> ComPlan:
    """Where the COM should go along a motion."""
    body = scene_bodies(motion.character.model, (motion.character,))[0]
    return balance_reference(make_reference(motion, 1 / 480), body, BalanceSettings()).plan


def test_where_the_reference_is_in_balance_the_com_follows_it() -> None:
    plan = plan_of(standing(1.0))
    np.testing.assert_allclose(plan.shift, 0.0, atol=1e-3)
    np.testing.assert_allclose(plan.acceleration(100, np.zeros(2), np.zeros(2)), 0.0, atol=0.02)
    pushed_on = plan.acceleration(100, np.array([0.03, 0.0]), np.array([0.1, 0.0]))
    assert pushed_on[0] < -0.5
    assert pushed_on[1] == pytest.approx(0.0, abs=1e-4)


def test_before_a_stop_that_no_floor_could_bring_about_the_com_lags_behind() -> None:
    still = standing(3.0)
    seconds = np.arange(len(still)) / still.fps
    sharp = 0.6 * np.minimum(seconds - 1.5, 0.0)  # 0.6 m/s until 1.5 s, then at rest at once, both feet gliding along
    moving = replace(still, qpos=still.qpos + sharp[:, None] * np.eye(still.qpos.shape[1])[0])
    plan = plan_of(moving)
    assert plan.shift[500:720, 0].min() < -0.02  # it brakes before the reference does
    assert np.abs(plan.shift[-1]).max() < 0.01
    assert np.abs(plan.shift[:, 1]).max() < 1e-3


def test_a_foot_that_lags_behind_the_fall_moves_if_the_feet_cannot_catch_the_body() -> None:
    corners = np.array([[-0.1, -0.2], [0.2, -0.2], [-0.1, 0.2], [0.2, 0.2]])
    forward = np.array([0.3, 0.0])
    assert lacking(forward, np.zeros(2), corners) == pytest.approx(0.1)
    assert lacking(0.5 * forward, np.zeros(2), corners) < 0
    assert lacking(np.zeros(2), np.zeros(2), corners) == -np.inf
    feet = np.array([[0.1, 0.1], [0.0, -0.1]])
    assert (foot_to_move(forward, feet), foot_to_move(-forward, feet)) == (1, 0)
    step = ExtraStep(0, 100, 244)
    heights = np.array([step.lift(at, 0.06) for at in range(100, 245)])
    assert heights.max() == pytest.approx(0.06, rel=1e-3)
    assert heights[[0, -1]] == pytest.approx([0, 0], abs=1e-9)


def test_a_body_that_was_pushed_hard_makes_a_step_of_its_own() -> None:
    run = track(standing(4.0), "balance", settings=pushed(300.0))
    never = track(
        standing(4.0), lambda task: BalanceController(task, BalanceSettings(extra_lacking=10.0)), settings=pushed(300.0)
    )
    assert run.settings["extra_steps"] >= 1
    assert never.settings["extra_steps"] == 0
    assert len(run.qpos) > len(never.qpos) + 240  # up for half a second more at least
    assert track(standing(1.0), "balance", settings=pushed(60.0)).settings["extra_steps"] == 0


def test_any_body_and_several_in_one_world() -> None:
    small, robot = humanoid(1.5, 45.0), primitive_robot()
    motions = [standing(0.8, character=one) for one in (small, robot)]
    motions[1] = replace(motions[1], qpos=motions[1].qpos + np.eye(motions[1].qpos.shape[1])[1] * 2.0)
    run = simulate(motions, "balance")
    assert run.end == "done"
    for number, motion in enumerate(motions):
        assert np.abs(run.bodies[number].qpos[-1, :3] - motion.qpos[-1, :3]).max() < 0.02


def test_a_motion_that_rests_on_hands_and_knees_is_borne_by_them() -> None:
    crawl = simprep.library_motion("crawl_hands_knees")
    middle = len(crawl) // 2
    still = Motion(np.repeat(crawl.qpos[middle : middle + 1], 61, axis=0), 60.0, np.zeros((61, 2), bool))
    run = track(still, "balance")
    assert run.end == "done"
    assert run.foot_force[-1, :, 2].sum() < 0.5 * run.ground_force[-1, 2]
    assert np.abs(run.qpos[-1, 7:] - still.qpos[0, 7:]).max() < 0.15


def equations(points: int) -> EquationsOfMotion:
    """The standing humanoid with some of its sole points as contacts."""
    character = humanoid()
    model, data = character.model, mujoco.MjData(character.model)
    data.qpos[:] = character.standing_qpos
    mujoco.mj_forward(model, data)
    inertia = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    jacobians = np.empty((points, 3, model.nv))
    for jacobian, geom in zip(jacobians, character.sole_geoms.ravel()):
        place = data.geom_xpos[geom] - [0, 0, model.geom_size[geom, 0]]
        mujoco.mj_jac(model, data, jacobian, None, place, model.geom_bodyid[geom])
    weight = GRAVITY * float(model.body_mass.sum())
    return EquationsOfMotion(
        inertia, data.qfrc_bias.copy(), jacobians, np.arange(6, model.nv), character.torque_limits, weight
    )


def rest(size: int) -> Tasks:
    return Tasks(np.eye(size), np.zeros(size))


def test_at_rest_the_forces_bear_the_weight_and_the_torques_are_those_of_statics() -> None:
    body = equations(8)
    qacc, torque, solved = best_motion(rest(len(body.bias)), body, 0.8, 1e-9)
    assert solved
    np.testing.assert_allclose(qacc, 0, atol=1e-3)
    rows = body.jacobians.reshape(-1, len(body.bias))
    needed = body.inertia @ qacc + body.bias
    needed[body.motors] -= torque
    force, *_ = np.linalg.lstsq(rows.T, needed, rcond=None)
    np.testing.assert_allclose(rows.T @ force, needed, atol=1e-6)  # contacts at the soles explain the rest
    assert force.reshape(-1, 3)[:, 2].sum() == pytest.approx(body.weight, rel=1e-3)


def test_in_flight_the_com_falls_and_torques_stay_within_their_limits() -> None:
    body = replace(equations(0), torque_limits=np.full(37, 7.0))
    wish = np.zeros(len(body.bias))
    wish[6:] = 900.0
    qacc, torque, _ = best_motion(Tasks(np.eye(len(wish)), wish), body, 0.8, 1e-3)
    np.testing.assert_allclose((body.inertia @ qacc + body.bias)[:6], 0, atol=1e-8)
    assert np.abs(torque).max() == 7.0


def test_no_wish_makes_the_floor_pull() -> None:
    body = equations(8)
    wish = np.zeros(len(body.bias))
    wish[2] = -30.0  # faster down than gravity
    qacc, _, _ = best_motion(Tasks(np.diag(np.r_[1e3 * np.ones(6), np.full(37, 1e3)]), 1e3 * wish), body, 0.8, 1e-6)
    lift = (body.inertia @ qacc + body.bias)[2]  # force of the floor
    assert lift == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(("name", "value"), [("rate", 0.0), ("com_weight", -1.0), ("friction", float("nan"))])
def test_settings_out_of_range_are_refused(name: str, value: float) -> None:
    with pytest.raises(SettingError, match=f"balance: {name} {value}; valid: "):
        BalanceSettings(**{name: value})


def test_settings_of_ones_own() -> None:
    run = track(standing(0.2), lambda task: BalanceController(task, BalanceSettings(friction=0.5)))
    assert (run.controller, run.settings["friction"]) == ("balance", 0.5)


def test_feet_that_are_low_but_not_where_they_should_stand_are_no_error() -> None:
    small = humanoid(1.6, 62.69387755102042)
    walk, leap = (onto(simprep.library_motion(name), small) for name in ("walk", "jump_forward"))
    motion = scenario(walk, leap, QUICK_PROFILE, "traditional")
    assert track(motion, "balance").end in ("done", "fell")
