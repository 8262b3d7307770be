"""The metrics of a fight as a whole: on the built-in stream against its truth, and on a fight made of it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.labels.labels import attacking, decode
from simprep.duel.stream.stream import DuelStream
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import PRESETS
from simprep.errors import SettingError
from simprep.humanoid_model import humanoid
from simprep.library.registry import library_motion
from simprep.metrics.contact import floor_penetration
from simprep.metrics.interaction.distributions import KINDS, distributions, js_distances, js_floor
from simprep.metrics.interaction.reactions import ANSWER_S, reactions
from simprep.metrics.interaction.stream import interaction_metrics
from simprep.motion.edit import move
from simprep.motion.motion import Motion
from simprep.physics.overlap import overlap_of_poses


@pytest.fixture(scope="module")
def example():
    return make_synthetic(replace(PRESETS["kickboxing"], clips=2, clip_s=30.0), seed=3)


def test_answers_are_those_of_the_truth(example):
    stream, truth = example.stream, example.truth
    found = reactions(truth.table, truth.codes, stream.bounds, stream.fps, 2)
    start, after = truth.table[:, 1], stream.bounds[truth.table[:, 3], 1]
    within, fitting = round(ANSWER_S * stream.fps), truth.fitting()
    expected = []
    for row in np.flatnonzero(attacking(decode(truth.codes))):
        if min(start[row] + within, truth.table[row, 2]) < after[row]:
            answering = (truth.answers == row) & fitting & (start - start[row] <= within)
            expected.append(answering.any())
    assert found.attacks == len(expected)
    assert found.answered_share == np.mean(expected)
    # the example reacts: clearly more often than by coincidence
    assert found.answered_share > found.chance_share + 0.08


def test_metrics_of_a_recording_and_of_the_same_as_a_fight(example):
    whole, truth = example.stream, example.truth
    inside = truth.table[:, 3] == 0
    stream = whole.part(0, int(whole.bounds[0, 1]))
    table, codes = truth.table[inside], truth.codes[inside]
    found = interaction_metrics(stream, table, codes, distributions(stream, table, codes), reference=whole)
    assert (found.g_mpjpe_mm, found.mpjpe_mm) == (0, 0)
    assert found.js == dict.fromkeys(KINDS, 0.0)
    a, b = stream.players
    depth = overlap_of_poses((a.qpos, b.qpos), (a.character, b.character))
    assert found.penetration.max_mm == pytest.approx(1e3 * depth.max())
    assert found.penetration.mean_mm == pytest.approx(1e3 * depth.mean())
    assert found.ground_penetration.max_mm == pytest.approx(1e3 * max(floor_penetration(m).max() for m in (a, b)))
    fight = Fight(stream, tuple(FightAction(int(p), int(s), int(e), int(c)) for (p, s, e, _), c in zip(table, codes)))
    again = interaction_metrics(fight.stream, fight.table, fight.codes)
    assert replace(again, js=found.js, g_mpjpe_mm=0.0, mpjpe_mm=0.0) == found
    # ... and survives JSON, where what does not exist is null
    content = json.loads(json.dumps(again.as_dict(), allow_nan=False))
    assert content["mpjpe_mm"] is None
    assert content["hits"]["intended"] == found.hits.intended > 0


def test_a_reference_elsewhere_and_one_that_does_not_fit(example):
    stream = example.stream.part(0, 30)
    table = np.array([(0, 0, 30, 0), (1, 0, 30, 0)])
    codes = example.truth.codes[:2]
    moved = [replace(m, qpos=m.qpos + np.array([0.03, 0.04, 0.0] + [0.0] * 41)) for m in stream.players]
    found = interaction_metrics(stream, table, codes, reference=DuelStream((moved[0], moved[1])))
    assert found.g_mpjpe_mm == pytest.approx(50)
    assert found.mpjpe_mm == pytest.approx(0, abs=1e-9)
    with pytest.raises(SettingError, match="reference of 20 frames"):
        interaction_metrics(stream, table, codes, reference=stream.part(0, 20))


def test_the_floor_is_what_samples_of_the_example_score(example):
    stream, table, codes = example.stream, example.truth.table, example.truth.codes
    floor, long = js_floor(stream, table, codes, 4.0), js_floor(stream, table, codes, 20.0)
    for name in KINDS:
        assert 0 < long[name] < floor[name] < 1  # the fewer are seen, the farther they are from the rest
    # fighters whose labels are dealt out anew keep their places and lose the order
    order = np.arange(len(codes))
    for player in (0, 1):
        own = np.flatnonzero(table[:, 0] == player)
        order[own] = np.random.default_rng(0).permutation(own)
    dealt = js_distances(distributions(stream, table, codes[order]), distributions(stream, table, codes))
    assert dealt["distance"] == dealt["facing"] == 0
    assert dealt["kind_bigram"] > 0.3


def test_the_head_faces_another_way_than_the_pelvis():
    stand = library_motion("stand")
    qpos = stand.qpos[:10].copy()
    qpos[:, 7 + humanoid().joint("neck_rotation")] += 0.3
    a = Motion(qpos, stand.fps, stand.contacts[:10])
    b = move(a, (1.0, 0.0), np.pi)
    table = np.array([(0, 0, 10, 0), (1, 0, 10, 0)])
    found = interaction_metrics(DuelStream((a, b)), table, np.zeros(2, dtype=np.int64))
    assert found.facing_error_deg.median < 3
    assert found.head_facing_error_deg.median == pytest.approx(np.degrees(0.3), abs=3)
