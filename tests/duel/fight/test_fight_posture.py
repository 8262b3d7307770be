"""Posture optimisation of fights: the COM comes nearer to the feet, punches land where they did, legs stay."""

import numpy as np

from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.fight.posture import FADE_S, optimise_fight_posture, punching
from simprep.duel.labels.labels import Label
from simprep.duel.stream.stream import DuelStream
from simprep.library import library_motion
from simprep.motion.edit import cut, move
from simprep.motion.kinematics import forward_kinematics


def fight(punch: tuple[int, int]) -> Fight:
    a, b = library_motion("jab_left_head"), library_motion("kick_front")
    frames = min(len(a), len(b))
    stream = DuelStream((cut(a, 0, frames), move(cut(b, 0, frames), (1.2, 0.0), np.pi)))
    guard, attack = Label(move="F-F").code, Label(move="F-F", left_punch="fwd").code
    first, after = punch
    edges = ((0, first, guard), (first, after, attack), (after, frames, guard))
    actions = [FightAction(0, start, end, code) for start, end, code in edges]
    return Fight(stream, (*actions, FightAction(1, 0, frames, guard)))


def test_balance_improves_and_the_punch_is_kept() -> None:
    original = fight((20, 70))
    optimised, changes = optimise_fight_posture(original)
    assert len(changes) == 2
    for change, before, after in zip(changes, original.stream.players, optimised.stream.players):
        assert change.com_cos_after_mm < change.com_cos_before_mm
        legs = np.r_[0:7, 7 + before.character.lower_joints]
        np.testing.assert_array_equal(after.qpos[:, legs], before.qpos[:, legs])
        np.testing.assert_array_equal(after.contacts, before.contacts)
        assert np.abs(after.qpos - before.qpos).max() > 0.01
    character = original.stream.players[0].character
    hand, punches = character.segment("left_hand"), (one.stream.players[0].qpos[20:70] for one in (original, optimised))
    paths = [forward_kinematics(qpos, character).xipos[:, hand] for qpos in punches]
    assert np.linalg.norm(paths[0] - paths[1], axis=1).max() < 1e-3
    assert changes[0].striking_hand_max_mm < 1.0
    assert np.isnan(changes[1].striking_hand_mm)  # B does not punch
    steps = [np.abs(np.diff(one.stream.players[0].qpos[:, 7:], axis=0)).max() for one in (original, optimised)]
    assert steps[1] < 1.25 * steps[0]  # no pops: an elbow near its stretch turns faster for the same way of the fist
    assert optimised.actions == original.actions


def test_fists_are_held_from_shortly_before_the_punch_until_shortly_after() -> None:
    weight = punching(fight((40, 60)), 0)
    fade = FADE_S * 60
    np.testing.assert_array_equal(weight[40:60, 0], 1.0)
    assert not weight[:, 1].any()
    assert not weight[: int(40 - fade), 0].any()
    assert not weight[int(60 + fade) :, 0].any()
    assert (np.diff(weight[:41, 0]) >= 0).all()
    assert 0 < weight[36, 0] < 1
    assert not punching(fight((40, 60)), 1).any()
