"""Simulation: Newton's laws hold for what is recorded, runs end honestly, controllers are deterministic."""

from dataclasses import replace

import numpy as np
import pytest

from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.edit import cut, repeat
from simprep.motion.kinematics import body_clearance, forward_kinematics
from simprep.motion.motion import Motion
from simprep.physics.mpc_settings import MpcSettings
from simprep.physics.pushes import Push
from simprep.physics.reference import ReferenceSettings, make_reference
from simprep.physics.run import Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track

WEIGHT_N = 75.0 * 9.81
CHEAP = MpcSettings(samples=16, refined=8, harder=())


def standing(seconds: float = 1.0, height: float = 0.0) -> Motion:
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], round(60 * seconds) + 1, axis=0)
    qpos[:, 2] += height
    return Motion(qpos, 60.0, np.ones((len(qpos), 2), dtype=bool), name="standing")


def momentum_residual(run: Run) -> np.ndarray:
    """m * COM acceleration - (ground force + gravity): zero if nothing else acts on the body."""
    com = forward_kinematics(run.qpos).com
    acceleration = np.diff(com, 2, axis=0) / run.timestep**2
    # x[k+2] - 2 x[k+1] + x[k] of the semi-implicit step is the acceleration of step k + 1
    force = 75.0 * acceleration - run.ground_force[1:] - [0.0, 0.0, -WEIGHT_N]
    return np.asarray(force)


def test_only_gravity_and_the_floor_move_the_com() -> None:
    motion = repeat(library_motion("walk"), 1)
    for run in (track(motion, "pd"), track(cut(motion, 0, 40), "mpc", settings=SimulationSettings(mpc=CHEAP))):
        residual = momentum_residual(run)
        # impulses per quarter second; what is left is the velocity-dependent part of the integrator's error
        window = round(0.25 / run.timestep)
        impulse = np.add.reduceat(residual, np.arange(0, len(residual), window)) * run.timestep
        assert np.abs(impulse).max() < 0.004 * WEIGHT_N * 0.25
        assert run.assist.force_n == 0.0
        assert run.assist.torque_nm == 0.0


def test_a_moment_that_costs_much_is_planned_with_more_simulations() -> None:
    settings = SimulationSettings(mpc=replace(CHEAP, harder=((0.5, 24, 10),)))
    calm = track(standing(0.7), "mpc", settings=settings).settings["plans_by_effort"]
    push = Push("pelvis", start=0.2, duration=0.2, force=(300.0, 0.0, 0.0))
    pushed = track(standing(0.7), "mpc", settings=replace(settings, pushes=(push,))).settings["plans_by_effort"]
    assert calm[1] == 0
    assert pushed[1] > 5
    assert sum(pushed) == sum(calm)


def test_a_body_in_the_air_falls_as_a_stone() -> None:
    run = track(standing(0.4, height=1.5), "pd")
    height = forward_kinematics(run.qpos).com[:, 2]
    # semi-implicit Euler lags the parabola by g t dt / 2
    np.testing.assert_allclose(height[0] - height, 9.81 / 2 * run.time * (run.time + run.timestep), atol=2e-4)
    assert np.isnan(run.centre_of_pressure).all()


