"""The command line: exit codes, one-line errors, help, exactly one JSON object, nothing heavy before it is needed."""

import errno
import json
import subprocess
import sys
from typing import get_args

import numpy as np
import pytest

from simprep.cli.main import Command, main
from simprep.errors import SettingError
from simprep.humanoid_model import humanoid
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion
from simprep.physics.store import read_run

COMMANDS = ("validate", "track", "import", "library", "train", "approach", "graph", "push", "stability")
TRACK_KEYS = {
    "success", "end", "fell_at_s", "g_mpjpe_mm", "mpjpe_mm", "foot_slip_ratio", "penetration_mm", "s_per_s", "assist_n",
}  # fmt: skip


@pytest.fixture
def arm_raise(tmp_path):
    """A file with 0.8 s of standing while an arm rises."""
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], 25, axis=0)
    qpos[:, 7 + humanoid().joint("left_shoulder_flexion")] = np.linspace(0, 0.6, 25)
    motion = Motion(qpos, 30.0, np.ones((25, 2), bool), name="arm_raise", source="test")
    return save_motion(motion, tmp_path / "arm_raise.npz")


def test_help_loads_nothing_heavy():
    heavy = ["numpy", "scipy", "mujoco", "pysindy", "matplotlib", "PIL"]
    code = (
        "import sys; from simprep.cli.main import main; assert main(['--help']) == 0; "
        f"print('LOADED', [name for name in {heavy!r} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith("LOADED []")


@pytest.mark.parametrize(("former", "present"), [("analyze", "analyse"), ("example", "synthetic")])
def test_subcommands_answer_to_their_former_names(former, present, capsys):
    assert main(["duel", former, "--help"]) == 0
    assert f"simprep duel {present}" in capsys.readouterr().out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_with_an_example(command, capsys):
    assert main([command, "--help"]) == 0
    assert f"Example: simprep {command}" in capsys.readouterr().out.replace("\n", " ")


@pytest.mark.parametrize(
    "arguments", [["nonsense"], ["track"], ["library"], ["track", "walk", "--seed", "x"], ["validate", "--foo"]]
)
def test_wrong_usage_exits_2(arguments, capsys):
    assert main(arguments) == 2
    assert not capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["track", "no_such_motion"], ("unknown motion 'no_such_motion'", "walk", ".bvh")),
        (["track", "missing/file.bvh"], ("missing/file.bvh", "no such file")),
        (["validate", "--target", "walk", "walk"], ("targets walk, walk", "all different")),
        (["validate", "--target", "stand", "--alpha", "1.5"], ("alpha 1.5", "0 to 1")),
        (["validate", "--target-frame", "3"], ("--target-frame", "exactly one --target")),
        (["validate", "--seeds", "0"], ("--seeds 0", "1 to 1000")),
        (["track", "walk", "--seed", "-1"], ("--seed -1", "0 or more")),
        (["track", "walk", "--kicks", "-1"], ("--kicks -1", "a seed, 0 or more")),
        (["track", "walk", "--delay-ms", "1000"], ("--delay-ms 1000", "0 to 200")),
        (["approach", "--goal", "1,0", "--seed", "-1"], ("--seed -1", "0 or more")),
    ],
)
def test_a_bad_wish_is_one_line_and_exit_2(arguments, words, capsys):
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert not printed.out
    assert printed.err.startswith("simprep: ")
    assert printed.err.count("\n") == 1
    for word in words:
        assert word in printed.err


@pytest.mark.parametrize(
    ("command", "place", "words"),
    [
        (["track", "walk"], "file", "file is a file; valid: a folder"),
        (["push", "stand"], "file/sub/x", "file is a file; valid: a folder"),
        (["import", "no.bvh"], "file/x.npz", "file is a file; valid: a folder"),
        (["import", "no.bvh"], ".", "a folder; valid: a file"),
    ],
)
def test_a_place_that_cannot_be_written_is_said_before_the_work(command, place, words, tmp_path, capsys):
    (tmp_path / "file").write_text("in the way")
    assert main([*command, "-o", str(tmp_path / place)]) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith(f"simprep: -o {tmp_path / place}: ")
    assert words in printed.err
    assert printed.err.count("\n") == 1


