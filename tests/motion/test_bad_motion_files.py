"""Damaged motion files: one clear error that names the file, within time and memory, and nothing left behind."""

import json
import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from motion_files import amc_text, asf_text, bvh_text, deepmimic_frame, deepmimic_text, write

from simprep.errors import MotionFileError, SimprepError
from simprep.humanoid_model import humanoid
from simprep.motion.load import import_motion, load_motion
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion

Case = tuple[str, Callable[[Path], Path], str]
CASES: list[Case] = []


def case(name: str, message: str) -> Callable[[Callable[[Path], Path]], Callable[[Path], Path]]:
    """Register a maker of a broken file, and what the error must say."""

    def register(maker: Callable[[Path], Path]) -> Callable[[Path], Path]:
        CASES.append((name, maker, message))
        return maker

    return register


def bvh(name: str, message: str, old: str, new: str, count: int = 1, regex: bool = False, **options: object) -> None:
    """A case made from a sound BVH file by one replacement."""

    def maker(folder: Path) -> Path:
        text = bvh_text(**options)  # type: ignore[arg-type]
        changed = re.sub(old, new, text, count=count) if regex else text.replace(old, new, count if count else -1)
        assert changed != text
        return write(folder, "take.bvh", changed)

    CASES.append((f"bvh: {name}", maker, message))


def acclaim(name: str, message: str, skeleton: Callable[[str], str] = str, motion: Callable[[str], str] = str) -> None:
    """A case made from a sound ASF/AMC pair."""

    def maker(folder: Path) -> Path:
        write(folder, "02.asf", skeleton(asf_text()))
        return write(folder, "02_01.amc", motion(amc_text()))

    CASES.append((f"acclaim: {name}", maker, message))


def deepmimic(name: str, message: str, content: str | Callable[[], str]) -> None:
    """A DeepMimic case."""
    CASES.append(
        (
            f"deepmimic: {name}",
            lambda folder: write(folder, "a.txt", content if isinstance(content, str) else content()),
            message,
        )
    )


def replaced(old: str, new: str, count: int = 1) -> Callable[[str], str]:
    """A replacement that must change something."""

    def change(text: str) -> str:
        assert old in text
        return text.replace(old, new, count)

    return change


for extension in ("bvh", "amc", "txt", "npz"):
    CASES.append((f"missing .{extension}", lambda folder, e=extension: folder / f"none.{e}", "no such file"))
    CASES.append((f"empty .{extension}", lambda folder, e=extension: write(folder, f"a.{e}", b""), ""))
    CASES.append(
        (f"binary .{extension}", lambda folder, e=extension: write(folder, f"a.{e}", bytes(range(256)) * 64), "")
    )
CASES.append(("directory", lambda folder: folder, "a directory"))
CASES.append(("wrong extension", lambda folder: write(folder, "a.fbx", "Kaydara"), "unknown extension '.fbx'"))
CASES.append(("one endless line", lambda folder: write(folder, "a.bvh", "HIERARCHY " + "x " * 10**6), "a line of"))

bvh("not a hierarchy", "begins with 'HIERARCHIE'", "HIERARCHY", "HIERARCHIE")
bvh("truncated in the hierarchy", "no MOTION section", "(?s)JOINT Spine1.*", "", regex=True)
bvh("truncated before the frames", "no 'Frames:'", "(?s)Frames: .*", "", regex=True)
bvh("truncated in a frame", "values in a frame", r"(?s)(\S+ ){20}\S+\n\Z", "", regex=True)
bvh("truncated between frames", "30 frames declared, 10 present", r"(?s)((?:[^\n]*\n){20})\Z", "", regex=True)
bvh("more frames than declared", "7 frames declared, 30 present", "Frames: 30", "Frames: 7")
bvh("no frames", "0 frames", "Frames: 30", "Frames: 0")
bvh("negative frames", "-5 frames", "Frames: 30", "Frames: -5")
bvh("half a frame", "2.5 frames", "Frames: 30", "Frames: 2.5")
bvh("a billion frames", "more than can be imported", "Frames: 30", "Frames: 1000000000")
bvh("frames in words", "the number of frames is 'many'", "Frames: 30", "Frames: many")
for value in ("0", "-0.01", "1e-9", "1e9", "nan", "inf", "soon"):
    bvh(f"frame time {value}", "frame time", "Frame Time: 0.033333", f"Frame Time: {value}")
