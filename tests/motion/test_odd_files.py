"""Files as people have them: encodings, comments, decimal commas, counts that are off by one, units that are a guess."""

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from motion_files import amc_text, asf_text, bvh_text, deepmimic_text, write

from simprep.errors import MotionFileError
from simprep.motion.formats.acclaim import read_acclaim
from simprep.motion.formats.bvh import read_bvh
from simprep.motion.formats.deepmimic import read_deepmimic
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.joint_map import find_joints, read_joint_map
from simprep.motion.load import import_motion, load_motion
from simprep.motion.normalise import normalise

ENCODED = {
    "UTF-8 with mark": lambda text: text.encode("utf-8-sig"),
    "UTF-16, little end first, with mark": lambda text: b"\xff\xfe" + text.encode("utf-16-le"),
    "UTF-16, big end first, with mark": lambda text: b"\xfe\xff" + text.encode("utf-16-be"),
    "UTF-16, little end first": lambda text: text.encode("utf-16-le"),
    "UTF-16, big end first": lambda text: text.encode("utf-16-be"),
    "UTF-32 with mark": lambda text: text.encode("utf-32"),
}


def same(a: SourceClip, b: SourceClip) -> bool:
    return a.names == b.names and np.array_equal(a.positions, b.positions) and np.array_equal(a.rotations, b.rotations)


def read(folder: Path, text: str) -> SourceClip:
    return read_bvh(write(folder, "a.bvh", text))


def motion_part(text: str, change: object) -> str:
    """The text with its frames changed, the hierarchy as it is."""
    head, time, frames = re.split(r"(Frame Time: \S+\n)", text)
    return head + time + change(frames)  # type: ignore[operator]


@pytest.mark.parametrize("encoding", ENCODED)
def test_encodings_of_every_text_format(tmp_path: Path, encoding: str) -> None:
    encode = ENCODED[encoding]
    plain, other = tmp_path / "plain", tmp_path / "other"
    for folder, form in ((plain, str.encode), (other, encode)):
        folder.mkdir()
        write(folder, "a.bvh", form(bvh_text(frames=5)))
        write(folder, "02.asf", form(asf_text()))
        write(folder, "02_01.amc", form(amc_text(5)))
        write(folder, "a.json", form(deepmimic_text()))
        write(folder, "map.json", form('{"neck": "Hals"}'))
    assert same(read_bvh(plain / "a.bvh"), read_bvh(other / "a.bvh"))
    assert same(read_acclaim(plain / "02_01.amc"), read_acclaim(other / "02_01.amc"))
    assert same(read_deepmimic(plain / "a.json"), read_deepmimic(other / "a.json"))
    assert read_joint_map(other / "map.json") == {"neck": "Hals"}


def test_comments_in_bvh_are_skipped_and_counted(tmp_path: Path) -> None:
    plain = bvh_text(frames=4)
    lines = plain.splitlines()
    for at, comment in (
        (len(lines) - 1, "; last frame"),
        (len(lines) - 3, "  # a frame"),
        (8, "// hip"),
        (0, "# on top"),
    ):
        lines.insert(at, comment)
    lines[-1] += " // at the end"
    clip = read(tmp_path, "\n".join(lines))
    assert same(clip, read(tmp_path, plain))
    assert "comments skipped: 5" in clip.notes
    lines[-2] = "word " + lines[-2]  # line numbers count the comments too
    with pytest.raises(MotionFileError) as caught:
        read(tmp_path, "\n".join(lines))
    assert caught.value.line == len(lines) - 1


def test_a_name_may_hold_the_sign_of_a_comment(tmp_path: Path) -> None:
    clip = read(tmp_path, bvh_text(frames=2).replace("JOINT Head", "JOINT Head #1"))
    assert "Head #1" in clip.names


def test_comments_in_acclaim_are_skipped_and_counted(tmp_path: Path) -> None:
    write(tmp_path, "02.asf", asf_text())
    plain = read_acclaim(write(tmp_path, "02_01.amc", amc_text(3)))
    assert not any("comments" in note for note in plain.notes)
    skeleton = "# AST/ASF file generated using VICON BodyLanguage\n# -----\n" + asf_text()
    write(
        tmp_path,
        "02.asf",
        skeleton.replace(":bonedata", "// bones\n:bonedata").replace("angle deg", "angle deg # not rad"),
    )
    motion = "#!OML:ASF C:\\02.ASF\n" + amc_text(3).replace("\n2\n", "\n; the second\n2\n")
    clip = read_acclaim(write(tmp_path, "02_01.amc", motion))
    assert same(clip, plain)
    # what the recording system writes on top is not counted
    assert "02.asf: comments skipped: 2" in clip.notes
    assert "comments skipped: 1" in clip.notes


