"""Quantised model, value iteration and SARSA: against brute force, against each other, and the bars of the controller."""

import subprocess
import sys
from dataclasses import replace
from time import process_time

import numpy as np
import pytest

from simprep.controller.assess import assess, random_approaches
from simprep.controller.best import measure
from simprep.controller.model import ENTERED, REACHED, build_model, choices, influence_outcomes
from simprep.controller.policy import Policy, read_policy, save_policy
from simprep.controller.rollout import Starts, greedy, roll_out
from simprep.controller.runtime.approach import near_obstacles
from simprep.controller.sarsa import greedy_actions, learn, new_learner
from simprep.controller.settings import ControllerSettings, LearningSettings, RewardSettings
from simprep.controller.spaces import AT_INFLUENCE, STATES
from simprep.controller.training import read_training, resume, run, save_training, start
from simprep.controller.value_iteration import (
    STATE_SHAPE,
    arrival_probability,
    backup,
    best_actions,
    by_action,
    policy_values,
    reachable,
    value_iteration,
)
from simprep.errors import MotionFileError, SettingError

SETTINGS = ControllerSettings()


@pytest.fixture(scope="module")
def table():
    return measure(SETTINGS)


@pytest.fixture(scope="module")
def model(table):
    return build_model(table, SETTINGS)


@pytest.fixture(scope="module")
def exact(model):
    return backup(model)


@pytest.fixture(scope="module")
def best(exact):
    return value_iteration(exact)


@pytest.fixture(scope="module")
def trained(table):
    run(start(table, SETTINGS, LearningSettings(steps=100)))  # compiles
    training = start(table, SETTINGS, LearningSettings())
    begin = process_time()
    policy = run(training)
    return policy, training, process_time() - begin


@pytest.fixture(scope="module")
def trained_with_another_seed(model, table):
    learning = LearningSettings(seed=1)
    learner = new_learner(model, learning)
    learn(learner, model, learning, learning.steps)
    return Policy(greedy_actions(learner, model), table, SETTINGS, {})


def sampled_return(model, policy, state, count, rng):
    """Mean and standard error of the return from a state, by playing the model's outcomes."""
    level, node, goal, influence = (np.full(count, part) for part in state)
    total, weight, active = np.zeros(count), 1.0, np.ones(count, bool)
    for _ in range(160):
        action = policy[level, node, goal, influence].astype(int)
        following, after = action // 6, action % 6
        pick = rng.integers(model.goal_next.shape[4], size=count)
        other = rng.integers(model.influence_next.shape[4], size=count)
        first, number = model.shared[goal, influence].T
        together = number > 0
        pick = np.where(together, first + (rng.random(count) * np.maximum(number, 1)).astype(int), pick)
        move = (following, level, after)
        next_goal = model.goal_next[(*move, goal, pick)].astype(int)
        apart = model.influence_next[(*move, influence, other)].astype(int)
        near = np.where(together, model.shared_next[(*move, goal, pick)].astype(int), apart)
        next_level = np.where(near >= ENTERED, AT_INFLUENCE, after)
        change = 0.2 * np.abs(next_level - level)
        reward = model.goal_reward[(*move, goal, pick)] + 0.6 * (1 - change**2)
        total += np.where(active, weight * reward, 0)
        weight *= model.rewards.discount
        ends = next_goal == REACHED
        total += np.where(active & ends, weight * model.rewards.arrival_value, 0)
        active &= ~ends
        level, node, influence = next_level, following, near % ENTERED
        goal = np.where(ends, 0, next_goal)
    return total.mean(), total.std() / np.sqrt(count)


def test_probabilities_add_up(exact):
    np.testing.assert_allclose(exact.goal.sum(axis=2) + exact.reached, 1, atol=1e-12)
    np.testing.assert_allclose((exact.influence + exact.entered).sum(axis=2), 1, atol=1e-12)
    np.testing.assert_allclose(np.asarray(exact.together.sum(axis=1)).ravel(), 1, atol=1e-12)
    assert exact.reward.min() >= 0
    assert exact.reward.max() <= 1  # the range of Eq. 17


def test_best_policy_earns_what_value_iteration_promises_and_no_single_change_earns_more(exact, best):
    values, policy = best
    np.testing.assert_allclose(policy_values(exact, policy), values, atol=1e-7)
    one_step = by_action(exact, exact.reward + exact.action_values(values, exact.discount, exact.arrival))
    assert (one_step.max(axis=-1) - values)[:, :, 8:].max() < 1e-7