def test_a_disk_that_is_full_is_one_line_and_exit_2(arm_raise, tmp_path, monkeypatch, capsys):
    def full(*_, **__):
        raise OSError(errno.ENOSPC, "No space left on device", str(tmp_path / "run.npz"))

    monkeypatch.setattr("simprep.physics.store.save_run", full)
    assert main(["track", str(arm_raise), "--controller", "pd", "--no-pictures", "--quiet", "-o", str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"simprep: {tmp_path / 'run.npz'}: No space left on device\n"


def test_an_error_in_a_process_has_no_traceback(tmp_path):
    (tmp_path / "bad.npz").write_bytes(b"not an archive")
    command = [sys.executable, "-m", "simprep.cli.main", "track", str(tmp_path / "bad.npz")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("simprep: ")
    assert "Traceback" not in done.stderr
    assert done.stderr.count("\n") == 1


def test_track_prints_one_json_object_and_writes_its_files(arm_raise, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["track", str(arm_raise), "--controller", "pd", "-o", str(out), "--json", "--no-pictures"]) == 0
    printed = capsys.readouterr()
    content = json.loads(printed.out)
    assert set(content) >= TRACK_KEYS
    assert content["end"] == "done"
    assert content["success"] is True
    assert content["assist_n"] == 0
    assert 0 < content["mpjpe_mm"] < 200
    assert str(out / "run.npz") in printed.err
    assert json.loads((out / "metrics.json").read_text()) == content
    run = read_run(out)
    assert (run.reference.name, run.controller, run.end) == ("arm_raise", "pd", "done")
    assert (run.qpos.shape, run.foot_contact.shape) == ((run.steps + 1, humanoid().nq), (run.steps, 2))
    assert run.end_s == content["survived_s"]


def test_track_in_a_world_that_the_controller_does_not_know(arm_raise, tmp_path, capsys):
    arguments = ["track", str(arm_raise), "--controller", "pd", "-o", str(tmp_path / "out"), "--json", "--no-pictures"]
    wrong = ["--mass-scale", "1.1", "--friction", "0.6", "--strength", "0.9", "--delay-ms", "10", "--noise", "0.5"]
    assert main([*arguments, *wrong, "--kicks", "3"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["settings"]["mismatch"] == {
        "mass_scale": 1.1, "friction": 0.6, "strength": 0.9, "delay_s": 0.01, "noise": 0.5,
    }  # fmt: skip
    assert content["assist_kick_mps"] == 0.0  # the clip ends before the first kick
    assert read_run(tmp_path / "out").settings["mismatch"]["strength"] == 0.9
    assert main([*arguments, "--mass-scale", "9"]) == 2
    assert "mismatch: mass_scale 9.0; valid: 0.2 to 5" in capsys.readouterr().err


@pytest.mark.parametrize(("frames", "used"), [("0:600", 25), ("10:26", 15)])
def test_frames_beyond_the_end_are_left_out_and_that_is_said(arm_raise, frames, used, tmp_path, capsys):
    arguments = ["track", str(arm_raise), "--controller", "pd", "-o", str(tmp_path / "out"), "--json", "--no-pictures"]
    assert main([*arguments, "--frames", frames]) == 0
    printed = capsys.readouterr()
    said = f"arm_raise: --frames {frames} goes beyond its 25 frames; {25 - used}:25 is used"
    assert printed.err.startswith(f"warning: {said}\n")
    assert json.loads(printed.out)["warnings"] == [said]
    assert json.loads(printed.out)["survived_s"] == pytest.approx((used - 1) / 30, abs=0.01)
    assert main([*arguments, "--frames", ":25"]) == 0
    assert "warning" not in capsys.readouterr().err


def test_track_frames_and_seconds(arm_raise, tmp_path, capsys):
    arguments = ["track", str(arm_raise), "--controller", "pd", "-o", str(tmp_path / "out"), "--json", "--no-pictures"]
    assert main([*arguments, "--frames", "5:20"]) == 0
    assert json.loads(capsys.readouterr().out)["survived_s"] == pytest.approx(14 / 30, abs=0.01)
    assert main([*arguments, "--seconds", "0.3"]) == 0
    assert json.loads(capsys.readouterr().out)["survived_s"] == pytest.approx(0.3, abs=0.01)
    assert main([*arguments, "--frames", "20:5"]) == 2
    assert "frames 20:5" in capsys.readouterr().err
    for beyond in ("25:30", "40:"):
        assert main([*arguments, "--frames", beyond]) == 2
        assert "valid: 0 <= a < b <= 25" in capsys.readouterr().err
    assert main([*arguments, "--frames", "a:5"]) == 2
    assert "--frames 'a:5'" in capsys.readouterr().err


def leaves(command=Command, words=()):
    """Every command: its words, and its class."""
    for part in get_args(command):
        kind, subcommand = get_args(part)[:2]
        here = (*words, subcommand.name)
        yield from leaves(kind, here) if get_args(kind) else [(here, kind)]


@pytest.mark.parametrize(("words", "kind"), [pytest.param(*leaf, id=" ".join(leaf[0])) for leaf in leaves()])
def test_every_command_has_json_and_quiet(words, kind, monkeypatch, capsys):
    def work(self, output):
        assert (self.json, self.quiet) == (output.as_json, output.quiet)
        output.say("a table")
        output.warn("a doubt")
        return {"complete": True}

    monkeypatch.setattr(kind, "_run", work)
    needed = {
        "approach": ["--goal", "1,0"],
        "fetch": ["cmu"],
        "synthetic": ["kickboxing"],
        "convert": ["x", "y"],
        "check": ["x", "--baseline", "b.json"],
        "render": ["x", "-o", "y.png"],
    }.get(words[-1])
    if needed is None:
        takes_one = (
            "track",
            "push",
            "margins",
            "sweep",
            "stability",
            "view",
            "import",
            "check-motion",
            "join",
            "label",
            "analyse",
            "show",
            "describe",
        )
        needed = ["x"] if words[-1] in takes_one else []
    printed = {}
    for flags in ([], ["--quiet"], ["--json"], ["--json", "--quiet"]):
        assert main([*words, *needed, *flags]) == 0
        printed[tuple(flags)] = tuple(capsys.readouterr())
    doubt, content = "warning: a doubt\n", '{"complete": true}\n'
    assert printed == {
        (): ("a table\n", doubt),
        ("--quiet",): ("", doubt),
        ("--json",): (content, f"a table\n{doubt}"),
        ("--json", "--quiet"): (content, doubt),
    }


def test_quiet_leaves_the_json_of_a_command_and_says_nothing_more(arm_raise, tmp_path, capsys):
    arguments = ["track", str(arm_raise), "--controller", "pd", "-o", str(tmp_path / "out"), "--no-pictures"]
    assert main([*arguments, "--json", "--quiet"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out) == json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert printed.err == ""
    assert main([*arguments, "--quiet", "--frames", "40:"]) == 2
    assert capsys.readouterr().err.startswith("simprep: arm_raise: frames 40:25")


@pytest.mark.parametrize(
    ("problem", "code", "said"),
    [(KeyboardInterrupt("3 cases are kept"), 130, "3 cases are kept"), (SettingError("two\nlines"), 2, "two lines")],
)
def test_what_a_command_raises_becomes_an_exit_code(problem, code, said, monkeypatch, capsys):
    def fail(self):
        raise problem

    monkeypatch.setattr("simprep.cli.track.Track.run", fail)
    assert main(["track", "walk"]) == code
    assert said in capsys.readouterr().err