@pytest.mark.parametrize("part", ["all", "frame time", "frames", "frames without fractions"])
def test_decimal_commas_in_bvh(tmp_path: Path, part: str) -> None:
    plain = bvh_text(frames=4)
    if part == "frames without fractions":
        plain = motion_part(plain, lambda frames: frames.replace(".000000", "").replace(" 0 ", " 0.25 ", 1))
    changed = {"all": lambda: plain.replace(".", ","), "frame time": lambda: plain.replace("0.033333", "0,033333")}.get(
        part, lambda: motion_part(plain, lambda frames: frames.replace(".", ","))
    )()
    assert changed != plain
    clip = read(tmp_path, changed)
    assert same(clip, read(tmp_path, plain))
    assert clip.fps == 30
    assert sum("decimal commas" in note for note in clip.notes) == 1


def test_decimal_commas_in_acclaim(tmp_path: Path) -> None:
    write(tmp_path, "02.asf", asf_text())
    text = amc_text(3).replace("lfemur 0 0 0", "lfemur 12.5 0 -3.25")
    plain = read_acclaim(write(tmp_path, "02_01.amc", text))
    write(tmp_path, "02.asf", asf_text().replace(":version 1.10", ":version 1").replace(".", ","))
    clip = read_acclaim(write(tmp_path, "02_01.amc", text.replace(".", ",")))
    assert same(clip, plain)
    assert sum("decimal commas" in note for note in clip.notes) == 2


@pytest.mark.parametrize(
    ("frames", "message"),
    [
        (lambda text: text.replace(" ", ","), "values parted by commas"),
        (lambda text: text.replace(" ", ", "), "values parted by commas"),
        (lambda text: text.replace(".", ",").replace(" ", "; "), "a channel value is"),
        (lambda text: text.replace("92.0", "92,0", 1), "whether the comma is a decimal sign cannot be told"),
        (lambda text: text.replace(".000000", "").replace("92", "1,092"), "a decimal comma or a thousand"),
        (lambda text: text.replace("92.0", "1,092.0", 1), "a channel value is '1,092.0"),
        (lambda text: text.replace(".", ",")[:-5] + "\n", "values in a frame"),
    ],
)
def test_other_commas_are_never_taken_for_decimals(tmp_path: Path, frames: object, message: str) -> None:
    text = bvh_text(frames=3)
    if message == "a decimal comma or a thousand":  # no fraction anywhere
        text = motion_part(text, lambda part: re.sub(r"\.\d{6}", ".000000", part))
    if message == "values in a frame":
        text = text.rstrip("\n") + " 1.5 1.5\n"
    with pytest.raises(MotionFileError, match=re.escape(message)):
        read(tmp_path, motion_part(text, frames))


@pytest.mark.parametrize("declared", [29, 31])
def test_a_frame_count_off_by_one_is_taken_with_a_warning(tmp_path: Path, declared: int) -> None:
    clip = read(tmp_path, bvh_text().replace("Frames: 30", f"Frames: {declared}"))
    assert len(clip.positions) == 30
    assert f"{declared} frames declared, 30 present: all 30 taken" in clip.notes


@pytest.mark.parametrize("declared", [28, 32])
def test_a_frame_count_off_by_two_is_an_error(tmp_path: Path, declared: int) -> None:
    with pytest.raises(MotionFileError, match=f"{declared} frames declared, 30 present"):
        read(tmp_path, bvh_text().replace("Frames: 30", f"Frames: {declared}"))


def test_a_last_frame_cut_short_is_an_error_also_where_the_count_is_off_by_one(tmp_path: Path) -> None:
    text = bvh_text().rstrip("\n").rsplit(" ", 3)[0]
    for declared in (29, 30, 31):
        with pytest.raises(MotionFileError, match="values in a frame"):
            read(tmp_path, text.replace("Frames: 30", f"Frames: {declared}"))


@pytest.mark.parametrize(
    ("leg_m", "unit", "said"),
    [
        (0.85, 100.0, None),
        (0.95, 1 / 0.0254, None),
        # 24 inches of a child, 42 of a giant: in centimetres nobody, or a small child
        (0.61, 1 / 0.0254, "a guess at the edge of its range (0.55 to 1.1 m). --scale"),
        (1.07, 1 / 0.0254, "also possible: cm (0.01 m, a leg of 0.42 m)"),
        (0.57, 0.45 / 0.0254, "also possible: dm (0.1 m, a leg of 1.01 m)"),
        (1.08, 1.0, "a guess at the edge of its range"),
    ],
)
def test_a_unit_at_the_edge_of_its_range_is_called_a_guess(
    tmp_path: Path, leg_m: float, unit: float, said: str | None
) -> None:
    clip = read(tmp_path, bvh_text(unit=unit * leg_m / 0.85))
    warning = next(
        text for text in normalise(clip, find_joints("a", clip.names, clip.parents)).warnings if "length unit" in text
    )
    assert (said in warning) if said else ("guess" not in warning)


