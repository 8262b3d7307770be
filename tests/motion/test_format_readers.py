"""Readers of SMPL's family, of points and of joint angles: layouts, units, axes, and what they refuse."""

import re
from pathlib import Path

import numpy as np
import pytest
from format_cases import random_motion, save, smpl_walk, trc_text
from motion_files import bvh_text

from simprep.errors import MotionFileError
from simprep.humanoid_model import humanoid
from simprep.library.registry import library_motion
from simprep.motion.formats.registry import format_to_write
from simprep.motion.formats.smpl_skeleton import JOINTS, MEAN_OFFSETS, NAMES
from simprep.motion.formats.trc import OPENSIM_AXES, read_trc
from simprep.motion.joint_map import find_joints
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import ImportResult, import_motion, read_source


def places(result: ImportResult) -> np.ndarray:
    return forward_kinematics(result.motion.qpos, result.motion.character).xpos


def knee_deg(result: ImportResult, side: str = "left") -> np.ndarray:
    return np.degrees(result.motion.qpos[:, 7 + humanoid().joint(f"{side}_knee_flexion")])


# --- SMPL ----------------------------------------------------------------------------------------------------------


def test_a_walk_of_amass(tmp_path: Path) -> None:
    walk = smpl_walk()
    poses = np.concatenate([walk["root_orient"], walk["pose_body"], np.zeros((90, 90))], axis=1)
    result = import_motion(
        save(tmp_path / "a.npz", poses=poses, trans=walk["trans"], betas=np.zeros(16), mocap_framerate=60.0)
    )
    assert (len(result.motion), result.motion.fps, result.report.up) == (90, 60, "z")
    assert not result.report.doubtful
    assert result.report.residual_mm < 15
    t = np.arange(90) / 60
    # SMPL's shank stands back by 6 degrees in its rest pose, and its thigh hardly
    assert np.abs(knee_deg(result) - np.degrees(0.5 + 0.4 * np.sin(2 * np.pi * t))).max() < 12
    # the person faces -y, and moves there
    heading = np.arctan2(
        *(2 * (result.motion.qpos[:, 3:4] * result.motion.qpos[:, 6:7])).T, 1 - 2 * result.motion.qpos[:, 6] ** 2
    )
    assert np.degrees(heading).mean() == pytest.approx(-90, abs=5)
    assert result.motion.qpos[-1, 1] < result.motion.qpos[0, 1] - 0.2
    assert any("betas are not used" in warning for warning in result.report.warnings)


def test_degrees_and_centimetres_are_named(tmp_path: Path) -> None:
    walk = smpl_walk(30)
    poses = np.concatenate([walk["root_orient"], walk["pose_body"]], axis=1)
    said = {}
    for unit, values in (("rad", poses), ("deg", np.degrees(poses))):
        path = save(tmp_path / f"{unit}.npz", poses=values, trans=walk["trans"], mocap_framerate=60.0)
        said[unit] = " ".join(import_motion(path).report.warnings)
    assert "degrees? read as rad" in said["deg"]
    assert "degrees" not in said["rad"]
    assert "centimetres" not in said["rad"]
    path = save(tmp_path / "cm.npz", poses=poses, trans=100 * walk["trans"], mocap_framerate=60.0)
    assert "centimetres? read as m" in " ".join(import_motion(path).report.warnings)


def test_the_layouts_of_smpl_are_one_motion(tmp_path: Path) -> None:
    walk = smpl_walk(60)
    root, body, trans = walk["root_orient"], walk["pose_body"], walk["trans"]
    rest = {"trans": trans, "betas": np.zeros(10)}
    whole = np.concatenate([root, body], axis=1)
    files = {
        "SMPL of PBHC": rest | {"poses": whole, "mocap_framerate": 60},
        "SMPL": {"smpl_poses": np.pad(whole, ((0, 0), (0, 6))), "smpl_trans": trans, "fps": 60},
        "SMPL-H": rest | {"poses": np.pad(whole, ((0, 0), (0, 90))), "mocap_framerate": 60.0},
        "SMPL-X": rest | {"poses": np.pad(whole, ((0, 0), (0, 99))), "mocap_frame_rate": 60.0},
        "split": rest
        | {"root_orient": root, "pose_body": body, "pose_hand": np.zeros((60, 90)), "mocap_frame_rate": [60]},
        "smplx": {"global_orient": root, "body_pose": body, "transl": trans, "fps": np.array(60)},
        "in rows": rest | {"poses": whole.reshape(60, 22, 3), "mocap_framerate": 60},
    }
    found = {name: places(import_motion(save(tmp_path / "a.npz", **content))) for name, content in files.items()}
    for name, other in found.items():
        assert np.abs(other - found["SMPL-H"]).max() < 1e-9, name
    inter_x = {"root_orient": root, "pose_body": body.reshape(60, 21, 3), "trans": trans}
    inter_x |= {"pose_lhand": np.zeros((60, 15, 3)), "pose_rhand": np.zeros((60, 15, 3))}
    report = import_motion(save(tmp_path / "P1.npz", **inter_x)).report
    assert report.recognised.startswith("Inter-X")
    assert any("120 frames/s" in warning for warning in report.warnings)


