"""The learned approach, piece by piece: without physics, and a moment of it with physics."""

import mujoco
import numpy as np
import pytest

from simprep.app.approaching import Approaching
from simprep.app.moments import HitReader
from simprep.app.session import Session, SessionSettings
from simprep.app.stage import BARS, KICK, stage, struck, targets
from simprep.controller.runtime.world import library_world
from simprep.errors import UnknownNameError
from simprep.motion.kinematics import forward_kinematics
from simprep.physics.bodies import scene_bodies
from simprep.physics.tracker import ASK_S
from simprep.physics.tracker_state import TrackerState
from simprep.scene import SceneSettings, scene_spec


@pytest.fixture(scope="module")
def world():
    return library_world([KICK])


class Played:
    """A stand-in for the tracker: the reference is played without physics."""

    def __init__(self, director):
        self.director, self.poses, self.time = director, [], 0.0
        self.seams = []
        self._add(director.first()[0])

    def _add(self, motion):
        if self.poses:
            self.seams.append(float(np.abs(motion.qpos[0, 7:] - self.poses[-1][7:]).max()))
        self.poses += list(motion.qpos[1 if self.poses else 0 :])

    @property
    def ahead(self):
        return max(0.0, (len(self.poses) - 1) / 60 - self.time)

    def go(self, seconds):
        end = self.time + seconds
        while self.time < end:
            now = np.asarray(self.poses[min(round(self.time * 60), len(self.poses) - 1)])
            state = TrackerState(self.time, (now,), (now * 0,), (now,), (self.ahead,), (), "")
            if self.ahead < ASK_S:
                more = self.director.more(state)
                if more is not None:
                    while len(self.poses) - 1 < round(self.time * 60):  # it stood meanwhile
                        self.poses.append(self.poses[-1])
                    self._add(more[0])
            self.time += 0.25


def test_the_kick_is_aimed_at_the_ball_and_pieces_join(world):
    ball = stage("ball")
    director = Approaching(ball, world=world)
    played = Played(director)
    director.go(*ball.tasks, strike=struck(ball))
    played.go(1.0)
    assert director.busy
    assert 0 <= director.caption(0.9).level <= 1
    assert director.caption(0.9).goal == director.task.goal
    played.go(8.0)
    assert not director.busy
    assert director.miss < 0.08
    poses = np.array(played.poses)
    soles = forward_kinematics(poses, ball.characters[0]).foot_points[:, 1].mean(axis=1)
    assert np.linalg.norm(soles - struck(ball), axis=1).min() < 0.12
    assert max(played.seams) < 0.1
    steps = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1)
    assert steps.max() < 0.06  # no jump


def test_arms_switch_and_a_target_is_launched_on_the_spot(world):
    director = Approaching(stage("empty"), "none", world)
    played = Played(director)
    with pytest.raises(UnknownNameError):
        director.launch("fly")
    director.launch(KICK)
    played.go(0.6)
    assert director.caption(0.5).level == 0  # unprepared
    director.switch("optimised")
    assert director.world.prepare
    played.go(6.0)
    assert any(KICK in director.caption(time).doing for time in np.arange(1.0, 6.0, 0.2))
    assert not director.busy


def test_physics_follows_the_approach(world, tmp_path):
    settings = SessionSettings("ball", folder=tmp_path)
    session = Session(settings, lambda: Approaching(stage("ball"), world=world))
    session.set_goal((1.5, 0.3))
    for _ in range(8):
        assert session.advance()
    moment = session.newest
    assert moment.fallen == ()
    np.testing.assert_allclose(moment.bodies[0][:3], moment.references[0][:3], atol=0.05)
    assert session.tracker.data.qfrc_applied.any() == session.tracker.data.xfrc_applied.any() == False  # noqa: E712


def test_what_is_to_be_followed_passes_every_bar_of_the_course(world):
    course = stage("course")
    wanted = [one for one in targets() if (one if isinstance(one, str) else one.name) in BARS]
    director = Approaching(course, world=library_world(wanted, policy=world.policy))
    played = Played(director)
    director.go(*course.tasks)
    played.go(0.5)
    while director.busy or played.ahead > 0:
        played.go(1.0)
        assert played.time < 40
    assert played.poses[-1][0] > 7.2  # behind the last bar
    model = scene_spec(SceneSettings(bodies=director.characters, obstacles=course.obstacles)).compile()
    data = mujoco.MjData(model)
    reader = HitReader(model, scene_bodies(model, director.characters))
    start, own = data.qpos.copy(), scene_bodies(model, director.characters)[0].qpos
    for pose in played.poses[::2]:
        data.qpos[:] = start
        data.qpos[own] = pose
        mujoco.mj_forward(model, data)
        reader.step(data)
    assert [hit.parts for hit in reader.hits] == []
