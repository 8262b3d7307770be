from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from simprep.controller.influence import Influence
from simprep.controller.runtime.approach import KEPT, NEAR_M, approach, near_obstacles
from simprep.controller.runtime.performer import RuntimeSettings
from simprep.controller.runtime.task import Task
from simprep.controller.runtime.world import library_world
from simprep.controller.spaces import REACH_M, Action
from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.preparation.blending import split_heading

PLAIN = RuntimeSettings(optimise=False)


@pytest.fixture(scope="module")
def world():
    return library_world(["punch_right", "duck", "jump"], PLAIN)


def one(goal, target="punch_right"):
    return Task(goal, target, (Influence(goal, {target: 1.0}),))


def test_it_gets_there_prepared_and_without_jumps(world):
    rng = np.random.default_rng(5)
    for _ in range(5):
        distance, bearing = rng.uniform(1.0, 3.0), rng.uniform(-np.pi, np.pi)
        goal = (distance * np.cos(bearing), distance * np.sin(bearing))
        result = approach(world, [one(goal)], frame=int(rng.integers(64)))
        assert result.reached
        assert result.alpha_at_influence > 0.9
        assert result.max_alpha_jump <= 0.25
        motion, at = result.motion, result.launches[0]
        assert motion.events["launch"] == at
        assert motion.events["impact"] > at
        assert np.linalg.norm(motion.qpos[at, :2] - goal) < REACH_M + 0.1
        assert np.linalg.norm(np.diff(motion.qpos[:, :2], axis=0), axis=1).max() < 0.035
        assert np.abs(np.diff(motion.qpos[: at + 20, 7:], axis=0)).max() < 0.35
        assert np.isnan(result.level[at:]).all()
        assert np.abs(np.diff(result.level[:at])).max() < 0.05  # the Gaussian filter


def test_whoever_turns_round_neither_jumps_nor_comes_back(world):
    """Goals all around and behind: more than half a turn by steps on the spot, then a prepared walk."""
    rng = np.random.default_rng(0)
    for _ in range(8):
        distance, bearing = rng.uniform(1.5, 5.0), rng.uniform(-np.pi, np.pi)
        result = approach(world, [one((distance * np.cos(bearing), distance * np.sin(bearing)))])
        motion, at = result.motion, result.launches[0]
        heading = np.unwrap(split_heading(motion.qpos[:at, 3:7])[0])
        assert np.abs(np.diff(heading)).max() < 0.1  # 6 rad/s at 60 frames/s
        assert np.abs(np.diff(motion.qpos[: at + 20, 7:], axis=0)).max() < 0.35
        travel = np.gradient(motion.qpos[:at, :2], axis=0)
        way = gaussian_filter1d(travel, 0.25 * motion.fps, axis=0)
        along = np.sum(travel * way, axis=1) / (np.linalg.norm(way, axis=1) + 1e-9)
        assert -np.minimum(along, 0.0).sum() < 0.03  # up to 0.11 m where walkers came back to their planted feet


def test_at_an_influence_on_the_way_the_level_stays_until_the_filter_has_settled(world):
    result = approach(world, [Task((4.0, 0.0), "punch_right", (Influence((3.0, 0.0), {"punch_right": 1.0}),))])
    assert result.reached
    assert any(action.forced for action in result.actions[:-1])
    assert result.alpha_at_influence > 0.9
    assert result.max_alpha_jump <= 0.25


def test_without_preparation_it_walks_on_and_launches(world):
    result = approach(replace(world, prepare=False), [one((2.0, 0.0))])
    assert result.reached
    assert result.alpha_at_influence == 0
    assert (result.level[: result.launches[0]] == 0).all()
    assert result.max_alpha_jump == 0
    assert result.time_s < approach(world, [one((2.0, 0.0))]).time_s


@dataclass
class Careless:
    """Walks straight on and never prepares."""

    def act(self, observation):
        return Action(0, 0.0)


