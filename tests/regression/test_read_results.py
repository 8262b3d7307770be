"""What simprep's commands write, and tables of other programs, as numbers by case and seed; and the command itself."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import simprep
from simprep.cli.main import main
from simprep.errors import MotionFileError, SettingError
from simprep.metrics.evaluate import evaluate_run
from simprep.regression.compare import Row
from simprep.regression.figure import judged, moved
from simprep.regression.measured import Case, numbers
from simprep.regression.page import runs_of, runs_replay
from simprep.regression.read_results import read_results

VALIDATE = {
    "schema": "simprep.validate/1", "complete": True, "wall_s": 3.0, "alphas": [0.5, 1.0],
    "versions": {"simprep": "0.1.0", "mujoco": "4.0.0"}, "platform": {"system": "Linux", "avx512": True},
    "cases": [
        {"target": "kick", "alpha": alpha, "arm": "optimised", "controller": "mpc", "seed": seed, "end": "done",
         "success": True, "mpjpe_mm": 20.0 + alpha + 0.1 * seed, "s_per_s": 0.3}
        for alpha in (0.5, 1.0) for seed in (0, 1, 2)
    ],
    "motions": [{"target": "kick", "alpha": 0.5, "arm": "optimised", "com_cos_mm": 70.0}],
}  # fmt: skip
PUSH = {
    "schema": "simprep.push/1", "motion": "walk", "segment": "pelvis", "preset": "live", "seeds": [0, 1],
    "directions_deg": [0.0, 90.0], "force_n": [[300.0, 320.0], [100.0, 120.0]], "max_force_n": [310.0, 110.0],
}  # fmt: skip
TRACK = {
    "schema": "simprep.track/1", "command": "simprep track walk", "motion": "walk", "controller": "mpc", "preset": "live",
    "seed": 0, "timestep_s": 0.002, "settings": {"samples": 21}, "end": "done", "end_reason": "the motion ended",
    "success": True, "mpjpe_mm": 20.0, "assist_n": 0.0, "files": ["run.npz"], "warnings": [], "s_per_s": 0.4,
}  # fmt: skip


def written(path: Path, content: object) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_a_study_has_a_case_for_each_condition_and_values_by_seed(tmp_path):
    read = read_results([written(tmp_path / "metrics.json", VALIDATE).parent])
    assert list(read.cases) == [
        "kick optimised mpc alpha=0.5", "kick optimised mpc alpha=1.0", "kick optimised alpha=0.5 before physics",
    ]  # fmt: skip
    one = read.cases["kick optimised mpc alpha=0.5"]
    assert one == Case((0, 1, 2), {"success": (1.0,) * 3, "mpjpe_mm": (20.5, 20.6, 20.7)})
    assert (read.versions["mujoco"], read.platform["avx512"]) == ("4.0.0", True)


def test_pushes_have_a_case_for_each_direction(tmp_path):
    read = read_results([written(tmp_path / "p.json", PUSH)])
    assert read.cases == {
        "walk pelvis live direction_deg=0": Case((0, 1), {"max_force_n": (300.0, 320.0)}),
        "walk pelvis live direction_deg=90": Case((0, 1), {"max_force_n": (100.0, 120.0)}),
    }


def test_folders_of_several_seeds_are_taken_together(tmp_path):
    for seed in range(3):
        written(tmp_path / f"walk_{seed}" / "metrics.json", {**TRACK, "seed": seed, "mpjpe_mm": 20.0 + seed})
    expected = {
        "walk mpc live": Case(
            (0, 1, 2), {"success": (1.0,) * 3, "mpjpe_mm": (20.0, 21.0, 22.0), "assist_n": (0.0,) * 3}
        )
    }
    assert read_results([tmp_path]).cases == expected
    assert read_results(sorted(tmp_path.iterdir())).cases == expected


def test_lines_and_tables_of_other_programs(tmp_path):
    rows = [{"clip": "a", "policy": "b", "seed": seed, "level": level, "reward": 1.5 * seed, "fell": "false"}
            for seed in (0, 1) for level in (1, 2)]  # fmt: skip
    table = tmp_path / "t.csv"
    with table.open("w", newline="") as stream:
        writer = csv.DictWriter(stream, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    with pytest.raises(SettingError, match=r"'a b' with seed 0 is there twice.*--by KEY"):
        read_results([table])
    cases = read_results([table], by=("level",)).cases
    assert cases["a b level=2"] == Case((0, 1), {"reward": (0.0, 1.5), "fell": (0.0, 0.0)})
    lines = written(tmp_path / "t.jsonl", "\n".join(json.dumps({**row, "fell": False}) for row in rows) + "\n")
    assert read_results([lines], by=("level",)).cases == cases


def test_a_run_is_measured(tmp_path):
    body = simprep.humanoid()
    still = simprep.Motion(np.repeat(body.standing_qpos[None], 8, axis=0), 30.0, np.ones((8, 2), bool), name="still")
    run = simprep.track(still, "pd")
    path = simprep.save_run(run, tmp_path / "run.npz")
    (case,) = read_results([path]).cases.values()
    assert {name: value for name, (value,) in case.metrics.items()} == numbers(evaluate_run(run))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("x.json", "{", "not readable"),
        ("x.json", {**VALIDATE, "complete": False}, "cut short"),
        ("x.json", {"schema": "other/1", "text": "no number"}, "no numbers by case"),
        ("x.json", [1, 2], "no numbers by case"),
        ("x.json", {**PUSH, "force_n": [[1.0], [2.0]]}, "damaged results"),
        ("x.csv", "a,b\n1\n", "line 2 has another number of columns"),
        ("x.csv", "a,b\n", "no numbers by case"),
        ("x.txt", "1", "ends with '.txt'; valid"),
        ("x.npz", "no run", "not a readable"),
        ("x.json", {"cases": [{"seed": 0.5, "a": 1}]}, "seed 0.5; valid: a whole number"),
    ],
)
def test_bad_results_are_refused(name, content, words, tmp_path):
    with pytest.raises((MotionFileError, SettingError), match=words):
        read_results([written(tmp_path / name, content)])


def test_missing_results_say_what_is_valid(tmp_path):
    with pytest.raises(MotionFileError, match="no such file; valid"):
        read_results([tmp_path / "none.json"])
    with pytest.raises(MotionFileError, match=r"a folder without metrics\.json"):
        read_results([tmp_path])


@pytest.fixture
def checked(tmp_path, capsys, monkeypatch):
    """Exit code, output and errors of `simprep check` of a tracked walk with some error."""
    monkeypatch.chdir(tmp_path)

    def check(mpjpe_mm, *arguments, folder="out"):
        results = written(tmp_path / folder / "metrics.json", {**TRACK, "mpjpe_mm": mpjpe_mm}).parent
        code = main(["check", str(results), "--baseline", str(tmp_path / "b.json"), *arguments])
        return code, *capsys.readouterr()

    return check


def test_the_command_passes_fails_and_accepts_with_a_reason(checked, tmp_path):
    assert checked(20.0, "--update", "--reason", "first")[0] == 0
    assert checked(20.5)[0] == 0
    code, out, _ = checked(25.0, "--junit", str(tmp_path / "j.xml"))
    assert code == 1
    assert "worse" in out
    assert "3 numbers of 1 cases: 1 worse, 2 within" in out
    assert "first" in out
    suite = ElementTree.parse(tmp_path / "j.xml").getroot().find("testsuite")
    assert {key: suite.get(key) for key in ("tests", "failures", "skipped")} == {
        "tests": "3",
        "failures": "1",
        "skipped": "0",
    }
    (failed,) = (test for test in suite.iter("testcase") if test.find("failure") is not None)
    assert (failed.get("classname"), failed.get("name")) == ("walk mpc live", "mpjpe_mm")
    assert failed.find("failure").get("message").startswith("worse: 20 before, 25 now (+5 (+25.0%))")
    assert checked(15.0)[0] == 0
    assert checked(15.0, "--strict")[0] == 1
    assert checked(25.0, "--tolerance", "mpjpe_mm=6")[0] == 0
    assert checked(25.0, "--update", "--reason", "new feet", "--tolerance", "mpjpe_mm=2")[0] == 0
    code, out, _ = checked(28.0, "--json")
    content = json.loads(out)
    assert (code, content["verdict"], content["failures"]) == (1, "fail", 1)
    assert [change["reason"] for change in content["history"]] == ["first", "new feet"]
    assert {row["metric"]: row["verdict"] for row in content["rows"]}["mpjpe_mm"] == "worse"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--update",), "--update and --reason TEXT belong together"),
        (("--reason", "x"), "--update and --reason TEXT belong together"),
        (("--update", "--reason", " "), "not changed without a reason"),
        (("--tolerance", "mpjpe_mm=x"), "valid: METRIC=2"),
        (("--false-alarm", "2"), "false alarms 2; valid"),
        ((), "no such baseline; make one with --update --reason TEXT"),
    ],
)
def test_a_bad_wish_is_one_line(checked, arguments, words, tmp_path):
    if arguments and arguments[0] in ("--tolerance", "--false-alarm"):
        assert checked(20.0, "--update", "--reason", "first")[0] == 0
    before = (tmp_path / "b.json").read_text() if (tmp_path / "b.json").exists() else None
    code, _, err = checked(20.0, *arguments)
    assert code == 2
    assert err.startswith("simprep: ")
    assert err.count("\n") == 1
    assert words in err
    assert ((tmp_path / "b.json").read_text() if (tmp_path / "b.json").exists() else None) == before


def test_the_report_says_what_moved(checked, tmp_path):
    assert checked(20.0, "--update", "--reason", "first")[0] == 0
    assert checked(25.0)[0] == 1
    page = (tmp_path / "results" / "check" / "report.html").read_text(encoding="utf-8")
    assert "Failed: mpjpe_mm of walk mpc live is worse, 20 before and 25 now. 3 numbers were compared." in page
    assert "<td>mpjpe_mm</td>" in page
    assert "how far numbers moved" in page
    code, out, _ = checked(20.5, "--json", "-o", str(tmp_path / "there"))
    assert code == 0
    assert json.loads(out)["files"] == [str(tmp_path / "there" / "report.html")]
    assert "Passed: none of 3 numbers" in (tmp_path / "there" / "report.html").read_text(encoding="utf-8")
    assert checked(20.5, "--no-pictures", "-o", str(tmp_path / "nowhere"))[0] == 0
    assert not (tmp_path / "nowhere").exists()


def test_runs_that_are_checked_are_shown_side_by_side(tmp_path, capsys):
    runs = [simprep.track(simprep.library_motion("stand")[:9], "pd", seed=seed) for seed in (0, 1)]
    paths = [str(simprep.save_run(run, tmp_path / f"{run.seed}.npz")) for run in runs]
    asked = ["check", *paths, "--baseline", str(tmp_path / "b.json"), "-o", str(tmp_path / "out")]
    assert main([*asked, "--update", "--reason", "first"]) == 0
    replay = runs_replay(runs_of([Path(path) for path in paths]))
    assert [actor.label for actor in replay.actors] == ["stand, pd, seed 0", "stand, pd, seed 1"]
    assert replay.actors[0].place != replay.actors[1].place
    assert 'id="recording-0"' in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_the_picture_measures_in_what_is_allowed():
    row = Row("walk", "mpjpe_mm", 20.0, 23.0, 18.0, 22.0, "worse", (1, 1))
    assert moved(row) == 1.5
    assert moved(replace(row, now=19.0)) == -0.5
    assert moved(replace(row, now=20.0)) == 0.0
    assert judged([row, replace(row, now=None, verdict="gone")]) == [row]
