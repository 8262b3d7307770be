"""Which contacts an attack intended."""

from dataclasses import fields, replace

import mujoco
import numpy as np
import pytest

from simprep.duel.fight.falls import blows
from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.fight.hits import BLOCKED, GRACE_S, HIT, NOBODY, UNINTENDED, judge, judge_actions
from simprep.duel.labels.labels import Label
from simprep.duel.stream.stream import DuelStream
from simprep.errors import UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.motion.motion import Motion
from simprep.physics.contacts import BodyContact

FPS = 60.0


def fight() -> Fight:
    """A: guard, left punch from 1 s, its return from 1.5 s. B: right kick (up, then down) until 1.2 s, guard."""
    frames = 180
    motions = []
    for x in (0.0, 1.0):
        qpos = np.repeat(humanoid().standing_qpos.copy()[None], frames, axis=0)
        qpos[:, 0] = x
        motions.append(Motion(qpos, FPS, np.ones((frames, 2), dtype=bool)))
    plan = (
        (0, 0, 60, Label(move="F-F")),
        (0, 60, 90, Label(move="F-F", left_punch="fwd")),
        (0, 90, 180, Label(move="F-F", left_punch="bwd")),
        (1, 0, 72, Label(move="F-L", right_kick="downup")),
        (1, 72, 180, Label(move="L-F", right_kick="down")),
    )
    actions = tuple(FightAction(player, start, end, label.code) for player, start, end, label in plan)
    return Fight(DuelStream((motions[0], motions[1])), actions)


def contact(time: float, part_a: str, part_b: str) -> BodyContact:
    return BodyContact(time, 0.05, (0, 1), (part_a, part_b), (3.0, 0.0, 4.0), 200.0, 2.0, (0.5, 0.0, 1.4), 0.002)


@pytest.mark.parametrize(
    ("time", "part_a", "part_b", "verdict", "attacker", "attack"),
    [
        (1.3, "left_hand", "head", HIT, 0, 1),
        (1.3, "left_forearm", "thorax", HIT, 0, 1),
        (1.3, "left_hand", "right_forearm", BLOCKED, 0, 1),
        (1.3, "right_hand", "head", UNINTENDED, NOBODY, NOBODY),  # the other fist
        (1.3, "left_upper_arm", "head", UNINTENDED, NOBODY, NOBODY),  # not what strikes
        (0.5, "left_hand", "head", UNINTENDED, NOBODY, NOBODY),  # before the punch
        (1.5 + 0.9 * GRACE_S, "left_hand", "head", HIT, 0, 1),
        (1.5 + 1.1 * GRACE_S, "left_hand", "head", UNINTENDED, NOBODY, NOBODY),  # on its way back
        (0.5, "pelvis", "right_foot", HIT, 1, 3),
        (0.5, "left_thigh", "right_shank", HIT, 1, 3),
        (0.5, "right_hand", "right_foot", BLOCKED, 1, 3),
        (0.5, "pelvis", "left_foot", UNINTENDED, NOBODY, NOBODY),
        (1.1, "left_hand", "right_foot", HIT, 0, 1),  # both attack: a fist on a leg hits, a foot on an arm is blocked
        (1.1, "left_shank", "right_foot", HIT, 1, 3),
        (1.1, "pelvis", "abdomen", UNINTENDED, NOBODY, NOBODY),
    ],
)
def test_verdicts(time: float, part_a: str, part_b: str, verdict: str, attacker: int, attack: int) -> None:
    touch = contact(time, part_a, part_b)
    judged = judge([touch], fight())[0]
    assert all(getattr(judged, field.name) == getattr(touch, field.name) for field in fields(touch))
    assert (judged.verdict, judged.attacker, judged.attack) == (verdict, attacker, attack)
    assert judged.intended == (verdict != UNINTENDED)
    assert judged.impulse_ns == 5.0


def test_of_three_fighters_one_attack_may_strike_two() -> None:
    punch = FightAction(2, 60, 90, Label(move="F-F", left_punch="fwd").code)
    idle = [FightAction(player, 0, 180, Label(move="F-F").code) for player in (0, 1)]
    touches = [
        replace(contact(1.2, "head", "left_hand"), bodies=(1, 2)),  # C strikes B ...
        replace(contact(1.3, "thorax", "left_hand"), bodies=(0, 2)),  # ... and A
        contact(1.4, "left_hand", "right_hand"),  # A and B touch
    ]
    judged = judge_actions(touches, [*idle, punch], [humanoid()] * 3, FPS)
    assert [(one.verdict, one.attacker, one.struck) for one in judged] == [
        (HIT, 2, 1),
        (HIT, 2, 0),
        (UNINTENDED, NOBODY, NOBODY),
    ]
    found = blows(judged)
    assert [(one.player, one.attack) for one in found] == [(1, 2), (0, 2)]
    # contacts hold what the first body does to the second: the struck one gets the opposite
    np.testing.assert_allclose(found[0].impulse, [-3.0, 0.0, -4.0])


def renamed() -> mujoco.MjSpec:
    """Our humanoid with other names for two segments, and with toes that are segments of their own."""
    spec = humanoid().build()
    for name in ("left_hand", "right_foot"):
        spec.body(name).name = name.upper()
    toes = spec.body("RIGHT_FOOT").add_body(name="toes", pos=[0.15, 0.0, 0.0])
    toes.add_geom(size=[0.02, 0.0, 0.0], mass=0.1)
    return spec


def test_segments_count_by_their_role_and_parts_without_one_by_that_above() -> None:
    ours = humanoid()
    roles = {**ours.roles, "left_hand": "LEFT_HAND", "right_foot": "RIGHT_FOOT"}
    other = replace(ours, name="other", build=renamed, roles=roles)
    assert other.parts[other.segments.index("toes")] == "right_foot"
    swapped = [other.segments[k] for k in other.mirror_segments]
    assert swapped[other.segments.index("LEFT_HAND")] == "right_hand"
    assert swapped[other.segments.index("left_foot")] == "RIGHT_FOOT"
    with pytest.raises(UnknownNameError, match="unknown group of joints of other 'tail'; valid: trunk, left_arm"):
        other.group("tail")
    one = fight()
    players = tuple(replace(motion, character=other) for motion in one.stream.players)
    one = replace(one, stream=replace(one.stream, players=players))
    verdicts = [
        judge([contact(*touch)], one)[0].verdict
        for touch in ((1.3, "LEFT_HAND", "head"), (0.5, "pelvis", "toes"), (0.5, "LEFT_HAND", "toes"))
    ]
    assert verdicts == [HIT, HIT, BLOCKED]