def course(gap):
    first, second = (1.4, 0.0), (2.0 + gap, 0.0)
    places = ((first, "duck"), (second, "jump"))
    keep = near_obstacles((2.0, 0.0), second)
    return [
        Task(place, name, (Influence(place, {name: 1.0}),), keep if number else 0.0)
        for number, (place, name) in enumerate(places)
    ]


def between(result):
    """Level of preparation from where the first target is left to the launch of the second."""
    level = result.level[result.launches[0] : result.launches[1]]
    return level[np.isfinite(level)]


@pytest.mark.parametrize("careless", [False, True])
def test_the_style_is_kept_between_near_obstacles_and_released_between_far_ones(world, careless):
    used = replace(world, policy=Careless()) if careless else world
    near, far = (approach(used, course(gap)) for gap in (NEAR_M - 0.3, NEAR_M + 2.5))
    for result in (near, far):
        assert result.reached
        assert len(result.launches) == 2
        assert {"launch", "launch_2", "take_off"} <= set(result.motion.events)
        assert np.linalg.norm(np.diff(result.motion.qpos[:, :2], axis=0), axis=1).max() < 0.035
    assert between(near).min() >= 0.5
    assert between(far).min() < 0.3
    dropped = [replace(task, keep=0.0) for task in course(NEAR_M - 0.3)]
    if careless:  # the rule does it, not the policy
        assert between(approach(used, dropped)).min() < 0.3


def test_near_means_nearer_than_a_metre_and_a_half():
    assert near_obstacles((0, 0), (1.49, 0)) == KEPT >= 0.5
    assert near_obstacles((0, 0), (1.2, 1.2)) == 0.0


def test_of_two_sources_the_sooner_one_decides_the_style(world):
    sources = (Influence((2.0, 0.0), {"punch_right": 1.0}), Influence((6.0, 3.0), {"duck": 1.0}))
    result = approach(world, [Task((2.0, 0.0), "punch_right", sources)])
    weights = np.array([action.weights for action in result.actions])
    np.testing.assert_allclose(weights.sum(axis=1), 1.0)
    assert weights[-1, 0] > 0.99
    at = result.launches[0] - 1
    expected = world.style("punch_right").qpos[7 : 7 + 25]
    np.testing.assert_allclose(result.motion.qpos[at, 7 : 7 + 25], expected, atol=0.05)


def test_an_opponent_is_met_on_the_way_and_prepared_for(world):
    comes = Influence((3.2, 0.3), {"punch_right": 1.0}, velocity=(-0.7, 0.0), stops_s=4.0)
    result = approach(world, [Task((0.0, 0.0), "punch_right", (comes,), meet=True)])
    assert result.reached
    assert result.max_alpha_jump <= 0.25
    assert result.alpha_at_influence > 0.9
    met = comes.at(result.time_s)
    frame = round(result.time_s * result.motion.fps)
    assert np.linalg.norm(result.motion.qpos[frame, :2] - met) < REACH_M + 0.05
    with pytest.raises(SettingError, match="meet a source of influence without one"):
        Task((0.0, 0.0), "duck", meet=True)


def test_an_approach_can_be_repeated(world):
    a, b = (approach(world, [one((1.5, 0.5))]) for _ in range(2))
    np.testing.assert_array_equal(a.motion.qpos, b.motion.qpos)


def test_bad_input(world):
    with pytest.raises(SettingError, match="without a task"):
        approach(world, [])
    with pytest.raises(UnknownNameError, match="unknown motion of the graph 'crawl'"):
        approach(world, [one((1.0, 0.0), "crawl")])
    with pytest.raises(UnknownNameError, match="unknown target 'walk'; valid: punch_left"):
        library_world(["walk"])
    bare = replace(world, graph=replace(world.graph, transitions=()))
    with pytest.raises(MotionError, match=r"no transition from .* into punch_right"):
        approach(bare, [one((1.0, 0.0))])
    lost = replace(world, policy=Careless(), max_actions=3)
    result = approach(lost, [one((-5.0, 0.0))])
    assert not result.reached
    assert result.time_s is None
    assert result.alpha_at_influence is None
    assert result.launches == ()
