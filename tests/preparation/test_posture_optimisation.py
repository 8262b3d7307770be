"""Posture optimisation: gradients, descent, and the acceptance numbers on built-in and captured motion."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from scipy.optimize import minimize

from simprep.library import library_motion
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import load_motion
from simprep.motion.motion import Motion
from simprep.preparation.posture_problem import PostureFrame, PostureProblem
from simprep.preparation.prepare import Preparation, Record, prepare
from simprep.preparation.settings import PreparationSettings


def problem_at(motion: Motion, frame: int, settings=None) -> tuple[PostureProblem, PostureFrame]:
    settings = settings or PreparationSettings()
    problem = PostureProblem(motion.character, settings)
    last, before = problem.centres_of(motion.qpos[frame - 1]), problem.centres_of(motion.qpos[frame - 2])
    posture = problem.frame(motion.qpos[frame], np.array([0.3, -0.1]) + motion.qpos[frame, :2], last, before)
    return problem, posture


def test_gradient_agrees_with_finite_differences(walk):
    rng = np.random.default_rng(0)
    for frame in (5, 20, 41):
        problem, posture = problem_at(walk, frame)
        hinges = np.clip(posture.hinges + rng.normal(0, 0.15, posture.hinges.shape), problem.low, problem.high)
        gradient, curvature = problem.gradient(posture, hinges)
        h = 1e-6
        numeric = [
            (problem.costs(posture, hinges + h * e).total - problem.costs(posture, hinges - h * e).total) / (2 * h)
            for e in np.eye(len(posture.hinges))
        ]
        np.testing.assert_allclose(gradient, numeric, atol=1e-7)
        assert np.linalg.eigvalsh(curvature).min() > 0


def test_terms_are_those_of_the_paper(walk):
    settings = PreparationSettings(smooth_norm=1e-9, joint_weight=0.0)
    problem, posture = problem_at(walk, 10, settings)
    changed = posture.hinges + 0.1
    costs = problem.costs(posture, changed)
    qpos = np.tile(walk.qpos[10], (2, 1))
    qpos[1, problem.columns] = changed
    now, past = (forward_kinematics(poses, walk.character) for poses in (qpos, walk.qpos[8:10]))
    moved = np.linalg.norm(now.xipos[1] - now.xipos[0], axis=1)
    jump = np.linalg.norm(now.xipos[1] - 2 * past.xipos[1] + past.xipos[0], axis=1)
    centre = np.array([0.3, -0.1]) + walk.qpos[10, :2]
    assert costs.balance == pytest.approx(np.linalg.norm(now.com[1, :2] - centre), abs=1e-6)
    assert costs.style == pytest.approx(moved.mean(), abs=1e-6)
    assert costs.smoothness == pytest.approx(jump.mean(), abs=1e-6)
    assert costs.total == pytest.approx(2.0 * costs.balance + 1.0 * costs.style + 0.25 * costs.smoothness)


def test_a_frame_after_other_postures_is_a_new_one(walk):
    problem, posture = problem_at(walk, 10)
    kept = posture.anchors.copy()
    earlier = [problem.centres_of(walk.qpos[frame]) for frame in (2, 5)]
    other = posture.after(*(centres[problem.moved] for centres in earlier))
    np.testing.assert_array_equal(posture.anchors, kept)
    np.testing.assert_array_equal(other.anchors[0], kept[0])
    wanted = problem.frame(walk.qpos[10], None, earlier[1], earlier[0])
    np.testing.assert_array_equal(other.anchors, wanted.anchors)


def test_frames_do_not_depend_on_the_order_of_calls(walk):
    problem, one = problem_at(walk, 12)
    alone = problem.costs(one, one.hinges + 0.05)
    other = problem.frame(walk.qpos[30], None)
    problem.minimise(other, other.hinges)
    problem.com_jacobian(walk.qpos[3])
    assert problem.costs(one, one.hinges + 0.05) == alone
    with pytest.raises(FrozenInstanceError):
        one.centre = None


def test_descent_never_raises_the_cost_and_keeps_limits_and_step_count(walk):
    rng = np.random.default_rng(3)
    for max_steps in (0, 1, 10):
        problem, posture = problem_at(walk, 12, PreparationSettings(max_steps=max_steps))
        for _ in range(5):
            start = np.clip(posture.hinges + rng.normal(0, 0.3, posture.hinges.shape), problem.low, problem.high)
            best, steps = problem.minimise(posture, start)
            assert problem.costs(posture, best).total <= problem.costs(posture, start).total
            assert (problem.low <= best).all()
            assert (best <= problem.high).all()
            assert steps <= max_steps


def reductions(prepared: Preparation, blended: Preparation, frames, joint_weight: float) -> np.ndarray:
    """Cost reductions at frames, given the same two frames before.

    Returns:
        (N, 3): of the result; of the descent alone, from the blended posture; of a converged L-BFGS.
    """
    settings = replace(prepared.record.settings, joint_weight=joint_weight)
    problem = PostureProblem(prepared.motion.character, settings)
    rows = []
    for frame in frames:
        history = [problem.centres_of(prepared.motion.qpos[frame - back]) for back in (1, 2)]
        centre = prepared.record.goal[frame]
        posture = problem.frame(blended.motion.qpos[frame], None if np.isnan(centre[0]) else centre, *history)
        start = np.clip(posture.hinges, problem.low, problem.high)
        best = minimize(
            lambda x, posture=posture: (problem.costs(posture, x).total, problem.gradient(posture, x)[0]),
            start,
            jac=True,
            bounds=list(zip(problem.low, problem.high)),
            method="L-BFGS-B",
            options={"maxiter": 2000, "maxfun": 5000, "ftol": 1e-12, "gtol": 1e-8, "maxcor": 30},
        )
        result = problem.costs(posture, prepared.motion.qpos[frame, problem.columns]).total
        descent = problem.costs(posture, problem.minimise(posture, start)[0]).total
        rows.append(problem.costs(posture, posture.hinges).total - np.array([result, descent, best.fun]))
    return np.array(rows)


def distances(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """COM to the centre of support as it is in the frame, before and after, where alpha is at least 0.3 and a foot supports."""
    chosen = ~np.isnan(record.centre[:, 0]) & (record.alpha >= 0.3)
    before, after = (
        np.linalg.norm(com[:, :2] - record.centre, axis=1)[chosen] for com in (record.com_before, record.com)
    )
    return before, after


def peak_acceleration(motion: Motion) -> float:
    return float(np.abs(np.diff(motion.qpos[:, 7:], n=2, axis=0)).max()) * motion.fps**2


def check_acceptance(locomotion: Motion, target: Motion, alpha: float) -> None:
    """Issue 2, must hold 2: in every frame with alpha at least 0.3."""
    frames = 120
    blended = prepare(locomotion, target, np.full(frames, alpha), optimise=False)
    prepared = prepare(locomotion, target, np.full(frames, alpha))
    record = prepared.record
    before, after = distances(record)
    assert (after < before).all()
    gain = record.costs_before - record.costs_after
    assert (gain[:, 3] > -0.002).all()  # where the centre jumps to the COM's other side there is nothing to gain ...
    assert (gain[:, 3] > 0).mean() > 0.9  # ... but the change of posture has to pass through
    assert (record.steps <= 10).all()
    after, before = (forward_kinematics(made.motion.qpos, made.motion.character) for made in (prepared, blended))
    moved = after.foot_points - before.foot_points
    assert np.abs(moved).max() == 0.0
    found = reductions(prepared, blended, range(5, frames, 13), record.settings.joint_weight)
    assert (found[:, 1] >= 0.9 * found[:, 2]).all()  # every frame, within 10 steps from the blended posture
    assert found[:, 0].sum() >= 0.9 * found[:, 2].sum()  # the result, smoothed in time
    paper = reductions(prepared, blended, range(5, frames, 13), 0.0)  # the paper's cost, without our joint term
    assert paper[:, 0].sum() >= 0.9 * paper[:, 2].sum()


@pytest.mark.parametrize("alpha", [0.3, 0.6, 1.0])
def test_acceptance_on_built_in_walk(walk, punch, alpha):
    check_acceptance(walk, punch, alpha)


@pytest.mark.parametrize("alpha", [0.5, 1.0])
def test_acceptance_on_captured_walk(real_pair, alpha):
    check_acceptance(*real_pair, alpha)


def check_nearer_and_smooth(locomotion: Motion, target: Motion, alpha: np.ndarray) -> None:
    """Nearer to the raw centre in every frame, whose jumps must not show in the joint accelerations."""
    blended = prepare(locomotion, target, alpha, optimise=False).motion
    prepared = prepare(locomotion, target, alpha)
    before, after = distances(prepared.record)
    assert (after < before).all()
    assert after.mean() < 0.95 * before.mean()
    own = peak_acceleration(prepare(locomotion, target, np.zeros(len(alpha)), optimise=False).motion)
    # fully prepared, the blended motion stands still: then a fraction of the locomotion's own is the measure
    assert peak_acceleration(prepared.motion) <= max(1.5 * peak_acceleration(blended), 0.2 * own)


@pytest.mark.parametrize("alpha", [0.3, 0.5, 0.8, 1.0])
@pytest.mark.parametrize("target", ["punch_right", "kick_front", "crawl"])
def test_every_frame_nearer_without_jerk_on_built_in_motions(walk, target, alpha):
    check_nearer_and_smooth(walk, library_motion(target), np.full(150, alpha))


@pytest.mark.parametrize("alpha", [0.3, 0.8])
def test_every_frame_nearer_without_jerk_on_captured_motions(real_pair, alpha):
    check_nearer_and_smooth(*real_pair, np.full(150, alpha))


def test_every_frame_nearer_while_alpha_rises_and_falls_and_across_flight(walk, punch, data_dir):
    alpha = np.concatenate([np.linspace(0, 1, 90), np.linspace(1, 0, 60)])
    for locomotion in (walk, load_motion(data_dir / "deepmimic" / "humanoid3d_run.txt")):
        before, after = distances(prepare(locomotion, punch, alpha).record)
        assert (after < before).all()


def test_skipped_below_the_threshold_and_eased_in_above(walk, punch):
    alpha = np.linspace(0.0, 1.0, 150)
    blended = prepare(walk, punch, alpha, optimise=False).motion.qpos
    prepared = prepare(walk, punch, alpha).motion.qpos
    change = np.abs(prepared - blended).max(axis=1)
    assert (change[alpha < 0.3] == 0).all()
    assert (change[alpha >= 0.3] > 0).all()
    hard = prepare(walk, punch, alpha, settings=PreparationSettings(threshold_ramp=0.0)).motion.qpos
    at = int(np.argmax(alpha >= 0.3))
    assert change[at] < 0.02 < np.abs(hard - blended)[at].max()  # rad: no jump at the threshold
    assert (prepared[:, :7] == blended[:, :7]).all()
    legs = 7 + walk.character.lower_joints
    assert (prepared[:, legs] == blended[:, legs]).all()


def test_only_balancing_joints_move_and_without_any_nothing_does(walk, punch):
    def prepared(balancing: tuple[str, ...], optimise: bool = True) -> np.ndarray:
        character = replace(walk.character, balancing=balancing)
        pair = (replace(motion, character=character) for motion in (walk, punch))
        return prepare(*pair, 0.6, optimise=optimise).motion.qpos

    blended = prepared((), optimise=False)
    np.testing.assert_array_equal(prepared(()), blended)
    some = ("right_shoulder_flexion", "lumbar_bending", "thorax_flexion")  # in any order
    moved = (prepared(some) != blended).any(axis=0)
    assert set(np.flatnonzero(moved)) == {7 + walk.character.joint(name) for name in some}


def test_without_our_smoothing_every_frame_comes_closer_to_the_raw_support_centre(walk, punch):
    literal = PreparationSettings(support_smoothing=0.0, change_smoothing=0.0, joint_weight=0.0, threshold_ramp=0.0)
    record = prepare(walk, punch, np.linspace(0.3, 1.0, 130), settings=literal).record
    np.testing.assert_array_equal(record.goal, record.centre)
    before, after = distances(record)
    assert (after < before).all()
