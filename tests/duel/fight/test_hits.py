"""Which contacts an attack intended."""

from dataclasses import fields

import numpy as np
import pytest

from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.fight.hits import BLOCKED, GRACE_S, HIT, NOBODY, UNINTENDED, judge
from simprep.duel.labels.labels import Label
from simprep.duel.stream.stream import DuelStream
from simprep.humanoid import humanoid
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
