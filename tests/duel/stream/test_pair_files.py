"""Two people in the files that people have: parameters of SMPL in pairs, and takes that did not begin together."""

import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from format_cases import save, smpl_walk

from simprep.cli.main import main
from simprep.duel.stream.import_pair import import_pair
from simprep.duel.stream.stream import root_distance
from simprep.errors import MotionError, MotionFileError
from simprep.library.registry import library_motion
from simprep.motion.edit import cut, move, resample
from simprep.motion.formats.registry import format_to_write
from simprep.motion.load import import_motion
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion


def people() -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Two who walk side by side, 1.5 m apart along x."""
    a, b = smpl_walk(40), smpl_walk(40)
    b["trans"] = b["trans"] + [1.5, 0.0, 0.0]
    return a, b


def test_a_pickle_of_interhuman(tmp_path: Path) -> None:
    a, b = people()
    content: dict[str, object] = {
        "person1": a | {"betas": np.zeros(10), "gender": "male"},
        "person2": b,
        "mocap_framerate": 60.0,
    }
    path = tmp_path / "7.pkl"
    path.write_bytes(pickle.dumps(content))
    pair = import_pair(path)
    assert (len(pair.stream), pair.stream.fps) == (40, 60)
    assert {report.recognised for report in pair.imports} == {"InterHuman, SMPL parameters of two people"}
    assert np.abs(root_distance(pair.stream) - 1.5).max() < 0.02
    with pytest.raises(MotionFileError, match=r"two people.*`simprep duel import` reads"):
        import_motion(path)
    del content["mocap_framerate"]
    path.write_bytes(pickle.dumps(content))
    with pytest.raises(MotionFileError, match="no frame rate"):
        import_pair(path)
    assert import_pair(path, file_fps=30).stream.fps == 30
    path.write_bytes(pickle.dumps({"person1": a}))
    with pytest.raises(MotionFileError, match="no person1 and person2"):
        import_pair(path)


class Evil:
    def __reduce__(self) -> tuple[object, tuple[str]]:
        return print, ("person1 ran",)


def test_a_pickle_that_runs_code_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "7.pkl"
    path.write_bytes(pickle.dumps({"person1": Evil()}))
    with pytest.raises(MotionFileError, match="could run code: refused"):
        import_pair(path)
    assert "ran" not in capsys.readouterr().out


def test_a_folder_of_inter_x(tmp_path: Path) -> None:
    for name, one in zip(("P1", "P2"), people()):
        hands = {"pose_lhand": np.zeros((40, 15, 3)), "pose_rhand": np.zeros((40, 15, 3))}
        body = one["pose_body"].reshape(40, 21, 3)
        save(tmp_path / f"{name}.npz", **(one | hands | {"pose_body": body, "gender": "neutral"}))
    pair = import_pair(tmp_path)
    assert (len(pair.stream), pair.stream.fps) == (20, 60)
    assert np.abs(root_distance(pair.stream) - 1.5).max() < 0.02


def walks() -> tuple[Motion, Motion]:
    """The same minute of two people, 1.2 m apart: B steps as A does."""
    walk = library_motion("step_forward")
    return walk, move(walk, (0.0, 1.2))


@pytest.mark.parametrize("late", [10, -10])
def test_files_of_different_starts(tmp_path: Path, late: int) -> None:
    a, b = walks()
    one = cut(a, max(0, -late), len(a) - 5)
    two = cut(b, max(0, late), len(b))
    paths = [save_motion(motion, tmp_path / name) for name, motion in (("a", one), ("b", two))]
    with pytest.raises(
        MotionFileError, match="recorded together, or the time of B's start after A's be given with --offset"
    ):
        import_pair(*paths)
    stream = import_pair(*paths, offset=late / a.fps).stream
    assert len(stream) == len(a) - 10 - 5
    assert np.abs(stream.players[0].qpos[:, 0] - stream.players[1].qpos[:, 0]).max() < 1e-9
    assert np.abs(root_distance(stream) - 1.2).max() < 1e-9
    with pytest.raises(MotionFileError, match="no time in common"):
        import_pair(*paths, offset=100.0)


def test_files_of_different_rates(tmp_path: Path) -> None:
    a, b = walks()
    paths = [tmp_path / "a.bvh", tmp_path / "b.csv"]
    for path, motion in zip(paths, (a, resample(b, 30.0))):
        format_to_write(path).write(motion, path)  # type: ignore[misc]
    pair = import_pair(*paths, offset=0.0)
    assert pair.stream.fps == 30
    assert np.abs(root_distance(pair.stream) - 1.2).max() < 0.01
    assert any("the time that both have" in warning for warning in pair.report.warnings)
    with pytest.raises((MotionError, MotionFileError)):
        import_pair(*paths)


def test_the_command_takes_an_offset(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = walks()
    paths = [str(save_motion(motion, tmp_path / name)) for name, motion in (("a", a), ("b", cut(b, 12, len(b))))]
    assert main(["duel", "import", *paths, "--offset", "0.2", "-o", str(tmp_path / "pair.npz"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["frames"] == len(a) - 12
    assert report["distance_m"] == pytest.approx([1.2, 1.2, 1.2], abs=1e-6)


def test_a_recorded_pair_with_another_start(data_dir: Path) -> None:
    files = [data_dir / "pairs" / name for name in ("18_01.bvh", "19_01.bvh")]
    whole = import_pair(*files).stream
    late = import_pair(*files, offset=0.5).stream
    assert len(late) == len(whole) - 30
    assert np.abs(late.players[0].qpos - whole.players[0].qpos[30:]).max() == 0
