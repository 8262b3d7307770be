"""The paper's tables, on a bout whose policy is known."""

import json

import numpy as np
import pytest
from synthetic_bout import bout

from simprep.duel.model.action_features import action_features, fit_pose_basis
from simprep.duel.model.evaluation import EvaluationSettings, evaluate, split_transitions
from simprep.duel.model.semi_tied import DiagonalCovariance
from simprep.errors import SettingError

SETTINGS = EvaluationSettings(splits=1, components=(2, 3, 6), prior_counts=(10.0, 1.0))


@pytest.fixture(scope="module")
def made():
    return bout(np.random.default_rng(21), 6, clips=3)


@pytest.fixture(scope="module")
def tables(made):
    return evaluate(made.graph, made.tracks, np.random.default_rng(5), SETTINGS, truth=(made.truth, made.truth))


def test_tables_are_json_and_repeat_from_the_seed(made, tables):
    assert json.loads(json.dumps(tables)) == tables
    quick = EvaluationSettings(splits=1, components=(), prior_counts=(10.0,))
    once, again, other = (evaluate(made.graph, made.tracks, np.random.default_rng(seed), quick) for seed in (5, 5, 6))
    assert once == again != other
    assert once["density_logprob"]["full"] == tables["density_logprob_splits"]["full"][0]


def test_no_model_beats_the_truth_and_training_data_look_better(tables):
    for kind in ("eq7", "eq8", "eq9", "log_linear"):
        assert tables["label_logprob"]["truth"] > tables["label_logprob"][kind]
        assert 0 < tables["label_total_variation"][kind] < 1
    for kind in ("semi_tied", "full", "diagonal"):
        assert tables["density_logprob_train"][kind] > tables["density_logprob"][kind]
    gaps = {
        kind: tables["density_logprob_train"][kind] - tables["density_logprob"][kind] for kind in ("full", "diagonal")
    }
    assert gaps["full"] > gaps["diagonal"]


def test_a_cell_agrees_with_its_definition(made, tables):
    rng = np.random.default_rng(5)
    features = action_features(made.tracks, made.actions, fit_pose_basis(made.tracks.joints))
    density = []
    for player in (0, 1):
        step = made.actions.transitions(player)
        train, held_out = split_transitions(len(step), rng)
        samples, label = features.samples(step), made.actions.label[step.next]
        model = DiagonalCovariance(10.0).fit(samples[train], label[train])
        density.append(model.log_density(samples[held_out], label[held_out]))
    assert tables["density_logprob_splits"]["diagonal"][0] == pytest.approx(np.concatenate(density).mean())


def test_components_beyond_those_that_differ_between_actions_say_nothing_more(tables):
    """The bout's poses hold three components that depend on the action; further ones are noise."""
    curve = {point["components"]: point for point in tables["components_curve"]}
    assert curve[3]["explained"] > 0.95
    assert curve[3]["held_out_gain"] > curve[6]["held_out_gain"]
    assert curve[6]["train_gain"] > curve[3]["train_gain"] > curve[2]["train_gain"]


def test_splits_are_two_to_one_and_do_not_overlap():
    train, held_out = split_transitions(1441, np.random.default_rng(0))
    assert (len(train), len(held_out)) == (961, 480)
    assert np.array_equal(np.sort(np.concatenate([train, held_out])), np.arange(1441))
    with pytest.raises(SettingError, match="2 transitions cannot be split"):
        split_transitions(2, np.random.default_rng(0))