def test_the_same_motion_as_bvh_is_the_same_body(tmp_path: Path) -> None:
    walk = smpl_walk(40)
    poses = np.concatenate([walk["root_orient"], walk["pose_body"]], axis=1)
    smpl = import_motion(save(tmp_path / "a.npz", poses=poses, trans=walk["trans"], mocap_framerate=60))
    (tmp_path / "a.bvh").write_text(smpl_as_bvh(poses, walk["trans"], 60.0))
    bvh = import_motion(tmp_path / "a.bvh", up="z")
    assert np.abs(places(bvh) - places(smpl)).max() < 1e-3


def smpl_as_bvh(poses: np.ndarray, trans: np.ndarray, fps: float) -> str:
    """The skeleton of the table as BVH whose rest pose is AMASS's T-pose, z up, metres."""
    from format_cases import Z_UP
    from scipy.spatial.transform import Rotation

    local = Rotation.from_rotvec(poses.reshape(-1, 3)).as_matrix().reshape(len(poses), -1, 3, 3)
    local = np.concatenate([local, np.tile(np.eye(3), (len(poses), 2, 1, 1))], axis=1)
    turned = Z_UP @ local @ Z_UP.T
    turned[:, 0] = local[:, 0] @ Z_UP.T
    angles = np.degrees(Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_euler("ZXY")).reshape(len(poses), -1, 3)
    lines, columns = ["HIERARCHY"], [trans]

    def add(joint: int) -> None:
        offset = " ".join(f"{value:.9f}" for value in Z_UP @ MEAN_OFFSETS[joint])
        channels = "6 Xposition Yposition Zposition" if joint == 0 else "3"
        lines.extend([f"{'ROOT' if joint == 0 else 'JOINT'} {NAMES[joint]}", "{", f"OFFSET {offset}"])
        lines.append(f"CHANNELS {channels} Zrotation Xrotation Yrotation")
        columns.append(angles[:, joint])
        for child, (_, parent, _) in enumerate(JOINTS):
            if parent == joint:
                add(child)
        lines.append("}")

    add(0)
    rows = [" ".join(f"{value:.9f}" for value in row) for row in np.concatenate(columns, axis=1)]
    return "\n".join([*lines, "MOTION", f"Frames: {len(poses)}", f"Frame Time: {1 / fps:.9f}", *rows]) + "\n"


def test_a_body_model_of_the_user_gives_the_bones(tmp_path: Path) -> None:
    walk = smpl_walk(20)
    path = save(tmp_path / "a.npz", **walk, betas=np.array([2.0, 0.0]), mocap_framerate=60)
    # a model whose vertices are its joints, and whose first shape lengthens everything by a tenth for each unit
    joints = np.zeros((22, 3))
    for number, (_, parent, offset) in enumerate(JOINTS[:22]):
        joints[number] = np.array(offset) + (joints[parent] if parent >= 0 else [0.0, -0.2, 0.0])
    shapes = np.stack([0.1 * (joints - joints[0]), np.zeros_like(joints)], axis=-1)
    model = save(tmp_path / "model.npz", J_regressor=np.eye(22), v_template=joints, shapedirs=shapes)
    mean, own = (import_motion(path, body_model=one).report for one in (None, model))
    assert any("betas" in warning and "model.npz" in warning for warning in own.warnings)
    assert not any("unusual person" in warning for warning in mean.warnings)
    clips = [read_source(path), None]
    from simprep.motion.formats.format import ReadOptions
    from simprep.motion.load import read_file

    clips[1], _ = read_file(path, ReadOptions(body_model=model))
    legs = [np.linalg.norm(clip.positions[0, 4] - clip.positions[0, 1]) for clip in clips]  # type: ignore[union-attr]
    assert legs[1] == pytest.approx(1.2 * legs[0])
    with pytest.raises(MotionFileError, match="no J_regressor, v_template, shapedirs"):
        import_motion(path, body_model=path)


