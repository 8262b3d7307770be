import numpy as np
import pytest

import experiment_two_opponents as module
from experiments.opponents import attacker, walk_at
from simprep.controller.influence import Influence
from simprep.errors import SettingError
from simprep.motion.edit import loop_displacement, yaw
from simprep.motion.kinematics import forward_kinematics


@pytest.mark.parametrize("speed", [0.5, 0.9])
def test_the_walk_has_the_speed_asked_for(speed):
    cycle = walk_at(speed)
    turn, step = loop_displacement(cycle)
    assert abs(turn) < 1e-6
    np.testing.assert_allclose(step, [speed * cycle.duration, 0], atol=2e-3)


@pytest.mark.parametrize("seed", [0, 1, 7])
def test_opponents_go_where_their_sources_of_influence_go_and_reach_there(seed):
    setting = module.draw(np.random.default_rng(seed), {})
    people = module.opponents(setting, 7.0)
    assert len(people) == 2
    for person, influence in zip(people, setting.tasks[0].influences):
        assert person.duration == pytest.approx(7.0, abs=1 / person.fps)
        direction = np.array(influence.velocity) / np.linalg.norm(influence.velocity)
        off = person.qpos[:, :2] - (influence.at(person.times) - module.STRIKE_M * direction)
        away = np.linalg.norm(off, axis=1)
        assert away.max() < 0.10  # where it stops within a step
        assert np.sqrt((away**2).mean()) < 0.04
        walking = person.times < influence.stops_s - 0.5
        assert np.abs((off[walking] @ direction).mean()) < 0.015
        facing = yaw(person.qpos[walking, 3:7]) - np.arctan2(direction[1], direction[0])
        assert np.abs(np.angle(np.exp(1j * facing))).max() < 0.2
        kinematics = forward_kinematics(person.qpos, person.character)
        # the blow comes where the source of influence stands
        impact = person.events["impact"]
        assert person.times[impact] > influence.stops_s
        reach = ((kinematics.xpos[impact, :, :2] - person.qpos[impact, :2]) @ direction).max()
        assert reach == pytest.approx(module.STRIKE_M, abs=0.15)
        # and feet on the floor stay there
        feet = kinematics.foot_points.mean(axis=2)
        held = person.contacts[1:] & person.contacts[:-1]
        slip = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1) * person.fps
        assert np.median(slip[held]) < 0.02
        assert feet[..., 2].min() > -0.01


def test_an_opponent_needs_a_way_and_a_walking_speed():
    with pytest.raises(SettingError, match="a time at which it stops"):
        attacker(Influence((2.0, 0.0), {"punch_left": 1.0}), 0.6, "jab_left_head", 3.0)
    with pytest.raises(SettingError, match="walking at 3 m/s; valid: 0"):
        attacker(Influence((2.0, 0.0), {"punch_left": 1.0}, (-3.0, 0.0), 1.0), 0.6, "jab_left_head", 3.0)