def test_quiet_standing_is_borne_by_the_feet_under_the_com() -> None:
    run = track(standing(1.0), "pd")
    late = slice(len(run.torque) // 2, None)
    assert run.end == "done"
    assert run.ground_force[late, 2].mean() == pytest.approx(WEIGHT_N, rel=0.01)
    np.testing.assert_allclose(run.foot_force[late].sum(axis=1), run.ground_force[late], atol=1e-6)
    com = forward_kinematics(run.qpos).com[-1, :2]
    # quasi-static: the COM sways within centimetres, the pressure centre follows it
    np.testing.assert_allclose(np.nanmean(run.centre_of_pressure[late], axis=0), com, atol=0.04)
    assert run.penetration.max() < 0.005


def test_plain_servos_fall_in_a_walk_and_the_run_says_so() -> None:
    run = track(repeat(library_motion("walk"), 4), "pd")
    assert run.end == "fell"
    assert run.fell_at_s == run.end_s == pytest.approx(run.time[-1])
    assert "reference" in run.end_reason or "floor" in run.end_reason
    assert len(run.qpos) == len(run.torque) + 1 == len(run.time)
    assert run.completed_share < 1


def test_mpc_walks_and_is_bit_identical_at_any_thread_count() -> None:
    motion = repeat(library_motion("walk"), 2)
    runs = [
        track(motion, "mpc", seed=3, settings=SimulationSettings(mpc=replace(MpcSettings(), threads=n))) for n in (1, 2)
    ]
    np.testing.assert_array_equal(runs[0].qpos, runs[1].qpos)
    np.testing.assert_array_equal(runs[0].torque, runs[1].torque)
    run = runs[0]
    assert run.end == "done"
    error = forward_kinematics(run.qpos).xpos - forward_kinematics(run.reference_qpos).xpos
    assert np.linalg.norm(error - error[:, :1], axis=-1).mean() < 0.06
    assert (np.abs(run.torque) <= run.torque_limit + 1e-9).all()
    other = track(cut(motion, 0, 20), "mpc", seed=4, settings=SimulationSettings(mpc=CHEAP))
    same = track(cut(motion, 0, 20), "mpc", seed=5, settings=SimulationSettings(mpc=CHEAP))
    assert np.abs(other.qpos[-1] - same.qpos[-1]).max() > 0  # the seed matters


def test_a_push_moves_the_body_and_is_reported() -> None:
    push = Push("thorax", 0.2, 0.1, (0.0, 100.0, 0.0))
    run = track(standing(0.5), "pd", settings=SimulationSettings(pushes=(push,)))
    still = track(standing(0.5), "pd")
    assert run.assist.force_n == 100.0
    com = [forward_kinematics(r.qpos).com[:, 1] for r in (run, still)]
    # until the feet answer, 10 N s on 75 kg
    assert np.diff(com[0] - com[1]).max() / run.timestep == pytest.approx(100 * 0.1 / 75, rel=0.35)
    with pytest.raises(SettingError, match="push on unknown body 'torso'; valid: pelvis, "):
        track(standing(), "pd", settings=SimulationSettings(pushes=(replace(push, body="torso"),)))


def test_divergence_is_reported_not_returned_as_data() -> None:
    qpos = standing(0.5).qpos.copy()
    qpos[:, 7 + humanoid().joint("left_knee_flexion")] = np.linspace(0, 1e9, len(qpos))
    motion = Motion(qpos, 60.0, np.ones((len(qpos), 2), dtype=bool), name="absurd")
    run = track(motion, "pd", settings=SimulationSettings(reference=ReferenceSettings(smoothing=0, lift=False)))
    assert run.end == "diverged"
    assert "MuJoCo warning" in run.end_reason or "NaN" in run.end_reason
    assert run.fell_at_s is None
    assert np.isfinite(run.qpos).all()


def test_reference_is_lifted_out_of_the_floor_and_recorded() -> None:
    motion = standing(1.0, height=-0.05)
    reference = make_reference(motion, 1 / 240)
    assert reference.processing["largest_lift_m"] == pytest.approx(0.05, abs=1e-6)
    assert body_clearance(reference.qpos).min() > -1e-9
    unlifted = make_reference(motion, 1 / 240, ReferenceSettings(lift=False))
    assert body_clearance(unlifted.qpos).min() == pytest.approx(-0.05, abs=1e-6)
    with pytest.raises(MotionError, match="needs at least 2"):
        make_reference(cut(motion, 0, 1), 1 / 240)


def test_smoothing_keeps_lines_and_ends() -> None:
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], 60, axis=0)
    qpos[:, 0] = np.arange(60) / 60
    motion = Motion(qpos, 60.0, np.ones((60, 2), dtype=bool))
    reference = make_reference(motion, 1 / 240, ReferenceSettings(smoothing=0.05))
    np.testing.assert_allclose(reference.qpos[:, 0], np.arange(len(reference.qpos)) / 240, atol=1e-9)


def test_unknown_controller_lists_the_valid_ones() -> None:
    with pytest.raises(UnknownNameError, match="unknown controller 'lqr'; valid: pd, balance, mpc"):
        track(standing(), "lqr")