bvh("NaN", "finite", "92.000000", "nan", 3)
bvh("infinity", "finite", "92.000000", "inf", 3)
bvh("words among the numbers", "a channel value is 'abc'", "92.000000", "abc")
bvh("number beyond all", "finite number up to", "92.000000", "1e300")
bvh(
    "huge offset",
    "the offset of 'LeftLeg' is beyond 1e6 units",
    "OFFSET 0.000000 -42.000000",
    "OFFSET 0.000000 -42000000.000000",
    0,
)
bvh("offset in words", "the offset of 'Spine'", "OFFSET 0.000000 15.000000", "OFFSET 0.000000 tall")
bvh("offset missing", "OFFSET", "OFFSET 0.000000 15.000000 0.000000", "")
bvh("the root jumps", "the root jumps", "(?s)92\\.000000(?=[^\\n]*\\n\\Z)", "92000.0", regex=True)
bvh("wrong channel", "channel 'Wrotation'", "Zrotation", "Wrotation")
bvh("too few channels", "channels of", "CHANNELS 6 Xposition", "CHANNELS 6")
bvh("nine channels", "channels of", "CHANNELS 3", "CHANNELS 9")
bvh("a channel twice", "a channel twice", "Zrotation Xrotation Yrotation", "Zrotation Zrotation Yrotation")
bvh("no channels at all", "no joint has channels", r"CHANNELS[^\n]*", "", count=0, regex=True)
bvh("joint twice", "a second joint called 'LeftLeg'", "JOINT LeftFoot", "JOINT LeftLeg")
bvh("joint without a name", "without a name", "JOINT LeftFoot", "JOINT")
bvh("two roots", "a second ROOT", "MOTION", "ROOT Second\n{\nOFFSET 0 0 0\n}\nMOTION")
bvh("brace missing", "before the '}'", "}\nMOTION", "\nMOTION")
bvh("brace too many", "'}' without", "}\nMOTION", "}\n}\nMOTION")
bvh("foreign names", "--joint-map", r"(Left|Right)(\w+)", r"bone_\1\2x", count=0, regex=True)
bvh(
    "legs without length",
    "the legs have no length",
    r"OFFSET 0\.000000 -4\d\.000000",
    "OFFSET 0 0",
    count=0,
    regex=True,
)
CASES.append(
    (
        "bvh: no feet",
        lambda f: write(f, "a.bvh", bvh_text(skip=("LeftFoot", "RightFoot"))),
        "no joint found for left_foot",
    )
)
CASES.append(("bvh: no legs", lambda f: write(f, "a.bvh", bvh_text(skip=("LeftUpLeg", "RightUpLeg"))), "left_thigh"))
CASES.append(("bvh: wrong unit", lambda f: write(f, "a.bvh", bvh_text(unit=1e5)), "fits a person in none of"))


@case("bvh: a million joints deep", "more than 2000 joints")
def deep(folder: Path) -> Path:
    path = folder / "deep.bvh"
    with path.open("w") as stream:
        stream.write("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n")
        for first in range(0, 10**6, 10**4):
            stream.write("".join(f"JOINT j{n}\n{{\nOFFSET 0 1 0\n" for n in range(first, first + 10**4)))
    return path


acclaim("skeleton without sections", "no section :hierarchy", skeleton=lambda text: text[: text.index(":hierarchy")])
acclaim(
    "skeleton truncated in a bone", "before the 'end' of bone", skeleton=replaced("  end\n:hierarchy", ":hierarchy")
)
acclaim(
    "skeleton truncated at a bone", "no section :hierarchy", skeleton=lambda text: text[: text.index("name lradius")]
)
acclaim("skeleton is garbage", "begins with 'hello'", skeleton=lambda _: "hello\n")
acclaim("unknown section", "section ':nonsense'", skeleton=replaced(":name TEST", ":nonsense"))
acclaim(
    "cyclic hierarchy",
    "is in a cycle",
    skeleton=replaced("    root lhipjoint rhipjoint lowerback", "    root lhipjoint lowerback\n    rtoes rhipjoint"),
)
acclaim(
    "two parents", "has two parents", skeleton=replaced("    lfemur ltibia", "    lfemur ltibia\n    rfemur ltibia")
)
acclaim("bone without data", "which has no bone data", skeleton=replaced("    lfemur ltibia", "    lfemur ltibia tail"))
acclaim("bone outside the hierarchy", "missing from the hierarchy", skeleton=replaced("    ltibia lfoot\n", ""))
acclaim("bone twice", "a second bone called", skeleton=replaced("name rtoes", "name ltoes"))
acclaim("zero direction", "has length 0", skeleton=replaced("direction 0 1 0", "direction 0 0 0"))
acclaim("NaN length", "finite number", skeleton=replaced("length 7.5", "length nan"))
acclaim("unit zero", "length unit 0", skeleton=replaced("length 0.45", "length 0"))
acclaim("wrong unit", "with 2.54 m per unit the leg is", skeleton=replaced("length 0.45", "length 0.01"))
acclaim("axis order", "axis order 'XXZ'", skeleton=replaced("axis 0 0 0 XYZ", "axis 0 0 0 XXZ"))
acclaim("wrong freedom", "dof 'rq'", skeleton=replaced("dof rx ry rz", "dof rq"))
acclaim("unknown bone", "bone 'tail', which the skeleton lacks", motion=replaced("lfemur 0", "tail 0"))
acclaim("wrong count", "2 values of 'lfemur'; valid: 3", motion=replaced("lfemur 0 0 0", "lfemur 0 0"))
acclaim("truncated", "frame 30 has no values of", motion=lambda text: text[: text.rindex("lhumerus")])
acclaim("no frames", "no frames", motion=lambda _: ":FULLY-SPECIFIED\n:DEGREES\n")
acclaim("NaN value", "a value of 'lfemur'", motion=replaced("lfemur 0 0 0", "lfemur nan 0 0"))
acclaim("word value", "a value of 'lfemur'", motion=replaced("lfemur 0 0 0", "lfemur 0 x 0"))
acclaim("bone twice in a frame", "twice in a frame", motion=replaced("lfemur 0 0 0", "lfemur 0 0 0\nlfemur 0 0 0"))
acclaim("values before a frame", "before the first frame number", motion=replaced("1\nroot", "root"))
CASES.append(("acclaim: no skeleton", lambda f: write(f, "02_01.amc", amc_text()), "needs its skeleton, 02.asf"))
CASES.append(("acclaim: skeleton alone", lambda f: write(f, "02.asf", asf_text()), "skeleton without motion"))

