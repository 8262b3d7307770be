"""Robot files that cannot be used: one clear error each, exit code 2, no traceback."""

from pathlib import Path

import pytest
from robot_models import robot_xml, toml_of, write_robot

from simprep.cli.main import main
from simprep.errors import RobotFileError, UnknownNameError
from simprep.robots.load import load_robot

LOOP = '<equality><connect body1="left_foot" body2="right_foot" anchor="0 0 0"/></equality>'
BROKEN_MODELS = {
    "no free joint": (robot_xml(root=""), r"synthetic\.xml: no free joint.*pelvis.*valid: <freejoint/>"),
    "no feet": (robot_xml("none"), r"the foot 'left_foot' has no colliding geom"),
    "unlimited joint": (robot_xml(knee='limited="false"'), r"joints without limits: left_knee; valid: a range.*\[limits\]"),
    "no actuators": (robot_xml(actuators="none"), r"no actuators, and no torque limit of left_hip_pitch, .*\[\[drive\]\]"),
    "cyclic include": (robot_xml(before='<include file="synthetic.xml"/>'), r"no valid MJCF \(.*include"),
    "missing include": (robot_xml(before='<include file="other.xml"/>'), r"no valid MJCF \(.*other\.xml"),
    "missing mesh": (
        robot_xml("mesh").replace('<mesh name="foot" vertex=', '<mesh name="foot" file="foot.stl"/><mesh name="b" vertex='),
        r"no valid MJCF \(.*foot\.stl",
    ),
    "slide joint": (robot_xml(looks='<body><joint type="slide"/><geom size="0.1"/></body>'), r"is a slide joint; valid: hinges"),
    "ring of bodies": (robot_xml(extra=LOOP), r"close rings of bodies.*'left_foot' and 'right_foot'"),
    "no MJCF": ("<robot name='a'/", r"no valid MJCF"),
    "no joints": (
        '<mujoco><worldbody><body name="box"><freejoint/><geom size="1"/></body></worldbody></mujoco>',
        r"nothing hangs on the body with the free joint \(box\)",
    ),
    "two robots": (
        robot_xml().replace("</worldbody>", '<body><freejoint/><body><geom size="1"/></body></body></worldbody>'),
        r"2 bodies with free joints",
    ),
}  # fmt: skip
BROKEN_DESCRIPTIONS = {
    "no TOML": ("name = ", r"synthetic\.toml: no valid TOML"),
    "another schema": ('schema = "simprep.robot/9"', r"schema 'simprep\.robot/9'; this version reads 'simprep\.robot/1'"),
    "unknown key": (toml_of(more="colour = 'red'"), r"unknown key 'colour'; valid: schema, name, model"),
    "unknown role": (toml_of().replace("thorax =", "tail ="), r"unknown key 'tail' in roles; valid: pelvis, abdomen"),
    "unknown movement": (toml_of().replace("lumbar_rotation", "waist_yaw"), r"unknown key 'waist_yaw' in joints; valid: lum"),
    "unknown body": (toml_of().replace('"left_shank"', '"left_shin"'), r"unknown body .*'left_shin'; valid: pelvis, left_hip"),
    "unknown joint": (toml_of().replace('"left_knee"', '"left_bend"'), r"unknown joint .*'left_bend'; valid: left_hip_pitch"),
    "no name": (toml_of().replace('name = "synthetic"\n', "", 1), r"no 'name'; needed: name, roles, joints"),
    "no foot": (toml_of().replace('left_foot = "left_foot"\n', ""), r"no role 'left_foot'"),
    "a joint left out": (toml_of().replace('lumbar_rotation = "waist"\n', ""), r"says nothing of the joints waist; valid: .*locked"),
    "text for a number": (toml_of(standing='"much"'), r"standing\.left_elbow is 'much'; valid: a number"),
    "a negative torque": (toml_of() + "[[drive]]\njoints = ['*']\ntorque = -1", r"drive\.torque is '-1'; valid: a number above 0"),
    "limits turned round": (toml_of() + "[limits]\nwaist = [1, -1]", r"limits\.waist is .*valid: a lower limit below the upper"),
    "half a sole": (toml_of() + "[soles]\nleft = ['a']", r"soles: as many on the left as on the right"),
    "unknown sole": (toml_of() + "[soles]\nleft = ['a']\nright = ['b']", r"unknown geom .*'a'; valid:"),
}  # fmt: skip


