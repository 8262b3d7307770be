"""The file readers against bvhio, against hand-computed kinematics, and the recognition of joint names."""

from pathlib import Path

import numpy as np
import pytest
from motion_files import BONES, amc_text, asf_text, bvh_hierarchy, bvh_text, deepmimic_frame, deepmimic_text, write
from scipy.spatial.transform import Rotation

from simprep.motion.formats.acclaim import read_acclaim
from simprep.motion.formats.bvh import read_bvh
from simprep.motion.formats.deepmimic import read_deepmimic
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.joint_map import find_joints


def against_bvhio(path: Path, clip: SourceClip, frames: list[int], tolerance: float) -> None:
    """World positions of every joint, as bvhio computes them."""
    bvhio = pytest.importorskip("bvhio")
    root = bvhio.readAsHierarchy(str(path))
    index = {name: number for number, name in enumerate(clip.names)}
    compared = 0
    for frame in frames:
        root.loadPose(frame)
        for joint, _, _ in root.layout():
            if joint.Name in index:
                theirs = np.array(list(joint.PositionWorld))
                assert clip.positions[frame, index[joint.Name]] == pytest.approx(theirs, abs=tolerance)
                compared += 1
    assert compared >= 15 * len(frames)


@pytest.mark.parametrize(
    "name", ["bandai-namco/walk-back_normal_001.bvh", "bandai-namco/run_normal_001.bvh", "pairs/18_01.bvh"]
)
def test_bvh_agrees_with_bvhio_on_real_files(data_dir: Path, name: str) -> None:
    clip = read_bvh(data_dir / name)
    against_bvhio(data_dir / name, clip, [0, 1, len(clip.positions) - 1], 2e-3 * np.ptp(clip.positions[0]) / 100)


