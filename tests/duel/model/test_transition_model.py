"""Action parameters and the transition model: invariances, exact selection, storage, speed."""

import time
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal
from synthetic_bout import bout

from simprep.duel.labels.labels import CODES
from simprep.duel.model.action_features import (
    FloorFrame,
    PairTracks,
    action_features,
    action_parameters,
    fit_pose_basis,
    floor_frame,
    summarise,
)
from simprep.duel.model.semi_tied import DiagonalCovariance
from simprep.duel.model.store import read_model, save_model
from simprep.duel.model.structures import link_actions
from simprep.duel.model.transition_model import TrainingSettings, train
from simprep.errors import MotionError, MotionFileError, SettingError
from simprep.motion.turns import turned


@pytest.fixture(scope="module")
def made():
    return bout(np.random.default_rng(11), 6, clips=4)


@pytest.fixture(scope="module")
def model(made):
    return train(made.graph, made.tracks)


def moved(tracks, angle, offset):
    """The same bout elsewhere in the world."""

    def point(p):
        return np.concatenate([turned(p[..., :2], angle) + offset, p[..., 2:]], axis=-1)

    return replace(tracks, root=point(tracks.root), com=point(tracks.com), heading=tracks.heading + angle)


def test_parameters_do_not_depend_on_where_the_bout_takes_place(made):
    basis = fit_pose_basis(made.tracks.joints)
    transitions = made.actions.transitions(0)
    here = action_features(made.tracks, made.actions, basis)
    there = action_features(moved(made.tracks, 2.4, np.array([3.0, -7.0])), made.actions, basis)
    np.testing.assert_allclose(there.samples(transitions), here.samples(transitions), atol=1e-9)
    np.testing.assert_allclose(there.goal, here.goal, atol=1e-9)


