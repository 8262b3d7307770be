"""Fights of more than two: against the definitions, against the pair among them, and simulated end to end."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from duel_cases import three_boxers

from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.fight.posture import optimise_fight_posture
from simprep.duel.labels.labels import Label, attacking, decode, neutral
from simprep.errors import MotionError
from simprep.metrics.interaction.distributions import distributions
from simprep.metrics.interaction.evaluate import evaluate_fight
from simprep.metrics.interaction.reactions import ANSWER_S, reactions
from simprep.metrics.interaction.run import run_metrics, simulated_stream
from simprep.metrics.interaction.stitches import stitches
from simprep.metrics.interaction.stream import facings, interaction_metrics
from simprep.physics.simulate import simulate

NEUTRAL = Label(move="F-F").code
PUNCH = Label(move="F-F", left_punch="fwdbwd").code
BACK = Label(move="F-F", left_punch="bwd").code
PLAN = ([(0, NEUTRAL), (6, PUNCH)], [(0, NEUTRAL), (9, PUNCH), (38, BACK)], [(0, NEUTRAL)])
"""First frame and label of the actions of A, B and C."""


def fight_of(stream, plan=PLAN):
    actions = [
        FightAction(player, start, end, code)
        for player, own in enumerate(plan[: len(stream.players)])
        for (start, code), (end, _) in pairwise([*own, (len(stream), 0)])
    ]
    return Fight(stream, tuple(actions))


def measured(fight, **more):
    return interaction_metrics(fight.stream, fight.table, fight.codes, **more)


@pytest.mark.parametrize("players", [2, 3, 4])
def test_answers_are_those_of_the_definition(players):
    rng, fps, bounds = np.random.default_rng(players), 20.0, np.array([[0, 400], [400, 900]])
    table, codes = [], []
    for player in range(players):
        for clip, (first, after) in enumerate(bounds):
            starts = [first, *np.unique(rng.integers(first + 1, after, 40)), after]
            table += [(player, a, b, clip) for a, b in pairwise(starts)]
    codes = rng.choice([NEUTRAL, PUNCH, BACK], len(table))
    table = np.array(table)
    attack = attacking(decode(codes))
    fitting = attack | neutral(decode(codes))
    answers, delays = [], []
    for player, start, end, clip in table[attack]:
        last = min(start + round(ANSWER_S * fps), end)
        if last < bounds[clip, 1]:
            began = [
                table[fitting & (table[:, 0] == other) & (table[:, 3] == clip), 1] if other != player else np.empty(0)
                for other in range(players)
            ]
            began = [one[(one > max(start, bounds[clip, 0])) & (one <= last)] for one in began]
            answers.append([np.nan if other == player else len(one) > 0 for other, one in enumerate(began)])
            delays += [min(np.concatenate(began)) - start] if any(len(one) for one in began) else []
    found = reactions(table, codes, bounds, fps, players)
    assert found.attacks == len(answers)
    assert found.answered_share == np.mean(np.nanmax(answers, axis=1))
    np.testing.assert_allclose(found.answered_by, np.nanmean(answers, axis=0))
    assert found.delay_s == pytest.approx(np.median(delays) / fps)
    assert len(found.attacks_per_min) == players
    assert sum(found.attacks_per_min) == pytest.approx(attack.sum() / (898 / fps / 60))


def test_two_of_three_are_measured_as_the_pair_that_they_are():
    three = fight_of(three_boxers(third=(-5.0, 3.0)))
    pair = fight_of(replace(three.stream, players=three.stream.players[:2]))
    found, alone = measured(three, reference=three.stream), measured(pair, reference=pair.stream)
    assert alone.hits.intended == 2
    assert alone.penetration.max_mm > 0
    # who stands far away and begins nothing changes neither what touches nor what is answered
    for name in ("duration_s", "penetration", "hits", "strike_miss_mm", "g_mpjpe_mm"):
        assert getattr(found, name) == getattr(alone, name), name
    for name in ("attacks", "answered_share", "chance_share", "delay_s"):
        np.testing.assert_equal(getattr(found.reactions, name), getattr(alone.reactions, name))
    np.testing.assert_equal(found.reactions.attacks_per_min, (*alone.reactions.attacks_per_min, 0.0))
    np.testing.assert_equal(found.reactions.answered_by, (*alone.reactions.answered_by, 0.0))
    for one, two in zip(facings(three.stream), facings(pair.stream)):
        assert one.shape == (40, 3)
        np.testing.assert_array_equal(one[:, :2], two)
    assert len(stitches(three.stream, three.table)) == len(stitches(pair.stream, pair.table))
    # posture is each fighter's own
    better, changes = optimise_fight_posture(three)
    alone_better, alone_changes = optimise_fight_posture(pair)
    np.testing.assert_equal([vars(one) for one in changes[:2]], [vars(one) for one in alone_changes])
    for one, two in zip(better.stream.players, alone_better.stream.players):
        np.testing.assert_array_equal(one.qpos, two.qpos)
    assert (len(changes), np.isnan(changes[2].striking_hand_mm)) == (3, True)


def test_it_does_not_matter_who_is_first():
    stream = three_boxers()
    found = measured(fight_of(stream))
    order = [2, 0, 1]
    turned = fight_of(replace(stream, players=tuple(stream.players[k] for k in order)), [PLAN[k] for k in order])
    again = measured(turned)
    assert (again.hits, again.reactions.attacks, again.reactions.answered_share) == (
        found.hits, found.reactions.attacks, found.reactions.answered_share
    )  # fmt: skip
    for name in ("attacks_per_min", "answered_by"):
        assert getattr(again.reactions, name) == tuple(getattr(found.reactions, name)[k] for k in order)
    for name in ("facing_error_deg", "distance_m", "stability", "penetration"):
        one, two = (np.array(list(vars(getattr(each, name)).values())) for each in (found, again))
        np.testing.assert_allclose(one, two, rtol=1e-9)


def test_three_are_simulated_and_measured_as_one_fight():
    fight = fight_of(three_boxers())
    run = simulate(fight.stream.players, "pd")
    assert (run.end, len(run.bodies)) == ("done", 3)
    simulated, tracked = simulated_stream(run, fight)
    assert [motion.name for motion in simulated.players] == ["A", "B", "C"]
    assert len(simulated) == len(tracked) == len(fight.stream)
    found = run_metrics(run, fight)
    assert len(found.fighters) == 3
    assert sum(found.contacts.values()) == len(run.contacts) > 0
    assert found.assist_n == 0
    own = [np.linalg.norm(one.qpos - two.qpos) for one, two in zip(simulated.players, tracked.players)]
    assert min(own) > 0
    assert 0 < found.simulated.mpjpe_mm < 300
    assert found.simulated.distance_m.median == pytest.approx(measured(fight).distance_m.median, abs=0.1)
    assert len(found.simulated.reactions.answered_by) == 3
    found.as_dict()
    # ... in one call as well; what labels' bigrams are compared with is of two
    assert evaluate_fight(fight, physics=False).kinematic.as_dict() == measured(fight).as_dict()
    with pytest.raises(MotionError, match="three: 3 people; valid here: 2"):
        distributions(fight.stream, fight.table, fight.codes)
