"""Formats that are written: what is read back is what was written, in every format the same body."""

from dataclasses import replace
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import mujoco
import numpy as np
import pytest
from format_cases import random_motion

from simprep.character import Character
from simprep.humanoid_model import humanoid
from simprep.library.registry import library_motion
from simprep.motion.formats.bvh import read_bvh
from simprep.motion.formats.registry import FORMATS, format_to_write
from simprep.motion.formats.trc import read_trc
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import import_motion
from simprep.motion.motion import Motion
from simprep.motion.rotations import rotation_matrix
from simprep.primitive_robot import primitive_robot


def leaning_robot() -> Character:
    """The robot with a bent elbow in its reference pose, and with a hinge that leans."""

    def build() -> mujoco.MjSpec:
        spec = primitive_robot().build()
        spec.joint("left_elbow").ref = 0.4
        spec.body("left_forearm").quat = [0.98, 0.1, 0.1, 0.1]
        return spec

    return replace(primitive_robot(), build=build)


BODIES = {
    "humanoid": humanoid(), "another size": humanoid(1.62, 58.0), "robot": primitive_robot(), "leaning robot": leaning_robot()
}  # fmt: skip
EXTENSIONS = ("npz", "bvh", "trc", "mot", "sto", "csv", *(("c3d",) if find_spec("ezc3d") else ()))
SINGLE_PRECISION = {"c3d": 5e-5}
"""Largest difference of an angle where the format has no double precision [rad]; 1e-6 elsewhere."""


def written(motion: Motion, path: Path) -> Motion:
    """A motion written to a file and read back."""
    form = format_to_write(path)
    assert form.write is not None
    form.write(motion, path)
    return import_motion(path, character=motion.character).motion


# simprep's own file names the robot, not how it leans
COMBINATIONS = [pair for pair in product(EXTENSIONS, BODIES) if pair != ("npz", "leaning robot")]


@pytest.mark.parametrize(("extension", "body"), COMBINATIONS)
def test_poses_come_back(tmp_path: Path, extension: str, body: str) -> None:
    motion = random_motion(BODIES[body])
    back = written(motion, tmp_path / f"a.{extension}")
    assert len(back) == len(motion)
    assert back.fps == pytest.approx(motion.fps, rel=1e-9)
    assert back.character.name == motion.character.name
    assert back.character.height_m == pytest.approx(motion.character.height_m, abs=1e-4)
    tolerance = SINGLE_PRECISION.get(extension, 1e-6)
    same_height = back.character.height_m == motion.character.height_m
    assert np.abs(back.qpos[:, :3] - motion.qpos[:, :3]).max() < 1e-6
    turn, wanted = rotation_matrix(back.qpos[:, 3:7]), rotation_matrix(motion.qpos[:, 3:7])
    assert np.abs(turn - wanted).max() < tolerance
    place = [forward_kinematics(one.qpos, one.character).xpos for one in (back, motion)]
    assert np.abs(place[0] - place[1]).max() < (2e-6 if same_height else 2e-5)
    # three hinges of a joint have two solutions where both are within the limits; the body is the same
    near = np.abs(back.qpos[:, 7:] - motion.qpos[:, 7:]) < tolerance
    assert near.mean() > (0.97 if extension in ("bvh", "trc", "c3d") else 0.9999)
    again = written(back, tmp_path / f"b.{extension}")
    assert np.abs(again.qpos - back.qpos).max() < tolerance


@pytest.mark.parametrize("name", ["walk", "roundhouse_right_head", "get_up_prone"])
def test_one_motion_is_the_same_body_in_all_formats(tmp_path: Path, name: str) -> None:
    motion = library_motion(name)
    wanted = forward_kinematics(motion.qpos).xpos
    for extension in EXTENSIONS:
        back = written(motion, tmp_path / f"a.{extension}")
        assert np.abs(back.qpos - motion.qpos).max() < SINGLE_PRECISION.get(extension, 1e-6), extension
        assert np.abs(forward_kinematics(back.qpos).xpos - wanted).max() < 1e-3, extension
        assert back.character == motion.character


def test_files_are_recognised_by_content(tmp_path: Path) -> None:
    motion = random_motion(humanoid(), frames=5)
    for form in FORMATS:
        if form.write is None or form.read is None:
            continue
        path = tmp_path / f"{form.name}.dat"
        form.write(motion, path)
        report = import_motion(path).report
        assert "by its content, though it is called .dat" in report.recognised
        assert report.frames == 5


def test_what_is_lost_is_said(tmp_path: Path) -> None:
    walk = library_motion("walk")
    for extension in EXTENSIONS[1:]:
        form = format_to_write(tmp_path / f"a.{extension}")
        assert form.write is not None
        notes = form.write(walk, tmp_path / "a")
        assert [note.split(":")[0] for note in notes] == [
            "the events are not kept",
            "that the motion is a loop is not kept",
        ]


@pytest.mark.parametrize("body", BODIES)
def test_bvh_and_points_show_the_body_where_it_is(tmp_path: Path, body: str) -> None:
    """Read as if it were foreign, a file has the joints where the model has them."""
    motion = random_motion(BODIES[body])
    wanted = forward_kinematics(motion.qpos, motion.character).xpos
    for extension, axes in (("bvh", [2, 0, 1]), ("trc", [0, 2, 1])):
        path = tmp_path / f"a.{extension}"
        format_to_write(path).write(motion, path)  # type: ignore[misc]
        if extension == "bvh":
            clip = read_bvh(path)
            names, positions = clip.names, clip.positions / 100
        else:
            points = read_trc(path)
            names, positions = points.names, points.positions / 1000
        for segment, name in enumerate(motion.character.segments):
            shown = positions[:, names.index(name)][:, axes] * ([1, -1, 1] if extension == "trc" else [1, 1, 1])
            assert np.abs(shown - wanted[:, segment]).max() < 1e-6, (extension, name)


@pytest.mark.parametrize(
    "clip", ["cmu/bvh/002_05.bvh", "deepmimic/humanoid3d_spin.txt", "deepmimic/humanoid3d_getup_faceup.txt"]
)
def test_captured_motions_are_the_same_body_in_all_formats(data_dir: Path, tmp_path: Path, clip: str) -> None:
    motion = import_motion(data_dir / clip).motion
    wanted = forward_kinematics(motion.qpos).xpos
    for extension in EXTENSIONS:
        back = written(motion, tmp_path / f"a.{extension}")
        assert np.abs(forward_kinematics(back.qpos).xpos - wanted).max() < 1e-5, extension
        assert np.abs(back.qpos[:, 7:] - motion.qpos[:, 7:]).max() < 1e-3, extension
