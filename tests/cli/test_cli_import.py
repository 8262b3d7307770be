"""`simprep import`: what it reports for machines, and --strict."""

import json
from pathlib import Path

import pytest
from motion_files import bvh_text, write
from robot_models import robot_xml, toml_of, write_robot

from simprep.cli.main import main


def crossed_arm(tmp_path: Path) -> Path:
    """A standing person whose left upper arm goes through the trunk."""
    lines = bvh_text(frames=12).splitlines()
    first = next(number for number, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    names = [line.split()[1] for line in lines if line.split()[:1] in (["ROOT"], ["JOINT"])]
    for row in range(first, len(lines)):
        values = lines[row].split()
        values[6 + 3 * (names.index("LeftArm") - 1) + 2] = "-170"
        lines[row] = " ".join(values)
    return write(tmp_path, "crossed.bvh", "\n".join(lines) + "\n")


def test_the_report_for_machines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = write(tmp_path, "good.bvh", bvh_text(frames=12))
    assert main(["import", str(good), "-o", str(tmp_path / "good.npz"), "--json", "--strict"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["doubtful"] is False
    assert len(report["limbs"]) == 8
    for limb in report["limbs"].values():
        assert 0 <= limb["median_deg"] <= limb["p95_deg"] <= limb["max_deg"] <= 5
    assert report["residual_mm"] <= report["worst_residual_mm"]
    assert 0 <= report["worst_residual_frame"] < report["frames"]
    assert isinstance(report["saturated"], dict)


def test_a_robots_report_states_what_the_humanoids_does(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    crossed = crossed_arm(tmp_path)
    model = write_robot(tmp_path, robot_xml(), toml_of())
    reports = []
    for body in ([], ["--robot", str(model)]):
        assert main(["import", str(crossed), "-o", str(tmp_path / "out.npz"), "--json", *body]) == 0
        reports.append(json.loads(capsys.readouterr().out))
    person, robot = reports
    assert set(robot) == set(person)
    assert set(robot["limbs"]) == set(person["limbs"])
    for limb, error in robot["limbs"].items():
        assert set(error) == set(person["limbs"][limb])
        assert 0 <= error["median_deg"] <= error["p95_deg"] <= error["max_deg"]
    assert robot["residual_mm"] <= robot["worst_residual_mm"]
    # the arm that the file puts through the trunk is told apart from those that are followed
    assert robot["limbs"]["left_upper_arm"]["max_deg"] > 15 > robot["limbs"]["right_upper_arm"]["max_deg"]
    assert robot["doubtful"] is True
    assert any("left upper arm" in line for line in robot["warnings"])


def test_strict_refuses_what_is_doubtful(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, out = crossed_arm(tmp_path), tmp_path / "out.npz"
    assert main(["import", str(path), "-o", str(out), "--strict"]) == 2
    assert not out.exists()
    error = capsys.readouterr().err
    assert "doubtful: the left upper arm points up to" in error
    assert "Traceback" not in error
    assert main(["import", str(path), "-o", str(out), "--json"]) == 0
    assert out.exists()
    captured = capsys.readouterr()
    assert json.loads(captured.out)["doubtful"] is True
    assert "warning: the left upper arm points" in captured.err


def test_two_people_in_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = bvh_text(frames=12)
    head, motion = one.split("MOTION\n")
    lines = motion.splitlines()
    rows = [line for line in lines[2:] if line.strip()]
    second = [" ".join([f"{float(row.split()[0]) + 120:g}", *row.split()[1:]]) for row in rows]
    both = "\n".join([*lines[:2], *(f"{a} {b}" for a, b in zip(rows, second))])
    path = write(tmp_path, "both.bvh", head + head.replace("HIERARCHY\n", "") + "MOTION\n" + both + "\n")
    assert main(["duel", "import", str(path), "-o", str(tmp_path / "pair.npz"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["distance_m"] == pytest.approx([1.2, 1.2, 1.2], abs=0.02)
    assert main(["import", str(path), "-o", str(tmp_path / "no.npz")]) == 2
    assert "a second ROOT" in capsys.readouterr().err
    assert main(["duel", "import", str(write(tmp_path, "one.bvh", one)), "-o", str(tmp_path / "no.npz")]) == 2
    assert "holds one person" in capsys.readouterr().err
    assert not (tmp_path / "no.npz").exists()
