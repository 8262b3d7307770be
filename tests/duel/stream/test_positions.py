"""People recorded as joint positions: the same poses come back; gaps, missing joints and noise."""

from dataclasses import replace

import numpy as np
import pytest
from duel_cases import bout

from simprep.character import SIDES
from simprep.cli.main import main
from simprep.duel.stream.import_pair import import_pair
from simprep.duel.stream.store import read_stream, save_stream
from simprep.duel.stream.stream import root_distance
from simprep.errors import MotionFileError, SettingError
from simprep.humanoid_model import humanoid
from simprep.motion.edit import resample
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.positions import PositionSettings, position_clip, read_positions

SHORT = {"thigh": "hip", "shank": "knee", "foot": "ankle", "upper_arm": "shoulder", "forearm": "elbow", "hand": "wrist"}
NAMES = ("neck", *(f"{side[0]}_{name}" for side in SIDES for name in SHORT.values()))
JOINTS = [humanoid().segment("neck"), *(humanoid().segment(f"{side}_{part}") for side in SIDES for part in SHORT)]


@pytest.fixture(scope="module")
def recorded():
    stream = bout(np.random.default_rng(4), 4)[0].part(0, 60)
    points = [forward_kinematics(motion.qpos, motion.character).xpos[:, JOINTS] for motion in stream.players]
    return stream, np.stack(points, axis=1)


def write(path, positions, names=NAMES, fps=30.0):
    np.savez(path, positions=positions, joint_names=np.array(names), fps=fps)
    return path


def test_thirteen_joints_bring_back_pose_place_and_stature(recorded, tmp_path):
    stream, points = recorded
    rng = np.random.default_rng(0)
    noisy = points + rng.normal(0, 0.005, points.shape)
    noisy[20:24, 0, 5] = np.nan
    pair = import_pair(write(tmp_path / "p.npz", noisy))
    for truth, motion in zip(stream.players, pair.stream.players):
        assert motion.character.height_m == pytest.approx(truth.character.height_m, abs=0.02)
        ours, theirs = (forward_kinematics(m.qpos, m.character).xpos[:, JOINTS] for m in (motion, truth))
        error = np.linalg.norm(ours - theirs, axis=-1)
        assert np.median(error) < 0.02
        assert error.mean() < 0.03
    assert np.abs(root_distance(pair.stream) - root_distance(stream)).max() < 0.03
    notes = " ".join(pair.imports[0].warnings)
    assert "4 unseen joint positions in short gaps interpolated" in notes
    assert "low-pass filtered at 6 Hz" in notes


def test_axes_and_units_are_found(recorded, tmp_path):
    stream, points = recorded
    y_up = 100 * np.stack([points[..., 1], points[..., 2], points[..., 0]], axis=-1)
    pair = import_pair(write(tmp_path / "p.npz", y_up))
    assert (pair.imports[0].up, pair.imports[0].scale) == ("y", 0.01)
    assert np.abs(root_distance(pair.stream) - root_distance(stream)).max() < 0.03


def test_long_gaps_name_frame_and_joint(recorded, tmp_path):
    points = recorded[1].copy()
    points[30:45, 1, 3] = np.nan
    path = write(tmp_path / "p.npz", points)
    with pytest.raises(
        MotionFileError, match=r"person 2, frame 30: joint 'l_ankle' is not seen for 15 frames \(0.50 s\)"
    ):
        import_pair(path)
    filled = position_clip(read_positions(path), 1, settings=PositionSettings(longest_gap_s=0.5))
    assert np.isfinite(filled.positions).all()
    with pytest.raises(SettingError, match="longest gap 5 s; valid: 0 to 2"):
        PositionSettings(longest_gap_s=5)


def test_files_that_lack_something_are_refused(recorded, tmp_path):
    points = recorded[1]
    with pytest.raises(MotionFileError, match="holds 1 person; an import takes 2"):
        import_pair(write(tmp_path / "one.npz", points[:, 0]))
    with pytest.raises(MotionFileError, match="no joint found for left_shank"):
        import_pair(write(tmp_path / "knee.npz", points, [name.replace("l_knee", "thing") for name in NAMES]))
    with pytest.raises(MotionFileError, match=r"positions \(60, 2, 13, 3\) for 12 joint names"):
        import_pair(write(tmp_path / "names.npz", points, NAMES[:-1]))
    np.savez(tmp_path / "fps.npz", positions=points, joint_names=np.array(NAMES))
    with pytest.raises(MotionFileError, match="no fps; joint positions need positions, joint_names, fps"):
        import_pair(tmp_path / "fps.npz")
    named = {"left_shank": "thing"}
    path = write(tmp_path / "map.npz", points, [name.replace("l_knee", "thing") for name in NAMES])
    assert import_pair(path, joint_map=named).stream.fps == 30


def test_people_swapped_halfway_give_a_warning(recorded, tmp_path):
    points = recorded[1].copy()
    points[:, 1, :, 0] -= 0.7  # as near as 0.5 m, where a filtered jump would not look like one
    points[30:] = points[30:, ::-1]
    pair = import_pair(write(tmp_path / "p.npz", points, fps=30.0))
    assert any("exchange names at frame 30" in warning for warning in pair.report.warnings)


def test_a_clip_like_another_can_be_joined_to_it(recorded, tmp_path, monkeypatch, capsys):
    stream, points = recorded
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "p.npz", points)
    faster = [replace(resample(motion, 60.0), character=humanoid(1.7)) for motion in stream.players]
    save_stream(replace(stream, players=tuple(faster)), "first.npz")
    assert main(["duel", "import", "p.npz", "--like", "first.npz", "-o", "second.npz"]) == 0
    assert main(["duel", "join", "first.npz", "second.npz", "-o", "both.npz"]) == 0
    assert read_stream("both.npz").seams == (len(faster[0]),)
    capsys.readouterr()
    assert main(["duel", "import", "p.npz", "--like", "first.npz", "--fps", "0"]) == 2
    assert "0" in capsys.readouterr().err


def test_depth_camera_pairs_come_in(data_dir, tmp_path):
    path = data_dir / "pairs" / "sbu_pairs.npz"
    if not path.is_file():
        pytest.skip(f"no {path}")
    with np.load(path) as archive:
        clip = archive["positions"][0, : archive["length"][0]]
        names = archive["joint_names"]
    pair = import_pair(write(tmp_path / "sbu.npz", clip, names, 15.0))
    hips = clip[:, :, [list(names).index("l_hip"), list(names).index("r_hip")], :2].mean(axis=2)
    wanted = np.linalg.norm(hips[:, 0] - hips[:, 1], axis=1)
    assert pair.stream.fps == 30
    assert np.abs(root_distance(pair.stream)[::2] - wanted).mean() < 0.03
    assert all(report.residual_mm < 25 for report in pair.imports)


def test_a_foot_that_creeps_until_the_end_of_the_recording_comes_in(data_dir, tmp_path):
    path = data_dir / "pairs" / "sbu_pairs.npz"
    if not path.is_file():
        pytest.skip(f"no {path}")
    with np.load(path) as archive:
        clip, names = archive["positions"][126, : archive["length"][126]], archive["joint_names"]
    assert len(import_pair(write(tmp_path / "sbu.npz", clip, names, 15.0)).stream) == 2 * len(clip) - 1
