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


def test_the_avatar_follows_clicks_and_answers_hotkeys(model, tmp_path):
    fighting = Dueling("interactive", 1, model)
    session = Session(SessionSettings("duel interactive", controller="pd", folder=tmp_path), lambda: fighting)
    session.set_goal((0.5, 0.5))
    session.launch("right punch")
    for _ in range(60):
        assert session.advance()
    answered = [one.request for one in fighting.fight.avatar.answers if one.choices]
    begins = next(one.begins for one in fighting.fight.avatar.answers if one.request.action == "right punch")
    assert "right punch" in fighting.caption(begins + 0.02).doing[0]
    strides = [one.goal for one in answered if one.goal]
    assert strides
    assert np.linalg.norm(strides[0] - session.history.all()[0].bodies[0][:2]) < 0.55
    assert session.newest.caption.goal == (0.5, 0.5)
    chances = [share for _, share in session.newest.caption.chances]
    assert chances == sorted(chances, reverse=True)
    assert 0 < sum(chances) <= 1 + 1e-9


def test_who_falls_is_told_and_the_fight_goes_on(model, tmp_path):
    fighting = Dueling("automatic", 1, model)
    session = Session(SessionSettings("duel automatic", controller="pd", folder=tmp_path), lambda: fighting)
    session.push(900, 90, 0.5)
    fallen = []
    for _ in range(150):
        assert session.advance()
        fallen += session.newest.fallen
    assert 0 in fallen
    assert fighting.live.falls[0].player == 0
    assert any("down" in one.caption.doing[0] for one in session.history.all())
    assert session.tracker.end == ""


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


def test_what_a_fight_remembers_is_bounded(model, tmp_path, monkeypatch):
    monkeypatch.setattr("simprep.app.page_tracker.KEPT_S", 0.1)
    monkeypatch.setattr("simprep.app.dueling.Dueling.longest_s", 1.0)
    session = Session(
        SessionSettings("duel automatic", controller="pd", folder=tmp_path), lambda: Dueling("automatic", 1, model)
    )
    kept, poses, begun = [], [], session.version
    for _ in range(90):
        session.advance()
        kept.append(session.tracker.kept)
        poses.append(len(session.director.live._poses[0]))
    assert session.version == begun + 1  # it began anew
    steps = 0.1 / session.tracker.timestep
    assert max(kept) < 4 * steps
    assert max(poses[:58]) < 60 * 2 + 240
    assert poses[-1] < max(poses)
