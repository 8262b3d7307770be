"""A folder stands for the one file of ours in it, wherever a command takes such a file."""

import json

import numpy as np
import pytest

from simprep.cli.main import main
from simprep.controller.best import best_policy
from simprep.controller.policy import save_policy
from simprep.duel.stream.store import read_stream, save_stream
from simprep.duel.stream.stream import DuelStream
from simprep.errors import SettingError
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.motion import Motion
from simprep.motion.store import read_motion, save_motion


def standing(name, x=0.0, turned=False):
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], 40, axis=0)
    qpos[:, 0] = x
    if turned:
        qpos[:, 3:7] = [0.0, 0.0, 0.0, 1.0]
    return Motion(qpos, 30.0, np.ones((40, 2), bool), name=name)


@pytest.fixture
def folders(tmp_path, monkeypatch):
    """`one` and `other` hold a motion each, `pair` a stream, each beside files of other kinds; `two` holds two of each."""
    monkeypatch.chdir(tmp_path)
    a, b = standing("a"), standing("b", 1.2, True)
    stream = DuelStream((a, b), name="bout")
    for folder, motion in (("one", a), ("other", b), ("two", a), ("two", b)):
        save_motion(motion, tmp_path / folder / motion.name)
    save_stream(stream, tmp_path / "pair" / "bout")
    for name in ("first", "second"):
        save_stream(stream, tmp_path / "two" / name)
    save_stream(stream, tmp_path / "one" / "bout")
    save_motion(a, tmp_path / "pair" / "a")
    for folder in ("one", "pair"):
        np.savez(tmp_path / folder / "foreign.npz", numbers=np.zeros(3))
        (tmp_path / folder / "damaged.npz").write_bytes(b"PK\x03\x04 no archive")
        (tmp_path / folder / "notes.txt").write_text("nothing of ours")
    (tmp_path / "empty").mkdir()
    return tmp_path


def test_track_and_import_take_the_motion_of_a_folder(folders, capsys):
    assert main(["track", "one", "--controller", "pd", "--seconds", "0.2", "--json", "--no-pictures", "-o", "out"]) == 0
    assert json.loads(capsys.readouterr().out)["motion"] == "a"
    assert main(["import", "one/", "-o", "copy.npz"]) == 0
    assert read_motion("copy.npz") == read_motion("one/a.npz")
    # where its own name would be the target, the file of the folder is not written over
    assert main(["import", "one", "-o", "one/a.npz"]) == 2
    assert "is the file to import" in capsys.readouterr().err


def test_a_folder_does_not_hide_a_motion_of_the_library(folders, capsys):
    save_motion(standing("impostor"), folders / "walk" / "impostor")
    assert (
        main(["track", "walk", "--controller", "pd", "--seconds", "0.2", "--json", "--no-pictures", "-o", "out"]) == 0
    )
    assert json.loads(capsys.readouterr().out)["motion"] == "walk"


def test_validate_takes_folders(folders, monkeypatch, capsys):
    plans = []

    def stop(plan, *_):
        plans.append(plan)
        raise SettingError("enough seen")

    monkeypatch.setattr("simprep.study.validate.run_study", stop)
    punch = save_motion(library_motion("punch_right"), folders / "punch" / "p")
    assert main(["validate", "--locomotion", "one", "--target", "punch", "-o", "out"]) == 2
    assert "enough seen" in capsys.readouterr().err
    assert plans[0].locomotion == read_motion("one/a.npz")
    assert plans[0].targets == (read_motion(punch),)


def test_duel_commands_take_the_streams_and_motions_of_folders(folders, capsys):
    assert main(["duel", "import", "one", "other", "-o", "pair.npz"]) == 0
    assert [motion.name for motion in read_stream("pair.npz").players] == ["a", "b"]
    assert main(["duel", "import", "pair", "-o", "same.npz", "--like", "pair"]) == 0
    assert read_stream("same.npz").name == "bout"
    assert main(["duel", "join", "pair", "pair.npz", "-o", "joined.npz"]) == 0
    assert len(read_stream("joined.npz").clips) == 2
    capsys.readouterr()
    for command in (["import", "pair"], ["join", "pair", "pair.npz"]):
        assert main(["duel", *command, "-o", "pair/bout.npz"]) == 2
        assert "give another with -o" in capsys.readouterr().err


def test_approach_takes_the_folder_of_a_controller(folders, capsys):
    save_policy(best_policy(), folders / "trained" / "policy")
    np.savez(folders / "trained" / "training.npz", header=np.array(json.dumps({"schema": "simprep.training/1"})))
    wanted = ["--goal", "1.6,0.2", "--no-physics", "--no-optimise", "--no-pictures", "--json"]
    assert main(["approach", *wanted, "--policy", "trained", "-o", "a"]) == 0
    assert json.loads(capsys.readouterr().out)["reached"] is True


@pytest.mark.parametrize(
    ("command", "folder", "said"),
    [
        ("track FOLDER", "two", "2 files that hold a simprep motion: a.npz, b.npz; valid: one of them"),
        ("track FOLDER", "empty", "a directory without a simprep motion; in it: no .npz"),
        ("validate --locomotion FOLDER", "two", "2 files that hold a simprep motion: a.npz, b.npz"),
        ("import FOLDER", "two", "2 files that hold a simprep motion: a.npz, b.npz"),
        ("approach --goal 1,0 --policy FOLDER", "one", "a directory without a policy; in it: a.npz, bout.npz, damaged.npz"),
        ("fight --model FOLDER", "pair", "a directory without a duel model"),
        ("duel analyse FOLDER", "two", "2 files that hold a stream of people: first.npz, second.npz; valid: one of them"),
        ("duel analyse FOLDER", "other", "a directory without a stream of people; in it: b.npz"),
        ("duel analyse pair --cuts FOLDER", "two", "a directory without a file of cuts; in it: no .txt"),
        ("duel analyse pair --annotations FOLDER", "two", "a directory without a table of annotations; in it: no .csv"),
        ("duel label FOLDER", "empty", "a directory without a stream of people"),
        ("duel join pair FOLDER", "two", "2 files that hold a stream of people"),
        ("duel import pair --like FOLDER", "two", "2 files that hold a stream of people"),
        ("duel import FOLDER", "two", "2 files that hold a stream of people"),
        ("duel import one FOLDER", "two", "2 files that hold a simprep motion"),
        ("fight --mode interactive --requests FOLDER", "two", "a directory without a table of requests"),
    ],
)  # fmt: skip
def test_a_folder_that_does_not_say_which_file_is_one_clear_error(command, folder, said, folders, capsys):
    before = sorted(folders.rglob("*"))
    assert main(command.replace("FOLDER", folder).split()) == 2
    printed = capsys.readouterr()
    *warnings, error = printed.err.splitlines()
    assert all(line.startswith("warning: ") for line in warnings)
    assert error.startswith(f"simprep: {folder}: ")
    assert said in error
    assert "Errno" not in error
    assert not printed.out
    assert sorted(folders.rglob("*")) == before