# --- points --------------------------------------------------------------------------------------------------------

CENTRES = {
    "RHip": "right_thigh", "RKnee": "right_shank", "RAnkle": "right_foot", "LHip": "left_thigh", "LKnee": "left_shank",
    "LAnkle": "left_foot", "Neck": "neck", "Head": "head", "RShoulder": "right_upper_arm", "RElbow": "right_forearm",
    "RWrist": "right_hand", "LShoulder": "left_upper_arm", "LElbow": "left_forearm", "LWrist": "left_hand",
}  # fmt: skip


def centres(extra: tuple[str, ...] = ()) -> tuple[tuple[str, ...], np.ndarray]:
    """Joint centres of a walk in OpenSim's axes [mm], and points that are no joints."""
    walk = library_motion("walk")
    place = forward_kinematics(walk.qpos).xpos
    points = place[:, [humanoid().segment(part) for part in CENTRES.values()]]
    points = np.concatenate([points, points[:, : len(extra)] + 0.05], axis=1)
    return (*CENTRES, *extra), points @ OPENSIM_AXES * 1000


def test_joint_centres_become_the_motion(tmp_path: Path) -> None:
    names, points = centres()
    points[5, 3] = np.nan
    path = tmp_path / "a.trc"
    path.write_text(trc_text(names, points, 60, "mm"))
    result = import_motion(path)
    assert result.report.recognised == "TRC, points over time"
    assert result.report.up == "y"
    assert any("1 unseen joint positions" in warning for warning in result.report.warnings)
    walk = library_motion("walk")
    wanted = np.degrees(walk.qpos[:, 7 + humanoid().joint("left_knee_flexion")])
    assert np.abs(knee_deg(result) - wanted).max() < 8
    assert result.report.residual_mm < 20


@pytest.mark.parametrize("extension", ["trc", "c3d"])
def test_markers_on_the_skin_are_refused(tmp_path: Path, extension: str) -> None:
    names = ("LASI", "RASI", "LPSI", "RPSI", "LTHI", "LKNE", "LANK", "LHEE", "C7", "CLAV", "LSHO", "LELB")
    points = np.random.default_rng(0).uniform(0, 1000, (20, len(names), 3))
    path = tmp_path / f"a.{extension}"
    if extension == "trc":
        path.write_text(trc_text(tuple(f"Subject:{name}" for name in names), points, 100, "mm"))
    else:
        write_c3d(path, names, points, 100.0)
    with pytest.raises(
        MotionFileError, match=r"markers on the skin \(LASI, RASI, LPSI.*\), not joints; valid: joint centres"
    ):
        import_motion(path)


def test_joint_centres_among_markers_are_taken(tmp_path: Path) -> None:
    names, points = centres(("LASI", "RASI", "C7", "CLAV"))
    path = tmp_path / "a.trc"
    path.write_text(trc_text(names, points, 60, "mm"))
    assert import_motion(path).report.residual_mm < 20


def test_joint_centres_of_vicon_by_their_letters(tmp_path: Path) -> None:
    letters = {"Hip": "HJC", "Knee": "KJC", "Ankle": "AJC", "Shoulder": "SJC", "Elbow": "EJC", "Wrist": "WJC"}
    names, points = centres()
    renamed = tuple(
        next((name[0] + code for word, code in letters.items() if name[1:] == word), name) for name in names
    )
    path = tmp_path / "a.c3d"
    write_c3d(path, renamed, points @ OPENSIM_AXES.T, 60.0)
    assert import_motion(path).report.residual_mm < 20


def write_c3d(path: Path, names: tuple[str, ...], points: np.ndarray, fps: float) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [fps]
    content["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    content["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    content["data"]["points"] = np.concatenate([points.transpose(2, 1, 0), np.ones((1, len(names), len(points)))])
    content.write(str(path))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("\tmm\t", "\tfurlong\t", "Units 'furlong'; valid: m, meters, cm, mm"),
        ("NumFrames", "Count", "no NumFrames"),
        ("RKnee", "RHip", "two of them called 'RHip'"),
        ("\t0.016667\t", "\t0.016667\tx", "a position is 'x"),
        ("Frame#", "Bild", "line Frame#"),
    ],
)
def test_broken_trc(tmp_path: Path, old: str, new: str, said: str) -> None:
    names, points = centres()
    text = trc_text(names, points[:4], 60, "mm")
    assert old in text
    path = tmp_path / "a.trc"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(MotionFileError, match=re.escape(said)):
        read_trc(path)


