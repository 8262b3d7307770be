"""Files of robots' motions: round trips, orders found by the bodies stored beside the angles, and what is refused."""

import os
import pickle
from pathlib import Path

import joblib
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simprep.errors import MotionFileError
from simprep.motion.contacts import detect_contacts
from simprep.motion.formats.format import ReadMotion, ReadOptions
from simprep.motion.formats.registry import format_to_write, recognise
from simprep.motion.formats.robot_order import breadth_first
from simprep.motion.formats.robot_write import body_arrays
from simprep.motion.formats.safe_pickle import read_pickle
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.primitive_robot import primitive_robot

ROBOT = primitive_robot()
WRITTEN = ("unitree", "beyondmimic", "mjlab", "gmr", "holosoma")
FPS = 50.0


@pytest.fixture(scope="module")
def motion() -> Motion:
    """All joints move, and the root turns about all axes."""
    rng = np.random.default_rng(0)
    time = np.arange(60)[:, None] / FPS
    qpos = np.tile(ROBOT.standing_qpos, (len(time), 1))
    waves = 0.3 * np.sin(2 * np.pi * time + rng.uniform(0, 6, len(ROBOT.joints)))
    qpos[:, 7:] = np.clip(qpos[:, 7:] + waves, *ROBOT.limits.T)
    qpos[:, :2] += np.hstack([time, 0.1 * np.sin(6 * time)])
    angles = np.hstack([1.2 + time, 0.1 * np.sin(5 * time), 0.1 * time])
    qpos[:, 3:7] = Rotation.from_euler("zyx", angles).as_quat(scalar_first=True)
    return Motion(qpos, FPS, detect_contacts(qpos, FPS, ROBOT), name="waves", character=ROBOT)


def read(path: Path, **options) -> ReadMotion:
    form, _ = recognise(path)
    content = form.read(path, ReadOptions(character=ROBOT, **options))
    assert isinstance(content, ReadMotion)
    return content


def write(motion: Motion, name: str, folder: Path) -> Path:
    form = format_to_write(Path("any"), name)
    path = folder / f"{name}{form.suffixes[0]}"
    form.write(motion, path)
    return path


def gmr(motion: Motion) -> dict:
    return {
        "fps": FPS, "root_pos": motion.qpos[:, :3], "root_rot": motion.qpos[:, [4, 5, 6, 3]], "dof_pos": motion.qpos[:, 7:],
        "local_body_pos": None, "link_body_list": None,
    }  # fmt: skip


def asap(motion: Motion) -> dict:
    columns = [index for index, name in enumerate(ROBOT.joints) if "wrist" not in name]
    axis_angle = np.zeros((len(motion), 24, 3), dtype=np.float32)
    axis_angle[:, 0] = Rotation.from_quat(motion.qpos[:, 3:7], scalar_first=True).as_rotvec()
    return {
        "root_trans_offset": motion.qpos[:, :3], "root_rot": motion.qpos[:, [4, 5, 6, 3]], "pose_aa": axis_angle,
        "dof": motion.qpos[:, 7:][:, columns], "fps": np.int64(FPS), "smpl_joints": None,
    }  # fmt: skip


@pytest.mark.parametrize("name", WRITTEN)
def test_round_trip(name, motion, tmp_path):
    path = write(motion, name, tmp_path)
    back = read(path, file_fps=FPS if name == "unitree" else None).motion
    assert back.fps == FPS
    np.testing.assert_allclose(back.qpos, motion.qpos, atol=1e-8)
    again = read(write(back, name, tmp_path), file_fps=FPS).motion
    np.testing.assert_allclose(again.qpos, back.qpos, atol=1e-8)


@pytest.mark.parametrize("name", WRITTEN)
def test_the_same_bodies_as_in_the_first_format(name, motion, tmp_path):
    bodies = forward_kinematics(read(write(motion, name, tmp_path)).motion.qpos, ROBOT).xpos
    assert np.abs(bodies - forward_kinematics(motion.qpos, ROBOT).xpos).max() < 1e-3


