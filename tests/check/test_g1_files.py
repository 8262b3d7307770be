"""Real motion files of a real robot: karate of the Unitree G1, in every format, checked and with faults."""

from pathlib import Path

import numpy as np
import pytest
from faults import FAULTS

from simprep.character import Character
from simprep.check.motion_check import check_motion
from simprep.motion.formats.registry import format_to_write
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import import_motion
from simprep.motion.motion import Motion
from simprep.robots.load import load_robot

CLIPS = ("B_SpinKarate", "M_Move18", "M_Move2", "M_ShortMove12")
FOUND = (
    "xyzw read as wxyz", "wxyz read as xyzw", "one foot 3 cm in the floor", "joint 10 deg over its limit", "spike of 200 rad/s",
    "left and right swapped", "y up", "y up in the position", "feet floating 5 cm", "hovering by 6 cm for a second",
    "root reversed", "root travels backwards", "joints breadth first", "angles in degrees", "position in centimetres",
    "teleport by 30 cm", "arm in the body",
)  # fmt: skip


@pytest.fixture(scope="module")
def robot(g1_model: Path) -> Character:
    return load_robot(g1_model)


def karate(data_dir: Path, robot: Character, name: str) -> Motion:
    return import_motion(data_dir / "g1_karate" / f"{name}.csv", character=robot, file_fps=60).motion


@pytest.mark.parametrize("name", ["unitree", "beyondmimic", "mjlab", "gmr", "holosoma", "csv"])
def test_formats_agree(name: str, data_dir: Path, robot: Character, tmp_path: Path) -> None:
    motion = karate(data_dir, robot, "M_ShortMove12")
    form = format_to_write(Path("any"), name)
    path = tmp_path / f"again{form.suffixes[0]}"
    form.write(motion, path)
    again = import_motion(path, character=robot, file_fps=60 if name == "unitree" else None).motion
    assert again.fps == 60
    np.testing.assert_allclose(again.qpos, motion.qpos, atol=1e-6)
    bodies, before = (forward_kinematics(one.qpos, robot).xpos for one in (again, motion))
    assert np.abs(bodies - before).max() < 1e-3


@pytest.mark.parametrize("name", CLIPS)
def test_karate_is_read_as_it_was_meant(name: str, data_dir: Path, robot: Character) -> None:
    checked = check_motion(karate(data_dir, robot, name))
    assert set(checked.raised) <= {"self-collision"}
    assert checked.verdict != "fail"


@pytest.mark.parametrize("name", FOUND)
def test_faults_are_found(name: str, data_dir: Path, robot: Character) -> None:
    fault = next(one for one in FAULTS if one.name == name)
    raised = check_motion(fault.apply(karate(data_dir, robot, "M_ShortMove12"))).raised
    assert set(raised) & set(fault.raised), raised


@pytest.mark.parametrize(
    "name",
    [
        "bandai-namco/dash_tired_001.bvh", "bandai-namco/walk-left_normal_001.bvh", "cmu/asfamc/02_04.amc",
        "cmu/bvh/006_10.bvh", "deepmimic/humanoid3d_run.txt", "deepmimic/humanoid3d_dance_spin.txt",
    ],
)  # fmt: skip
def test_people_moved_onto_it_raise_nothing(name: str, data_dir: Path, robot: Character) -> None:
    """No threshold was looked at on a person's clip that was moved onto a robot."""
    assert check_motion(import_motion(data_dir / name, character=robot).motion).raised == ()
