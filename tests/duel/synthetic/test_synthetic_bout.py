"""The built-in example: its policy, force peaks, truth, and what the analysis makes of it."""

from dataclasses import replace

import numpy as np
import pytest

from simprep.duel.analysis import (
    AnalysisSettings,
    analyse,
    annotate_as_proposed,
    cut_scores,
    match_actions,
    match_frames,
)
from simprep.duel.labels.labels import ASPECTS, LEARNED_ASPECTS, QUALIFIERS, Label, decode
from simprep.duel.labels.rules import move_rule, react_rule
from simprep.duel.labels.segmentation import Cuts, segment_stream
from simprep.duel.model.evaluation import EvaluationSettings
from simprep.duel.model.structures import link_actions
from simprep.duel.synthetic.generating_model import GeneratingModel, Temper, kind_table
from simprep.duel.synthetic.heave import heave
from simprep.duel.synthetic.kinds import KIND_NAMES, KIND_OF, KINDS, attacks, context_of, kind_indices, label_of
from simprep.duel.synthetic.make import SOURCE, make_synthetic
from simprep.duel.synthetic.presets import PRESETS, SyntheticSettings, preset
from simprep.duel.synthetic.summary import summarise_synthetic
from simprep.duel.synthetic.truth import read_truth, save_truth, truth_path
from simprep.errors import MotionFileError, SettingError, SimprepError
from simprep.humanoid_model import GRAVITY, humanoid
from simprep.motion.contacts import stances
from simprep.motion.kinematics import forward_kinematics

SHORT = replace(PRESETS["kickboxing"], clips=2, clip_s=40.0)


@pytest.fixture(scope="module")
def example():
    return make_synthetic(SHORT, seed=3)


def policies(settings):
    return [GeneratingModel(kind_table(temper), settings.footing) for temper in settings.tempers]


def test_every_kind_has_its_own_label_and_the_meaning_that_the_rule_for_react_finds():
    assert len(KIND_OF) == len(KINDS) == len({kind_indices(kind) for kind in KINDS})
    for kind in KIND_NAMES:
        table = np.array([[0, 0, 40, 0], [0, 40, 60, 0], [1, 0, 20, 0], [1, 20, 60, 0]])
        learned = np.array([kind_indices("neutral")] * 2 + [kind_indices(kind)] * 2)
        rule = QUALIFIERS["react"][react_rule(table, learned)[1]]
        assert rule == (context_of(kind) if attacks(kind) else "others")
        assert attacks(kind) == label_of(kind, "others", "L-L").attacks


@pytest.mark.parametrize("name", PRESETS)
def test_policy_gives_distributions_that_keep_the_rules(name):
    a, b = policies(preset(name))
    table = a.tabulated(b)  # checks that every row sums to one
    rows = np.random.default_rng(0).integers(len(a.candidates), size=40)
    own, theirs = a.candidates[rows], b.candidates[rows[::-1]]
    given = a.distribution(own, theirs)
    np.testing.assert_allclose(table.distribution(own, theirs), given)
    for l1, l2, chances in zip(own, theirs, given):
        for code in a.candidates[chances > 0]:
            following, opponent = Label.from_code(int(code)), Label.from_code(int(l2))
            assert following.move[0] == Label.from_code(int(l1)).move[-1]
            kicks = any(getattr(opponent, leg) in ("up", "downup") for leg in ("left_kick", "right_kick"))
            assert (following.react == "kick") == kicks


def test_policy_survives_json_and_refuses_what_it_never_does():
    policy = policies(preset("taekwondo"))[0]
    again = GeneratingModel.from_dict(policy.as_dict())
    np.testing.assert_array_equal(again.candidates, policy.candidates)
    np.testing.assert_array_equal(again.kinds, policy.kinds)
    odd = Label(left_kick="up", right_kick="up", move="L-L").code
    with pytest.raises(SettingError, match="no such kind"):
        policy.distribution(odd, odd)
    with pytest.raises(SettingError, match="unknown kind of action 'headbutt'"):
        kind_table(Temper({"headbutt": 1.0}, {}))


def test_heave_has_one_peak_between_minima_at_the_cuts_and_rests_there():
    rng = np.random.default_rng(1)
    cuts = np.concatenate([[0], np.cumsum(rng.integers(22, 50, 12))])
    minima = -GRAVITY * rng.uniform(0.2, 0.4, 13)
    heights = 0.93 + rng.normal(0, 0.005, 13)
    course = heave(cuts, minima, heights, np.zeros(13), 60.0)
    velocity = np.gradient(course.height, 1 / 60.0)
    for first, after, peak in zip(cuts[:-1], cuts[1:], course.peaks):
        part = course.acceleration[first:after]
        assert np.abs(first + np.argmax(part) - peak) <= 1
        steps = np.diff(part)
        assert (steps[: peak - first - 1] > -1e-9).all()
        assert (steps[peak - first + 1 :] < 1e-9).all()
    np.testing.assert_allclose(course.acceleration[cuts[:-1]], minima[:-1], atol=1e-9)
    assert np.abs(velocity[cuts[1:-1]]).max() < 0.05
    assert np.abs(course.height[cuts[:-1]] - heights[:-1]).max() < 0.03


