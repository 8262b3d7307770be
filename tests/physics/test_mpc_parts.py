"""Parts of `mpc`: inverse dynamics against statics, the cost's zero, the reduced planner model."""

from dataclasses import fields, replace
from typing import get_args

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.cli.output import Preset
from simprep.errors import SettingError
from simprep.humanoid_model import GRAVITY, humanoid
from simprep.library import library_motion
from simprep.motion.motion import Motion
from simprep.physics.bodies import scene_bodies
from simprep.physics.controller import ControlTask
from simprep.physics.inverse_dynamics import InverseDynamics
from simprep.physics.mpc import MpcController
from simprep.physics.mpc_settings import MPC_PRESETS, MpcSettings
from simprep.physics.planner import build_planner
from simprep.physics.reference import Reference, make_reference
from simprep.physics.rollouts import Record
from simprep.physics.sampling import OffsetSearch, SearchSettings
from simprep.physics.tracking_cost import CostWeights, TrackingCost
from simprep.scene import SceneSettings, build_scene


def held(hinge: str, angle: float, height: float = 0.0) -> Reference:
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], 31, axis=0)
    qpos[:, 7 + humanoid().joint(hinge)] = angle
    qpos[:, 2] += height
    return make_reference(Motion(qpos, 60.0, np.ones((31, 2), dtype=bool)), 1 / 240)


def needed_torques(reference: Reference) -> FloatArray:
    return InverseDynamics(humanoid()).torques(reference)


def test_an_arm_held_out_needs_its_weight_times_its_lever() -> None:
    model = humanoid().model
    data = mujoco.MjData(model)
    data.qpos[7 + humanoid().joint("left_shoulder_flexion")] = np.pi / 2
    mujoco.mj_forward(model, data)
    arm = [model.body(f"left_{part}").id for part in ("upper_arm", "forearm", "hand")]
    shoulder = data.body("left_upper_arm").xpos
    expected = sum(model.body_mass[b] * GRAVITY * (data.xipos[b, 0] - shoulder[0]) for b in arm)
    torque = needed_torques(held("left_shoulder_flexion", np.pi / 2))[60, humanoid().joint("left_shoulder_flexion")]
    assert torque == pytest.approx(expected, rel=1e-6)


def test_standing_legs_bear_the_body_and_hang_in_free_fall() -> None:
    bent = needed_torques(held("left_knee_flexion", 0.0))[60]
    # upright, COM 1 mm before the hips and 4 to 8 cm before the ankles' centres of pressure: small, symmetric torques
    left, right = (bent[humanoid().joint(f"{side}_ankle_dorsiflexion")] for side in ("left", "right"))
    assert left == pytest.approx(right, abs=0.5)
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], 61, axis=0)
    time = np.arange(61) / 60
    qpos[:, 2] += 6.0 - GRAVITY / 2 * time**2
    falling = make_reference(Motion(qpos, 60.0, np.zeros((61, 2), dtype=bool)), 1 / 240)
    assert np.abs(needed_torques(falling)[100:140]).max() < 0.05


def test_torques_of_some_steps_have_the_bits_that_they_have_among_all():
    reference = make_reference(library_motion("walk"), 1 / 480)
    whole = needed_torques(reference)
    last = len(whole) - 1
    again = InverseDynamics(humanoid())  # knows other references' frames, and then this one's
    again.torques(make_reference(library_motion("punch_right"), 1 / 480))
    for since, until in (
        (0, None),
        (37, None),
        (480, None),
        (last, None),
        (0, 0),
        (100, 180),
        (199, 399),
        (430, last + 9),
    ):
        for dynamics in (InverseDynamics(humanoid()), again):
            some = dynamics.torques(reference, since=since, until=until)
            np.testing.assert_array_equal(some, whole[since : (last if until is None else min(until, last)) + 1])