@pytest.mark.parametrize("joints", [0, 1])
@pytest.mark.parametrize("bodies", [0, 1])
def test_orders_are_found_by_the_stored_bodies(joints, bodies, motion, tmp_path):
    """All four combinations: BeyondMimic's, mjlab's, and the mix that trains on wrong bodies without an error."""
    broad_joints, broad_bodies = breadth_first(ROBOT)
    names = ("depth first", "breadth first")
    arrays = body_arrays(
        motion,
        broad_joints if joints else np.arange(len(ROBOT.joints)),
        broad_bodies if bodies else np.arange(len(ROBOT.segments)),
    )
    np.savez(tmp_path / "mixed.npz", **arrays)
    content = read(tmp_path / "mixed.npz")
    np.testing.assert_allclose(content.motion.qpos, motion.qpos, atol=1e-9)
    report = " ".join(content.notes)
    assert f"joints {names[joints]}, bodies {names[bodies]}" in report
    assert ("maps targets wrongly" in report) == (joints != bodies)


def test_bodies_of_another_robot_are_refused(motion, tmp_path):
    arrays = body_arrays(motion, *breadth_first(ROBOT))
    scaled = {**arrays, "body_pos_w": 1.3 * arrays["body_pos_w"]}
    np.savez(tmp_path / "other.npz", **scaled)
    with pytest.raises(MotionFileError, match="of another robot"):
        read(tmp_path / "other.npz")


def test_angles_without_a_root_are_named(tmp_path):
    np.savez(tmp_path / "angles.npz", joint_pos=np.zeros((5, 29)), joint_vel=np.zeros((5, 29)), fps=[30])
    with pytest.raises(MotionFileError, match=r"parts of a robot's motion \(joint_pos, joint_vel\): valid: all keys"):
        recognise(tmp_path / "angles.npz")


def test_stored_bodies_show_swapped_quaternions(motion, tmp_path):
    arrays = body_arrays(motion, *breadth_first(ROBOT))
    np.savez(tmp_path / "xyzw.npz", **{**arrays, "body_quat_w": arrays["body_quat_w"][..., [1, 2, 3, 0]]})
    content = read(tmp_path / "xyzw.npz")
    np.testing.assert_allclose(content.motion.qpos, motion.qpos, atol=1e-9)
    assert any("quaternions are xyzw, not the format's wxyz" in note for note in content.notes)


def test_stored_velocities_tell_a_wrong_frame_rate(motion, tmp_path):
    np.savez(tmp_path / "rate.npz", **{**body_arrays(motion, *breadth_first(ROBOT)), "fps": [25]})
    content = read(tmp_path / "rate.npz")
    assert content.motion.fps == 25
    assert any("frame rate doubtful: 25 per second" in note and "50.0" in note for note in content.notes)
    assert not any("doubtful" in note for note in read(tmp_path / "rate.npz", file_fps=50).notes)


def test_training_files_hold_the_whole_qpos_and_the_world(motion, tmp_path):
    arrays = body_arrays(motion, np.arange(len(ROBOT.joints)), np.arange(len(ROBOT.segments)))
    world = {"body_pos_w": np.zeros(3), "body_quat_w": np.array([1.0, 0, 0, 0])}
    for name, value in world.items():
        still = np.broadcast_to(value, (len(motion), 1, len(value)))
        arrays[name] = np.concatenate([still, arrays[name]], axis=1)
    np.savez(tmp_path / "train.npz", **{**arrays, "joint_pos": motion.qpos, "joint_vel": motion.velocities()})
    np.testing.assert_allclose(read(tmp_path / "train.npz").motion.qpos, motion.qpos, atol=1e-9)


def test_quaternion_first_or_position_first_by_content(motion, tmp_path):
    qpos = motion.qpos
    np.savez(tmp_path / "omni.npz", qpos=np.concatenate([qpos[:, 3:7], qpos[:, :3], qpos[:, 7:]], axis=1))
    content = read(tmp_path / "omni.npz", file_fps=FPS)
    np.testing.assert_allclose(content.motion.qpos, qpos, atol=1e-12)
    assert any("quaternion first" in note for note in content.notes)
    huge = qpos.copy()
    huge[3, 4] = 1e200
    np.savez(tmp_path / "huge.npz", qpos=huge)
    with pytest.raises(MotionFileError, match=r"huge\.npz: qpos in frame 3, column 4 is 1e\+200"):
        read(tmp_path / "huge.npz")
    np.savez(tmp_path / "neither.npz", qpos=3 * qpos)
    with pytest.raises(MotionFileError, match="cannot be told"):
        read(tmp_path / "neither.npz")


