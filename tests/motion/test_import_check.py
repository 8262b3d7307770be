"""An import judges itself: constructed errors are found as large as they are, at every frame rate."""

import re
from pathlib import Path

import generated_clips
import numpy as np
import pytest
from motion_files import bvh_text, write
from scipy.spatial.transform import Rotation

from simprep.humanoid_model import humanoid
from simprep.motion.import_check import LIMBS, check_import
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import import_motion, load_motion
from simprep.motion.targets import ORIENTED, Targets


def standing(frames: int = 50) -> tuple[np.ndarray, Targets]:
    """Poses, and targets that they meet exactly."""
    qpos = np.tile(humanoid().standing_qpos, (frames, 1))
    pose = forward_kinematics(qpos)
    turn = Rotation.from_quat(pose.xquat[:, ORIENTED].reshape(-1, 4), scalar_first=True).as_matrix()
    return qpos, Targets(pose.xpos, turn.reshape(frames, -1, 3, 3), np.ones(5, dtype=bool), 30.0, None)


def test_a_limb_that_points_elsewhere_is_found() -> None:
    qpos, targets = standing()
    none = np.zeros(len(qpos), dtype=bool)
    exact = check_import(qpos, none, targets, humanoid())
    assert not exact.doubtful
    assert exact.residual_mm == pytest.approx(0, abs=1e-9)
    turned = qpos.copy()
    turned[10:20, 7 + humanoid().joint("left_shoulder_abduction")] = np.radians(30)
    turned[17, 7 + humanoid().joint("left_shoulder_abduction")] = np.radians(40)
    check = check_import(turned, none, targets, humanoid())
    arm = check.limbs["left_upper_arm"]
    assert (arm.median_deg, arm.p95_deg) == (pytest.approx(0, abs=1e-5), pytest.approx(30, abs=1e-6))
    assert (arm.max_deg, arm.max_frame, arm.far_share) == (pytest.approx(40), 17, pytest.approx(0.2))
    assert check.worst_residual_frame == 17
    assert check.doubtful
    assert check.worst_limb in ("left_upper_arm", "left_forearm")
    assert any("left upper arm" in line and "40 deg" in line and "10-19" in line for line in check.warnings)
    assert all(check.limbs[name].good for name in LIMBS if not name.startswith(("left_upper", "left_fore")))


def test_a_hinge_that_stays_at_its_limit_is_named() -> None:
    qpos, targets = standing()
    knee = 7 + humanoid().joint("right_knee_flexion")
    low = humanoid().model.jnt_range[1 + knee - 7, 0]
    qpos[:15, knee] = low
    unsettled = np.zeros(len(qpos), dtype=bool)
    unsettled[[3, 4, 8]] = True
    check = check_import(qpos, unsettled, targets, humanoid())
    assert check.saturated == {"right_knee_flexion": pytest.approx(0.3)}
    assert any("did not settle in frames 3-4, 8" in line for line in check.warnings)


def through_the_trunk(folder: Path, frames: range) -> Path:
    """A person who holds an upper arm through the trunk in some of 40 frames: no shoulder reaches that."""
    lines = bvh_text(frames=40).splitlines()
    first = next(number for number, line in enumerate(lines) if line.startswith("Frame Time")) + 1
    names = [line.split()[1] for line in lines if line.split()[:1] in (["ROOT"], ["JOINT"])]
    column = 6 + 3 * (names.index("LeftArm") - 1) + 2  # about y: the arm of a T-pose swings horizontally
    for row in frames:
        values = lines[first + row].split()
        values[column] = "-170"
        lines[first + row] = " ".join(values)
    return write(folder, "a.bvh", "\n".join(lines) + "\n")


def test_a_doubtful_import_says_so(tmp_path: Path) -> None:
    path = through_the_trunk(tmp_path, range(40))
    report = import_motion(path).report
    assert report.doubtful
    assert "left upper arm" in report.warnings[0]
    with pytest.warns(UserWarning, match="doubtful import"):
        load_motion(path)
    content = report.as_dict()
    assert content["doubtful"] is True
    assert set(content["limbs"]["left_upper_arm"]) >= {"median_deg", "p95_deg", "max_deg"}
    assert {"saturated", "residual_mm", "worst_residual_mm", "worst_residual_frame"} <= set(content)


def test_what_the_body_cannot_do_for_a_moment_is_told_but_not_doubtful(tmp_path: Path) -> None:
    report = import_motion(through_the_trunk(tmp_path, range(20, 25))).report
    arm = report.check.limbs["left_upper_arm"]
    assert not arm.good
    assert arm.out_of_reach_share == pytest.approx(5 / 40, abs=2 / 40)
    assert arm.reachable_p95_deg < 5 < arm.p95_deg
    assert not report.doubtful
    assert any("left upper arm" in line and "out of reach in 1" in line for line in report.warnings)


def largest_turn(coarse: Path, fine: Path, up: str | None = None) -> float:
    """Largest angle between the limbs of a file as it is, at 30 Hz, and of another one at 120 Hz [deg]."""
    bones = []
    for path, fps in ((coarse, 30.0), (fine, 120.0)):
        motion = import_motion(path, fps=fps, up=up).motion
        at = forward_kinematics(motion.qpos, motion.character).xpos[:: round(fps / 30)]
        role = motion.character.segment
        bones.append(np.stack([at[:, role(b)] - at[:, role(a)] for a, b in LIMBS.values()], axis=1))
    frames = min(len(bone) for bone in bones)
    one, two = (bone[:frames] / np.linalg.norm(bone[:frames], axis=-1, keepdims=True) for bone in bones)
    return float(np.degrees(np.arccos(np.clip((one * two).sum(axis=-1), -1, 1)).max()))


@pytest.mark.parametrize("number", [5, 13, 21, 25])
def test_frame_rates_agree(tmp_path: Path, number: int) -> None:
    """A 30 Hz file as it is and resampled to 120 Hz: slow, fast, arms that leave their reach, arms that swing."""
    clip = generated_clips.generate(number, seconds=2)
    assert clip.fps == 30
    path = write(tmp_path, "a.bvh", clip.text)
    assert largest_turn(path, path, clip.up) < 3


@pytest.mark.parametrize("number", [15, 23])
def test_files_of_other_frame_rates_agree(tmp_path: Path, number: int) -> None:
    """A 120 Hz file, and one with every fourth of its frames."""
    clip = generated_clips.generate(number, seconds=2)
    assert clip.fps == 120
    head, rows = clip.text.split("Frame Time:")
    every = rows.strip().splitlines()[1::4]
    coarse = re.sub(r"Frames: \d+", f"Frames: {len(every)}", head) + "Frame Time: 0.0333333\n" + "\n".join(every) + "\n"
    assert largest_turn(write(tmp_path, "b.bvh", coarse), write(tmp_path, "a.bvh", clip.text), clip.up) < 3


@pytest.mark.parametrize("name", ["kick_normal_001", "punch_normal_001", "run_normal_001"])
def test_frame_rates_of_captured_clips_agree(data_dir: Path, name: str) -> None:
    path = data_dir / f"bandai-namco/{name}.bvh"
    assert largest_turn(path, path) < 3
