"""`simprep convert`: what it writes, what it says, and that nothing is left where it fails."""

import json
from pathlib import Path

import numpy as np
import pytest
from motion_files import bvh_text, write

from simprep.cli.main import main
from simprep.library.registry import library_motion
from simprep.motion.formats import trc
from simprep.motion.load import import_motion
from simprep.primitive_robot import primitive_robot


def test_a_chain_of_formats_keeps_the_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    last = "walk"
    for name in ("a.bvh", "b.trc", "c.mot", "d.csv", "e.npz"):
        assert main(["convert", last, str(tmp_path / name), "--json"]) == 0
        report = json.loads(capsys.readouterr().out)
        assert report["out"] == str(tmp_path / name)
        assert report["frames"] == 64
        last = report["out"]
    assert np.abs(import_motion(tmp_path / "e.npz").motion.qpos - library_motion("walk").qpos).max() < 1e-6
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.bvh", "b.trc", "c.mot", "d.csv", "e.npz"]


def test_what_format_and_what_is_lost(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "walk.txt"
    assert main(["convert", "walk", str(out), "--to", "opensim"]) == 0
    captured = capsys.readouterr()
    assert "OpenSim: the events are not kept: right_heel_strike" in captured.err
    assert f"written: {out} (OpenSim)" in " ".join(captured.out.split())
    assert out.read_text().startswith("Coordinates\n")


def test_a_foreign_file_is_retargeted_first(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = write(tmp_path, "a.bvh", bvh_text(frames=12))
    assert main(["convert", str(source), str(tmp_path / "b.csv"), "--json", "--fps", "60", "--strict"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["recognised"], report["fps"], report["doubtful"]) == ("BVH", 60, False)


def test_a_motion_is_moved_onto_the_robot_that_is_named(tmp_path: Path) -> None:
    robot = primitive_robot()
    own, file = tmp_path / "own.npz", tmp_path / "walk.bvh"
    assert main(["convert", "walk", str(file)]) == 0  # of the humanoid
    for source in ("walk", str(file)):
        assert main(["convert", source, str(own), "--robot", "primitive_robot"]) == 0
        assert import_motion(own).motion.character == robot


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["walk", "b.fbx"], "unknown extension of a file to write '.fbx'; valid: .npz (simprep), .bvh (BVH)"),
        (["walk", "b.bvh", "--to", "fbx"], "unknown format to write 'fbx'; valid: simprep, bvh, trc"),
        (["none.bvh", "b.trc"], "none.bvh: no such file"),
        (["wolk", "b.trc"], "unknown motion 'wolk'"),
        (["a.bvh", "a.bvh"], "a.bvh: is the file to read"),
        (["noise.dat", "b.trc"], "unknown extension '.dat', and unknown content; valid: .npz (simprep), .bvh (BVH)"),
        (["a.bvh", "b.trc", "--file-fps", "0"], "frame rate of the file 0.0 1/s"),
    ],
)
def test_bad_input(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path, "a.bvh", bvh_text(frames=12))
    write(tmp_path, "noise.dat", "Kaydara")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert main(["convert", *arguments]) == 2
    error = capsys.readouterr().err
    assert error.startswith("simprep: ")
    assert said in error
    assert error.count("\n") == 1
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_nothing_is_left_of_a_failed_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> tuple[tuple[str, ...], np.ndarray]:
        raise KeyboardInterrupt

    monkeypatch.setattr(trc, "points_of_motion", fail)
    out = tmp_path / "b.trc"
    out.write_text("before")
    assert main(["convert", "walk", str(out)]) == 130
    assert [path.name for path in tmp_path.iterdir()] == ["b.trc"]
    assert out.read_text() == "before"


def test_from_python(tmp_path: Path) -> None:
    import simprep

    walk = simprep.library_motion("walk")
    lost = simprep.export_motion(walk, tmp_path / "a.dat", "csv")
    assert any("loop" in note for note in lost)
    assert np.abs(simprep.load_motion(tmp_path / "a.dat").qpos - walk.qpos).max() < 1e-6
    with pytest.raises(simprep.UnknownNameError, match="extension of a file to write"):
        simprep.export_motion(walk, tmp_path / "a.dat")
