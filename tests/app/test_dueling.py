"""The duel's pieces join, requests are answered, and the simulation takes them."""

from dataclasses import replace

import numpy as np
import pytest

from simprep.app.dueling import Dueling
from simprep.app.session import Session, SessionSettings
from simprep.duel.model.fight_model import FightModel
from simprep.duel.model.structures import couple, link_actions
from simprep.duel.model.tracks import pair_tracks
from simprep.duel.model.transition_model import train
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import PRESETS
from simprep.errors import SettingError


@pytest.fixture(scope="module")
def model():
    example = make_synthetic(replace(PRESETS["kickboxing"], clips=1, clip_s=30.0), seed=5)
    player, start, end, clip = example.truth.table.T
    graph = couple(link_actions(player, start, end, example.truth.codes, clip))
    return FightModel(train(graph, pair_tracks(example.stream)), example.stream)


def test_a_fight_is_drawn_in_pieces_and_simulated(model, tmp_path):
    fighting = Dueling("interactive", 1, model)
    settings = SessionSettings("duel interactive", controller="pd", folder=tmp_path)
    session = Session(settings, lambda: fighting)
    last = fighting.begin()
    fighting.request("", (0.5, 0.5))
    state = session.tracker.state
    for _ in range(4):
        pieces = fighting.more(state)
        for before, after in zip(last, pieces):
            np.testing.assert_allclose(before.qpos[-1], after.qpos[0], atol=1e-9)
            assert len(after) > 60
        last = pieces
    assert any(one.request.goal == (0.5, 0.5) for one in fighting.fight.avatar.answers)
    caption = fighting.caption(fighting.fight.bout.time)
    assert caption.doing[0].startswith("A: ")
    chances = [share for _, share in caption.chances]
    assert chances == sorted(chances, reverse=True)
    assert 0 < sum(chances) <= 1 + 1e-9


def test_two_bodies_are_simulated_and_shown(model, tmp_path):
    settings = SessionSettings("duel automatic", controller="pd", folder=tmp_path)
    session = Session(settings, lambda: Dueling("automatic", 1, model))
    for _ in range(6):
        assert session.advance()
    moment = session.newest
    assert len(moment.bodies) == len(moment.marks) == 2
    for body, reference in zip(moment.bodies, moment.references):
        np.testing.assert_allclose(body[:3], reference[:3], atol=0.1)
    with pytest.raises(SettingError, match="duel interactive"):
        session.launch("kick")