def test_c3d_without_its_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    from simprep.errors import MissingExtraError

    monkeypatch.setitem(sys.modules, "ezc3d", None)
    form = format_to_write(tmp_path / "a.c3d")
    assert form.write is not None
    with pytest.raises(
        MissingExtraError, match=r"C3D files needs an optional dependency: pip install 'simprep\[c3d\]'"
    ):
        form.write(library_motion("walk"), tmp_path / "a.c3d")


# --- joint angles --------------------------------------------------------------------------------------------------


def csv(tmp_path: Path) -> tuple[Path, list[str]]:
    path = tmp_path / "a.csv"
    format_to_write(path).write(random_motion(humanoid(), 12), path)  # type: ignore[misc]
    return path, path.read_text().splitlines()


def test_degrees_and_radians_are_one_motion(tmp_path: Path) -> None:
    path, lines = csv(tmp_path)
    wanted = import_motion(path).motion.qpos
    names = lines[0].split(",")
    rows = [[float(field) for field in line.split(",")] for line in lines[1:]]
    scaled = [[np.degrees(v) if name.endswith("_rad") else v for name, v in zip(names, row)] for row in rows]
    head = [re.sub("_rad$", " [deg]", name) for name in names]
    text = ";".join(head) + "\n" + "\n".join(";".join(f"{v:.9f}".replace(".", ",") for v in row) for row in scaled)
    path.write_text("# from a gait laboratory\n" + text)
    result = import_motion(path)
    assert result.report.recognised == "CSV of 37 joint angles in degrees"
    assert any("decimal commas" in warning for warning in result.report.warnings)
    assert np.abs(result.motion.qpos - wanted).max() < 1e-6


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda t: t.replace("left_knee_flexion_rad", "left_knee_flexion"),
            "'left_knee_flexion' does not state its unit",
        ),
        (lambda t: t.replace("root_qx", "rx"), "the root lacks root_qx"),
        (lambda t: t.replace("time_s", "clock"), "no frame rate: no column of times"),
        (lambda t: t.replace("0.040000000", "0.090000000"), "valid: even times"),
        (lambda t: t.replace("0.040000000", "0.04x"), "line 4: a value is '0.04x'"),
        (lambda t: t.replace("\n0.04", "\n0.04,0"), "line 4: 46 values in a frame; valid: 45"),
        (lambda t: t.splitlines()[0] + "\n", "no frames"),
        (lambda t: re.sub("_rad", "_thing_rad", t), "no column is a joint of simprep_humanoid"),
        (
            lambda t: t.replace("right_knee_flexion_rad", "left_knee_flexion_rad"),
            "two columns called 'left_knee_flexion_rad'",
        ),
    ],
)
def test_broken_csv(tmp_path: Path, change: object, said: str) -> None:
    path, lines = csv(tmp_path)
    path.write_text(change("\n".join(lines)))  # type: ignore[operator]
    with pytest.raises(MotionFileError, match=re.escape(said)):
        import_motion(path)


def test_a_csv_of_some_joints_stands(tmp_path: Path) -> None:
    path = tmp_path / "knees.csv"
    path.write_text("left_knee_flexion_deg,right_knee_flexion_deg,root_note_deg\n10,20,0\n11,21,0\n")
    with pytest.raises(MotionFileError, match="no frame rate"):
        import_motion(path)
    result = import_motion(path, file_fps=50)
    assert result.motion.fps == 50
    assert knee_deg(result) == pytest.approx([10, 11])
    assert any("35 joints have no column" in warning for warning in result.report.warnings)
    assert any("the root" in warning for warning in result.report.warnings)