deepmimic("not JSON", "not valid JSON", '{"Loop": "none", "Frames": [[1, 2')
deepmimic("another JSON", "no list 'Frames'", '{"Skeleton": {}}')
deepmimic("a list", "no list 'Frames'", "[1, 2, 3]")
deepmimic("nested a million deep", "nested too deeply", "[" * 10**6)
deepmimic("no frames", "no frames", lambda: deepmimic_text([]))
deepmimic(
    "short frame",
    "frame 1 has 43 values; valid: 44",
    lambda: deepmimic_text([deepmimic_frame(), deepmimic_frame()[:-1]]),
)
deepmimic("frames are words", "other than numbers", lambda: deepmimic_text([["a"] * 44]))
deepmimic("NaN", "frame 0 holds NaN", lambda: deepmimic_text([[float("nan")] * 44] * 3))
deepmimic(
    "zero quaternion",
    "the quaternion of 'root' has length 0",
    lambda: deepmimic_text([[0.03, 0, 0.9, 0] + [0.0] * 40] * 3),
)
deepmimic("zero duration", "frame 0 has duration 0", lambda: deepmimic_text([deepmimic_frame(0.0)] * 5))
deepmimic("negative duration", "has duration -1", lambda: deepmimic_text([deepmimic_frame(-1.0)] * 5))
deepmimic("absurd rate", "frame duration", lambda: deepmimic_text([deepmimic_frame(1e-9)] * 5))
deepmimic("a loop of another kind", "'Loop' is 'bounce'", lambda: deepmimic_text(loop="bounce"))


def npz_with(folder: Path, **changes: object) -> Path:
    """A motion of ours with entries of its header or its arrays replaced."""
    path = save_motion(
        Motion(np.tile(humanoid().standing_qpos.copy(), (5, 1)), 30.0, np.ones((5, 2), dtype=bool)), folder / "own.npz"
    )
    with np.load(path) as archive:
        content = {key: archive[key] for key in archive.files}
    header = json.loads(str(content["header"]))
    for key, value in changes.items():
        if key in content:
            content[key] = np.asarray(value)
        else:
            header[key] = value
    if "header" not in changes:
        content["header"] = np.array(json.dumps(header))
    np.savez_compressed(path, **content)
    return path


CASES += [
    ("npz: another version", lambda f: npz_with(f, schema="simprep.motion/99"), "schema 'simprep.motion/99'"),
    ("npz: another model", lambda f: npz_with(f, model="robot"), "poses of model 'robot'"),
    ("npz: other hinges", lambda f: npz_with(f, hinges=[*humanoid().joints[:-1], "tail"]), "poses of model"),
    ("npz: wrong shape", lambda f: npz_with(f, qpos=np.zeros((5, 7))), "qpos has shape"),
    ("npz: NaN", lambda f: npz_with(f, qpos=np.full((5, 44), np.nan)), "NaN"),
    ("npz: no frames", lambda f: npz_with(f, qpos=np.zeros((0, 44)), contacts=np.zeros((0, 2))), "no frames"),
    ("npz: pickled objects", lambda f: npz_with(f, qpos=np.array([{}, []], dtype=object)), "npz"),
    ("npz: absurd rate", lambda f: npz_with(f, fps=1e9), "frame rate"),
    ("npz: a giant", lambda f: npz_with(f, height_m=9.0), "height 9.0 m"),
    ("npz: truncated", lambda f: write(f, "cut.npz", npz_with(f).read_bytes()[:700]), "npz"),
    ("npz: not ours", lambda f: np.savez(f / "other.npz", a=np.zeros(3)) or f / "other.npz", "not a simprep motion"),
    (
        "npz: a zip bomb",
        lambda f: np.savez_compressed(f / "b.npz", a=np.zeros(39_000_000)) or f / "b.npz",
        "MB unpacked",
    ),
]