def test_exact_return_agrees_with_playing(model, exact, best):
    rng = np.random.default_rng(3)
    values = policy_values(exact, best[1])
    for state in [(0, 0, 32, 16), (5, 3, 24, 18), (2, 1, 17, 8), (4, 0, 8, 4), (0, 3, 36, 6)]:
        mean, error = sampled_return(model, best[1], state, 4000, rng)
        assert abs(mean - values[state]) < 5 * error + 1e-6


def test_actions_near_the_influence_keep_the_forced_change_to_one_level(table, model):
    may = choices(model).reshape(6, 4, 20, 4, 6)
    for before, _, cell, node, after in np.argwhere(may):
        outcomes = model.influence_next[node, before, after, cell]
        if (outcomes >= ENTERED).any():
            assert min(before, after) >= AT_INFLUENCE - 1
    # 64 000 places between the samples, straight ahead of a walk at level 0.4 -> 0.6: reached somewhere, so forbidden there
    walk = table.path[0, 2, 3]
    grid = np.stack(np.meshgrid(np.linspace(0.4, 1.2, 320), np.linspace(-0.4, 0.4, 200)), axis=-1).reshape(1, -1, 2)
    cell, _ = influence_outcomes(grid, walk)
    assert (cell >= ENTERED).any()
    assert not model.allowed[0, 2, 3, 4]


def test_with_the_papers_discount_the_best_policy_stays_away_from_the_goal(table, exact, best):
    assert reachable(exact).all()
    assert arrival_probability(exact, best[1]).min() > 1 - 1e-6
    short = backup(build_model(table, replace(SETTINGS, rewards=RewardSettings(discount=0.3))))
    arrives = arrival_probability(short, value_iteration(short)[1])[:, :, 8:] > 0.99
    assert arrives.mean() < 0.5
    ending = backup(build_model(table, replace(SETTINGS, rewards=RewardSettings(arrival=0.0))))
    assert (arrival_probability(ending, value_iteration(ending)[1])[:, :, 8:] > 0.99).mean() < 0.05


def test_sarsa_reaches_its_bars(trained):
    policy, training, cpu_s = trained
    result = assess(policy)
    assert training.learner.steps >= 20_000_000
    assert cpu_s < 60
    assert result.states == STATES == 19_200
    assert result.optimal_share >= 0.97
    assert result.optimal_share_moving >= 0.97
    assert result.reachable_share == 1
    assert result.unreached == 0
    returns = np.array([point.mean_return for point in training.curve])
    assert (np.diff(returns) > -0.002 * result.best_return).all()  # monotone up to noise
    assert returns[-1] > returns[0] + 0.5


def test_reaching_the_goal_does_not_depend_on_the_seed(trained_with_another_seed):
    result = assess(trained_with_another_seed)
    assert result.optimal_share >= 0.97
    assert result.unreached == 0


def test_upper_confidence_starts_try_everything_first_and_then_what_may_be_best(model):
    for settings in (
        LearningSettings(confidence=0.0, explore=0.0, longest=1),
        LearningSettings(confidence=1e6, longest=1),
    ):
        learner = new_learner(model, settings)
        learn(learner, model, settings, 1_500_000)
        may = np.broadcast_to(choices(model)[:, :, None], learner.updates.shape)[:, :, 8:]
        tried = learner.updates[:, :, 8:]
        assert (tried[may] > 0).mean() > 0.999
        assert (tried[~may] == 0).all()
        spread = tried.max(axis=-1) - np.where(may, tried, np.iinfo(np.uint32).max).min(axis=-1)
        if settings.confidence:
            assert spread.max() <= 1  # all actions of a state equally often
        else:
            assert (spread > 1).mean() > 0.99  # the best known ones again and again


def test_a_policy_reaches_nothing_from_a_closed_set_of_states(exact, best):
    policy = best[1].copy()
    assert reachable(exact, policy).all()
    policy[0, 3, 32, 16] = 18  # stands at alpha 0, for ever
    assert np.argwhere(~reachable(exact, policy)).tolist() == [[0, 3, 32, 16]]
    assert arrival_probability(exact, policy)[0, 3, 32, 16] == 0


