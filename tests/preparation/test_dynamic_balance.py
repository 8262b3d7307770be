"""The optimiser `dynamic`: its gradient, its optimum, feet that stay, and a dynamic cost that falls."""

from dataclasses import replace

import numpy as np
import pytest

from simprep.errors import UnknownNameError
from simprep.humanoid_model import GRAVITY
from simprep.library import library_motion
from simprep.motion.kinematics import forward_kinematics
from simprep.preparation import build_scenario
from simprep.preparation.dynamic_balance import DynamicBalance, coming_support, pelvis_shift, shift_pelvis
from simprep.preparation.posture_problem import PostureProblem
from simprep.preparation.prepare import prepare
from simprep.preparation.settings import PreparationSettings

DYNAMIC = PreparationSettings(optimiser="dynamic")
FPS = 60.0


def made_up(frames: int = 40) -> DynamicBalance:
    rng = np.random.default_rng(1)
    com = np.cumsum(rng.normal(0, 0.01, (frames, 3)), axis=0) + np.array([0, 0, 0.9])
    centres = com[:, :2] + rng.normal(0, 0.05, (frames, 2))
    centres[10:14] = np.nan
    return DynamicBalance(com, centres, FPS, DYNAMIC)


def test_gradient_agrees_with_finite_differences_and_the_step_finds_the_least():
    problem, rng = made_up(), np.random.default_rng(0)
    at = rng.normal(0, 0.05, (40, 2))
    gradient, h = problem.gradient(at), 1e-5
    for frame, axis in ((0, 0), (7, 1), (12, 0), (38, 1), (39, 0)):
        change = np.zeros_like(at)
        change[frame, axis] = h
        numeric = (problem.cost(at + change) - problem.cost(at - change)) / (2 * h)
        assert gradient[frame, axis] == pytest.approx(numeric, rel=1e-5, abs=1e-10)
    best = problem.solve()
    assert np.abs(problem.gradient(best)).max() < 1e-12
    for _ in range(5):
        assert problem.cost(best) < problem.cost(best + rng.normal(0, 0.01, best.shape))


def test_a_pendulum_that_stands_beside_its_support_is_brought_back_over_it():
    com = np.tile([0.03, 0.0, 0.9], (240, 1))
    problem = DynamicBalance(com, np.zeros((240, 2)), FPS, DYNAMIC)
    assert problem.distance(np.zeros((240, 2))) == pytest.approx(np.full(240, 0.03))
    assert problem.solve()[120] == pytest.approx([-0.03, 0.0], abs=1e-3)
    moving = com + np.linspace(0, 4, 240)[:, None] * [0.1, 0, 0]  # at 0.1 m/s the XcoM is v / omega0 ahead
    ahead = DynamicBalance(moving, moving[:, :2], FPS, replace(DYNAMIC, look_ahead=1 / FPS))
    assert ahead.distance(np.zeros((240, 2)))[100] == pytest.approx(0.4 / 239 * FPS / np.sqrt(GRAVITY / 0.9), rel=1e-6)


def test_coming_support_leaves_flight_out():
    centres = np.array([[0.0, 0], [1, 0], [np.nan, np.nan], [np.nan, np.nan], [4, 0]])
    assert coming_support(centres, 2)[:, 0] == pytest.approx([0.5, 1, np.nan, 4, 4], nan_ok=True)
    assert coming_support(centres, 1)[:, 0] == pytest.approx([0, 1, np.nan, np.nan, 4], nan_ok=True)


@pytest.mark.parametrize(("target", "alpha"), [("punch_right", 0.3), ("kick_front", 0.6), ("crawl", 1.0)])
def test_feet_stay_and_the_dynamic_cost_falls(walk, target, alpha):
    level = np.full(150, alpha)
    target = library_motion(target)
    before = prepare(walk, target, level, optimise=False)
    paper, dynamic = prepare(walk, target, level), prepare(walk, target, level, settings=DYNAMIC)
    poses = [forward_kinematics(one.motion.qpos, walk.character) for one in (before, paper, dynamic)]
    assert np.abs(poses[2].foot_points - poses[0].foot_points).max() < 1e-3  # m; in the air too
    assert np.abs(dynamic.motion.qpos[:, :2] - before.motion.qpos[:, :2]).max() > 1e-3  # the pelvis helps
    low, high = walk.character.limits.T
    assert (dynamic.motion.qpos[:, 7:] >= low - 1e-9).all()
    assert (dynamic.motion.qpos[:, 7:] <= high + 1e-9).all()
    cost = [
        np.nanmean(DynamicBalance(one.com, dynamic.record.centre, FPS, DYNAMIC).distance(np.zeros((150, 2))))
        for one in poses
    ]
    assert cost[2] < 0.75 * cost[0]
    assert alpha == 1.0 or cost[2] < 0.85 * cost[1]  # walking: below the paper's; standing: both are at the centre
    acceleration = [np.abs(np.diff(one.motion.qpos[:, 7:], n=2, axis=0)).max() * FPS**2 for one in (before, dynamic)]
    assert acceleration[1] < max(1.3 * acceleration[0], 10)


def test_the_pelvis_holds_back_where_a_leg_is_too_short(walk):
    qpos = walk.qpos
    poses = forward_kinematics(qpos, walk.character)
    shift = np.tile([0.5, 0.0], (len(qpos), 1))  # no leg can do that
    out, after, share = shift_pelvis(qpos, poses, shift, FPS, walk.character)
    assert np.abs(after.foot_points - poses.foot_points).max() < 1e-3
    assert share.max() < 0.9
    np.testing.assert_array_equal(shift_pelvis(qpos, poses, 0 * shift, FPS, walk.character)[0], qpos)
    asked = pelvis_shift(shift, np.ones(len(qpos)), FPS, 0.03)
    assert np.linalg.norm(asked, axis=1).max() <= 0.03
    assert np.isfinite(out).all()


def test_arms_settings_and_descents(walk, punch):
    default = prepare(walk, punch, 0.5)
    made = build_scenario(walk, punch, 0.5, "dynamic")
    assert made.approach.record.settings.optimiser == "dynamic"
    assert build_scenario(walk, punch, 0.5).approach.record.settings.optimiser == "paper"
    assert not np.array_equal(prepare(walk, punch, 0.5, settings=DYNAMIC).motion.qpos, default.motion.qpos)
    for name in ("optimiser", "descent"):
        with pytest.raises(UnknownNameError, match="valid: "):
            PreparationSettings(**{name: "magic"})
    costs = {}
    for descent in ("gauss-newton", "steepest"):
        problem = PostureProblem(walk.character, PreparationSettings(descent=descent, max_steps=3))
        posture = problem.frame(walk.qpos[10], walk.qpos[10, :2] + [0.1, 0.0])
        best, steps = problem.minimise(posture, posture.hinges)
        assert 0 < steps <= 3
        costs[descent] = problem.costs(posture, best).total
    assert costs["gauss-newton"] < costs["steepest"] < problem.costs(posture, posture.hinges).total