def test_a_flight_is_ballistic():
    course = heave(
        np.array([0, 42, 84]), -GRAVITY * np.array([0.5, 0.3, 0.5]), np.full(3, 0.93), np.array([0, 0.3, 0]), 60.0
    )
    air = slice(42 - 8, 42 + 9)
    np.testing.assert_allclose(course.acceleration[air], -GRAVITY)
    assert np.argmax(course.height) == pytest.approx(42, abs=1)


def test_the_same_seed_gives_the_same_stream_and_another_another(example):
    one = replace(SHORT, clips=1)
    again, other = make_synthetic(one, seed=3), make_synthetic(one, seed=4)
    count = len(again.stream)
    np.testing.assert_array_equal(again.stream.players[1].qpos, example.stream.players[1].qpos[:count])
    assert not np.array_equal(other.stream.players[1].qpos, again.stream.players[1].qpos)
    assert example.stream.players[0].source == SOURCE
    assert "synthetic" in SOURCE


def test_labels_are_drawn_from_the_policy():
    """Log-likelihood of the labels lies where the policy's own entropy says it should."""
    from simprep.duel.synthetic.schedule import draw_clip

    a, b = policies(SHORT)
    rng = np.random.default_rng(5)
    surplus, variance = 0.0, 0.0
    for _ in range(12):
        fighters = draw_clip(SHORT, (a, b), rng)
        columns = np.array([(p, x.start, x.end, x.code, 0) for p in range(2) for x in fighters[p].done]).T
        actions = link_actions(*columns)
        for player, policy in enumerate((a, b)):
            step = actions.transitions(player)
            own, theirs, then = (actions.label[rows] for rows in (step.current, step.opponent, step.next))
            chances = policy.distribution(own, theirs)
            logs = np.log(np.where(chances > 0, chances, 1.0))
            mean = (chances * logs).sum(axis=1)
            drawn = policy.log_prob(own, theirs, then)
            assert np.isfinite(drawn).all()
            surplus += (drawn - mean).sum()
            variance += ((chances * logs**2).sum(axis=1) - mean**2).sum()
    assert abs(surplus) < 4 * np.sqrt(variance)


def test_the_truth_fits_the_stream(example):
    stream, truth = example.stream, example.truth
    codes = decode(truth.codes)
    learned = codes[:, : len(LEARNED_ASPECTS)]
    cuts = truth.cuts()
    np.testing.assert_array_equal(cuts.table(), truth.table)
    contacts = (stream.players[0].contacts, stream.players[1].contacts)
    np.testing.assert_array_equal(react_rule(truth.table, learned), codes[:, ASPECTS.index("react")])
    np.testing.assert_array_equal(move_rule(truth.table, contacts, cuts.bounds), codes[:, ASPECTS.index("move")])
    answers = np.flatnonzero(truth.answers >= 0)
    assert len(answers) > 20
    other = truth.table[truth.answers[answers]]
    assert (other[:, 0] != truth.table[answers, 0]).all()
    assert ((other[:, 1] < truth.table[answers, 1]) & (truth.table[answers, 1] <= other[:, 2])).all()
    assert all(Label.from_code(int(code)).attacks for code in truth.codes[truth.answers[answers]])


def test_poses_are_possible(example):
    for motion in example.stream.players:
        low, high = motion.character.model.jnt_range[1:].T
        assert (motion.qpos[:, 7:] >= low - 1e-9).all()
        assert (motion.qpos[:, 7:] <= high + 1e-9).all()
        assert np.abs(np.diff(motion.qpos[: example.stream.seams[0], :3], axis=0)).max() * 60 < 4.0
    assert np.percentile(example.missed_m, 99) < 0.01


def test_supporting_feet_stand_still():
    from simprep.duel.synthetic.perform import perform
    from simprep.duel.synthetic.schedule import draw_clip

    a, b = policies(SHORT)
    rng = np.random.default_rng(2)
    fighter = draw_clip(replace(SHORT, clip_s=20.0), (a, b), rng)[0]
    done = perform(fighter, rng)
    points = forward_kinematics(done.qpos, humanoid()).foot_points
    travel = []
    for side in range(2):
        for first, after in stances(done.contacts[:, side]):
            # the point that is lowest throughout carries; the foot may roll and pivot about it
            part = points[first + 1 : after - 1, side]
            if len(part) < 4 or done.missed_m[first:after].max() > 0.005:
                continue
            travel.append(np.linalg.norm(np.ptp(part[..., :2], axis=0), axis=-1).min())
    assert len(travel) > 20
    assert np.percentile(travel, 90) < 0.01


