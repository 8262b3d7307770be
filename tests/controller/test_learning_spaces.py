"""States, alpha filter, measured displacement, and the train command."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from simprep.cli.main import main
from simprep.controller.alpha_filter import filter_kernel, smooth_alpha
from simprep.controller.best import measure
from simprep.controller.cores import core_motion, core_motions
from simprep.controller.displacement import integrate, level_schedule
from simprep.controller.model import goal_terms
from simprep.controller.settings import ControllerSettings, RewardSettings
from simprep.controller.spaces import (
    STATES,
    alpha_level,
    cell_samples,
    decode,
    encode,
    goal_cell,
    influence_cell,
    observe,
    polar,
    state_index,
)
from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.library import library_motion
from simprep.motion.edit import loop_displacement
from simprep.preparation.settings import PreparationSettings

SETTINGS = ControllerSettings()


@pytest.fixture(scope="module")
def table():
    return measure(SETTINGS)


def test_states_number_19200_and_decode_inverts():
    states = np.arange(STATES)
    assert STATES == 19_200
    assert (state_index(*decode(states)) == states).all()


def test_samples_lie_in_their_cells():
    for sectors, cell in ((8, goal_cell), (4, influence_cell)):
        points = cell_samples(sectors, 4, 6)
        assert (cell(*polar(points)) == np.arange(5 * sectors)[:, None]).all()


def test_observation_is_relative_to_heading_and_quantised():
    seen = observe((1.0, 2.0), np.pi / 2, (1.0, 3.0), (2.5, 2.0), 0.61, 2)
    assert (seen.goal_distance, seen.goal_angle) == pytest.approx((1.0, 0.0))
    assert (seen.influence_distance, seen.influence_angle) == pytest.approx((1.5, -np.pi / 2))
    assert encode(seen) == (3, 2, 2 * 8, 3 * 4 + 3)
    nothing = observe((0, 0), 0.0, (9.0, 0.1), None, 0.0, 0)
    far = observe((0, 0), 0.0, (9.0, 0.1), (2.7, 0.0), 0.0, 0)
    assert encode(nothing) == encode(far) == (0, 0, 32, 18)
    assert alpha_level([0.0, 0.29, 0.31, 1.0]).tolist() == [0, 1, 2, 5]


def test_alpha_filter_is_causal_smooth_and_settles_within_an_action():
    kernel = filter_kernel(SETTINGS.smoothing, 60)
    assert kernel.sum() == pytest.approx(1)
    assert len(kernel) <= round(SETTINGS.action_s * 60)
    commands = np.repeat([0.0, 0.2, 0.4, 1.0], 32)
    smooth = smooth_alpha(commands, kernel)
    np.testing.assert_allclose(smooth[31::32], [0.0, 0.2, 0.4, 1.0], atol=1e-12)
    changed = commands.copy()
    changed[70:] = 0.0
    np.testing.assert_array_equal(smooth_alpha(changed, kernel)[:70], smooth[:70])
    assert np.abs(np.diff(smooth)).max() < 0.6 * kernel.max() + 1e-12
    assert (np.diff(smooth) >= -1e-12).all()


def test_level_schedule_passes_every_small_change_once():
    schedule = level_schedule()
    changes = list(pairwise(schedule))
    assert sorted(changes) == sorted((a, b) for a in range(6) for b in range(6) if abs(a - b) <= 1)


def test_integrated_steps_close_a_circle():
    steps = np.tile([0.01, 0.0, 2 * np.pi / 100], (100, 1))
    path = integrate(steps)
    np.testing.assert_allclose(path[-1], [0, 0, 2 * np.pi], atol=1e-12)


def test_displacement_is_that_of_the_synthesised_motion(table):
    for number, core in enumerate(core_motions(SETTINGS)):
        turn, step = loop_displacement(core)
        share = table.frames / len(core)
        assert table.path[number, 0, 0, -1, 2] == pytest.approx(share * turn, abs=0.02)
        if core.name == "walk":
            assert table.path[number, 0, 0, -1, 0] == pytest.approx(share * step[0], abs=0.01)
    travelled = np.linalg.norm(table.path[0, range(6), range(6), -1, :2], axis=-1)
    np.testing.assert_allclose(travelled, travelled[0] * (1 - 0.2 * np.arange(6)), atol=0.003)
    assert np.abs(table.path[:, 5, 5]).max() < 1e-6  # fully prepared, it stands still
    rising = table.path[0, 2, 3, -1, 0]
    assert travelled[3] < rising < travelled[2]


def test_displacement_depends_on_the_roots_curve_and_not_on_the_target(table):
    other = measure(SETTINGS, library_motion("crawl"))
    np.testing.assert_allclose(other.path, table.path, atol=1e-6)
    curved = measure(replace(SETTINGS, preparation=PreparationSettings(curvature_lower=0.5)))
    assert curved.path[0, 2, 2, -1, 0] < 0.5 * table.path[0, 2, 2, -1, 0]


def test_step_round_nodes_turn_nearly_on_the_spot_and_mirror_each_other():
    left, right = core_motion("step_round_left"), core_motion("step_round_right")
    assert loop_displacement(left)[0] == pytest.approx(-loop_displacement(right)[0])
    assert np.linalg.norm(loop_displacement(left)[1]) < 0.2


def test_reward_prefers_many_small_changes():
    rewards = RewardSettings()
    cost = 0.2**rewards.power
    assert 5 * cost < 1.0**rewards.power
    facing_and_near = goal_terms(np.array(1.5), np.array(0.5), np.array(0.0), rewards)
    assert facing_and_near == pytest.approx(0.1 + 0.3)
    assert goal_terms(np.array(0.5), np.array(1.5), np.array(np.pi), rewards) == pytest.approx(0.0)


def test_impossible_controllers():
    with pytest.raises(SettingError, match="4 different motions"):
        ControllerSettings(cores=("walk", "walk", "stand", "crawl"))
    with pytest.raises(SettingError, match="sixth of action_s"):
        ControllerSettings(smoothing=0.2)
    with pytest.raises(SettingError, match="discount 1"):
        RewardSettings(discount=1.0)
    with pytest.raises(UnknownNameError, match="step_round_left"):
        core_motion("fly")
    with pytest.raises(MotionError, match="not a loop"):
        core_motion("jump")


def test_train_command(tmp_path, capsys):
    assert main(["train", "--help"]) == 0
    assert "Example: simprep train" in capsys.readouterr().out.replace("\n", " ")
    out = tmp_path / "controller"
    assert main(["train", "--steps", "60000", "--starts", "20", "-o", str(out), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert {"steps", "wall_s", "states", "mean_return", "optimal_share"} <= set(result)
    assert (result["steps"], result["states"]) == (60_000, 19_200)
    assert 0 < result["optimal_share"] <= 1
    for name in ("policy.npz", "training.npz", "metrics.json", "learning_curve.png"):
        assert (out / name).stat().st_size > 0
    assert main(["train", "--steps", "90000", "--starts", "20", "--resume", "-o", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["steps"] == 90_000
    assert main(["train", "--resume", "--seed", "3", "-o", str(out)]) == 2
    assert "another controller" in capsys.readouterr().err
