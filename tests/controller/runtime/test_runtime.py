from dataclasses import replace

import numpy as np
import pytest

from simprep.controller.alpha_filter import filter_kernel, smooth_alpha
from simprep.controller.influence import style_of
from simprep.controller.runtime.locomotion import LocomotionStream
from simprep.controller.runtime.performer import Performer, RuntimeSettings
from simprep.controller.runtime.world import library_world
from simprep.errors import SettingError, UnknownNameError
from simprep.library import library_motion
from simprep.motion.edit import repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.preparation.blending import split_heading
from simprep.preparation.synthesis import synthesise

FRAMES = 32
CHANGES = ("walk", "turn", "walk", "stand", "walk")


@pytest.fixture(scope="module")
def cores():
    return library_world(["punch_right"]).cores


@pytest.fixture(scope="module")
def style():
    return style_of(library_motion("punch_right"))


def turning(cores):
    return next(name for name in cores.names if name not in ("walk", "stand"))


def slip(qpos, contacts, fps):
    """Speed of the slowest point of a supporting foot, largest over time [m/s]."""
    points = forward_kinematics(qpos, library_motion("walk").character).foot_points[..., :2]
    speed = np.linalg.norm(np.diff(points, axis=0), axis=-1).min(axis=-1) * fps
    return float(speed[contacts[1:] & contacts[:-1]].max())


def test_the_stream_is_the_loop_repeated(cores):
    walk = library_motion("walk")
    window = LocomotionStream(cores, "walk").window(0, 200)
    expected = repeat(walk, 4)
    np.testing.assert_allclose(window.qpos[:, 2:3], expected.qpos[:200, 2:3])
    np.testing.assert_allclose(window.qpos[:, 7:], expected.qpos[:200, 7:])
    np.testing.assert_allclose(np.diff(window.qpos[:, :2], axis=0), np.diff(expected.qpos[:200, :2], axis=0), atol=1e-8)


def stride(pose):
    """Distance between the feet [m]."""
    character = library_motion("walk").character
    left, right = forward_kinematics(pose[None], character).xpos[0, character.feet, :2]
    return np.linalg.norm(left - right)


@pytest.mark.parametrize("first", [20, 40, 60, 80])
def test_who_stops_in_the_middle_of_a_stride_closes_the_step_and_stands(cores, first):
    stream = LocomotionStream(cores, "walk")
    at = stream.change("stand", first, 64)
    assert at is not None
    window = stream.window(0, at + 400)  # far beyond the piece that is made at a change
    assert stride(window.qpos[at + 90]) > 0.6
    assert stride(window.qpos[-1]) < 0.3
    ahead = window.qpos[at + 90 :, 0]
    assert np.diff(ahead).min() > -2e-4  # it never goes back
    closed = slice(at + 200, at + 400)
    assert window.contacts[closed].all()
    assert slip(window.qpos[closed], window.contacts[closed], window.fps) < 1e-3
    then = stream.change("walk", at + 400, 64)
    assert then is not None
    window = stream.window(0, then + 60)
    assert slip(window.qpos, window.contacts, window.fps) < 0.05
    assert np.abs(np.diff(window.qpos[:, 7:], axis=0)).max() * window.fps < 15.0


def test_who_is_turned_in_the_middle_of_a_stride_steps_and_does_not_sink(cores):
    """With both feet kept on the floor, half a stride apart, the pelvis sank by 8 to 14 cm and the leg behind kicked."""
    tried = 0
    for frame in np.flatnonzero(library_motion("walk").contacts.all(axis=1)):
        stream = LocomotionStream(cores, "walk")
        at = stream.change(turning(cores), 64 + int(frame), 1)
        if at is None:
            continue
        tried += 1
        window = stream.window(0, at + 60)
        assert window.qpos[at:, 2].min() > window.qpos[:at, 2].min() - 0.02
        assert np.abs(np.diff(window.qpos[:, 7:], axis=0)).max() * window.fps < 15.0
        assert slip(window.qpos, window.contacts, window.fps) < 0.02
    assert tried


@pytest.mark.parametrize("first", [64, 80, 96, 112])
def test_who_walks_on_after_one_turn_does_not_halt(cores, first):
    """The walker halted (0 to 0.1 m/s ahead) and shifted by 3 to 10 cm to the side."""
    stream = LocomotionStream(cores, "walk")
    at = stream.change(turning(cores), first, 64)
    assert at is not None
    back = stream.change("walk", at + FRAMES, 64)
    assert back is not None
    part = slice(at, back + 40)
    window = stream.window(0, part.stop)
    step = np.diff(window.qpos[part, :2], axis=0)
    heading = window.trend[part][1:]
    ahead = step[:, 0] * np.cos(heading) + step[:, 1] * np.sin(heading)
    aside = np.abs(step[:, 1] * np.cos(heading) - step[:, 0] * np.sin(heading))
    assert abs(heading[-1] - heading[0]) > 0.4
    assert ahead.min() * window.fps > 0.25
    assert aside[aside > ahead].sum() < 0.02
    assert slip(window.qpos, window.contacts, window.fps) < 0.05


