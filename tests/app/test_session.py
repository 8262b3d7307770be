from dataclasses import replace

import numpy as np
import pytest

from simprep.app.display import Display
from simprep.app.lane import LANE_M
from simprep.app.moments import FPS, History
from simprep.app.session import Session, SessionSettings
from simprep.errors import SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.motion.store import read_motion
from simprep.physics.bodies import scene_bodies
from simprep.scene import Obstacle, SceneSettings, build_scene


def run(session, moments):
    for _ in range(moments):
        assert session.advance()


def test_a_moment_is_a_sixtieth_and_balance_is_measured(session):
    run(session, 20)
    moment = session.newest
    assert moment.time == pytest.approx(20 / 60)
    assert session.director.asked == 20
    marks = moment.marks[0]
    weight_inside = marks.polygon.min(axis=0) < marks.com
    assert weight_inside.all()
    assert marks.margin > 0.02
    np.testing.assert_allclose(marks.pressure, marks.com, atol=0.05)
    assert moment.caption.doing == (f"stands at {moment.time:.2f}",)


def test_it_waits_goes_on_by_one_moment_and_looks_back(session):
    run(session, 5)
    session.pause()
    assert session.rate == 0
    assert not session.advance()
    session.single_step()
    assert session.advance()
    assert not session.advance()
    assert session.time == pytest.approx(6 / 60)
    assert session.history.back(3 / 60).time == pytest.approx(3 / 60)
    assert session.history.back(99).time == pytest.approx(1 / 60)
    session.pause(False)
    assert session.advance()


def test_between_two_moments_bodies_are_drawn_part_of_the_way(session):
    run(session, 6)
    before, after, share = session.history.between(1.75 / FPS)
    assert (before.time, after.time) == pytest.approx((4 / 60, 5 / 60))
    assert share == pytest.approx(0.25)
    stage, characters = session.shown
    display = Display(characters, stage)
    drawn = display.pose(before, after, share).qpos.copy()
    first, second = display.pose(before).qpos.copy(), display.pose(after).qpos.copy()
    assert np.abs(second - first).max() > 0
    np.testing.assert_allclose(drawn[:3], 0.75 * first[:3] + 0.25 * second[:3], atol=1e-12)
    np.testing.assert_allclose(drawn[7:], 0.75 * first[7:] + 0.25 * second[7:], atol=1e-6)
    assert session.history.between(99)[0] is session.history.between(99)[1]


def test_what_is_remembered_stays_bounded(session):
    run(session, 2)
    history = History(1.0)
    for _ in range(5 * FPS):
        history.add(session.newest)
    assert len(history) == FPS
    assert session.tracker.hits.hits.maxlen


def test_a_push_is_shown_while_it_acts_and_moves_the_body(session):
    run(session, 6)
    before = session.newest.bodies[0][1]
    session.push(200, 90, 0.1)
    run(session, 4)
    assert session.newest.push == pytest.approx((0, 200, 0), abs=1e-9)
    run(session, 8)
    assert session.newest.push == (0, 0, 0)
    assert session.newest.bodies[0][1] > before + 0.01
    assert not session.tracker.data.xfrc_applied.any()
    with pytest.raises(SettingError, match="valid: up to"):
        session.push(1e9)


def test_motions_are_saved_in_the_folder_and_nowhere_else(session, tmp_path):
    with pytest.raises(SettingError, match="nothing to save"):
        session.save("early")
    run(session, 10)
    path = session.save("mine")
    assert path == tmp_path / "saved" / "mine.npz"
    motion = read_motion(path)
    assert len(motion) == 10
    assert motion.contacts.all()
    for name in ("../out", "a/b", "", ".hidden", "x" * 65, "C:\\x"):
        with pytest.raises(SettingError, match="no folders"):
            session.save(name)
    assert [one.name for one in tmp_path.rglob("*.npz")] == ["mine.npz"]


def test_what_cannot_be_is_refused(session):
    with pytest.raises(UnknownNameError, match="ball, opponents, course"):
        session.restart("moon")
    with pytest.raises(UnknownNameError, match="traditional"):
        session.switch("best")
    with pytest.raises(SettingError, match="within 50 m"):
        session.set_goal((float("nan"), 0.0))
    with pytest.raises(SettingError, match="farther away"):
        session.set_ball((0.2, 0.0))
    with pytest.raises(UnknownNameError, match="optimised"):
        Session(SessionSettings(arm="best"))


