"""Files that once came out wrong without a word, with their right values; and generated ones of the same kinds.

The small files lie with the other motion data (`SIMPREP_TEST_DATA`); what is generated needs nothing.
"""

from pathlib import Path

import numpy as np
import pytest
from motion_files import LIMBS, bvh_text, write

from simprep.duel.stream.import_pair import import_pair
from simprep.errors import MotionFileError
from simprep.humanoid_model import humanoid
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import ImportResult, import_motion
from simprep.motion.motion import Motion


@pytest.fixture
def faults(data_dir: Path) -> Path:
    return data_dir / "faults"


def worst(result: ImportResult) -> float:
    """Largest angle of any limb to the source in any frame [deg]."""
    assert result.report.check is not None
    return max(limb.max_deg for limb in result.report.check.limbs.values())


def hip_line_deg(motion: Motion) -> np.ndarray:
    """Heading of the line from the right to the left hip, from the y axis [deg]."""
    character = humanoid()
    place = forward_kinematics(motion.qpos).xpos
    line = place[:, character.segment("left_thigh")] - place[:, character.segment("right_thigh")]
    return np.degrees(np.arctan2(-line[:, 0], line[:, 1]))


def hinge_deg(motion: Motion, name: str) -> np.ndarray:
    return np.degrees(motion.qpos[:, 7 + motion.character.joint(name)])


def test_arms_in_a_v_leave_the_trunk_upright(faults: Path) -> None:
    result = import_motion(faults / "arms_overhead_held_only.bvh")
    for hinge in humanoid().groups["trunk"][:6]:
        assert np.abs(hinge_deg(result.motion, hinge)).max() < 2
    assert worst(result) < 2
    assert not result.report.doubtful


def test_each_frame_is_as_good_as_alone(faults: Path, tmp_path: Path) -> None:
    text = (faults / "elbow_stuck.bvh").read_text().splitlines()
    first = next(number for number, line in enumerate(text) if line.startswith("Frame Time")) + 1
    head = [line.replace("Frames: 40", "Frames: 2") for line in text[:first]]
    clip = import_motion(faults / "elbow_stuck.bvh")
    assert worst(clip) < 3
    for frame in (0, 9, 14, 20, 39):
        path = write(tmp_path, f"{frame}.bvh", "\n".join([*head, text[first + frame], text[first + frame]]) + "\n")
        alone = import_motion(path)
        assert worst(clip) < worst(alone) + 1
        between = forward_kinematics(clip.motion.qpos[frame : frame + 1]).xpos[0]
        own = forward_kinematics(alone.motion.qpos[:1]).xpos[0]
        assert np.abs((between - between[0]) - (own - own[0])).max() < 0.02


def test_the_end_pose_alone(faults: Path) -> None:
    result = import_motion(faults / "elbow_stuck_end_pose_only.bvh")
    assert worst(result) <= 2.9
    assert result.report.residual_mm <= 2.6


def test_a_toe_below_its_ankle_tells_no_direction(faults: Path) -> None:
    result = import_motion(faults / "toe_below_ankle.bvh")
    assert sum("direction is not told" in warning for warning in result.report.warnings) == 2
    for side in ("left", "right"):
        assert np.abs(hinge_deg(result.motion, f"{side}_ankle_dorsiflexion")).max() < 1
        assert np.abs(hinge_deg(result.motion, f"{side}_ankle_inversion")).max() < 1
    assert np.abs(hip_line_deg(result.motion)).max() < 1
    control = import_motion(faults / "toe_ahead_control.bvh")
    assert not any("direction is not told" in warning for warning in control.report.warnings)
    assert np.abs(hip_line_deg(control.motion)).max() < 1


@pytest.mark.parametrize("ahead", [0.0, 0.01, 0.03, -0.02])
def test_a_toe_nearly_below_its_ankle(tmp_path: Path, ahead: float) -> None:
    text = bvh_text().replace("0.000000 -6.000000 14.000000", f"{0.7 * ahead * 100:.6f} -6.000000 {ahead * 100:.6f}")
    assert text.count(f" -6.000000 {ahead * 100:.6f}") == 2
    result = import_motion(write(tmp_path, "a.bvh", text))
    assert sum("direction is not told" in warning for warning in result.report.warnings) == 2
    assert np.abs(hip_line_deg(result.motion)).max() < 1
    assert worst(result) < 2


def test_daz_names(faults: Path, tmp_path: Path) -> None:
    assert worst(import_motion(faults / "daz_shldr.bvh")) < 2
    # the later figures' names: bend and twist joints
    later = {f"{side}{ours}": f"{side[0].lower()}{theirs}" for side in LIMBS for ours, theirs in (
        ("UpLeg", "ThighBend"), ("Leg", "Shin"), ("Foot", "Foot"), ("ToeBase", "Toe"), ("Arm", "ShldrBend"),
        ("ForeArm", "ForearmBend"), ("Hand", "Hand"),
    )}  # fmt: skip
    text = bvh_text()
    for ours, theirs in later.items():
        text = text.replace(f"JOINT {ours}\n", f"JOINT {theirs}\n")
    assert "lShldrBend" in text
    result = import_motion(write(tmp_path, "a.bvh", text))
    assert result.motion.qpos == pytest.approx(import_motion(write(tmp_path, "b.bvh", bvh_text())).motion.qpos)


def test_utf_16(faults: Path, tmp_path: Path) -> None:
    assert worst(import_motion(faults / "utf16.bvh")) < 2
    plain = import_motion(write(tmp_path, "a.bvh", bvh_text())).motion
    for encoding in ("utf-16", "utf-16-be", "utf-16-le", "utf-8-sig"):
        path = tmp_path / f"{encoding}.bvh"
        path.write_bytes(bvh_text().encode(encoding))
        assert np.array_equal(import_motion(path).motion.qpos, plain.qpos)


def test_two_people_in_one_file(faults: Path, tmp_path: Path) -> None:
    pair = import_pair(faults / "two_roots.bvh")
    assert [len(player) for player in pair.stream.players] == [6, 6]
    with pytest.raises(MotionFileError, match=r"line 127: a second ROOT.*duel import"):
        import_motion(faults / "two_roots.bvh")
    with pytest.raises(MotionFileError, match="holds one person"):
        import_pair(write(tmp_path, "one.bvh", bvh_text()))


def test_an_amass_file_is_converted(faults: Path) -> None:
    result = import_motion(faults / "amass_like.npz")
    assert result.report.recognised.startswith("AMASS")
    assert (len(result.motion), result.motion.fps) == (5, 60)
    assert worst(result) < 5