@pytest.mark.parametrize("steps", [24, 22])  # scored at even times, and at the last step too
def test_cost_is_zero_on_the_reference_and_grows_away_from_it(steps: int) -> None:
    reference = make_reference(library_motion("punch_right"), 1 / 240)
    planner = build_planner(build_scene(), SceneSettings(), 1 / 120)
    cost = TrackingCost(reference, 2, 1 / 240, steps, planner.dofs[0], planner.bodies[0].feet, CostWeights())
    start = 120
    states = start + 2 * np.arange(1, steps + 1)
    world = np.zeros((1, steps, 1, 3))
    lagging = reference.kinematics.xpos[states - 2][None]  # MuJoCo's positions lag the state by one step
    record = {
        "qpos": reference.qpos[states][None],
        "qvel": reference.qvel[states][:, planner.qvel][None],
        "xpos": np.concatenate([world, lagging], axis=2),
        "xquat": np.concatenate([np.zeros((1, steps, 1, 4)), reference.kinematics.xquat[states - 2][None]], axis=2),
        "subtree_com": np.repeat(reference.kinematics.com[states - 2][None, :, None], 18, axis=2),
    }
    theta = np.zeros((1, 6, 19))

    def cost_of(record: Record, theta: np.ndarray, cost: TrackingCost = cost) -> float:
        return float(np.sum(cost.residuals(start, record, theta) ** 2))

    on_reference = cost_of(record, theta)
    assert on_reference < 1e-3
    costs = []
    for shift in (0.01, 0.02, 0.04):
        moved = {**record, "xpos": record["xpos"] + [shift, 0, 0], "subtree_com": record["subtree_com"] + [shift, 0, 0]}
        costs.append(cost_of(moved, theta) - on_reference)
    np.testing.assert_allclose(costs, 60.0 * np.square([0.01, 0.02, 0.04]), rtol=1e-6)  # only the global position
    assert cost_of(record, theta + 0.1) > on_reference

    # global and relative errors of the segments alone: their mean over the segments, each with its weight
    nothing = dict.fromkeys((name.name for name in fields(CostWeights) if name.name not in ("final", "instants")), 0.0)
    own = CostWeights(**{**nothing, "position": 60.0, "relative": 200.0})
    positions = TrackingCost(reference, 2, 1 / 240, steps, planner.dofs[0], planner.bodies[0].feet, own)
    at, segments = np.random.default_rng(0).normal(0, 0.03, (17, 3)), 17
    moved = {**record, "xpos": record["xpos"] + np.concatenate([np.zeros((1, 3)), at])}
    asked = 60.0 * np.sum(at**2) / segments + 200.0 * np.sum((at - at[0]) ** 2) / segments
    assert cost_of(record, theta, positions) < 1e-20
    assert cost_of(moved, theta, positions) == pytest.approx(asked)

    # feet that turn where they are: no position tells it
    feet = TrackingCost(
        reference, 2, 1 / 240, steps, planner.dofs[0], (13, 16), CostWeights(**{**nothing, "foot_orientation": 0.6})
    )
    turned = record["xquat"].copy()
    turn = Rotation.from_rotvec([0.0, 0.0, 0.1])
    for entry in (14, 17):
        turned[0, :, entry] = (turn * Rotation.from_quat(turned[0, :, entry], scalar_first=True)).as_quat(
            scalar_first=True
        )
    assert cost_of(record, theta, feet) < 1e-20
    assert cost_of({**record, "xquat": turned}, theta, feet) == pytest.approx(0.6 * (2 * np.sin(0.05)) ** 2)


SEARCH = SearchSettings(samples=20, refined=8, keep=2, shrink=0.7, scales=(0.25, 0.5, 1.0), damping=(1e-9, 0.1, 1.0))


def search_of(knots: int, sampled: int, settings: SearchSettings = SEARCH) -> OffsetSearch:
    search = OffsetSearch(knots, np.full(sampled, 0.1), settings)
    search.begin()
    return search


def test_linear_residuals_are_minimised_by_as_many_samples_as_unknowns() -> None:
    rng = np.random.default_rng(3)
    response, constant = rng.standard_normal((30, 12)), rng.standard_normal(30)
    search = search_of(4, 3, replace(SEARCH, damping=(1e-9,)))
    tried = search.sample(rng, 0)
    none_failed = np.zeros(len(tried), dtype=bool)
    assert search.update(tried, tried.reshape(20, 12) @ response.T + constant, none_failed)
    exact = np.linalg.lstsq(response, -constant)[0]
    np.testing.assert_allclose(search.plan.ravel(), exact, atol=1e-5)