def test_there_are_enough_cases() -> None:
    names = [name for name, _, _ in CASES]
    assert len(set(names)) == len(names) >= 80


@pytest.mark.parametrize(
    ("maker", "message"), [(maker, message) for _, maker, message in CASES], ids=[c[0] for c in CASES]
)
def test_broken_file(tmp_path: Path, maker: Callable[[Path], Path], message: str) -> None:
    path = maker(tmp_path)
    before = sorted(tmp_path.iterdir())
    start = time.process_time()
    with pytest.raises(SimprepError) as caught:
        load_motion(path)
    assert time.process_time() - start < 2
    text = str(caught.value)
    assert message in text
    assert path.stem.split("_")[0] in text  # names the file (an .amc's error can lie in its .asf)
    assert len(text) < 1500
    assert sorted(tmp_path.iterdir()) == before


def test_sound_files_of_the_makers_import(tmp_path: Path) -> None:
    """The broken files differ from these by their damage alone."""
    write(tmp_path, "02.asf", asf_text())
    for path in (
        write(tmp_path, "a.bvh", bvh_text()),
        write(tmp_path, "one.bvh", bvh_text(frames=1)),
        write(tmp_path, "two.bvh", bvh_text(frames=2)),
        write(tmp_path, "02_01.amc", amc_text()),
        write(tmp_path, "a.txt", deepmimic_text()),
        npz_with(tmp_path),
    ):
        result = import_motion(path)
        assert result.report.residual_mm < 25
        assert np.isfinite(result.motion.qpos).all()
        assert result.motion.qpos[0, 2] == pytest.approx(
            humanoid().standing_qpos.copy()[2], abs=0.07
        )  # feet apart stand lower


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"up": "w"}, "up axis 'w'"),
        ({"scale": -1.0}, "scale -1.0"),
        ({"scale": 1.0}, "with 1 m per unit the leg is 85 m"),
        ({"fps": 0.0}, "frame rate 0.0"),
        ({"fps": float("nan")}, "frame rate nan"),
        ({"joint_map": {"tail": "Hips"}}, "unknown part in the joint map 'tail'"),
        ({"joint_map": {"left_foot": "Hoof"}}, "the joint map names 'Hoof'"),
        ({"joint_map": {"left_foot": "LeftLeg"}}, "stands for"),
        ({"joint_map": "nothing.json"}, "cannot be read"),
    ],
)
def test_wrong_settings(tmp_path: Path, settings: dict[str, object], message: str) -> None:
    with pytest.raises(SimprepError, match=re.escape(message)):
        load_motion(write(tmp_path, "a.bvh", bvh_text()), **settings)  # type: ignore[arg-type]


def test_line_numbers(tmp_path: Path) -> None:
    lines = bvh_text().splitlines()
    lines[-3] = "1 2 x"
    with pytest.raises(MotionFileError) as caught:
        load_motion(write(tmp_path, "a.bvh", "\n".join(lines)))
    assert caught.value.line == len(lines) - 2


_MEASURED = """
import pathlib, sys
from simprep.cli.main import main
code = main(sys.argv[1:])
status = pathlib.Path("/proc/self/status")  # Linux; the peak that wait reports counts the parent's memory too
if status.exists():
    print(next(line for line in status.read_text().splitlines() if line.startswith("VmHWM")))
sys.exit(code)
"""


@pytest.mark.parametrize(
    "name", ["bvh: a million joints deep", "bvh: NaN", "deepmimic: nested a million deep", "directory"]
)
def test_command_line_refuses(tmp_path: Path, name: str) -> None:
    """Exit code 2, one line, no traceback, under 2 s and 500 MB, nothing written."""
    path = next(maker for case_name, maker, _ in CASES if case_name == name)(tmp_path)
    out = tmp_path / "out.npz"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-c", _MEASURED, "import", str(path), "-o", str(out)],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert str(path) in done.stderr
    assert not out.exists()
    assert (after.ru_utime - before.ru_utime) + (after.ru_stime - before.ru_stime) < 2
    if done.stdout:
        assert int(done.stdout.split()[-2]) < 500_000  # "VmHWM: ... kB"