def test_parameters_of_a_simple_approach():
    """Player 0 walks along world y at 1 m/s toward player 1, who turns at 0.5 rad/s on the spot, 4 m away."""
    t = np.arange(60) / 30
    root = np.zeros((60, 2, 3))
    root[:, 0, 1], root[:, 1, 1] = t, 4.0
    heading = np.column_stack([np.full(60, np.pi / 2), -np.pi / 2 + 0.5 * t])
    tracks = PairTracks(30.0, root, heading, np.random.default_rng(0).normal(size=(60, 2, 5, 3)), root)
    actions = link_actions([0, 0, 1], [0, 30, 0], [30, 60, 60], [0, 1, 2], [0, 0, 0])
    features = action_features(tracks, actions, fit_pose_basis(tracks.joints))
    sample = features.samples(actions.transitions(0))
    assert sample.shape == (1, 36)
    # The frame: origin half way between y = 1 and y = 4, x along world y.
    own, opponent, following = np.split(sample[0], 3)
    mean_y = t[:30].mean()
    np.testing.assert_allclose(own[:3], [mean_y - 2.5, 0, 0], atol=1e-12)
    np.testing.assert_allclose(own[6:9], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(opponent[:3], [1.5, 0, 0.5 * t.mean()], atol=1e-12)
    np.testing.assert_allclose(opponent[6:9], [0, 0, 0.5], atol=1e-12)
    np.testing.assert_allclose(following[0], t[30:].mean() - 2.5, atol=1e-12)
    # Half a second after frame 30 is frame 45, at y = 1.5.
    np.testing.assert_allclose(features.goal[1], [-1.0, 0], atol=1e-12)


def test_one_action_summarised_alone_equals_the_stream(made, model):
    action = 17
    span = slice(made.actions.start[action], made.actions.end[action])
    who = made.actions.player[action]
    summary = summarise(
        made.tracks.root[span, who],
        made.tracks.heading[span, who],
        model.basis.project(made.tracks.joints[span, who]),
        made.tracks.fps,
    )
    com = made.tracks.com[span.start]
    parameters = action_parameters(summary, floor_frame(com[who], com[1 - who]))
    np.testing.assert_allclose(parameters, model.parameters[action], atol=1e-9)


def test_floor_frame_goes_there_and_back():
    frame = floor_frame(np.array([1.0, 2.0, 0.9]), np.array([1.0, 5.0, 0.8]))
    assert frame.toward == pytest.approx(np.pi / 2)
    point = np.array([0.3, -0.7])
    np.testing.assert_allclose(frame.point(frame.world_point(point)), point)
    np.testing.assert_allclose(frame.point([1.0, 5.0]), [1.5, 0], atol=1e-12)


def test_pose_basis_finds_the_directions_of_variance():
    rng = np.random.default_rng(1)
    directions = np.linalg.qr(rng.normal(size=(12, 12)))[0][:3]
    joints = (rng.normal(size=(5000, 3)) * [3, 2, 1]) @ directions + 0.01 * rng.normal(size=(5000, 12))
    basis = fit_pose_basis(joints.reshape(5000, 4, 3), 3)
    np.testing.assert_allclose(np.abs(basis.components @ directions.T), np.eye(3), atol=0.05)
    np.testing.assert_allclose(basis.explained, np.array([9, 4, 1]) / 14, atol=0.03)


@pytest.mark.parametrize("with_goal", [False, True])
def test_selection_is_eq12_and_eq6(made, model, with_goal):
    player = model.players[1]
    actions = made.actions
    features = action_features(made.tracks, actions, model.basis)
    step = actions.transitions(1)
    row = int(np.flatnonzero(np.isfinite(features.goal[step.next]).all(axis=1))[5])
    own, opponent, _ = np.split(features.samples(step)[row], 3)
    goal = np.array([-0.4, 0.2]) if with_goal else None
    labels = [int(actions.label[a[row]]) for a in (step.current, step.opponent)]
    found = player.candidates(*labels, own, opponent, goal)

    gaussians = player.goal_gaussians if with_goal else player.gaussians
    for k, code in enumerate(player.labels.candidates):
        members = model.graph.graphs[1].members(k)
        x = [np.concatenate([own, opponent, model.parameters[a], goal if with_goal else []]) for a in members]
        m = int(gaussians.row(code))
        density = np.atleast_1d(multivariate_normal(gaussians.mean[m], gaussians.covariance[m]).logpdf(np.array(x)))
        assert found.example[k] == members[density.argmax()]
        expected = density.max() + player.labels.log_prob(*labels, code)
        assert found.log_weight[k] == pytest.approx(expected, rel=1e-7)


def test_actions_are_drawn_in_proportion_and_only_where_allowed(made, model):
    player = model.players[0]
    step = made.actions.transitions(0)
    samples = action_features(made.tracks, made.actions, model.basis).samples(step)
    candidates = [
        player.candidates(made.actions.label[i], made.actions.label[j], x[:12], x[12:24])
        for i, j, x in zip(step.current[:80], step.opponent[:80], samples, strict=False)
    ]
    # The situation that leaves most open, so that the draw has something to get wrong.
    row = int(np.argmax([-(p * np.log(p + 1e-300)).sum() for p in (one.probabilities() for one in candidates)]))
    probability = candidates[row].probabilities()
    assert probability.max() < 0.9
    situation = (
        int(made.actions.label[step.current[row]]),
        int(made.actions.label[step.opponent[row]]),
        samples[row, :12],
        samples[row, 12:24],
    )
    rng = np.random.default_rng(4)
    drawn = np.array([player.sample(rng, *situation) for _ in range(3000)])
    share = np.array([(drawn == example).mean() for example in candidates[row].example])
    assert np.abs(share - probability).max() < 4 * np.sqrt(0.25 / 3000)
    again = np.random.default_rng(4)
    assert [player.sample(again, *situation) for _ in range(20)] == drawn[:20].tolist()

    allowed = np.zeros(len(probability), dtype=bool)
    allowed[model.graph.table.answering(0, "kick")] = True
    for _ in range(50):
        chosen = player.sample(rng, *situation, allowed=allowed)
        assert allowed[model.graph.graphs[0].node[chosen]]
    with pytest.raises(SettingError, match="no candidate action is allowed"):
        player.sample(rng, *situation, allowed=np.zeros(len(probability), dtype=bool))


def test_goal_draws_examples_that_go_there(made, model):
    """Asked to end up forward or back of a spot, the chosen examples shift to that side."""
    player = model.players[0]
    features = action_features(made.tracks, made.actions, model.basis)
    step = made.actions.transitions(0)
    reached = {}
    for shift in (-0.25, 0.25):
        rng = np.random.default_rng(6)
        ends = []
        for row in range(0, 120, 2):
            x = features.samples(step)[row]
            labels = [int(made.actions.label[a[row]]) for a in (step.current, step.opponent)]
            goal = np.nanmean(features.goal[made.actions.of(0)], axis=0) + np.array([shift, 0])
            ends.append(features.goal[player.sample(rng, *labels, x[:12], x[12:24], goal=goal), 0])
        reached[shift] = np.nanmean(ends)
    assert reached[0.25] > reached[-0.25] + 0.1


def test_a_choice_takes_well_under_a_millisecond(made, model):
    player = model.players[0]
    step = made.actions.transitions(0)
    x = action_features(made.tracks, made.actions, model.basis).samples(step)[0]
    labels = [int(made.actions.label[a[0]]) for a in (step.current, step.opponent)]
    rng = np.random.default_rng(0)
    begin = time.process_time()
    for _ in range(200):
        player.sample(rng, *labels, x[:12], x[12:24])
    assert (time.process_time() - begin) / 200 < 1e-3


@pytest.mark.parametrize("label_model", ["eq9", "log_linear", "rules"])
def test_a_saved_model_chooses_as_before(made, label_model, tmp_path):
    model = train(made.graph, made.tracks, TrainingSettings(label_model, DiagonalCovariance()))
    path = save_model(model, tmp_path / "model")
    read = read_model(path)
    x = action_features(made.tracks, made.actions, model.basis).samples(made.actions.transitions(0))[3]
    code = int(made.actions.label[0])
    for goal in (None, np.array([-0.5, 0.1])):
        before, after = (m.players[0].candidates(code, code, x[:12], x[12:24], goal) for m in (model, read))
        assert np.array_equal(before.log_weight, after.log_weight)
        assert np.array_equal(before.example, after.example)
    codes = made.graph.graphs[0].labels
    for before, after in zip(model.players, read.players):
        assert before.labels.kind == after.labels.kind == label_model
        every = np.meshgrid(np.append(codes, CODES - 1), np.append(codes, CODES - 1))
        np.testing.assert_array_equal(before.labels.distribution(*every), after.labels.distribution(*every))
    assert (read.fps, read.goal_delay) == (model.fps, model.goal_delay)
    assert np.array_equal(read.basis.components, model.basis.components)


def test_damaged_models_are_refused(model, tmp_path):
    with pytest.raises(MotionFileError, match="no such file"):
        read_model(tmp_path / "missing.npz")
    path = save_model(model, tmp_path / "model.npz")
    with np.load(path) as archive:
        parts = dict(archive)
    for change, message in (
        ({"header": np.array('{"schema": "simprep.duel_model/9"}')}, "schema 'simprep.duel_model/9'; this version"),
        ({"gaussian_mean_0": np.full_like(parts["gaussian_mean_0"], np.nan)}, "gaussian_mean_0 holds NaN"),
        ({"parameters": parts["parameters"][:-1]}, "for .* segments"),
        ({"gaussian_mean_1": parts["gaussian_mean_1"][:, :-1]}, r"covariances of shape \(\d+, 36, 36\)"),
        ({"gaussian_mean_1": parts["goal_mean_1"], "gaussian_covariance_1": parts["goal_covariance_1"]}, "38 param"),
    ):
        np.savez(path, **(parts | change))
        with pytest.raises(MotionFileError, match=message):
            read_model(path)
    path.write_bytes(b"PK rubbish")
    with pytest.raises(MotionFileError, match="not a readable duel model"):
        read_model(path)


def test_bad_input_is_refused(made, model):
    tracks = made.tracks
    with pytest.raises(MotionError, match=r"heading has shape \(5, 2\); valid: \(\d+, 2\)"):
        replace(tracks, heading=tracks.heading[:5])
    broken = tracks.com.copy()
    broken[7, 1, 2] = np.nan
    with pytest.raises(MotionError, match="frame 7: com holds NaN"):
        replace(tracks, com=broken)
    short = PairTracks(60.0, tracks.root[:100], tracks.heading[:100], tracks.joints[:100], tracks.com[:100])
    with pytest.raises(MotionError, match="the stream has 100 frames"):
        train(made.graph, short)
    with pytest.raises(MotionError, match="above the same spot"):
        floor_frame(np.zeros(3), np.zeros(3))
    with pytest.raises(SettingError, match="12 finite parameters of each player"):
        model.players[0].sample(np.random.default_rng(0), 0, 0, np.full(12, np.nan), np.zeros(12))
    tiny = bout(np.random.default_rng(0), 0.2)
    with pytest.raises(MotionError, match=r"player A changes its action \d+ times; a model needs more than 36"):
        train(tiny.graph, tiny.tracks)


def test_the_frame_is_a_plain_rotation():
    frame = FloorFrame(np.array([1.0, 1.0]), np.array(0.3))
    assert np.linalg.norm(frame.point([2.0, 3.0])) == pytest.approx(np.hypot(1, 2))
