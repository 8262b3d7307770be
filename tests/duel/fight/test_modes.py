"""Modes of fights: requests, goals, held-out attacks, baselines, drawing, and models with their example motions."""

from dataclasses import replace

import numpy as np
import pytest

from simprep.duel.fight.alertness import SHORTEST_S, Alertness, run
from simprep.duel.fight.avatar import Avatar, Steering, displacements
from simprep.duel.fight.baselines import IndependentChooser, RandomChooser, own_motion
from simprep.duel.fight.choice import Situation
from simprep.duel.fight.default_model import default_fight_model
from simprep.duel.fight.drawing import ConditionalDensities, DrawingChooser, DrawSettings, begins_where
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.duel.fight.masks import LabelMasks, kind_of, reaction_to, seen_successions
from simprep.duel.fight.modes import begin_fight
from simprep.duel.fight.passive import ReactingChooser, RecordedChooser
from simprep.duel.fight.requests import Request, read_requests
from simprep.duel.fight.synthesis import Bout
from simprep.duel.labels.labels import Label, decode, neutral
from simprep.duel.model.action_features import FloorFrame
from simprep.duel.model.fight_model import FightModel, read_fight_model, save_fight_model, stream_digest
from simprep.duel.model.held_out import held_out_actions, learn_before, split_frame
from simprep.duel.model.store import save_model
from simprep.duel.model.structures import REQUESTS, couple, link_actions
from simprep.duel.model.tracks import pair_tracks
from simprep.duel.model.transition_model import train
from simprep.duel.stream.store import save_stream
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import PRESETS
from simprep.errors import MotionError, MotionFileError, SettingError, UnknownNameError

SHORT = replace(PRESETS["kickboxing"], clips=3, clip_s=30.0)


@pytest.fixture(scope="module")
def whole():
    example = make_synthetic(SHORT, seed=5)
    player, start, end, clip = example.truth.table.T
    graph = couple(link_actions(player, start, end, example.truth.codes, clip))
    return FightModel(train(graph, pair_tracks(example.stream)), example.stream)


@pytest.fixture(scope="module")
def learned(whole):
    return learn_before(whole, split_frame(whole))


@pytest.fixture(scope="module")
def examples(learned):
    return ExampleMotions.of(learned.stream, learned.model)


def situation(model, row, player=0, **changed):
    """About the moment at which an action of the examples ended: parameters are those with which the actions began."""
    actions, parameters = model.model.graph.actions, model.model.parameters
    now = Situation(
        player, 1.0, int(actions.label[row]), int(actions.label[actions.concurrent[row]]), parameters[row],
        parameters[actions.concurrent[row]], FloorFrame(np.zeros(2), np.float64(0.0)), int(row), np.array([-0.5, 0.0]), 0.0,
    )  # fmt: skip
    return replace(now, **changed)


def transitions(model, player, kind=None):
    """Actions of a player that end in the examples with a neutral opponent, of some kind."""
    graph = model.model.graph
    rows = graph.actions.transitions(player).current
    labels = [Label.from_code(int(code)) for code in graph.actions.label[rows]]
    return [row for row, label in zip(rows, labels) if kind is None or kind(label)]


# ---- requests --------------------------------------------------------------------------------------------------------


def attacks_with(code, action):
    label = Label.from_code(code)
    if action == "jump":
        return label.jump == "up"
    return any(Label(move="L-L", **{aspect: getattr(label, aspect)}).attacks for aspect in REQUESTS[action])


@pytest.mark.parametrize("action", REQUESTS)
def test_what_is_asked_for_comes_next_or_after_a_limb_has_been_taken_back(whole, action):
    rng = np.random.default_rng(0)
    seen = seen_successions(whole.model.graph, 0)
    labels = whole.model.graph.actions.label
    for row in transitions(whole, 0)[::9]:
        avatar = Avatar(whole, 0)
        avatar.request(action)
        first = avatar.choose(situation(whole, row), rng)
        if first.request:
            assert first.request == action
            assert attacks_with(labels[first.example], action)
            continue
        # not at once only where the examples never go straight from what was done to what is asked for
        wanted = {int(kind_of(code)) for code in avatar.model.labels.candidates if attacks_with(code, action)}
        assert not any((int(kind_of(labels[row])), kind) in seen for kind in wanted)
        second = avatar.choose(situation(whole, first.example), rng)
        assert attacks_with(labels[second.example], action)
        assert [one.choices for one in avatar.answers] == [2]


