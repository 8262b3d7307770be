"""Robots' poses keep ranges, speeds, the floor and themselves, and say what could not be kept."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from robot_models import robot_xml, toml_of, write_robot

import simprep
from simprep.character import SPEED_SHARE, Character
from simprep.errors import MissingExtraError
from simprep.motion.edit import cut, mirror
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.robot_ik import at_full_speed
from simprep.motion.self_contact import collision_model, own_overlap
from simprep.motion.transfer import transferred
from simprep.robots.load import load_robot


def robot(folder: Path, drive: str = "") -> Character:
    return load_robot(write_robot(folder, robot_xml(), toml_of() + drive))


def across_the_belly() -> Motion:
    """A person whose left forearm goes through the trunk."""
    stand = simprep.library_motion("stand")
    body = stand.character
    qpos = np.repeat(stand.qpos[:1], 45, axis=0)
    bump = np.zeros(45)
    bump[10:35] = np.sin(np.linspace(0, np.pi, 25)) ** 2
    for movement, angle in (("elbow_flexion", 1.5), ("shoulder_rotation", 1.2)):
        index = body.anatomical(f"left_{movement}")
        assert index is not None
        qpos[:, 7 + index] += angle * bump
    return Motion(qpos, 60.0, np.ones((45, 2), bool), character=body)


def test_an_arm_stays_out_of_the_trunk(tmp_path: Path) -> None:
    body = robot(tmp_path)
    result = transferred(across_the_belly(), body)
    assert own_overlap(result.motion.qpos, body).max() < 1e-3
    assert not any("in itself" in line for line in result.report.warnings)
    # as a body that is nowhere in its own way, it would be
    free = replace(body, build=body.build, origin={})
    assert own_overlap(transferred(across_the_belly(), free).motion.qpos, free).max() > 0.02


def test_a_robot_that_lists_its_pairs_keeps_those_apart_and_no_others(tmp_path: Path) -> None:
    xml = robot_xml()
    for name, geom in (("chest", 'size="0.07 0.1 0.15"'), ("right_bone", 'fromto="0.02 0 0 0.19 0 0"')):
        before, found, after = xml.rpartition(geom)  # of both forearms the right one comes last
        xml = f'{before}name="{name}" {found}{after}'
    body = load_robot(write_robot(tmp_path, xml, toml_of(more='pairs = [["chest", "right_bone"]]')))
    names = [{collision_model(body).model.geom(geom).name for geom in pair} for pair in collision_model(body).pairs]
    assert names == [{"chest", "right_bone"}]
    assert own_overlap(transferred(mirror(across_the_belly()), body).motion.qpos, body).max() < 1e-3
    everything = robot(tmp_path)
    left = transferred(across_the_belly(), body).motion.qpos
    assert own_overlap(left, everything).max() > 0.02


def test_joints_keep_their_speeds_and_the_import_names_those_that_are_late(tmp_path: Path) -> None:
    kick = simprep.library_motion("kick_front")
    body = robot(tmp_path, "[[drive]]\njoints = ['*knee']\nvelocity = 5\n[[drive]]\njoints = ['*']\nvelocity = 30\n")
    result = transferred(kick, body)
    speed = np.abs(np.diff(result.motion.qpos[:, 7:], axis=0)) * result.motion.fps
    assert (speed <= SPEED_SHARE * np.array(body.velocity_limits) + 1e-9).all()
    assert speed[:, body.joint("right_knee")].max() == pytest.approx(SPEED_SHARE * 5)
    assert any("slowed" in line and "right_knee" in line for line in result.report.warnings)
    assert at_full_speed(result.motion.qpos, result.motion.fps, replace(body, velocity_limits=())) == []


def test_nothing_is_in_the_floor_and_standing_soles_are_flat(tmp_path: Path) -> None:
    body = robot(tmp_path)
    walk = transferred(replace(cut(simprep.library_motion("walk"), 0, 30), loop=False), body).motion
    points = forward_kinematics(walk.qpos, body).foot_points
    assert points[..., 2].min() > -1e-3
    mid = walk.contacts & np.roll(walk.contacts, 3, axis=0) & np.roll(walk.contacts, -3, axis=0)
    mid[:3], mid[-3:] = False, False
    tilt = np.ptp(points[..., 2], axis=-1)
    assert np.median(tilt[mid]) < 2e-3


def test_without_mink_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mink", None)
    with pytest.raises(MissingExtraError, match=r"simprep\[robots\]"):
        transferred(across_the_belly(), robot(tmp_path))


def test_the_same_bits_again(tmp_path: Path) -> None:
    first, again = (transferred(across_the_belly(), robot(tmp_path)).motion.qpos for _ in range(2))
    np.testing.assert_array_equal(first, again)