def test_a_file_of_opensim(tmp_path: Path) -> None:
    path = tmp_path / "ik.mot"
    columns = {
        "time": [0, 0.01, 0.02], "pelvis_tilt": [-5.0] * 3, "pelvis_list": [2.0] * 3, "pelvis_rotation": [30.0] * 3,
        "pelvis_tx": [1.0, 1.1, 1.2], "pelvis_ty": [0.93] * 3, "pelvis_tz": [-0.5] * 3, "hip_flexion_r": [20.0] * 3,
        "hip_adduction_r": [-7.0] * 3, "knee_angle_r": [40.0] * 3, "lumbar_extension": [-8.0] * 3, "lumbar_bending": [0.0] * 3,
        "lumbar_rotation": [4.0] * 3, "mtp_angle_r": [0.0] * 3,
    }  # fmt: skip
    rows = ["\t".join(f"{value}" for value in row) for row in zip(*columns.values())]
    head = "Coordinates\nversion=1\nnRows=3\nnColumns=14\ninDegrees=yes\n\nendheader\n"
    path.write_text(head + "\t".join(columns) + "\n" + "\n".join(rows) + "\n")
    result = import_motion(path)
    assert result.motion.fps == 100
    angle = {name: np.degrees(result.motion.qpos[0, 7 + humanoid().joint(name)]) for name in humanoid().joints}
    assert angle["right_hip_flexion"] == pytest.approx(20)
    assert angle["right_hip_abduction"] == pytest.approx(7)
    assert angle["right_knee_flexion"] == pytest.approx(40)
    assert angle["lumbar_flexion"] + angle["thorax_flexion"] == pytest.approx(8)
    assert angle["lumbar_rotation"] == pytest.approx(2)
    # x forward, z to the right: our y is -z; a turn to the left
    assert result.motion.qpos[0, :3] == pytest.approx([1.0, 0.5, 0.93])
    place = forward_kinematics(result.motion.qpos).xpos[0]
    line = place[humanoid().segment("left_thigh")] - place[humanoid().segment("right_thigh")]
    assert np.degrees(np.arctan2(-line[0], line[1])) == pytest.approx(30, abs=1)
    neck = place[humanoid().segment("abdomen")] - place[0]
    ahead = np.array([np.cos(np.radians(30)), np.sin(np.radians(30)), 0.0])
    assert neck @ ahead > 0  # a negative tilt leans forward
    path.write_text(path.read_text().replace("inDegrees=yes\n", ""))
    with pytest.raises(MotionFileError, match="inDegrees=missing; valid: yes or no"):
        import_motion(path)


# --- names of joints -----------------------------------------------------------------------------------------------


def test_names_of_100style() -> None:
    chain = {
        "Hips": "",
        "Chest": "Hips",
        "Chest2": "Chest",
        "Chest3": "Chest2",
        "Chest4": "Chest3",
        "Neck": "Chest4",
        "Head": "Neck",
    }
    for side in ("Right", "Left"):
        chain |= {f"{side}Collar": "Chest4", f"{side}Shoulder": f"{side}Collar", f"{side}Elbow": f"{side}Shoulder",
                  f"{side}Wrist": f"{side}Elbow", f"{side}Hip": "Hips", f"{side}Knee": f"{side}Hip",
                  f"{side}Ankle": f"{side}Knee", f"{side}Toe": f"{side}Ankle"}  # fmt: skip
    names = tuple(chain)
    found = find_joints("a", names, np.array([names.index(parent) if parent else -1 for parent in chain.values()]))
    wanted = {
        "thigh": "Hip",
        "shank": "Knee",
        "foot": "Ankle",
        "toe": "Toe",
        "upper_arm": "Shoulder",
        "forearm": "Elbow",
        "hand": "Wrist",
    }
    for part, name in wanted.items():
        assert names[found.joints[f"left_{part}"]] == f"Left{name}"
    assert [names[joint] for joint in found.trunk] == ["Hips", "Chest", "Chest2", "Chest3", "Chest4", "Neck"]


def test_a_bvh_of_another_extension(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text(bvh_text(frames=12))
    assert import_motion(path).report.recognised == "BVH (by its content, though it is called .txt)"


def test_a_wrong_frame_rate_is_corrected_on_demand(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"
    path.write_text(bvh_text(frames=12))
    result = import_motion(path, file_fps=60)
    assert (len(result.motion), result.motion.fps) == (12, 60)
    assert "the file states 30 frames/s; taken as 60, as asked for" in result.report.warnings
    table, _ = csv(tmp_path)
    result = import_motion(table, file_fps=25, up="y")
    assert result.motion.fps == 25
    assert "the file states 50 frames/s; taken as 25, as asked for" in result.report.warnings
    assert any("vertical axis and scale are not applied" in warning for warning in result.report.warnings)
