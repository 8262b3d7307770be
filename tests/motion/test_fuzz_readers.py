"""Sound small files, damaged at random: every reader refuses with an error of ours or gives finite values, in little memory.

The damage is drawn by hypothesis with a fixed seed; a failure is shrunk to its smallest case. hypothesis also draws constants of
the modules loaded so far, so the cases differ between a run of this file alone and one after other tests.
"""

import io
import re
import tracemalloc
import zipfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from format_cases import random_motion, smpl_walk, trc_text
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.internal.conjecture import providers
from motion_files import LIMBS, amc_text, asf_text, bvh_text, deepmimic_frame, deepmimic_text

from simprep.errors import SimprepError
from simprep.humanoid_model import humanoid
from simprep.motion.edit import resample
from simprep.motion.formats.bvh import read_bvh_people
from simprep.motion.formats.registry import format_to_write
from simprep.motion.formats.skeleton import SourceClip
from simprep.motion.joint_map import find_joints, read_joint_map
from simprep.motion.load import read_file, read_source
from simprep.motion.motion import Motion
from simprep.motion.normalise import normalise
from simprep.motion.positions import position_clip, read_positions
from simprep.motion.store import read_motion, save_motion

BASE_BYTES, PER_BYTE = 40_000_000, 1000
"""What reading may take at its peak: this much, and so much for every byte of the file."""
LONGEST_BYTES = 100_000
"""What repeating a line may add to a file."""
FUZZ = settings(
    max_examples=200, derandomize=True, database=None, deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)  # fmt: skip