def test_distances_and_times_are_plausible(example):
    summary = summarise_synthetic(example)
    assert 0.8 < summary["strike_distance_m"]["punch"]["50"] < 1.15
    assert 1.0 < summary["strike_distance_m"]["kick"]["50"] < 1.3
    assert 0.2 < summary["reaction_s"]["punch"]["50"] < 0.35
    assert 0.3 < summary["reaction_s"]["kick"]["50"] < 0.5
    assert all(8 < sum(rates) / 2 < 40 for rates in summary["attacks_per_min"].values())


def test_truth_is_read_back_and_belongs_to_its_stream(example, tmp_path):
    path = save_truth(example.truth, truth_path(tmp_path / "a.npz"))
    assert path.name == "a.truth.npz"
    again = read_truth(path, example.stream)
    np.testing.assert_array_equal(again.table, example.truth.table)
    np.testing.assert_array_equal(again.codes, example.truth.codes)
    assert again.variants == example.truth.variants
    assert 0 < again.fitting().sum() < (again.answers >= 0).sum()
    with pytest.raises(MotionFileError, match="not of 'other'"):
        read_truth(path, replace(example.stream, name="other"))
    with pytest.raises(MotionFileError, match="no such file"):
        read_truth(tmp_path / "none.npz")
    (tmp_path / "bad.npz").write_bytes(b"nothing")
    with pytest.raises(MotionFileError, match="not a readable truth"):
        read_truth(tmp_path / "bad.npz")


def test_settings_are_checked():
    with pytest.raises(SettingError, match="30 or 60"):
        replace(SHORT, fps=50.0)
    with pytest.raises(SettingError, match="5 to 90 s"):
        replace(SHORT, clip_s=90.0)
    with pytest.raises(SimprepError, match="kickboxing, taekwondo"):
        preset("sumo")
    assert isinstance(preset("taekwondo"), SyntheticSettings)


def test_matching_counts_every_cut_once():
    assert match_frames(np.array([10, 12, 50]), np.array([11, 40]), 3).tolist() in ([[0, 0]], [[1, 0]])
    bounds = np.array([[0, 100]])
    found = Cuts((np.array([20, 40]), np.array([30])), bounds)
    truth = Cuts((np.array([22, 60]), np.array([30])), bounds)
    f1, precision, recall, error = cut_scores(found, truth, 3)
    assert (f1, precision, recall, error) == pytest.approx((2 / 3, 2 / 3, 2 / 3, 1.0))
    matched = match_actions(found.table(), truth.table(), 3)
    assert matched.tolist() == [0, -1, -1, 3, 4]


def test_analysis_against_the_truth(example):
    settings = AnalysisSettings(0.3, evaluation=EvaluationSettings(splits=1, components=(2, 3), prior_counts=(10.0,)))
    found = analyse(example.stream, np.random.default_rng(0), truth=example.truth, settings=settings)
    tables = found.tables
    assert tables["cut_f1"] > 0.95
    assert tables["rules_on_true_cuts"]["react"] == tables["rules_on_true_cuts"]["move"] == 1.0
    for aspect in ("left_punch", "right_punch", "left_kick", "right_kick", "jump"):
        assert tables["label_accuracy"][aspect] > 0.93
    truth = tables["label_logprob"]["truth"]
    assert all(value < truth for kind, value in tables["label_logprob"].items() if kind != "truth")
    assert found.cuts.table().shape[0] == tables["segments"] == len(found.graph.actions)
    with pytest.raises(SettingError, match="no annotations"):
        analyse(example.stream, np.random.default_rng(0))


def test_annotation_as_proposed_keeps_to_its_share_and_to_what_is_cut_right(example):
    table = example.truth.table
    match = np.arange(len(table))
    match[::7] = -1
    features = np.random.default_rng(0).normal(size=(len(table), 540))
    found = annotate_as_proposed(example.truth, match, 0.2, features, example.stream.players[0].character)
    assert len(found.rows) == len(np.unique(found.rows)) == round(0.2 * len(table))
    assert (match[found.rows] >= 0).all()
    np.testing.assert_array_equal(found.qualifiers, example.truth.qualifiers[found.rows])


def test_cuts_are_not_found_by_chance(example):
    """Cuts shifted by half an action are no cuts: the score can fail."""
    cuts = segment_stream(example.stream).cuts
    shifted = Cuts(tuple(np.unique(np.clip(frames + 15, 1, 2398)) for frames in cuts.frames), cuts.bounds)
    keep = [np.setdiff1d(frames, cuts.bounds[:, 0]) for frames in shifted.frames]
    assert cut_scores(Cuts((keep[0], keep[1]), cuts.bounds), example.truth.cuts(), 3)[0] < 0.3
