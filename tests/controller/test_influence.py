import numpy as np
import pytest

from simprep.controller.influence import (
    LEAST_SPEED,
    Influence,
    contact_weights,
    expected_posture,
    mixed_style,
    style_from_vectors,
    style_of,
    style_vector,
    time_to_contact,
)
from simprep.errors import SettingError
from simprep.library import library_motion
from simprep.preparation.synthesis import Locomotion, synthesise

RNG = np.random.default_rng(3)


def test_time_to_contact_of_simple_cases():
    offset = np.array([[2.4, 0.0], [0.0, 2.4], [2.4, 0.0], [0.1, 0.0]])
    closing = np.array([[1.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [1.0, 0.0]])
    ahead, beside, behind, here = time_to_contact(offset, closing, 0.4)
    assert ahead == pytest.approx(2.0)  # 2 m at 1 m/s
    assert beside == behind == pytest.approx(2.0 / LEAST_SPEED)
    assert here < 0.1


def test_contact_weights_favour_the_soonest():
    np.testing.assert_allclose(contact_weights([1.0, 1.0]), 0.5)
    np.testing.assert_allclose(contact_weights([1.0, 2.0]), [0.8, 0.2])  # inverse squares
    np.testing.assert_allclose(contact_weights([3.0, 1.0, 2.0], power=0.0), 1 / 3)
    assert contact_weights([0.05, 5.0])[0] > 0.999
    weights = [contact_weights([time, 2.0])[0] for time in (4.0, 2.0, 1.0, 0.5)]
    assert np.all(np.diff(weights) > 0)


def cost(q, postures, weights, power):
    return weights @ np.abs(q - postures) ** power


@pytest.mark.parametrize("power", [1.0, 1.3, 2.0, 4.0])
def test_the_prepared_posture_has_the_least_expected_distance(power):
    postures = RNG.normal(size=(5, 4))
    weights = RNG.dirichlet(np.ones(5))
    best = expected_posture(postures, weights, power)
    grid = np.linspace(postures.min(), postures.max(), 4001)
    for joint in range(4):
        costs = [cost(q, postures[:, joint], weights, power) for q in grid]
        assert cost(best[joint], postures[:, joint], weights, power) <= min(costs) + 1e-7


def test_mean_median_and_certainty():
    postures = np.array([[0.0], [1.0], [10.0]])
    assert expected_posture(postures, [1, 1, 1], 2.0) == pytest.approx(11 / 3)
    assert expected_posture(postures, [1, 1, 1], 1.0) == pytest.approx(1.0)
    assert expected_posture(postures[:2], [0.5, 0.5], 1.0) == pytest.approx(0.5)  # any value between is as good
    assert expected_posture(postures, [0.2, 0.6, 0.2], 1.0) == pytest.approx(1.0)
    for power in (1.0, 1.5, 2.0, 3.0):
        np.testing.assert_allclose(expected_posture(postures, [0, 0, 1], power), 10.0, atol=1e-9)
    with pytest.raises(SettingError, match=r"power 0\.5 of the expected distance; valid: 1 or more"):
        expected_posture(postures, [1, 1, 1], 0.5)


def test_styles_mix_and_survive_the_way_through_numbers():
    punch, crawl = (style_of(library_motion(name)) for name in ("punch_right", "crawl"))
    back = style_from_vectors(style_vector(punch))
    np.testing.assert_allclose(back.qpos[7:], punch.qpos[7:])
    np.testing.assert_allclose(style_vector(back), style_vector(punch), atol=1e-12)
    half = mixed_style([punch, crawl], [1.0, 1.0])
    np.testing.assert_allclose(half.qpos[7:], (punch.qpos[7:] + crawl.qpos[7:]) / 2)
    np.testing.assert_allclose(style_vector(mixed_style([punch, crawl], [1, 0]))[:-4], style_vector(punch)[:-4])
    likelier = mixed_style([punch, crawl], [0.7, 0.3], power=1.0)
    np.testing.assert_allclose(likelier.qpos[7:], punch.qpos[7:])


def test_a_target_that_may_not_come_draws_every_joint_by_its_probability():
    walk, style = library_motion("walk"), style_of(library_motion("punch_right"))
    source = Locomotion(walk.qpos, walk.contacts, np.zeros(len(walk)), walk.fps, walk.character)
    upper = slice(7, 7 + 25)  # the legs also obey the planted feet
    made = synthesise(source, style, np.ones(len(walk)), optimise=False, share=0.3).qpos[:, upper]
    # least expected squared distance to the locomotion (0.7) and to the reference posture (0.3)
    np.testing.assert_allclose(made, 0.7 * walk.qpos[:, upper] + 0.3 * style.qpos[upper], atol=1e-12)


def test_moving_sources_stop():
    source = Influence((1.0, 0.0), {"duck": 0.6, "jump": 0.4}, velocity=(-0.5, 0.2), stops_s=2.0)
    np.testing.assert_allclose(source.at(np.array([0.0, 1.0, 9.0])), [[1, 0], [0.5, 0.2], [0, 0.4]])
    assert source.probability == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("targets", "message"),
    [
        ({}, "has no target motion"),
        ({"duck": 0.0}, "probability 0 of duck; valid: above 0, at most 1"),
        ({"duck": 0.7, "jump": 0.6}, "add up to 1.3; valid: at most 1 for one source"),
    ],
)
def test_impossible_sources_are_refused(targets, message):
    with pytest.raises(SettingError, match=message):
        Influence((1.0, 0.0), targets)