def test_style_is_kept_between_near_obstacles_and_released_between_far_ones(trained, trained_with_another_seed):
    distance, angle, node = (
        part.ravel() for part in np.meshgrid(np.arange(0.45, 1.5, 0.05), np.linspace(0, np.pi, 5), np.arange(4))
    )
    near = np.column_stack([distance * np.cos(angle), distance * np.sin(angle)])
    least = np.array([near_obstacles((0, 0), place) / 0.2 for place in near]).round().astype(int)
    far = np.array([[4.0, 0.0], [0.0, 4.0], [-4.0, 0.0]])
    for policy in (trained[0], trained_with_another_seed):
        starts = Starts(near, near, np.full(len(near), AT_INFLUENCE), node)
        outcome = roll_out(policy.table, greedy(policy), starts, SETTINGS.smoothing, least=least)
        assert outcome.reached.all()
        assert outcome.level_range[:, 0].min() >= 0.5
        assert outcome.largest_jump.max() <= 0.25
        starts = Starts(far, far, np.full(3, AT_INFLUENCE), np.full(3, 3))
        outcome = roll_out(policy.table, greedy(policy), starts, SETTINGS.smoothing)
        assert outcome.reached.all()
        assert outcome.level_range[:, 0].max() <= 0.25


def test_prepared_at_the_influence_without_jumps_on_the_continuous_floor(trained):
    numbers = random_approaches(trained[0], 1000, np.random.default_rng(1))
    assert numbers["reached_share"] == 1
    assert numbers["met_influence"] > 300
    assert numbers["alpha_at_influence_min"] >= 0.9
    assert numbers["alpha_on_crossing_min"] >= 0.75
    assert numbers["max_alpha_jump"] <= 0.25


def test_resumed_training_is_bit_by_bit_the_uninterrupted_one(table, tmp_path):
    learning = LearningSettings(steps=250_000, seed=5)
    whole = start(table, SETTINGS, learning)
    policy = run(whole)
    part = start(table, SETTINGS, replace(learning, steps=70_000))
    run(part)
    save_training(part, tmp_path / "training.npz")
    again = resume(tmp_path / "training.npz", table, SETTINGS, replace(learning, steps=250_000))
    resumed = run(again)
    for name in ("values", "updates", "untried", "now", "random"):
        assert getattr(again.learner, name).tobytes() == getattr(whole.learner, name).tobytes()
    assert (resumed.actions == policy.actions).all()
    assert again.curve[-1].mean_return == pytest.approx(whole.curve[-1].mean_return, abs=1e-3)
    with pytest.raises(SettingError, match="another controller"):
        resume(tmp_path / "training.npz", table, SETTINGS, replace(learning, seed=6))
    other = start(table, SETTINGS, replace(learning, seed=6))
    run(other)
    assert (other.learner.values != whole.learner.values).any()


def test_stop_rule_ends_training_before_its_steps(table):
    training = start(table, SETTINGS, LearningSettings(steps=9_000_000, stop_share=0.95))
    run(training)
    assert training.settled()
    assert 2_000_000 <= training.learner.steps < 9_000_000
    assert training.curve[-1].updated_share < 0.95 <= training.curve[-2].updated_share


def test_saved_policy_comes_back(table, best, tmp_path):
    policy = Policy(best[1], table, SETTINGS, {"method": "value iteration"})
    back = read_policy(save_policy(policy, tmp_path / "policy"))
    assert (back.actions == policy.actions).all()
    assert back.settings == SETTINGS
    assert back.table.path.tobytes() == table.path.tobytes()
    (tmp_path / "bad.npz").write_bytes(b"no zip")
    for read in (read_policy, read_training):
        with pytest.raises(MotionFileError, match=r"bad\.npz: not a readable"):
            read(tmp_path / "bad.npz")
        with pytest.raises(MotionFileError, match="no such file"):
            read(tmp_path / "absent.npz")
    with pytest.raises(MotionFileError, match=r"schema 'simprep\.policy/1'"):
        read_training(tmp_path / "policy.npz")


def test_greedy_choice_skips_what_is_not_allowed():
    values = np.full((*STATE_SHAPE, 24), -np.inf)
    values[..., 7] = -1e9
    assert (best_actions(values) == 7).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"steps": 0}, "steps 0"),
        ({"rate": 1.5}, "rate 1.5"),
        ({"explore": -0.1}, "explore"),
        ({"seed": -1}, "seed"),
        ({"confidence": -1.0}, "confidence"),
    ],
)
def test_impossible_learning_settings(change, message):
    with pytest.raises(SettingError, match=message):
        LearningSettings(**change)


def test_without_numba_a_message_says_what_to_install():
    code = (
        "import sys; sys.modules['numba'] = None\n"
        "from simprep.controller.sarsa import compiled\nfrom simprep.errors import MissingExtraError\n"
        "try:\n    compiled()\nexcept MissingExtraError as error:\n    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "pip install 'simprep[learn]'" in done.stdout