@pytest.mark.parametrize("what", BROKEN_MODELS)
def test_a_broken_model_is_named(tmp_path: Path, what: str) -> None:
    xml, message = BROKEN_MODELS[what]
    path = write_robot(tmp_path, xml)
    with pytest.raises(RobotFileError, match=message):
        load_robot(path)


@pytest.mark.parametrize("what", BROKEN_DESCRIPTIONS)
def test_a_broken_description_is_named(tmp_path: Path, what: str) -> None:
    toml, message = BROKEN_DESCRIPTIONS[what]
    with pytest.raises(RobotFileError, match=message):
        load_robot(write_robot(tmp_path, robot_xml(), toml))


def test_the_command_line_says_it_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number, (xml, _) in enumerate(BROKEN_MODELS.values()):
        (tmp_path / str(number)).mkdir()
        path = write_robot(tmp_path / str(number), xml)
        assert main(["track", "walk", "--robot", str(path)]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert len(err.strip().splitlines()) == 1
        assert err.startswith(f"simprep: {path}")


def test_missing_files_and_unknown_names_say_what_there_is(tmp_path: Path) -> None:
    with pytest.raises(RobotFileError, match=r"nobody\.xml: no such file"):
        load_robot(tmp_path / "nobody.xml")
    with pytest.raises(RobotFileError, match=r"nobody\.toml: cannot be read \(No such file"):
        load_robot(tmp_path / "nobody.toml")
    with pytest.raises(
        UnknownNameError, match=r"unknown robot 'optimus'; valid: .*unitree_g1.*path of a robot's \.xml"
    ):
        load_robot("optimus")
    path = write_robot(tmp_path, robot_xml())
    path.with_suffix(".toml").unlink()
    with pytest.raises(
        RobotFileError, match=r"no synthetic\.toml beside it.*unitree_g1.*robot describe synthetic\.xml"
    ):
        load_robot(path)


def test_looks_need_no_meshes(tmp_path: Path) -> None:
    """Geoms that only show the robot are left out, and with them the files of their meshes."""
    looks = '<inertial pos="0 0 0" mass="5" diaginertia="0.1 0.1 0.1"/><geom type="mesh" mesh="shell" contype="0" conaffinity="0"/>'
    xml = robot_xml(looks=looks).replace("<asset>", '<asset><mesh name="shell" file="nowhere.stl"/>')
    assert len(load_robot(write_robot(tmp_path, xml)).joints) == 21


def test_a_toml_may_name_its_model(tmp_path: Path) -> None:
    path = write_robot(tmp_path, robot_xml())
    toml = tmp_path / "elsewhere.toml"
    toml.write_text(toml_of("elsewhere").replace('model = "elsewhere.xml"', 'model = "synthetic.xml"'))
    robot = load_robot(toml)
    assert robot.name == "elsewhere"
    assert robot.origin["mjcf"] == str(path)
    toml.write_text(toml_of("elsewhere").replace('model = "elsewhere.xml"\n', ""))
    with pytest.raises(RobotFileError, match=r"elsewhere\.toml: names no model; valid: model = "):
        load_robot(toml)


def test_a_name_without_the_extra_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import sys

    monkeypatch.setitem(sys.modules, "mujoco_menagerie", None)
    assert main(["track", "walk", "--robot", "unitree_h1"]) == 2
    assert "pip install 'simprep[robots]'" in capsys.readouterr().err


def test_a_model_that_cannot_be_downloaded_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys
    from types import SimpleNamespace

    class MenagerieError(Exception):
        pass

    def xml(entry: str) -> Path:
        raise MenagerieError(f"{entry}: no network")

    known = SimpleNamespace(default_model="h1", xml=xml)
    monkeypatch.setitem(
        sys.modules, "mujoco_menagerie", SimpleNamespace(MenagerieError=MenagerieError, get=lambda name: known)
    )
    with pytest.raises(
        RobotFileError, match=r"'unitree_h1' is not here.*h1: no network.*MENAGERIE_ROOT.*path of its \.xml"
    ):
        load_robot("unitree_h1")