def test_bvh_agrees_with_bvhio_on_random_rotations(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    hierarchy = bvh_hierarchy()
    width = 3 * hierarchy.count("CHANNELS") + 3
    rows = rng.uniform(-180, 180, (3, width))
    text = "\n".join(
        [
            hierarchy,
            "MOTION",
            "Frames: 3",
            "Frame Time: 0.01",
            *(" ".join(f"{value:.9f}" for value in row) for row in rows),
        ]
    )
    path = write(tmp_path, "random.bvh", text)
    against_bvhio(path, read_bvh(path), [0, 1, 2], 1e-3)


def test_bvh_keeps_bone_lengths_and_reads_loose_layout(tmp_path: Path) -> None:
    tight = read_bvh(write(tmp_path, "a.bvh", bvh_text()))
    loose = (
        bvh_text()
        .replace("\n", "\r\n")
        .replace("{", " {\t")
        .replace("Frames: 30", "Frames:\t30")
        .replace("End Site", "END SITE")
    )
    other = read_bvh(write(tmp_path, "b.bvh", loose.replace("ROOT Hips\r\n {\t", "ROOT Hips {")))
    assert other.names == tight.names
    assert other.positions == pytest.approx(tight.positions)
    parents = tight.parents[1:]
    length = np.linalg.norm(tight.positions[:, 1:] - tight.positions[:, parents], axis=-1)
    assert length == pytest.approx(np.tile(length[0], (len(length), 1)))
    assert tight.fps == 30


def test_acclaim_rotates_bones_about_their_own_axes(tmp_path: Path) -> None:
    """A knee with the axis turned by 90 degrees about z: its x rotation is then about the world's y."""
    skeleton = asf_text().replace(
        "name ltibia\n    direction 0.34 -0.94 0\n    length 7.2\n    axis 0 0 0 XYZ",
        "name ltibia\n    direction 0 -1 0\n    length 7.2\n    axis 0 0 90 XYZ",
    )
    assert skeleton != asf_text()
    write(tmp_path, "02.asf", skeleton)
    clip = read_acclaim(write(tmp_path, "02_01.amc", amc_text(2).replace("ltibia 0 0 0", "ltibia 30 0 0")))
    turn = clip.rotations[0, clip.names.index("ltibia")]
    assert turn == pytest.approx(Rotation.from_euler("y", 30, degrees=True).as_matrix(), abs=1e-12)
    # a bone about the world's axes: rx, ry, rz one after the other, about fixed axes
    write(tmp_path, "02.asf", asf_text())
    clip = read_acclaim(write(tmp_path, "02_01.amc", amc_text(2).replace("lfemur 0 0 0", "lfemur 20 30 40")))
    femur, knee = clip.names.index("lfemur"), clip.names.index("ltibia")
    expected = Rotation.from_euler("xyz", [20, 30, 40], degrees=True)
    assert clip.rotations[0, femur] == pytest.approx(expected.as_matrix())
    _, direction, length = BONES["lfemur"]
    bone = expected.apply(np.array(direction) / np.linalg.norm(direction)) * length
    assert clip.positions[0, knee] - clip.positions[0, femur] == pytest.approx(bone)


def test_acclaim_finds_its_skeleton(tmp_path: Path) -> None:
    write(tmp_path, "02.asf", asf_text())
    write(tmp_path, "03.asf", asf_text().replace("length 0.45", "length 1"))
    assert read_acclaim(write(tmp_path, "03_07.amc", amc_text(2))).unit_m == pytest.approx(0.0254)
    assert read_acclaim(write(tmp_path, "02_07.amc", amc_text(2))).unit_m == pytest.approx(0.0254 / 0.45)


def test_deepmimic_bends_knees_back_and_elbows_forward(tmp_path: Path) -> None:
    frame = deepmimic_frame()
    knee, elbow = 4 + 4 + 4 + 4 + 4, 4 + 4 + 4 + 4 + 4 + 1 + 4 + 4
    frame[knee], frame[elbow] = -1.0, 1.0
    clip = read_deepmimic(write(tmp_path, "a.txt", deepmimic_text([frame] * 3)))
    at = {name: clip.positions[0, number] for number, name in enumerate(clip.names)}
    assert (at["right_ankle"] - at["right_knee"])[0] < -0.3  # x is forward
    assert (at["right_wrist"] - at["right_elbow"])[0] > 0.2
    assert at["right_hip"][2] > 0  # z is to the right


def test_deepmimic_cycle_is_displaced_and_closed(tmp_path: Path) -> None:
    frames = []
    for number in range(21):
        frame = deepmimic_frame(0.05 if number < 20 else 0.0)
        frame[1] = 0.06 * number
        frame[20] = -0.5 - 0.4 * np.sin(2 * np.pi * number / 20) - 0.002 * number  # a knee that does not quite close
        frames.append(frame)
    clip = read_deepmimic(write(tmp_path, "a.txt", deepmimic_text(frames, "wrap")))
    assert clip.step == pytest.approx([1.2, 0, 0])
    assert len(clip.positions) == 20
    positions = np.concatenate([clip.positions, clip.positions + clip.step])
    jerk = np.abs(np.diff(positions, 3, axis=0)).max(axis=(1, 2))
    assert jerk[17:20].max() < 1.5 * jerk[:16].max()  # no break at the seam


NAMES = {
    "CMU": ("Hips", "LeftUpLeg LeftLeg LeftFoot LeftToeBase", "LeftArm LeftForeArm LeftHand", "Neck"),
    "Mixamo": (
        "mixamorig:Hips",
        "mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot mixamorig:LeftToeBase",
        "mixamorig:LeftArm mixamorig:LeftForeArm mixamorig:LeftHand",
        "mixamorig:Neck",
    ),
    "Bandai-Namco": ("Hips", "UpperLeg_L LowerLeg_L Foot_L Toes_L", "UpperArm_L LowerArm_L Hand_L", "Neck"),
    "Poser style": ("hip", "LeftHip LeftKnee LeftAnkle LeftToe", "LeftShoulder LeftElbow LeftWrist", "Neck"),
    "SMPL": ("Pelvis", "L_Hip L_Knee L_Ankle L_Foot", "L_Shoulder L_Elbow L_Wrist", "Neck"),
    "Blender": ("spine", "thigh.L shin.L foot.L toe.L", "upper_arm.L forearm.L hand.L", "neck"),
    "Biped": (
        "Bip01 Pelvis",
        "Bip01 L Thigh|Bip01 L Calf|Bip01 L Foot|Bip01 L Toe0",
        "Bip01 L UpperArm|Bip01 L Forearm|Bip01 L Hand",
        "Bip01 Neck",
    ),
    "Xsens": ("Hips", "LeftUpperLeg LeftLowerLeg LeftFoot LeftToe", "LeftUpperArm LeftForeArm LeftHand", "Neck"),
    "Character Creator": (
        "CC_Base_Hip",
        "CC_Base_L_Thigh CC_Base_L_Calf CC_Base_L_Foot CC_Base_L_ToeBase",
        "CC_Base_L_Upperarm CC_Base_L_Forearm CC_Base_L_Hand",
        "CC_Base_NeckTwist01",
    ),
    "Acclaim": ("root", "lfemur ltibia lfoot ltoes", "lhumerus lradius lwrist", "lowerneck"),
    "Poser": ("hip", "lThigh lShin lFoot lToe", "lShldr lForeArm lHand", "neck"),
    "Poser, numbered": ("hip:1", "lThigh:1 lShin:1 lFoot:1 lToe:1", "lShldr:1 lForeArm:1 lHand:1", "neck:1"),
    "Poser, lower case": ("hip", "lthigh lshin lfoot ltoe", "lshldr lforearm lhand", "neck"),
    "Poser, buttocks": ("hip", "lButtock lShin lFoot lToe", "lShldr lForeArm lHand", "neck"),
    "DAZ Genesis 8": ("hip", "lThighBend lShin lFoot lToe", "lShldrBend lForearmBend lHand", "neckLower"),
    "DAZ Genesis 9": ("hip", "l_thigh l_shin l_foot l_toes", "l_upperarm l_forearm l_hand", "neck1"),
    "second person": (
        "B_Hips",
        "B_LeftUpLeg B_LeftLeg B_LeftFoot B_LeftToe",
        "B_LeftArm B_LeftForeArm B_LeftHand",
        "B_Neck",
    ),
    "person at the end": ("Hips_B", "lThigh_B lShin_B lFoot_B lToe_B", "lShldr_B lForeArm_B lHand_B", "neck_B"),
    "DeepMimic": ("root", "left_hip left_knee left_ankle left_toe", "left_shoulder left_elbow left_wrist", "neck"),
}


@pytest.mark.parametrize("style", NAMES)
def test_joint_names_are_recognised(style: str) -> None:
    root, leg, arm, neck = NAMES[style]
    names, parents = [root, neck], [-1, 0]
    separator = "|" if "|" in leg else " "
    for chain in (leg, arm):
        for side in ("left", "right"):
            parent = 0
            for name in chain.split(separator):
                names.append(name if side == "left" else mirrored(name))
                parents.append(parent)
                parent = len(names) - 1
    joints = find_joints("x", tuple(names), np.array(parents)).joints
    parts = ("thigh", "shank", "foot", "toe")
    for part, name in [*zip(parts, leg.split(separator)), *zip(("upper_arm", "forearm", "hand"), arm.split(separator))]:
        assert names[joints[f"left_{part}"]] == name
        assert names[joints[f"right_{part}"]] == mirrored(name)
    assert names[joints["neck"]] == neck


def mirrored(name: str) -> str:
    """The right side's name."""
    for left, right in (("Left", "Right"), ("left", "right"), ("L_", "R_"), ("_L", "_R"), (".L", ".R"), (" L ", " R ")):
        if left in name:
            return name.replace(left, right)
    assert name.startswith("l")
    return "r" + name[1:]


def test_joint_map_of_the_user(tmp_path: Path) -> None:
    from simprep.motion.load import import_motion

    strange = {"LeftFoot": "hoofA", "RightFoot": "hoofB", "LeftToeBase": "tipA", "RightToeBase": "tipB"}
    path = write(tmp_path, "a.bvh", bvh_text(names=strange))
    chart = write(tmp_path, "map.json", '{"left_foot": "hoofA", "right_foot": "hoofB"}')
    result = import_motion(path, joint_map=chart)
    assert result.report.residual_mm < 5