def test_the_last_iteration_works_out_the_plan_alone() -> None:
    rng = np.random.default_rng(5)
    response, constant = rng.standard_normal((30, 12)), rng.standard_normal(30)
    plans = []
    for final in (False, True):
        search, rng = search_of(4, 3), np.random.default_rng(6)
        for iteration in range(2):
            tried = search.sample(rng, iteration)
            found = np.sin(tried.reshape(len(tried), -1) @ response.T) + constant
            search.update(tried, found, np.zeros(len(tried), dtype=bool), final=final and iteration == 1)
        plans.append(search.plan)
    np.testing.assert_array_equal(*plans)


def test_a_step_from_few_samples_never_leaves_what_they_span_and_lowers_the_cost() -> None:
    rng = np.random.default_rng(4)
    response, constant = rng.standard_normal((200, 60)), rng.standard_normal(200)

    def residuals(theta: np.ndarray) -> np.ndarray:
        return np.asarray(np.sin(theta.reshape(len(theta), -1) @ response.T) + constant)

    search, costs = search_of(6, 10), []
    for iteration in range(2):
        tried = search.sample(rng, iteration)
        found = residuals(tried)
        costs.append(np.sum(found**2, axis=1))
        assert search.update(tried, found, np.zeros(len(tried), dtype=bool))
        if iteration == 0:
            span = (tried - tried[0]).reshape(len(tried), -1)
            step = (search.plan - tried[0]).ravel()
            left = step - span.T @ np.linalg.lstsq(span.T, step)[0]
            np.testing.assert_allclose(left, 0.0, atol=1e-8)
    # the tried plan, then the best sample of the first iteration, then the best step of the second
    assert costs[1].min() < costs[0].min() <= costs[0][0]
    assert np.sum(residuals(search.plan[None]) ** 2) < costs[0].min()


def test_rounds_without_time_between_them_find_what_one_cannot() -> None:
    rng = np.random.default_rng(6)
    response, constant = rng.standard_normal((100, 40)), rng.standard_normal(100)  # 40 unknowns, 28 samples a round
    search = OffsetSearch(4, np.full(10, 0.1), replace(SEARCH, damping=(1e-9,)))
    least = np.sum((response @ np.linalg.lstsq(response, -constant)[0] + constant) ** 2)
    excess = []
    for _ in range(12):
        search.begin()
        for iteration in range(2):
            tried = search.sample(rng, iteration)
            residuals = tried.reshape(len(tried), -1) @ response.T + constant
            assert search.update(tried, residuals, np.zeros(len(tried), dtype=bool))
        excess.append(np.sum((response @ search.plan.ravel() + constant) ** 2) - least)
    assert np.all(np.diff(excess) < 1e-9)
    assert excess[-1] < 1e-3 * excess[0]


def test_failed_samples_count_for_nothing() -> None:
    rng = np.random.default_rng(5)
    response, constant = rng.standard_normal((30, 12)), rng.standard_normal(30)
    search, other = search_of(4, 3), search_of(4, 3)
    tried = search.sample(rng, 0)
    residuals = tried.reshape(20, 12) @ response.T + constant
    failed = np.arange(20) % 4 == 1
    spoilt = np.where(failed[:, None], np.nan, residuals)
    assert search.update(tried, spoilt, failed)
    assert other.update(tried, np.where(failed[:, None], 0.0, residuals), failed)
    np.testing.assert_array_equal(search.plan, other.plan)
    plan = search.plan.copy()
    search.begin()
    again = search.sample(rng, 0)
    assert not search.update(again, np.full((20, 30), np.nan), np.ones(20, dtype=bool))
    np.testing.assert_array_equal(search.plan, plan)


def test_a_start_that_the_body_cannot_have_had_is_mended_and_told() -> None:
    scene = SceneSettings()
    model = build_scene(scene)
    bodies = scene_bodies(model, scene.bodies)
    reference = make_reference(library_motion("walk"), model.opt.timestep)
    task = ControlTask(model, scene, bodies, (reference,), seed=0)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = reference.qpos[0], reference.qvel[0]
    data.qvel[1] += 0.3  # sideways
    mujoco.mj_forward(model, data)
    given = data.qvel.copy()
    controller = MpcController(task, MpcSettings(threads=1))
    chosen = controller.start(data)
    np.testing.assert_array_equal(data.qvel, given)
    off = np.abs(chosen[1] - reference.qvel[0, 1])
    assert off < 0.2
    np.testing.assert_allclose(controller.settings()["start_change_mps_radps"], (chosen - given)[None, :6], atol=1e-12)
    np.testing.assert_array_equal(chosen[6:], given[6:])
    fixed = MpcController(task, MpcSettings(threads=1, start_speed=0.0, start_spin=0.0, first_rounds=1))
    np.testing.assert_array_equal(fixed.start(data), given)