def test_a_request_waits_for_its_time_and_the_newest_counts(whole):
    rng, row = np.random.default_rng(1), transitions(whole, 0, lambda label: not label.attacks)[0]
    avatar = Avatar(whole, 0, script=(Request("left kick", time=5.0),))
    assert avatar.choose(situation(whole, row), rng).request == ""
    old, new = avatar.request("right punch"), avatar.request("kick")
    choice = avatar.choose(situation(whole, row), rng)
    if not choice.request:
        choice = avatar.choose(situation(whole, choice.example), rng)
    assert choice.request == "kick"
    assert [(one.request, one.choices > 0) for one in avatar.answers] == [(old, False), (new, True)]
    with pytest.raises(UnknownNameError, match="valid: punch, kick, left punch"):
        avatar.request("headbutt")
    with pytest.raises(SettingError, match="an action, a goal, or both"):
        avatar.request()


def test_a_goal_leads_the_choice_there_and_the_drift_no_farther_than_allowed(whole):
    rng, steering = np.random.default_rng(2), Steering(False, 0.002, 0.05)
    own = whole.model.players[0].examples
    ways = displacements(whole, 0, own)
    row = transitions(whole, 0, lambda label: label.move[-1] == "L")[0]
    errors, plain = [], []
    for reachable in ways[::12]:
        goal = np.array([-0.5, 0.0]) + reachable
        for collected, use in ((errors, steering), (plain, Steering(False, np.inf, 0.0))):
            avatar = Avatar(whole, 0, use)
            avatar.request(goal=tuple(goal))
            choice = avatar.choose(situation(whole, row), rng)
            leads = np.array([-0.5, 0.0]) + ways[own == choice.example][0]
            collected.append(np.linalg.norm(leads - goal))
            if use is steering:
                assert np.linalg.norm(choice.goal - leads) <= 0.05 + 1e-9
                assert np.linalg.norm(choice.goal - goal) == pytest.approx(max(0, collected[-1] - 0.05))
            else:
                assert choice.goal is None
    assert len(errors) >= 8
    # an example leads exactly there, and so strong a wish outweighs most of everything else
    assert np.median(errors) < 0.25 * np.median(plain)


def test_a_script_names_file_and_line_of_what_is_wrong(tmp_path):
    path = tmp_path / "wishes.csv"
    path.write_text("# mine\ntime_s,action,x_m,y_m\n2.5,,0.4,-0.2\n\n1, left kick ,,\n")
    assert read_requests(path) == (Request("left kick", None, 1.0), Request("", (0.4, -0.2), 2.5))
    for line, said in (
        ("1,headbutt,,", "unknown requested action 'headbutt'; valid: punch"),
        ("x,kick,,", "time_s 'x'; valid: a number"),
        ("1,kick,0.3,", "both x_m and y_m"),
        ("1,,,", "an action, a goal, or both"),
        ("-1,kick,,", "valid: 0 or later"),
        ("1,kick", "2 cells; valid: 4"),
        ("1,kick,nan,0", "within 100 m"),
    ):
        path.write_text(f"time_s,action,x_m,y_m\n0,punch,,\n{line}\n")
        with pytest.raises(MotionFileError, match="line 3") as caught:
            read_requests(path)
        assert said in str(caught.value)
        assert str(path) in str(caught.value)
    path.write_text("when,what\n")
    with pytest.raises(MotionFileError, match="valid: time_s,action,x_m,y_m"):
        read_requests(path)
    with pytest.raises(MotionFileError, match="no such file"):
        read_requests(tmp_path / "none.csv")


# ---- held-out part, passive mode -------------------------------------------------------------------------------------


def test_what_is_held_out_is_neither_learned_nor_chosen(whole, learned):
    frame, actions = learned.learned_until, learned.model.graph.actions
    assert frame == whole.stream.seams[1]
    for player in learned.model.players:
        assert actions.end[player.examples].max() <= frame
        assert set(actions.label[player.examples]) == set(player.labels.candidates)
        assert len(player.labels.triples) < len(whole.model.players[player.player].labels.triples)
    assert actions.start[held_out_actions(learned, 0)].min() >= frame
    # the rest of the stream plays no part in what is learned
    changed = [replace(m, qpos=np.concatenate([m.qpos[:frame], m.qpos[frame:][::-1]])) for m in whole.stream.players]
    other = FightModel(whole.model, replace(whole.stream, players=tuple(changed)))
    again = learn_before(other, frame)
    for one, two in zip(learned.model.players, again.model.players):
        np.testing.assert_allclose(one.gaussians.mean, two.gaussians.mean)
        np.testing.assert_allclose(one.gaussians.covariance, two.gaussians.covariance, atol=1e-9)
    with pytest.raises(MotionError, match="a longer stream"):
        learn_before(whole, 600)
    with pytest.raises(MotionError, match="no action of player 1 is held out"):
        held_out_actions(whole, 1)