def test_the_ball_goes_where_it_is_put_and_the_world_begins_anew(session):
    run(session, 3)
    version = session.version
    session.set_ball((1.5, 1.0))
    run(session, 1)
    assert session.version != version
    assert session.time == pytest.approx(1 / 60)
    np.testing.assert_allclose(session.newest.things[0, :2], (1.5, 1.0), atol=1e-6)


def test_things_with_a_mass_move_and_are_no_bodies():
    ball = Obstacle("ball", (2.0, 0.0, 1.0), (0.11,) * 3, ball=True, mass=0.43)
    bar = Obstacle("bar", (-2.0, 0.0, 0.5), (0.03, 0.5, 0.03), mass=0.8)
    model = build_scene(SceneSettings(obstacles=(ball, bar)))
    (body,) = scene_bodies(model, (humanoid(),))
    assert (body.qpos.start, body.qvel.start) == (0, 0)
    assert model.nq == humanoid().nq + 14
    assert model.body_mass[model.body("ball").id] == pytest.approx(0.43)
    # a solid ball: 2/5 m r^2
    assert model.body_inertia[model.body("ball").id] == pytest.approx(np.full(3, 0.4 * 0.43 * 0.11**2))

    import mujoco

    data = mujoco.MjData(model)
    for _ in range(480):
        mujoco.mj_step(model, data)
    at = int(model.jnt_qposadr[model.joint("ball").id])
    assert 0.1 < data.qpos[at + 2] < 0.2
    with pytest.raises(SettingError, match="0 \\(fixed\\) or more"):
        Obstacle("bad", (0, 0, 0), (1, 1, 1), mass=-1)


def test_two_arms_side_by_side_are_two_worlds_that_hear_the_same(tmp_path):
    session = Session(SessionSettings("ball", arm="optimised", beside="none", controller="pd", folder=tmp_path))
    alone = Session(SessionSettings("ball", arm="optimised", controller="pd", folder=tmp_path))
    run(session, 5)
    run(alone, 5)
    moment = session.newest
    assert len(moment.bodies) == len(moment.marks) == 2
    np.testing.assert_array_equal(moment.bodies[0], alone.newest.bodies[0])  # the first lane is as it were alone
    np.testing.assert_array_equal(moment.things[0], alone.newest.things[0])
    # standing still, both arms are the same but for where they are drawn
    aside = np.zeros_like(moment.bodies[0])
    aside[1] = LANE_M
    np.testing.assert_allclose(moment.bodies[1] - moment.bodies[0], aside, atol=1e-12)
    np.testing.assert_allclose(moment.marks[1].com - moment.marks[0].com, (0, LANE_M), atol=1e-12)
    assert [words.split(":")[0] for words in moment.caption.doing] == ["optimised", "none"]
    stage, characters = session.shown
    assert len(characters) == 2
    assert [one.name for one in stage.moving] == ["ball", "beside_ball"]
    assert Display(characters, stage).pose(moment).qpos is not None

    session.launch("kick")
    assert all(lane.director.busy for lane in session.lanes)
    assert [lane.director.world.prepare for lane in session.lanes] == [True, False]
    session.push(150, 90)
    run(session, 3)
    assert session.newest.pushed == (0, 1)
    session.push(150, 90, body=1)
    run(session, 11)  # the first push is over
    assert session.newest.pushed == (1,)
    for nobody in (-1, 2):
        with pytest.raises(SettingError, match="valid: 0 to 1"):
            session.push(150, 90, body=nobody)
    path = session.save("second", body=1)
    assert len(read_motion(path)) == 19

    session.show_beside(None)
    run(session, 1)
    assert len(session.newest.bodies) == 1
    with pytest.raises(UnknownNameError, match="traditional"):
        session.show_beside("best")


def test_a_fight_is_shown_in_one_arm(session):
    session.settings = replace(session.settings, scene="duel automatic")
    with pytest.raises(SettingError, match="one arm"):
        session.show_beside("none")