def test_changes_of_core_node_keep_feet_and_heading(cores):
    stream = LocomotionStream(cores, "walk", place=(1.0, 2.0, 0.5))
    frames = 0
    for name in CHANGES:
        node = turning(cores) if name == "turn" else name
        if node != stream.node:
            assert stream.change(node, frames, 64) is not None
            assert stream.node == node
        frames += 96
        stream.window(0, frames)
    window = stream.window(0, frames)
    steps = np.linalg.norm(np.diff(window.qpos[:, :2], axis=0), axis=1)
    assert steps.max() * window.fps < 2.1  # walking sways at up to 1.5 m/s; the rest is the change
    assert slip(window.qpos, window.contacts, window.fps) < 0.02
    assert np.abs(np.diff(window.trend)).max() * window.fps < 1.5
    heading = np.unwrap(split_heading(window.qpos[:, 3:7])[0])
    assert np.abs(heading - window.trend).max() < 0.2  # the pelvis's swing, no more
    with pytest.raises(UnknownNameError, match="unknown core node 'fly'; valid: walk"):
        stream.change("fly", frames, 32)


def test_unprepared_frames_are_the_locomotion_bit_by_bit(cores, style):
    character = Performer(cores, RuntimeSettings())
    for _ in range(4):
        character.act(np.zeros(FRAMES), style)
    np.testing.assert_array_equal(character.motion().qpos, character.stream.window(0, 4 * FRAMES).qpos)


LEVELS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.0, 0.8, 0.6)  # the policy goes by one level at a time
PLAN = [("turn" if number == 2 else "walk", level) for number, level in enumerate(LEVELS)]


@pytest.mark.parametrize("optimise", [False, True])
def test_actions_one_by_one_come_out_like_the_whole_clip_at_once(cores, style, optimise):
    character = Performer(cores, RuntimeSettings(optimise=optimise))
    for name, alpha in PLAN:
        character.turn_to(turning(cores) if name == "turn" else name, FRAMES)
        commands = np.full(FRAMES, alpha)
        foreseen = character.path(commands)[-1]
        character.act(commands, style)
        np.testing.assert_allclose(foreseen, character.place, atol=1e-9)
    motion = character.motion()
    commands = np.repeat([alpha for _, alpha in PLAN], FRAMES)
    np.testing.assert_allclose(
        character.level, smooth_alpha(commands, filter_kernel(0.08, 60.0), before=0.0), atol=1e-12
    )
    n, ahead = len(motion), FRAMES  # the clip at once, too, must know where a foot in the air will land
    level = np.concatenate([character.level, np.full(ahead, character.command)])
    whole = synthesise(character.stream.window(0, n + ahead), style, level, optimise=optimise, measure=False)
    whole = replace(whole, qpos=whole.qpos[:n], contacts=whole.contacts[:n])
    np.testing.assert_allclose(motion.qpos[:, :2], whole.qpos[:, :2], atol=1e-9)
    np.testing.assert_allclose(motion.qpos[:, 2], whole.qpos[:, 2], atol=0.005)
    difference = motion.qpos[:, 7:] - whole.qpos[:, 7:]
    assert np.sqrt(np.mean(difference**2)) < (0.03 if optimise else 0.006)
    assert slip(motion.qpos, motion.contacts, motion.fps) < slip(whole.qpos, whole.contacts, motion.fps) + 0.02
    # no jolt where one action follows another
    acceleration = np.abs(np.diff(motion.qpos[:, 7:], 2, axis=0)).max(axis=1) * motion.fps**2
    joints = np.arange(FRAMES, len(motion) - 2, FRAMES)
    at_joints = np.concatenate([acceleration[joint - 2 : joint + 2] for joint in joints])
    whole_acceleration = np.abs(np.diff(whole.qpos[:, 7:], 2, axis=0)).max(axis=1) * motion.fps**2
    assert at_joints.max() < 1.2 * whole_acceleration.max()


def test_fully_prepared_the_character_stands_in_the_reference_posture(cores, style):
    character = Performer(cores, RuntimeSettings(optimise=False))
    for alpha in (0.5, 1.0, 1.0, 1.0):
        character.act(np.full(FRAMES, alpha), style)
    last = character.motion().qpos[-FRAMES:]
    np.testing.assert_allclose(last[:, 7 : 7 + 25], np.tile(style.qpos[7 : 7 + 25], (FRAMES, 1)), atol=1e-9)
    assert np.ptp(last[:, :2], axis=0).max() < 1e-9


def test_impossible_times_are_refused():
    with pytest.raises(SettingError, match="run time: fade 0 s; valid: above 0"):
        RuntimeSettings(fade=0)
