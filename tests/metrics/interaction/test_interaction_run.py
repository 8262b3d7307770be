"""Metrics of a simulated fight: contacts, the time until a fall, and what was tracked."""

import json

import numpy as np
import pytest
from metric_cases import rigid_motion, run_of

from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.labels.labels import Label
from simprep.duel.stream.stream import DuelStream
from simprep.errors import SettingError
from simprep.metrics.interaction.run import fight_so_far, run_metrics
from simprep.physics.contacts import BodyContact
from simprep.physics.run import Run

NEUTRAL = Label(move="L-L").code
PUNCH = Label(move="L-L", left_punch="fwd").code
FPS, RATE = 60.0, 480.0


def still(frames, fps, x, shift=0.0):
    return rigid_motion(np.tile([x + shift, 0.0, 0.0], (frames, 1)), fps)


def make_fight(seconds=2.0):
    """A punches from frame 30 to 60; 1.2 m apart."""
    frames = round(seconds * FPS) + 1
    stream = DuelStream((still(frames, FPS, 0.0), still(frames, FPS, 1.2)))
    actions = [
        (0, 0, 30, NEUTRAL),
        (0, 30, 60, PUNCH),
        (0, 60, frames, NEUTRAL),
        (1, 0, 50, NEUTRAL),
        (1, 50, frames, NEUTRAL),
    ]
    return Fight(stream, tuple(FightAction(*one) for one in actions))


def make_run(seconds, end="done", contacts=()):
    """Both stand 3 cm beside what they track, one in the other by 2 cm half of the time."""
    steps = round(seconds * RATE)
    bodies = []
    for x in (0.0, 1.2):
        one = run_of(still(steps + 1, RATE, x, 0.03), still(steps + 1, RATE, x))
        bodies += one.bodies
    depth = np.zeros(steps)
    depth[: steps // 2] = 0.02
    return Run(
        tuple(bodies), "test", 0, 1 / RATE, end, "made up", 1 if end == "fell" else None, contacts, depth,
        np.full(steps, 0.05), wall_s=3.0 * seconds,
    )  # fmt: skip


def contact(start, a, b, impulse=5.0):
    return BodyContact(start, 0.05, (0, 1), (a, b), (impulse, 0.0, 0.0), 100.0, 1.0, (0.5, 0.0, 1.2), 0.01)


def test_numbers_of_a_run():
    touches = (
        contact(0.7, "left_hand", "head"),
        contact(0.7, "left_forearm", "head", 1.0),
        contact(1.5, "pelvis", "pelvis"),
    )
    found = run_metrics(make_run(2.0, contacts=touches), make_fight())
    assert (found.end, found.falls_per_min, found.s_per_s) == ("done", 0.0, 3.0)
    assert found.contacts == {"hit": 2, "unintended": 1}
    assert found.impulse_ns.median == 5
    simulated = found.simulated
    # two parts of an arm that meet the head are one hit; poses alone would show none, as the bodies are far apart
    assert (simulated.hits.intended, simulated.hits.blocked, simulated.hits.unintended) == (1, 0, 1)
    assert simulated.g_mpjpe_mm == pytest.approx(30)
    assert simulated.mpjpe_mm == pytest.approx(0, abs=1e-9)
    assert (simulated.penetration.mean_mm, simulated.penetration.share) == (pytest.approx(10), 0.5)
    assert found.penetration_before.mean_mm == pytest.approx(50)
    assert simulated.reactions.attacks == 1
    assert simulated.reactions.answered_share == 1  # B begins something 20 frames after the punch does
    assert json.loads(json.dumps(found.as_dict(), allow_nan=False))["simulated"]["js"] == {}


def test_a_fall_ends_what_is_measured():
    fight = make_fight()
    found = run_metrics(make_run(1.0, "fell"), fight)
    assert found.falls_per_min == pytest.approx(60)
    assert found.simulated.duration_s == pytest.approx(1.0)
    assert found.impulse_ns is None
    table, codes = fight_so_far(fight, 61)
    assert table[:, 2].tolist() == [30, 60, 61, 50, 61]
    assert len(codes) == 5
    assert run_metrics(make_run(0.3, "fell"), fight).simulated is None
    with pytest.raises(SettingError, match=r"a run of 3.00 s of a fight of 121 frames"):
        run_metrics(make_run(3.0), fight)
