"""`simprep duel import` of one BVH file with a ROOT for each person, as a user runs it."""

import json

import pytest
from motion_files import bvh_text, write

from simprep.cli.main import main
from simprep.duel.stream.store import read_stream

DISTANCE_M = 1.2


def people(prefixes, frames=30):
    """A file with one ROOT for each prefix of its names, standing 1.2 m apart; the arms of each swing by another angle."""
    one = bvh_text(frames=frames)
    hierarchy, rows = one.split("MOTION\n")
    root = hierarchy.removeprefix("HIERARCHY\n")
    head, values = rows.split("0.033333\n")
    trees, columns = [], [[] for _ in range(frames)]
    for number, prefix in enumerate(prefixes):
        trees.append(root.replace("ROOT ", f"ROOT {prefix}").replace("JOINT ", f"JOINT {prefix}"))
        for frame, row in enumerate(values.splitlines()):
            numbers = row.split()
            numbers[2] = f"{100 * DISTANCE_M * number:.6f}"
            columns[frame].append(" ".join(numbers))
    return "HIERARCHY\n" + "".join(trees) + "MOTION\n" + head + "0.033333\n" + "\n".join(map(" ".join, columns)) + "\n"


def run(capsys, *arguments):
    code = main([str(argument) for argument in arguments])
    return code, *capsys.readouterr()


@pytest.mark.parametrize("prefixes", [("", "B_"), ("", ""), ("A:", "B:"), ("Anna_", "Ben_")])
def test_two_roots_are_two_people(tmp_path, monkeypatch, capsys, prefixes):
    monkeypatch.chdir(tmp_path)
    file = write(tmp_path, "both.bvh", people(prefixes))
    code, out, _ = run(capsys, "duel", "import", file, "--json")
    assert code == 0
    report = json.loads(out)
    assert report["frames"] == 30
    assert report["distance_m"] == pytest.approx([DISTANCE_M] * 3, abs=0.02)
    assert [imported["residual_mm"] < 5 for imported in report["imports"]] == [True, True]
    stream = read_stream(tmp_path / "both.npz")
    assert [motion.name for motion in stream.players] == ["both_A", "both_B"]


@pytest.mark.parametrize(
    ("command", "prefixes", "said"),
    [
        (("duel", "import"), ("",), "holds one person; give the other one's file too, or one file with both people"),
        (("duel", "import"), ("", "B_", "C_"), "holds 3 people, one for each ROOT; an import takes 2"),
        (("import",), ("", "B_"), "a second ROOT; valid: one skeleton in a file (`simprep duel import` takes two"),
    ],
)
def test_other_numbers_of_people_are_refused(tmp_path, monkeypatch, capsys, command, prefixes, said):
    monkeypatch.chdir(tmp_path)
    file = write(tmp_path, "people.bvh", people(prefixes))
    code, out, err = run(capsys, *command, file)
    assert code == 2
    assert err.startswith("simprep: ")
    assert err.count("\n") == 1
    assert said in err
    assert not out
    assert list(tmp_path.iterdir()) == [file]


def test_a_file_that_is_missing_or_of_smpl_is_named(tmp_path, monkeypatch, capsys):
    import numpy as np

    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, "duel", "import", "none.bvh")
    assert (code, err) == (2, "simprep: none.bvh: no such file\n")
    np.savez("smpl.npz", poses=np.zeros((5, 156)), trans=np.zeros((5, 3)), betas=np.zeros(16))
    code, _, err = run(capsys, "duel", "import", "smpl.npz")
    assert code == 2
    assert "no frame rate (mocap_framerate" in err


def test_two_roots_of_the_shared_data(data_dir, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    code, out, _ = run(capsys, "duel", "import", data_dir / "faults" / "two_roots.bvh", "-o", "pair.npz", "--json")
    assert code == 0
    assert json.loads(out)["frames"] == 6
    assert read_stream(tmp_path / "pair.npz").clips == ("two_roots",)