def test_planner_is_the_same_body_with_fewer_joints() -> None:
    full = build_scene()
    planner = build_planner(full, SceneSettings(), 1 / 120)
    assert planner.model.nv == 43 - 11
    np.testing.assert_allclose(planner.model.body_mass, full.body_mass)
    rng = np.random.default_rng(2)
    data, reduced = mujoco.MjData(full), mujoco.MjData(planner.model)
    low, high = full.jnt_range[1:].T
    data.qpos[7:] = rng.uniform(low, high)
    mujoco.mj_forward(full, data)
    reduced.qpos[:] = data.qpos[planner.qpos]
    for body, quat in planner.fused_orientations(data):
        planner.model.body_quat[body] = quat
    mujoco.mj_forward(planner.model, reduced)
    hands = [full.body(f"{side}_hand").id for side in ("left", "right")]
    others = np.setdiff1d(np.arange(full.nbody), hands)
    np.testing.assert_allclose(reduced.xpos[others], data.xpos[others], atol=1e-9)
    np.testing.assert_allclose(reduced.subtree_com[1], data.subtree_com[1], atol=2e-3)  # hands at rest in the plan
    assert [planner.model.actuator(i).name for i in range(planner.model.nu)] == [
        humanoid().joints[i] for i in planner.controls
    ]
    assert planner.bodies[0].joint_names == tuple(humanoid().joints[i] for i in planner.controls)


def test_impossible_settings_are_refused() -> None:
    with pytest.raises(SettingError, match=r"mpc: samples 3; valid: at least 7"):
        MpcSettings(samples=3)
    with pytest.raises(SettingError, match=r"mpc: horizon 0 s; valid: above 0"):
        MpcSettings(horizon=0)
    with pytest.raises(SettingError, match=r"mpc: refined 2; valid: at least 5"):
        MpcSettings(refined=2)
    for instants in (0.01, 0.5):  # less than two steps, beyond the horizon
        with pytest.raises(
            SettingError, match=r"mpc: weights.instants .* s; valid: 1.5 timesteps to the horizon, 0.0156"
        ):
            MpcSettings(weights=CostWeights(instants=instants))
    for wrong in (
        {"samples": 20.5}, {"threads": -3}, {"fade_in": np.nan}, {"horizon": np.inf}, {"noise_scale": -1.0}, {"shrink": 0.0},
        {"scales": ()}, {"noise": ()}, {"torque_share": np.nan},
    ):  # fmt: skip
        with pytest.raises(SettingError, match=f"mpc: {next(iter(wrong))} .*; valid: "):
            MpcSettings(**wrong)  # type: ignore[arg-type]
    with pytest.raises(SettingError, match=r"mpc: damping \(0.0,\); valid"):
        MpcSettings(damping=(0.0,))
    with pytest.raises(SettingError, match=r"mpc: harder .*; valid: \(cost, samples, refined\) with ascending costs"):
        MpcSettings(harder=((2.0, 60, 20), (1.0, 90, 20)))
    with pytest.raises(SettingError, match=r"mpc: harder .* at least 7 samples and 5 refined"):
        MpcSettings(harder=((2.0, 60, 2),))


def test_least_squares_survives_degenerate_problems(monkeypatch: pytest.MonkeyPatch) -> None:
    import simprep.physics.inverse_dynamics as module

    rng = np.random.default_rng(0)
    matrix, wanted = rng.standard_normal((8, 5)), rng.standard_normal(8)
    plain = module.nonnegative_least_squares(matrix, wanted)

    def cycles(*arguments: object) -> None:
        raise RuntimeError("Maximum number of iterations reached.")

    monkeypatch.setattr(module, "nnls", cycles)
    np.testing.assert_allclose(module.nonnegative_least_squares(matrix, wanted), plain, atol=1e-5)


def test_the_command_line_offers_every_preset() -> None:
    assert get_args(get_args(Preset)[0]) == tuple(MPC_PRESETS)
    assert MPC_PRESETS["default"] == MpcSettings()
