"""Cleaning, following, folders of files, and the command."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from faults import FAULTS, once

from simprep.check.folder import check_folder
from simprep.check.follow import follow
from simprep.check.mend import mend
from simprep.check.motion_check import check_motion
from simprep.cli.main import main
from simprep.errors import MotionFileError
from simprep.library.registry import library_motion
from simprep.motion.formats.unitree_csv import write_unitree_csv
from simprep.motion.motion import Motion
from simprep.motion.store import read_motion, save_motion

MENDED = {
    "one foot 3 cm in the floor": "penetration",
    "body 3 cm in the floor": "penetration",
    "skating stance": "soles",
    "spike of 200 rad/s": "spikes",
    "feet floating 5 cm": "float",
    "hovering by 6 cm for a second": "float",
}


def fault(name: str, base: str = "walk") -> Motion:
    return next(one for one in FAULTS if one.name == name).apply(once(library_motion(base)))


@pytest.mark.parametrize("base", ["walk", "kick_front"])
@pytest.mark.parametrize("name", MENDED)
def test_what_is_mended_raises_nothing(name: str, base: str) -> None:
    mended = mend(fault(name, base))
    assert any(change.startswith(MENDED[name]) for change in mended.changes)
    assert check_motion(mended.motion).raised == ()


@pytest.mark.parametrize("base", ["walk", "kick_front", "jump", "crawl"])
def test_a_clean_motion_is_left_as_it_is(base: str) -> None:
    motion = once(library_motion(base))
    mended = mend(motion)
    assert mended.changes == ()
    assert mended.motion is motion


def test_limits_are_kept_after_mending() -> None:
    mended = mend(fault("joint 10 deg over its limit"))
    low, high = mended.motion.character.limits.T
    assert (mended.motion.qpos[:, 7:] >= low - 1e-9).all()
    assert (mended.motion.qpos[:, 7:] <= high + 1e-9).all()
    assert any("left_knee_flexion by up to 10.0 deg" in change for change in mended.changes)


def test_a_replay_is_what_was_simulated() -> None:
    motion = once(library_motion("step_forward"))
    followed = follow(motion, preset="live")
    assert followed.finding.verdict == "pass"
    assert followed.replay is not None
    assert followed.replay.fps == motion.fps
    assert len(followed.replay) == len(motion)
    assert np.abs(followed.replay.qpos[0] - followed.run.qpos[0]).max() == 0
    assert "simulated" in followed.replay.source


def test_a_motion_that_cannot_be_followed_fails() -> None:
    motion = once(library_motion("stand"))[:120]
    qpos = motion.qpos.copy()
    qpos[:, 2] += np.linspace(0, 1.5, len(qpos))  # ascends to heaven
    followed = follow(replace(motion, qpos=qpos), preset="live")
    assert followed.finding.verdict == "fail"
    assert followed.replay is None
    assert "fell at" in followed.finding.note or "farther than" in followed.finding.note


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    save_motion(once(library_motion("walk")), tmp_path / "clips" / "good.npz")
    save_motion(fault("spike of 200 rad/s"), tmp_path / "clips" / "more" / "bad.npz")
    (tmp_path / "clips" / "broken.bvh").write_text("nothing")
    return tmp_path / "clips"


def test_a_folder_goes_on_where_it_stopped(folder: Path, tmp_path: Path) -> None:
    looked = []

    def check(path: Path) -> dict:
        looked.append(path.name)
        return check_motion(read_motion(path)).as_dict()

    def decisions(settings: dict) -> dict[str, str]:
        found = check_folder(folder, tmp_path / "records", settings, check)
        return {path.name: record["decision"] for path, record, _ in found}

    first = check_folder(folder, tmp_path / "records", {"a": 1}, check)
    next(first)
    first.close()
    assert len(looked) == 1
    wanted = {"broken.bvh": "drop", "good.npz": "keep", "bad.npz": "drop"}
    assert decisions({"a": 1}) == wanted
    assert sorted(looked) == ["bad.npz", "broken.bvh", "good.npz"]
    assert decisions({"a": 1}) == wanted
    assert len(looked) == 3
    save_motion(once(library_motion("walk_fast")), folder / "good.npz")
    (tmp_path / "records" / "more" / "bad.npz.json").write_text("{")
    decisions({"a": 1})
    assert sorted(looked[3:]) == ["bad.npz", "good.npz"]
    decisions({"a": 2})
    assert len(looked) == 8


def test_an_empty_folder_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(MotionFileError, match="without a motion file"):
        list(check_folder(tmp_path, tmp_path / "records", {}, lambda path: {}))


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, dict]:
    code = main(["check-motion", *map(str, arguments), "--json", "--quiet"])
    out = capsys.readouterr().out
    return code, json.loads(out) if out else {}


def test_the_command_on_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, content = run(capsys, "walk", "--no-track")
    assert (code, content["verdict"], content["raised"]) == (0, "pass", [])
    path = save_motion(fault("spike of 200 rad/s"), tmp_path / "spike.npz")
    code, content = run(capsys, path, "--no-track")
    assert code == 1
    assert "joint velocity" in content["raised"]
    code, content = run(capsys, path, "--no-track", "--fix", tmp_path / "fixed.npz")
    assert (code, content["verdict"]) == (0, "pass")
    assert "joint velocity" in content["raised_before"]
    assert content["changes"]
    assert (tmp_path / "fixed.npz").is_file()
    assert run(capsys, path, "--no-track", "--fix", tmp_path / "fixed.csv", "--to", "unitree")[0] == 0
    assert (tmp_path / "fixed.csv").read_text()[0] in "-0123456789"


def test_the_command_writes_a_replay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    motion = once(library_motion("step_forward"))[:90]
    path = save_motion(motion, tmp_path / "step.npz")
    code, content = run(capsys, path, "--preset", "live", "--replay", tmp_path / "replay.csv")
    assert code == 0
    assert content["replay"] == str(tmp_path / "replay.csv")
    assert (tmp_path / "replay.csv").read_text().startswith("time_s")


def test_a_replay_keeps_to_the_ranges_and_says_what_was_set_back(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    motion = once(library_motion("step_forward"))[:60]
    qpos = motion.qpos.copy()
    joint = motion.character.joint("left_elbow_flexion")
    low, high = motion.character.limits.T
    qpos[:, 7 + joint] = high[joint]  # the simulated elbow gives way at its stop
    path = save_motion(replace(motion, qpos=qpos), tmp_path / "bent.npz")
    _, content = run(capsys, path, "--preset", "live", "--replay", tmp_path / "replay.npz")
    (change,) = content["replay_changes"]
    assert "left_elbow_flexion by up to" in change
    replay = read_motion(tmp_path / "replay.npz").qpos[:, 7:]
    assert (replay <= high).all()
    assert (replay >= low).all()
    assert replay[:, joint].max() == high[joint]


def test_the_command_on_a_folder(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, content = run(capsys, folder, "--no-track")
    assert (code, content["kept"], content["verdict"]) == (1, 1, "fail")
    assert (folder / "check-motion" / "good.npz.json").is_file()
    again, same = run(capsys, folder, "--no-track")
    assert (again, same["files"]) == (code, content["files"])


def test_a_robot_csv_is_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from simprep.primitive_robot import primitive_robot

    robot = primitive_robot()
    motion = Motion(np.tile(robot.standing_qpos, (60, 1)), 60, np.ones((60, 2), dtype=bool), character=robot)
    write_unitree_csv(motion, tmp_path / "stand.csv")
    code, content = run(capsys, tmp_path / "stand.csv", "--robot", "primitive_robot", "--file-fps", 60, "--no-track")
    assert (code, content["raised"], content["fps"]) == (0, [], 60)
    assert any("xyzw" in note for note in content["notes"])


def test_stored_velocities_show_a_wrong_frame_rate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from simprep.motion.formats.robot_write import write_beyondmimic
    from simprep.primitive_robot import primitive_robot

    robot = primitive_robot()
    qpos = np.tile(robot.standing_qpos, (60, 1))
    qpos[:, 7 + robot.joint("left_elbow")] -= 0.2 + 0.1 * np.sin(2 * np.pi * np.arange(60) / 60)
    write_beyondmimic(Motion(qpos, 30, np.ones((60, 2), dtype=bool), character=robot), tmp_path / "right.npz")
    with np.load(tmp_path / "right.npz") as arrays:
        np.savez(tmp_path / "wrong.npz", **{**arrays, "fps": [60]})
    options = ("--robot", "primitive_robot", "--no-track")
    assert run(capsys, tmp_path / "right.npz", *options)[0] == 0
    code, content = run(capsys, tmp_path / "wrong.npz", *options)
    assert (code, content["raised"]) == (1, ["frame rate: velocities"])
    assert run(capsys, tmp_path / "wrong.npz", *options, "--file-fps", 30)[0] == 0
    assert [one["decision"] for one in run(capsys, tmp_path, *options)[1]["files"]] == ["keep", "drop"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("walk", "--no-track", "--replay", "a.npz"), "valid: one of them"),
        (("nowhere.csv",), "no such file"),
        (("walk", "--no-track", "--fix", "a.xyz"), "unknown extension"),
        (("walk.npz", "--robot", "nobody"), "no such file|unknown character"),
    ],
)
def test_bad_input_is_one_line(arguments, message, capsys, tmp_path, monkeypatch) -> None:
    import re

    monkeypatch.chdir(tmp_path)
    assert main(["check-motion", *arguments]) == 2
    error = capsys.readouterr().err
    assert len(error.strip().splitlines()) == 1
    assert re.search(message, error)
