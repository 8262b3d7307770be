"""Motion, editing and storage: properties that hold for any motion."""

import json
import pickle
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simprep.errors import MotionError, MotionFileError
from simprep.humanoid_model import humanoid
from simprep.motion.edit import at_origin, concatenate, cut, mirror, move, repeat, resample, yaw
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.store import read_motion, save_motion


def walk_like(frames: int = 60, fps: float = 60.0, turn: float = 0.0) -> Motion:
    """A smooth cyclic motion that travels and turns, with all hinges moving."""
    rng = np.random.default_rng(7)
    phase = 2 * np.pi * np.arange(frames) / frames
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], frames, axis=0)
    low, high = humanoid().model.jnt_range[1:].T
    middle, half = (low + high) / 2, 0.3 * (high - low) / 2
    qpos[:, 7:] = middle + half * np.sin(phase[:, None] + rng.uniform(0, 6, 37))
    heading = turn * np.arange(frames) / frames
    qpos[:, 0] = np.cumsum(np.cos(heading)) / frames
    qpos[:, 1] = np.cumsum(np.sin(heading)) / frames
    qpos[:, 3], qpos[:, 6] = np.cos(heading / 2), np.sin(heading / 2)
    contacts = np.stack([phase < np.pi, phase >= np.pi], axis=1)
    return Motion(qpos, fps, contacts, {"target": frames // 2}, name="walk_like", loop=True)


def test_velocities_are_derivatives_of_the_pose() -> None:
    motion = replace(walk_like(600, 600.0, turn=0.8), loop=False)
    qvel = motion.velocities()
    numeric = np.gradient(motion.qpos[:, 7:], 1 / motion.fps, axis=0)
    np.testing.assert_allclose(qvel[:, 6:], numeric, atol=1e-9)
    np.testing.assert_allclose(qvel[1:-1, 5], 0.8, rtol=1e-3)  # turn of 0.8 rad in one second
    assert np.abs(qvel[1:-1, :2]).max() == pytest.approx(1.0, rel=1e-2)


def test_resampling_up_and_down_returns_the_motion() -> None:
    motion = replace(walk_like(), loop=False)
    back = resample(resample(motion, 240.0), 60.0)
    np.testing.assert_allclose(back.qpos, motion.qpos, atol=1e-12)
    np.testing.assert_array_equal(back.contacts, motion.contacts)
    assert dict(back.events) == dict(motion.events)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_loop_carries_on_where_it_ended(turn: float) -> None:
    motion = walk_like(turn=turn)
    three = repeat(motion, 3)
    step = np.linalg.norm(np.diff(three.qpos[:, :2], axis=0), axis=1)
    np.testing.assert_allclose(step, step.mean(), rtol=0.02)  # no jump at the seams
    np.testing.assert_allclose(np.unwrap(yaw(three.qpos[:, 3:7]))[120], 2 * turn, atol=1e-6)
    np.testing.assert_array_equal(three.qpos[60:120, 7:], motion.qpos[:, 7:])


def test_concatenation_aligns_plan_and_heading() -> None:
    a = replace(walk_like(turn=1.1), loop=False)
    b = move(replace(walk_like(), loop=False, name="b"), (3.0, -2.0), 2.0)
    joined = concatenate(a, b)
    assert len(joined) == len(a) + len(b) - 1
    np.testing.assert_allclose(joined.qpos[59, :2], a.qpos[-1, :2], atol=1e-12)
    assert yaw(joined.qpos[59, 3:7]) == pytest.approx(float(yaw(a.qpos[-1, 3:7])), abs=1e-9)
    np.testing.assert_allclose(np.linalg.norm(joined.qpos[-1, :2] - joined.qpos[59, :2]),
                               np.linalg.norm(b.qpos[-1, :2] - b.qpos[0, :2]), rtol=1e-9)  # fmt: skip
    assert joined.events["target"] == 30 + len(a) - 1


def test_mirroring_twice_is_nothing_and_once_reflects_the_body() -> None:
    motion = move(walk_like(turn=0.5), (0.3, -0.2), 0.4)
    np.testing.assert_allclose(mirror(mirror(motion)).qpos, motion.qpos, atol=1e-12)
    swap = [
        humanoid().segments.index(n.replace("left", "?").replace("right", "left").replace("?", "right"))
        for n in humanoid().segments
    ]
    original, mirrored = forward_kinematics(motion.qpos).xipos, forward_kinematics(mirror(motion).qpos).xipos
    np.testing.assert_allclose(mirrored, original[:, swap] * [1, -1, 1], atol=1e-6)


def test_rigid_moves_keep_the_shape() -> None:
    motion = walk_like(turn=0.5)
    moved = at_origin(move(motion, (1.0, 2.0), 0.9))
    np.testing.assert_allclose(moved.qpos, at_origin(motion).qpos, atol=1e-9)


def test_storage_returns_every_field(tmp_path: Path) -> None:
    motion = replace(walk_like(), source="a test", character=humanoid(1.8, 80.0))
    path = save_motion(motion, tmp_path / "m")
    back = read_motion(path)
    np.testing.assert_array_equal(back.qpos, motion.qpos)
    np.testing.assert_array_equal(back.contacts, motion.contacts)
    for field in ("fps", "name", "source", "loop", "character"):
        assert getattr(back, field) == getattr(motion, field)
    assert dict(back.events) == dict(motion.events)
    assert [p.name for p in tmp_path.iterdir()] == ["m.npz"]  # no temporary file is left


@pytest.mark.parametrize(
    ("entry", "value", "message"),
    [
        ("schema", "simprep.motion/99", r"schema 'simprep\.motion/99'; this version reads 'simprep\.motion/1'"),
        ("model", "other_robot", r"poses of model 'other_robot'; valid: simprep_humanoid"),
        ("model_version", 7, "version 7; valid"),
    ],
)
def test_files_of_other_versions_are_refused(tmp_path: Path, entry: str, value: object, message: str) -> None:
    path = save_motion(walk_like(), tmp_path / "m.npz")
    with np.load(path) as archive:
        arrays = dict(archive)
    header = json.loads(str(arrays["header"]))
    arrays["header"] = np.array(json.dumps({**header, entry: value}))
    np.savez(path, **arrays)
    with pytest.raises(MotionFileError, match=message):
        read_motion(path)


def test_contradictory_motions_are_refused() -> None:
    good = walk_like()
    nan = good.qpos.copy()
    nan[5, 9] = np.nan
    zero = good.qpos.copy()
    zero[3, 3:7] = 0
    for change, message in [
        ({"qpos": nan}, "frame 5 of 60 holds NaN"),
        ({"qpos": zero}, "frame 3 has a zero root quaternion"),
        ({"qpos": good.qpos[:, :40]}, r"shape \(60, 40\); valid: \(frames, 44\)"),
        ({"qpos": good.qpos[:0], "contacts": good.contacts[:0], "events": {}}, "no frames"),
        ({"fps": 0.0}, "frame rate 0.0"),
        ({"contacts": good.contacts[:5]}, r"contacts has shape \(5, 2\)"),
        ({"events": {"hit": 60}}, "event 'hit' at frame 60; valid: 0 to 59"),
    ]:
        with pytest.raises(MotionError, match=message):
            replace(good, **change)  # type: ignore[arg-type]
    with pytest.raises(MotionError, match=r"frames 10:10; valid: 0 <= a < b <= 60"):
        cut(good, 10, 10)
    with pytest.raises(MotionError, match="is not a loop"):
        repeat(replace(good, loop=False), 2)


def test_motions_cannot_be_changed_in_place() -> None:
    motion = walk_like()
    with pytest.raises(ValueError, match="read-only"):
        motion.qpos[0, 0] = 1.0


def test_a_motion_is_a_value(tmp_path: Path) -> None:
    motion = replace(walk_like(), events={"impact": 3})
    for copy in (pickle.loads(pickle.dumps(motion)), deepcopy(motion), read_motion(motion.save(tmp_path / "m"))):
        assert copy == motion
    other = np.array(motion.qpos)
    other[0, 0] += 1e-15
    assert replace(motion, qpos=other) != motion
    assert motion != "motion"
    assert len(repr(motion)) < 120
    assert motion.character.name in repr(motion)


def test_parts_by_frames_and_by_seconds() -> None:
    motion = replace(walk_like(), events={"impact": 3})
    part = motion[2:-1]
    assert len(part) == len(motion) - 3
    assert part.events == {"impact": 1}
    assert motion.seconds(2 / motion.fps, motion.times[-2]) == part
    assert motion[:] == motion
    for wrong in (slice(0, None, 2), 3):
        with pytest.raises(MotionError, match="valid: frames a:b"):
            motion[wrong]  # type: ignore[index]
    with pytest.raises(MotionError):
        motion[5:5]
    assert motion.resample(2 * motion.fps).fps == 2 * motion.fps