def genesis() -> str:
    """A Genesis 8 figure: a pelvis below the hip, twist bones in the limbs, many toes and fingers."""
    limbs = {
        "UpLeg": "ThighBend", "Leg": "Shin", "Foot": "Foot", "ToeBase": "Toe", "Arm": "ShldrBend", "ForeArm": "ForearmBend",
        "Hand": "Hand",
    }  # fmt: skip
    names = {
        f"{side}{ours}": f"{side[0].lower()}{theirs}" for side in ("Left", "Right") for ours, theirs in limbs.items()
    }
    trunk = {"Hips": "hip", "Spine": "abdomenLower", "Spine1": "chestUpper", "Neck": "neckLower", "Head": "head"}
    return bvh_text(names=names | trunk)


@pytest.mark.parametrize("number", ["", ":1"])
def test_a_genesis_figure_imports(tmp_path: Path, number: str) -> None:
    text = re.sub(r"(ROOT|JOINT) (\S+)", rf"\1 \2{number}", genesis())
    report = import_motion(write(tmp_path, "g.bvh", text)).report
    assert report.residual_mm < 5
    assert not any("drive nothing" in warning for warning in report.warnings)


def test_twist_bones_toes_and_fingers_of_genesis_do_not_confuse() -> None:
    tree = {
        "hip": None,
        "pelvis": "hip",
        "abdomenLower": "hip",
        "chestUpper": "abdomenLower",
        "neckLower": "chestUpper",
    }
    tree |= {"neckUpper": "neckLower", "head": "neckUpper", "lEye": "head"}
    for s in "lr":
        leg = [
            "pelvis",
            f"{s}ThighBend",
            f"{s}ThighTwist",
            f"{s}Shin",
            f"{s}Foot",
            f"{s}Metatarsals",
            f"{s}Toe",
            f"{s}BigToe",
        ]
        arm = [
            "chestUpper",
            f"{s}Collar",
            f"{s}ShldrBend",
            f"{s}ShldrTwist",
            f"{s}ForearmBend",
            f"{s}ForearmTwist",
            f"{s}Hand",
        ]
        tree |= {child: parent for chain in (leg, arm) for parent, child in pairwise(chain)}
        tree |= {
            f"{s}Thumb1": f"{s}Hand",
            f"{s}Carpal1": f"{s}Hand",
            f"{s}Mid1": f"{s}Carpal1",
            f"{s}Pectoral": "chestUpper",
        }
    names = tuple(tree)
    parents = np.array([-1 if parent is None else names.index(parent) for parent in tree.values()])
    found = find_joints("x", names, parents)
    wanted = {
        "thigh": "ThighBend", "shank": "Shin", "foot": "Foot", "toe": "Toe", "upper_arm": "ShldrBend",
        "forearm": "ForearmBend", "hand": "Hand", "hand_tip": "Mid1",
    }  # fmt: skip
    for side in ("left", "right"):
        assert {part: names[found.joints[f"{side}_{part}"]] for part in wanted} == {
            part: side[0] + name for part, name in wanted.items()
        }
    assert [names[joint] for joint in found.trunk] == ["hip", "abdomenLower", "chestUpper", "neckLower"]


SMPL = {"poses": (5, 156), "trans": (5, 3), "betas": (16,)}


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({"poses": (5, 156), "betas": (16,)}, "an AMASS/SMPL motion (betas, poses): `simprep import`"),
        (SMPL, "no frame rate (mocap_framerate, mocap_frame_rate"),
        (SMPL | {"poses": (5, 150), "fps": ()}, "'poses' has shape (5, 150); valid: (T, N) with N of 66 (SMPL body)"),
        (SMPL | {"trans": (4, 3), "fps": ()}, "'trans' has shape (4, 3); valid: (5, 3)"),
        ({"body_pose": (5, 60), "global_orient": (5, 3), "transl": (5, 3)}, "'body_pose' has shape (5, 60)"),
        ({"betas": (16,), "gender": ()}, "an AMASS/SMPL body shape without a motion"),
        ({"fps": (1,), "joint_pos": (5, 29), "body_pos_w": (5, 30, 3)}, "BeyondMimic, mjlab or holosoma"),
    ],
)
def test_npz_of_others_are_refused_by_name(tmp_path: Path, entries: dict[str, tuple[int, ...]], said: str) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, **{name: np.zeros(shape) for name, shape in entries.items()})
    with pytest.raises(MotionFileError, match=re.escape(said)):
        load_motion(path)
