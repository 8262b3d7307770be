"""Everything in results/ has a command that makes it, and a number that moved is found."""

import json
import subprocess
import sys

import pytest

import reproduce
from reproducing.made import EVERYTHING, ROOT, Made
from reproducing.moved import compare, moved_text


def kept_folders():
    """Folders of results/ that are in the repository: commands write their own results beside them."""
    listed = subprocess.run(
        ["git", "ls-files", "--", "results/*.json"], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout
    return {line.split("/")[1] for line in listed.splitlines()}


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no git checkout, so nobody knows what is kept")
def test_everything_that_is_kept_has_its_command():
    folders, kept = {one.folder for one in EVERYTHING}, kept_folders()
    assert "reference" in kept
    assert kept <= folders
    assert len({one.name for one in EVERYTHING}) == len(EVERYTHING)
    for one in EVERYTHING:
        assert one.command[0] == "simprep" or (ROOT / one.command[0]).is_file()
        assert any("{out}" in word for word in one.command)


def test_what_moved_is_said_and_times_are_not():
    kept = {
        "created_utc": "then",
        "wall_s": 1.0,
        "cpu_ms_per_frame": 0.3,
        "cases": [{"mpjpe_mm": 10.0, "end": "done"}, {"mpjpe_mm": 20.0, "end": "done"}],
    }
    now = {
        "created_utc": "now",
        "wall_s": 9.0,
        "cpu_ms_per_frame": 0.5,
        "cases": [{"mpjpe_mm": 10.0001, "end": "fell"}, {"mpjpe_mm": 22.0, "end": "done"}],
    }
    found = compare(kept, now)
    assert found.values == 4
    assert [(change.place, change.kept, change.now) for change in found.moved] == [
        (("cases", "0", "end"), "done", "fell"),
        (("cases", "1", "mpjpe_mm"), 20.0, 22.0),
    ]
    assert list(moved_text(found)) == [
        "end: 1 moved, other or missing; cases.0.end: done -> fell",
        "mpjpe_mm: 1 moved, by 10 % in the middle; cases.1.mpjpe_mm: 20 -> 22",
    ]
    assert compare(kept, kept).moved == ()
    assert len(compare(kept, {"cases": kept["cases"][:1]}).moved) == 2
    assert compare(kept, now, relative=0.2).moved == found.moved[:1]


def test_a_part_is_made_once_compared_and_its_failure_said(tmp_path, monkeypatch, capsys):
    script = tmp_path / "make.py"
    script.write_text(
        "import json, pathlib, sys\n"
        "out = pathlib.Path(sys.argv[1])\n"
        "made = out / 'made'\n"
        "made.write_text(made.read_text() + 'x' if made.exists() else 'x')\n"
        "(out / 'numbers.json').write_text(json.dumps({'error_mm': 2.0}))\n"
        "sys.exit(int(sys.argv[2]))\n"
    )
    results = tmp_path / "results"
    for name, number in (("same", 2.0), ("moved", 1.0), ("fails", 2.0)):
        (results / name).mkdir(parents=True)
        (results / name / "numbers.json").write_text(json.dumps({"error_mm": number}))

    def run(*names):
        parts = [
            Made(name, name, (str(script), "{out}", "3" if name == "fails" else "0"), "numbers.json", 0)
            for name in names
        ]
        monkeypatch.setattr(reproduce, "EVERYTHING", tuple(parts))
        monkeypatch.setattr(reproduce, "chosen", lambda _: parts)
        monkeypatch.setattr(reproduce, "RESULTS", results)
        monkeypatch.setattr(reproduce, "ROOT", tmp_path)
        monkeypatch.setattr(sys, "argv", ["reproduce.py", "-o", str(tmp_path / "out")])
        return reproduce.main(), capsys.readouterr().out

    assert run("same")[0] == 0
    code, said = run("same", "moved")
    assert code == 1
    assert "same: made before" in said
    assert "error_mm: 1 moved, by 100 % in the middle; error_mm: 1 -> 2" in said
    assert (tmp_path / "out" / "same" / "made").read_text() == "x"
    code, said = run("same", "fails")
    assert code == 2
    assert "fails: failed with exit code 3" in said


def test_the_list_shows_commands(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["reproduce.py", "--list"])
    assert reproduce.main() == 0
    shown = capsys.readouterr().out
    assert "simprep validate --full --yardstick -o results/reference --quiet" in " ".join(shown.split())


@pytest.mark.parametrize("one", EVERYTHING, ids=lambda one: one.name)
def test_commands_take_their_folder(one, tmp_path):
    arguments = one.arguments(tmp_path / "out", tmp_path / "data")
    assert str(tmp_path / "out") in " ".join(arguments)
    assert "{" not in " ".join(arguments)