@pytest.mark.parametrize("first", ["position", "quaternion"])
def test_the_pose_of_an_object_in_qpos_is_left_out(first, motion, tmp_path):
    """A scene's whole qpos: seven numbers of an object behind the robot's joints, in the same order as the root's."""
    qpos, place = motion.qpos, np.tile([0.5, 0.1, 0.4], (len(motion), 1))
    root, turn = [qpos[:, :3], qpos[:, 3:7]], np.tile([0.6, 0.0, 0.8, 0.0], (len(motion), 1))
    parts = [*root, qpos[:, 7:], place, turn] if first == "position" else [*root[::-1], qpos[:, 7:], turn, place]
    np.savez(tmp_path / "box.npz", qpos=np.concatenate(parts, axis=1), fps=FPS)
    content = read(tmp_path / "box.npz")
    np.testing.assert_allclose(content.motion.qpos, qpos, atol=1e-12)
    assert any("pose of an object: left out" in note for note in content.notes)
    parts[-1] = 3 * parts[-1]  # seven numbers more that are no pose
    parts[-2] = 3 * parts[-2]
    np.savez(tmp_path / "more.npz", qpos=np.concatenate(parts, axis=1), fps=FPS)
    with pytest.raises(MotionFileError, match=rf"{len(ROBOT.joints) + 7} joints; valid: {len(ROBOT.joints)}"):
        read(tmp_path / "more.npz")


@pytest.mark.parametrize("protocol", range(2, 6))
def test_gmr_pickles(protocol, motion, tmp_path):
    path = tmp_path / "gmr.pkl"
    path.write_bytes(pickle.dumps(gmr(motion), protocol=protocol))
    np.testing.assert_allclose(read(path).motion.qpos, motion.qpos, atol=1e-12)


@pytest.mark.parametrize("compress", [0, 3, ("gzip", 3), ("bz2", 3), ("xz", 3), ("lzma", 3)])
def test_joblib_files_with_23_joints(compress, motion, tmp_path):
    path = tmp_path / "asap.pkl"
    joblib.dump({"one": asap(motion)}, path, compress=compress)
    content = read(path)
    wrists = np.array(["wrist" in name for name in ROBOT.joints])
    np.testing.assert_allclose(content.motion.qpos[:, :7], motion.qpos[:, :7], atol=1e-12)
    np.testing.assert_allclose(content.motion.qpos[:, 7:][:, ~wrists], motion.qpos[:, 7:][:, ~wrists], atol=1e-12)
    assert (content.motion.qpos[:, 7:][:, wrists] == ROBOT.standing_qpos[7:][wrists]).all()
    assert any("6 joints are not in the file" in note for note in content.notes)


def test_axis_angles_show_a_wxyz_quaternion(motion, tmp_path):
    joblib.dump({"one": {**asap(motion), "root_rot": motion.qpos[:, 3:7]}}, tmp_path / "wxyz.pkl")
    content = read(tmp_path / "wxyz.pkl")
    np.testing.assert_allclose(content.motion.qpos[:, 3:7], motion.qpos[:, 3:7], atol=1e-12)
    assert any("wxyz, not the format's xyzw" in note for note in content.notes)


def test_one_of_several_clips_must_be_named(motion, tmp_path):
    joblib.dump({"left": asap(motion), "right": asap(motion)}, tmp_path / "two.pkl")
    with pytest.raises(MotionFileError, match="left, right"):
        read(tmp_path / "two.pkl")
    with pytest.raises(MotionFileError, match="no clip 'middle'; valid: left, right"):
        read(tmp_path / "two.pkl", clip="middle")
    assert len(read(tmp_path / "two.pkl", clip="right").motion) == len(motion)


class Command:
    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return os.system, (f"touch {self.path}",)


@pytest.mark.parametrize("dump", [lambda value, path: path.write_bytes(pickle.dumps(value)), joblib.dump])
@pytest.mark.parametrize(
    "hide", [lambda bad: bad, lambda bad: {"root_pos": [bad]}, lambda bad: np.array([bad], dtype=object)]
)
def test_pickles_that_run_code_are_refused(dump, hide, tmp_path):
    trace = tmp_path / "ran"
    dump(hide(Command(trace)), tmp_path / "bad.pkl")
    with pytest.raises(MotionFileError, match="could run code: refused"):
        read(tmp_path / "bad.pkl")
    assert not trace.exists()