def test_passive_mode_plays_what_was_held_out_in_order_and_the_other_only_reacts(learned, examples):
    made = begin_fight(learned, "passive", seed=3, player=1, examples=examples)
    made.run(15.0)
    fight = made.fight(15.0)
    played = np.array([one.example for one in fight.of(1)[1:]])
    held_out = held_out_actions(learned, 1)
    place = np.searchsorted(held_out, played)
    assert np.array_equal(held_out[place], played)
    assert np.array_equal(np.diff(place) % len(held_out), np.ones(len(place) - 1))
    codes = np.array([one.label for one in fight.of(0)[1:]])
    assert neutral(decode(codes)).all()
    # each reacts to what is under way when it begins
    for one in fight.of(0)[1:]:
        (now,) = (other for other in fight.of(1) if other.start < one.start <= other.end)
        assert decode([one.label])[0, 5] == reaction_to(now.label)
    assert fight.record["learned_until_frame"] == learned.learned_until
    with pytest.raises(SettingError, match="at least one"):
        RecordedChooser([])


def test_a_waiting_fighter_answers_early_and_nobody_else_is_disturbed(learned, examples):
    alertness = Alertness.of(learned.model.graph, learned.stream.fps, learned.learned_until)
    assert 0.1 < np.median(alertness.to_punch) < np.median(alertness.to_kick) < 0.7
    counts = []
    for alert in (None, replace(alertness, players=(1,))):
        choosers = (DrawingChooser(learned.model.players[0]), ReactingChooser(learned.model.players[1]))
        bout = Bout(examples, choosers, np.random.default_rng(4))
        run(bout, 1200, alert)
        fight = bout.fight(1200)
        attacks = [one for one in fight.of(0) if reaction_to(one.label) != 2 and one.end < 1200]
        starts = np.array([one.start for one in fight.of(1)])
        counts.append(np.mean([((starts > one.start) & (starts <= one.end)).any() for one in attacks]))
        # shortened actions are not shorter than that, unless the example is
        lengths = [one.end - one.start for one in fight.of(1)[1:-1]]
        assert min(lengths) >= min(SHORTEST_S * 60 - 1, 0.8 * np.min(examples.actions.end - examples.actions.start))
    assert counts[1] > counts[0]
    with pytest.raises(SettingError, match="all above 0 s"):
        Alertness(np.array([0.0]), np.array([0.3]))


# ---- drawing and baselines -------------------------------------------------------------------------------------------


def test_labels_that_contradict_the_rules_are_never_drawn(whole):
    rng, drawing = np.random.default_rng(5), DrawingChooser(whole.model.players[1])
    labels = whole.model.graph.actions.label
    for row in transitions(whole, 1)[::5]:
        now = situation(whole, row, 1)
        before, after = Label.from_code(now.own_label), Label.from_code(int(labels[drawing.draw(now, rng)]))
        assert after.move[0] == before.move[-1]
        assert decode([after.code])[0, 5] == reaction_to(now.opponent_label)


def test_densities_are_those_of_the_joint_gaussian(whole):
    model = whole.model.players[0]
    found = ConditionalDensities(model.gaussians, model.labels.candidates, model.candidate, model.parameters)
    size, row = model.parameters.shape[1], model.gaussians.row(model.labels.candidates)
    rng = np.random.default_rng(6)
    given = 0.3 * rng.normal(size=(2, 2 * size))
    label = int(np.argmax(np.bincount(model.candidate)))
    own = np.flatnonzero(model.candidate == label)
    mean, covariance = model.gaussians.mean[row], model.gaussians.covariance[row]

    def log_density(values, middle, spread):
        white = np.linalg.solve(np.linalg.cholesky(spread), (values - middle).T).T
        return -0.5 * (white**2).sum(axis=-1) - 0.5 * np.linalg.slogdet(spread)[1]

    # P(g | f, l) is P(g, f | l) over P(f | l): compared as differences, since constants are free
    joint = [
        log_density(np.column_stack([np.tile(g, (len(own), 1)), model.parameters[own]]), mean[label], covariance[label])
        for g in given
    ]
    alone = log_density(model.parameters[own], mean[label, 2 * size :], covariance[label, 2 * size :, 2 * size :])
    ours = [found.given_examples(g, label, own) for g in given]
    np.testing.assert_allclose(ours[0] - ours[1], joint[0] - joint[1], rtol=1e-6)
    np.testing.assert_allclose(np.diff(ours[0]), np.diff(joint[0] - alone), rtol=1e-6, atol=1e-6)
    marginal = [log_density(given[0], m[: 2 * size], c[: 2 * size, : 2 * size]) for m, c in zip(mean, covariance)]
    np.testing.assert_allclose(np.diff(found.given_labels(given[0])), np.diff(marginal), rtol=1e-6, atol=1e-6)