TOKENS = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "1e7", "-1e7", "1e9", "0", "-0", "-1", "1", "2", "7", "0.001", "1000",
    "100000", "100000000", "99999999999999999999", "9" * 5000, "0,5", "1,234", "1,2,3", "1_000", "²", "true", "null", "[]",
    "{}", "{", "}", "[", "]", '"', ",", ";", "#", "//", "ROOT", "JOINT", "End", "MOTION", "Frames:", "CHANNELS", "OFFSET",
    ":bonedata", ":hierarchy", "begin", "end", "root", "Hips", "LeftFoot", "left_foot", "none", "wrap", "\0", "\ufeff", "\r",
)  # fmt: skip
ENCODINGS = ("utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "utf-32", "cp037")
WORD = re.compile(rb"[^\s,\[\]{}:\"]+")
Damage = tuple[str, float, Any]
Damages = list[Damage]

place = st.floats(0, 1, exclude_max=True)
byte_damage = st.tuples(st.sampled_from(["flip", "insert", "cut", "drop"]), place, st.integers(1, 255))
word_damage = st.tuples(st.just("word"), place, st.sampled_from(TOKENS))
line_damage = st.tuples(st.sampled_from(["delete", "double", "swap", "repeat"]), place, place)
text_damage = st.one_of(
    word_damage, word_damage, line_damage, byte_damage, st.tuples(st.just("encode"), place, st.sampled_from(ENCODINGS))
)
damages = st.lists(text_damage, min_size=1, max_size=2)


@pytest.fixture(autouse=True)
def no_constants_of_loaded_modules(monkeypatch: pytest.MonkeyPatch) -> None:
    """hypothesis also draws constants found in the modules loaded so far: cases would depend on the tests run before.

    It offers no setting for that; where a version keeps them elsewhere, cases are only less repeatable.
    """
    if not hasattr(providers, "Constants") or not hasattr(providers, "CONSTANTS_CACHE"):
        return
    nothing = providers.Constants(integers=set(), floats=set(), bytes=set(), strings=set())
    monkeypatch.setattr(providers, "_get_local_constants", lambda: nothing, raising=False)
    monkeypatch.setattr(providers, "CONSTANTS_CACHE", type(providers.CONSTANTS_CACHE)(1024))


def damaged(content: bytes, how: Damage) -> bytes:
    """A file's content with one more thing wrong."""
    kind, where, what = how
    at = int(where * len(content))
    if kind == "flip":
        return content[:at] + bytes([content[at] ^ what]) + content[at + 1 :] if content else content
    if kind == "insert":
        return content[:at] + bytes([what]) + content[at:]
    if kind == "drop":
        return content[:at] + content[at + what :]
    if kind == "cut":
        return content[:at]
    if kind == "encode":
        return content.decode("utf-8", errors="replace").encode(what, errors="replace")
    if kind == "word":
        words = list(WORD.finditer(content))
        if not words:
            return content
        chosen = words[int(where * len(words))]
        return content[: chosen.start()] + what.encode() + content[chosen.end() :]
    lines = content.splitlines(keepends=True)
    if not lines:
        return content
    one, other = int(where * len(lines)), int(what * len(lines))
    if kind == "delete":
        del lines[one]
    elif kind == "double":
        lines.insert(other, lines[one])
    elif kind == "repeat":
        lines[one:one] = lines[one : one + 1] * min(200, LONGEST_BYTES // len(lines[one]))
    else:
        lines[one], lines[other] = lines[other], lines[one]
    return b"".join(lines)


def outcome(path: Path, read: Callable[[Path], object]) -> str:
    """What reading a damaged file came to; only errors of ours pass, and no more memory than the file is worth."""
    tracemalloc.start()
    message = None
    try:
        read(path)
    except SimprepError as error:
        message = str(error)
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        size = sum(file.stat().st_size for file in path.parent.iterdir())
        assert peak < BASE_BYTES + PER_BYTE * size
    assert message is None or 0 < len(message) < 3000
    return "read" if message is None else "refused"


def sound(clip: SourceClip) -> None:
    """What the retargeting is given has to be finite, and a tree."""
    joints = find_joints(clip.path, clip.names, clip.parents)
    for fps in (None, 240.0):
        ready = normalise(clip, joints, fps=fps).clip
        for values in (ready.positions, ready.rotations, ready.rest_positions, ready.rest_rotations):
            assert np.isfinite(values).all()
        assert len(ready.positions) == len(ready.rotations) > 0
    assert (clip.parents < np.arange(len(clip.parents))).all()
    assert 1 <= clip.fps <= 1000


def fuzz(strategy: st.SearchStrategy[Any], once: Callable[[Any], str]) -> None:
    """Many drawn cases; some must be read and some refused (10 % at least), else the damage is too weak or too strong to tell anything."""
    seen: Counter[str] = Counter()

    @FUZZ
    @given(strategy)
    def run(case: Any) -> None:
        seen[once(case)] += 1

    run()
    assert min(seen["read"], seen["refused"]) > 0.1 * FUZZ.max_examples, seen


def all_damaged(content: bytes, how: Damages) -> bytes:
    """A file's content with several things wrong."""
    for one in how:
        content = damaged(content, one)
    return content


def test_more_memory_and_other_errors_would_be_found(tmp_path: Path) -> None:
    def greedy(_: Path) -> None:
        np.zeros(BASE_BYTES)

    def careless(_: Path) -> None:
        [][1]

    assert outcome(tmp_path / "a", lambda _: None) == "read"
    with pytest.raises(AssertionError):
        outcome(tmp_path / "a", greedy)
    with pytest.raises(IndexError):
        outcome(tmp_path / "a", careless)


def test_bvh(tmp_path: Path) -> None:
    path = tmp_path / "a.bvh"

    def once(how: Damages) -> str:
        path.write_bytes(all_damaged(bvh_text(frames=9).encode(), how))
        people = outcome(path, lambda file: [sound(clip) for clip in read_bvh_people(file)])
        alone = outcome(path, lambda file: sound(read_source(file)))
        assert alone == people or people == "read"
        return alone

    fuzz(damages, once)


@pytest.mark.parametrize("chosen", ["02.asf", "02_01.amc"])
def test_acclaim(tmp_path: Path, chosen: str) -> None:
    files = {"02.asf": asf_text().encode(), "02_01.amc": amc_text(9).encode()}
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)

    def once(how: Damages) -> str:
        (tmp_path / chosen).write_bytes(all_damaged(files[chosen], how))
        return outcome(tmp_path / "02_01.amc", lambda file: sound(read_source(file)))

    fuzz(damages, once)


@pytest.mark.parametrize("loop", ["wrap", "none"])
def test_deepmimic(tmp_path: Path, loop: str) -> None:
    path = tmp_path / "a.json"
    content = deepmimic_text([deepmimic_frame(0.03 + 0.001 * number) for number in range(9)], loop)
    content = content.replace("], [", "],\n[").encode()

    def once(how: Damages) -> str:
        path.write_bytes(all_damaged(content, how))
        return outcome(path, lambda file: sound(read_source(file)))

    fuzz(damages, once)


def test_joint_map(tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    content = b'{"left_foot": "LeftFoot",\n"right_foot": "RightFoot",\n"neck": "Neck"}\n'
    limbs = [f"{side}{part}" for side in LIMBS for part in ("UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand")]
    names = ("Hips", *limbs, "Neck")
    parents = np.array([-1, 0, 1, 2, 0, 4, 5, 0, 7, 8, 0, 10, 11, 0])

    def read(file: Path) -> None:
        joints = find_joints("a.bvh", names, parents, read_joint_map(file))
        assert all(0 <= joint < len(names) for joint in joints.joints.values())

    def once(how: Damages) -> str:
        path.write_bytes(all_damaged(content, how))
        return outcome(path, read)

    fuzz(damages, once)


def own_npz(path: Path) -> bytes:
    """A motion of ours."""
    return save_motion(
        Motion(np.tile(humanoid().standing_qpos.copy(), (9, 1)), 30.0, np.ones((9, 2), bool)), path
    ).read_bytes()


def read_own(path: Path) -> None:
    assert np.isfinite(resample(read_motion(path), 240.0).qpos).all()


def amass_npz(path: Path) -> bytes:
    """A walk as AMASS has it."""
    walk = smpl_walk(9)
    poses = np.concatenate([walk["root_orient"], walk["pose_body"]], axis=1)
    np.savez(path, poses=poses, trans=walk["trans"], betas=np.zeros(10), mocap_framerate=60.0)
    return path.read_bytes()


def read_any(path: Path) -> None:
    content, _ = read_file(path)
    if isinstance(content, SourceClip):
        sound(content)
    else:
        assert np.isfinite(content.motion.qpos).all()


@pytest.mark.parametrize("extension", ["trc", "csv", "mot", "c3d"])
def test_formats_that_are_written(tmp_path: Path, extension: str) -> None:
    if extension == "c3d":
        pytest.importorskip("ezc3d")
    path = tmp_path / f"a.{extension}"
    form = format_to_write(path)
    assert form.write is not None
    form.write(random_motion(humanoid(), 9), path)
    content = path.read_bytes()

    def once(how: Damages) -> str:
        if extension == "c3d":  # what moves the rest of a binary file leaves none
            how = [("flip", place, 1 + number % 255) for number, (_, place, _) in enumerate(how, 40)]
        path.write_bytes(all_damaged(content, how))
        return outcome(path, read_any)

    fuzz(damages, once)


def test_joint_centres(tmp_path: Path) -> None:
    path = tmp_path / "a.trc"
    parts = ("Hip", "Knee", "Ankle", "Shoulder", "Elbow", "Wrist")
    names = tuple(f"{side[0]}{part}" for side in LIMBS for part in parts)
    points = np.zeros((9, 12, 3))
    points[..., 2] = [0.9, 0.5, 0.1, 1.4, 1.1, 0.8] * 2
    points[:, 6:, 1] = -0.3
    content = trc_text(names, points, 30.0).encode()

    def once(how: Damages) -> str:
        path.write_bytes(all_damaged(content, how))
        return outcome(path, read_any)

    fuzz(damages, once)


def positions_npz(path: Path) -> bytes:
    """Two people who stand still, as joint positions."""
    parts = ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
    names = [f"{side.lower()}_{part}" for side in LIMBS for part in parts]
    points = np.zeros((9, 2, 12, 3))
    points[..., 2] = [0.9, 0.5, 0.1, 1.4, 1.1, 0.8] * 2
    points[:, :, 6:, 1] = -0.3
    np.savez(path, positions=points, joint_names=np.array(names), fps=10.0)
    return path.read_bytes()


def read_recording(path: Path) -> None:
    recording = read_positions(path)
    for person in range(min(2, recording.positions.shape[1])):
        clip = position_clip(recording, person)
        assert np.isfinite(clip.positions).all()
        assert np.isfinite(clip.rotations).all()


@pytest.mark.parametrize(
    ("make", "read"), [(own_npz, read_own), (positions_npz, read_recording), (amass_npz, read_any)]
)
def test_npz(tmp_path: Path, make: Callable[[Path], bytes], read: Callable[[Path], None]) -> None:
    """Damage to the packed file, and to an entry packed again, whose checksum is then right."""
    path = tmp_path / "a.npz"
    content = make(path)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}

    def once(case: tuple[Damages, str | None, bool, int]) -> str:
        how, chosen, near, method = case
        if chosen is None:
            path.write_bytes(all_damaged(content, how))
        else:
            entry = entries[chosen]
            cut = 128 if near else len(entry)  # the first bytes declare type and shape
            changed = all_damaged(entry[:cut], how) + entry[cut:]
            with zipfile.ZipFile(path, "w", method) as packed:
                for name, kept in entries.items():
                    packed.writestr(name, changed if name == chosen else kept)
        return outcome(path, read)

    methods = st.sampled_from([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
    fuzz(st.tuples(damages, st.sampled_from([None, *sorted(entries)]), st.booleans(), methods), once)