def test_pickled_state_changes_no_class(tmp_path):
    """BUILD may write attributes of whatever is on the stack, classes too."""
    attack = b"\x80\x02cjoblib.numpy_pickle\nNumpyArrayWrapper\nN}X\x04\x00\x00\x00evilK\x01s\x86b."
    (tmp_path / "build.pkl").write_bytes(attack)
    with pytest.raises(MotionFileError, match="refused"):
        read_pickle(tmp_path / "build.pkl")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty|not a readable pickle"),
        (b"\x80\x04", "not a readable pickle"),
        (pickle.dumps([1, 2]), "a pickle of a list"),
        (pickle.dumps({"a": 1}), "a pickle with a; valid"),
        (pickle.dumps({"root_pos": [[0, 0]], "root_rot": [[0, 0, 0, 1]], "dof_pos": [[0]]}), r"shape \(1, 2\)"),
    ],
)
def test_bad_pickles(content, message, tmp_path):
    (tmp_path / "bad.pkl").write_bytes(content)
    with pytest.raises(MotionFileError, match=message):
        read(tmp_path / "bad.pkl")


ASAP = {
    "root_trans_offset": np.zeros((5, 3)), "dof": np.zeros((5, 29)), "root_rot": np.tile([0, 0, 0, 1.0], (5, 1)), "fps": 30
}  # fmt: skip
GMR = {"root_pos": np.zeros((5, 3)), "dof_pos": np.zeros((5, 29)), "root_rot": ASAP["root_rot"], "fps": 30}
TRAINING = {"joint_pos": np.zeros((5, 29)), "body_pos_w": np.zeros((5, 3, 3)), "body_quat_w": np.ones((5, 3, 4))}


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({**ASAP, "pose_aa": np.zeros((4, 3))}, r"pose_aa has shape \(4, 3\); valid: \(5, bodies, 3\)"),
        ({**ASAP, "pose_aa": np.zeros((5, 4))}, r"pose_aa has shape \(5, 4\)"),
        ({**ASAP, "pose_aa": np.full((5, 30, 3), np.nan)}, "pose_aa in frame 0, number 0 is nan"),
        ({**ASAP, "root_rot": np.zeros((0, 4))}, r"root_rot has shape \(0, 4\)"),
        ({**GMR, "root_rot": np.zeros((5, 3))}, r"root_rot has shape \(5, 3\); valid: \(frames, 4\)"),
        ({**GMR, "local_body_pos": np.zeros((4, 3, 3))}, r"local_body_pos has shape \(4, 3, 3\)"),
        ({**TRAINING, "body_pos_w": np.zeros((5, 0, 3)), "body_quat_w": np.ones((5, 0, 4))}, "5 frames of 0 bodies"),
        ({name: value[:0] for name, value in TRAINING.items()}, "0 frames of 3 bodies"),
    ],
)
def test_arrays_of_wrong_shapes(arrays, message, tmp_path):
    np.savez(tmp_path / "bad.npz", **arrays)
    with pytest.raises(MotionFileError, match=rf"bad\.npz: {message}"):
        read(tmp_path / "bad.npz")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda rows: [*rows[:1], rows[1][:-1], *rows[2:]], "line 2: 35 values; valid: 36"),
        (lambda rows: [row[:-2] for row in rows], "27 joints; valid: 29 or 23 without wrists"),
        (lambda rows: [[*row[:3], "2", *row[4:]] for row in rows], "norm"),
        (lambda rows: [*rows[:3], [*rows[3][:9], "x", *rows[3][10:]]], "line 4: a value is 'x'"),
        (lambda rows: [*rows[:3], [*rows[3][:9], "nan", *rows[3][10:]]], "frame 3"),
    ],
)
def test_bad_csv(change, message, motion, tmp_path):
    rows = [line.split(",") for line in write(motion, "unitree", tmp_path).read_text().splitlines()]
    (tmp_path / "bad.csv").write_text("\n".join(",".join(row) for row in change(rows)))
    with pytest.raises(MotionFileError, match=message):
        read(tmp_path / "bad.csv")


def test_the_missing_frame_rate_is_reported(motion, tmp_path):
    path = write(motion, "unitree", tmp_path)
    content = read(path)
    assert content.motion.fps == 30
    assert any("frame rate is not in the file: 30 per second" in note for note in content.notes)
    assert read(path, file_fps=60).motion.fps == 60