def test_baselines_ignore_the_opponent_and_the_model_does_not(whole):
    row = transitions(whole, 0, lambda label: not label.attacks)[3]
    codes = whole.model.players[1].labels.candidates
    size = whole.model.parameters.shape[1]
    elsewhere = {
        "opponent_label": int(codes[LabelMasks.of(whole.model.players[1]).attacks][0]),
        "opponent": np.full(size, 0.7),
    }
    for chooser in (IndependentChooser.of(whole.model, 0), RandomChooser(whole.model.players[0])):
        for seed in range(5):
            one = chooser.choose(situation(whole, row), np.random.default_rng(seed))
            assert one == chooser.choose(situation(whole, row, **elsewhere), np.random.default_rng(seed))
    drawing = DrawingChooser(whole.model.players[0], DrawSettings(rules=False))
    here, there = (
        drawing.label_probabilities(one) for one in (situation(whole, row), situation(whole, row, **elsewhere))
    )
    assert 0.5 * np.abs(here - there).sum() > 0.1
    # where the own placement in the common frame is concerned, too
    moved = np.zeros(size)
    moved[:3] = [0.4, -0.2, 0.0]
    np.testing.assert_array_equal(own_motion(moved), own_motion(np.zeros(size)))
    assert begins_where(codes, int(codes[0])).any()


# ---- models with their motions ---------------------------------------------------------------------------------------


def test_a_model_keeps_its_motions_and_refuses_those_of_another(whole, tmp_path):
    save_fight_model(whole.model, whole.stream, tmp_path)
    for path in (tmp_path, tmp_path / "model.npz"):
        again = read_fight_model(path)
        assert stream_digest(again.stream) == stream_digest(whole.stream)
        np.testing.assert_array_equal(again.model.parameters, whole.model.parameters)
    a, b = whole.stream.players
    shifted = a.qpos.copy()
    shifted[1000, 0] += 1e-9
    save_stream(replace(whole.stream, players=(replace(a, qpos=shifted), b)), tmp_path / "stream.npz")
    with pytest.raises(MotionFileError, match="not the stream that"):
        read_fight_model(tmp_path)
    (tmp_path / "stream.npz").unlink()
    with pytest.raises(MotionFileError, match=r"no stream\.npz beside it"):
        read_fight_model(tmp_path / "model.npz")
    save_stream(whole.stream, tmp_path / "stream.npz")
    save_model(whole.model, tmp_path / "model.npz")  # as written before digests were
    with pytest.raises(MotionFileError, match="not the stream that"):
        read_fight_model(tmp_path)
    with pytest.raises(
        MotionFileError, match=r"a directory without a duel model, which `simprep duel analyse STREAM -o DIR` writes"
    ):
        read_fight_model(tmp_path.parent)
    with pytest.raises(SettingError, match="does not belong to"):
        FightModel(whole.model, whole.stream.part(0, 500))


def test_the_default_model_is_made_once_and_again_where_the_cache_is_damaged(tmp_path, monkeypatch):
    monkeypatch.setenv("SIMPREP_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(
        "simprep.duel.fight.default_model.preset", lambda name: replace(PRESETS[name], clips=1, clip_s=60.0)
    )
    monkeypatch.setattr("simprep.duel.fight.default_model.edited_since_import", lambda folders: False)
    said = []
    made = default_fight_model(lambda what, share: said.append(what))
    assert said[0] == "built-in stream"
    assert said[-1] == "evaluation"
    said.clear()
    kept = default_fight_model(lambda what, share: said.append(what))
    assert not said
    np.testing.assert_array_equal(kept.model.parameters, made.model.parameters)
    (path,) = tmp_path.rglob("stream.npz")
    path.write_bytes(b"damaged")
    monkeypatch.setattr("simprep.duel.fight.default_model._made", lambda settings, progress: made)
    assert default_fight_model() is made
    assert stream_digest(read_fight_model(path.parent).stream) == stream_digest(made.stream)


def test_wrong_modes_are_refused(whole):
    with pytest.raises(UnknownNameError, match="valid: automatic, interactive, passive"):
        begin_fight(whole, "nice")
    with pytest.raises(SettingError, match="valid: in interactive mode"):
        begin_fight(whole, "automatic", requests=(Request("kick"),))
    with pytest.raises(SettingError, match="seed -1"):
        begin_fight(whole, seed=-1)
    with pytest.raises(SettingError, match="player 2"):
        begin_fight(whole, player=2)
