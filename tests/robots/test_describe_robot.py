"""`simprep robot describe` writes a first description by itself; `list` shows what is shipped."""

import json
from pathlib import Path

import pytest
from robot_models import robot_xml, toml_of, write_robot

from simprep.cli.main import main
from simprep.errors import RobotFileError
from simprep.humanoid_model import humanoid, mjcf_folder
from simprep.primitive_robot import primitive_robot
from simprep.robots.describe import describe_robot
from simprep.robots.description import read_description
from simprep.robots.load import load_robot
from simprep.robots.resolve import shipped_robots


def described(mjcf: Path, folder: Path) -> Path:
    toml = folder / "first.toml"
    toml.write_text(describe_robot(mjcf).text)
    return toml


@pytest.mark.parametrize("feet", ["capsules", "mesh"])
def test_a_description_by_itself_is_the_one_by_hand(tmp_path: Path, feet: str) -> None:
    by_hand = load_robot(write_robot(tmp_path, robot_xml(feet)))
    path = tmp_path / "synthetic.xml"
    assert main(["robot", "describe", str(path), "-o", str(tmp_path / "synthetic.toml"), "--quiet"]) == 0
    by_itself = load_robot(path)
    assert dict(by_itself.anatomy) == dict(by_hand.anatomy)
    assert dict(by_itself.roles) == dict(by_hand.roles)
    assert dict(by_itself.mirror) == dict(by_hand.mirror)
    assert by_itself.standing_qpos == pytest.approx(by_hand.standing_qpos, abs=1e-5)
    assert by_itself.soles == by_hand.soles


@pytest.mark.parametrize(("file", "known"), [("humanoid.xml", humanoid()), ("primitive_robot.xml", primitive_robot())])
def test_our_own_bodies_are_recognised(tmp_path: Path, file: str, known: object) -> None:
    found = read_description(described(mjcf_folder() / file, tmp_path))
    assert isinstance(known, type(humanoid()))
    assert dict(found.roles) == dict(known.roles)
    assert {joint: known.movement(joint) for joint in known.joints} == {j: m for m, j in found.movements.items()}
    assert not found.standing


def test_the_g1_is_recognised(tmp_path: Path, g1_model: Path) -> None:
    found, shipped = read_description(described(g1_model, tmp_path)), read_description(shipped_robots()["unitree_g1"])
    assert dict(found.roles) == dict(shipped.roles)
    assert dict(found.movements) == dict(shipped.movements)
    assert dict(found.standing) == pytest.approx(dict(shipped.standing), abs=1e-5)


def test_what_is_missing_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_robot(tmp_path, robot_xml(actuators="none", knee='limited="false"'))
    assert main(["robot", "describe", str(path), "--json"]) == 0
    checks = "\n".join(json.loads(capsys.readouterr().out)["checks"])
    assert "lacks torque limits" in checks
    assert "no limits in the model, [limits] is a guess: left_knee" in checks
    assert "the left arm has no wrist: its hand is put at" in checks
    path.write_text(robot_xml().replace("left_hip_roll", "roll_a").replace("right_hip_roll", "roll_b"))
    assert "roll_a" in describe_robot(path).text


def test_what_is_no_humanoid_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(
        "<mujoco><worldbody><body><freejoint/><geom size='0.1'/><body><joint/><geom size='0.1'/></body></body></worldbody></mujoco>"
    )
    with pytest.raises(RobotFileError, match=r"no humanoid: no chain of joints on the left"):
        describe_robot(path)


def test_shipped_robots_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["robot", "list", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert {row["name"]: row["joints"] for row in rows} == {
        "booster_t1": 22, "fourier_n1": 23, "pndbotics_adam_lite": 25, "unitree_g1": 29, "unitree_h1": 19,
    }  # fmt: skip


def test_a_motion_of_one_body_is_imported_onto_another(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write_robot(tmp_path, robot_xml(), toml_of())
    wave = tmp_path / "walk.npz"
    from simprep.library.registry import library_motion
    from simprep.motion.edit import cut
    from simprep.motion.store import read_motion, save_motion

    save_motion(cut(library_motion("walk"), 0, 30), wave)
    moved = tmp_path / "moved.npz"
    assert main(["import", str(wave), "--robot", str(path), "-o", str(moved)]) == 0
    assert read_motion(moved).character == load_robot(path)
    assert "mean joint distance to the source" in capsys.readouterr().out
    assert main(["import", str(moved), "--robot", "humanoid", "-o", str(tmp_path / "back.npz"), "--quiet"]) == 0
    assert read_motion(tmp_path / "back.npz").character == humanoid()
