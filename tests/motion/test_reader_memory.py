"""A number in a file never decides alone how much memory is taken; the number of threads decides nothing."""

import os
import subprocess
import sys
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from motion_files import bvh_text, deepmimic_frame, deepmimic_text, write

from simprep.errors import MotionFileError, SettingError
from simprep.humanoid_model import humanoid
from simprep.motion.edit import resample
from simprep.motion.formats.bvh import read_bvh
from simprep.motion.formats.deepmimic import read_deepmimic
from simprep.motion.joint_map import find_joints
from simprep.motion.load import load_motion
from simprep.motion.motion import Motion
from simprep.motion.normalise import normalise


def peak(work: Callable[[], None]) -> int:
    tracemalloc.start()
    try:
        work()
    finally:
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return most


@pytest.mark.parametrize("duration", [1e3, 1e8, 2.0, 1e-5])
def test_one_absurd_duration_is_refused_with_its_frame(tmp_path: Path, duration: float) -> None:
    frames = [deepmimic_frame(0.03) for _ in range(20)]
    frames[7][0] = duration
    path = write(tmp_path, "a.txt", deepmimic_text(frames))

    def refused() -> None:
        with pytest.raises(MotionFileError, match="frame 7 has duration"):
            read_deepmimic(path)

    assert peak(refused) < 5e6


def test_durations_that_make_many_more_frames_are_refused(tmp_path: Path) -> None:
    frames = [deepmimic_frame(0.02 if number % 2 else 0.9) for number in range(101)]
    with pytest.raises(MotionFileError, match="more than 10 times as many at a constant rate"):
        read_deepmimic(write(tmp_path, "a.txt", deepmimic_text([*frames, *[deepmimic_frame(0.02)] * 6])))


def test_a_pause_in_a_clip_is_read(tmp_path: Path) -> None:
    frames = [deepmimic_frame(0.03) for _ in range(20)]
    frames[7][0] = 0.6
    clip = read_deepmimic(write(tmp_path, "a.txt", deepmimic_text(frames)))
    assert len(clip.positions) == 39
    assert any("resampled" in note for note in clip.notes)


def test_joints_without_values_cost_no_more_than_the_file_is_worth(tmp_path: Path) -> None:
    lines = ["HIERARCHY", "ROOT a", "{", "OFFSET 0 0 0", "CHANNELS 1 Xposition"]
    for number in range(1500):
        lines += [f"JOINT j{number}", "{", "OFFSET 0 1 0", "}"]
    frames = 2500  # of 2 bytes each; 3.75 million joints over all frames
    path = write(
        tmp_path, "a.bvh", "\n".join([*lines, "}", "MOTION", f"Frames: {frames}", "Frame Time: 0.01", *"1" * frames])
    )

    def refused() -> None:
        with pytest.raises(MotionFileError, match="hardly a joint has values"):
            read_bvh(path)

    assert peak(refused) < 10e6


@pytest.mark.parametrize(
    ("shape", "kind"), [((10**12,), "<f8"), ((10**9, 44), "<f8"), ((-1, -(10**12)), "<f8"), ((10**12,), "<U0")]
)
def test_a_shape_that_nothing_stands_behind_is_refused_before_memory_is_taken(
    tmp_path: Path, shape: tuple[int, ...], kind: str
) -> None:
    path = tmp_path / "a.npz"
    with zipfile.ZipFile(path, "w") as archive, archive.open("qpos.npy", "w") as stream:
        np.lib.format.write_array_header_1_0(stream, {"descr": kind, "fortran_order": False, "shape": shape})

    def refused() -> None:
        with pytest.raises(MotionFileError, match="damaged"):
            load_motion(path)

    assert peak(refused) < 5e6


def test_packed_zeros_are_bounded_by_the_size_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, qpos=np.zeros((100_000, 44)))  # 35 MB in 34 kB

    def refused() -> None:
        with pytest.raises(MotionFileError, match="35 MB unpacked; valid: up to 30 MB for its size"):
            load_motion(path)

    assert peak(refused) < 5e6


def test_frame_rates_that_make_too_many_frames_are_refused(tmp_path: Path) -> None:
    clip = read_bvh(
        write(tmp_path, "a.bvh", bvh_text(frames=300, frame_time="1"))
    )  # five minutes at one frame per second
    joints = find_joints("a", clip.names, clip.parents)
    ready = normalise(clip, joints, fps=10)
    assert len(ready.clip.positions[:: ready.stride]) == 2991
    with pytest.raises(SettingError, match="joints are too many"):
        normalise(clip, joints, fps=1000)
    motion = Motion(np.tile(humanoid().standing_qpos, (1000, 1)), 1.0, np.ones((1000, 2), bool))
    with pytest.raises(SettingError, match="are too many"):
        resample(motion, 1000)
    with pytest.raises(SettingError, match="frame rate nan"):
        resample(motion, float("nan"))


_PRINT = """
import hashlib, sys
from simprep.motion.load import load_motion
for path in sys.argv[1:]:
    motion = load_motion(path)
    print(hashlib.sha256(motion.qpos.tobytes() + motion.contacts.tobytes()).hexdigest())
"""


def by_threads(threads: int, *files: Path) -> list[str]:
    count = {f"{library}_NUM_THREADS": str(threads) for library in ("OPENBLAS", "OMP", "MKL")}
    done = subprocess.run(
        [sys.executable, "-c", _PRINT, *map(str, files)],
        env={**os.environ, **count},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.split()


def test_the_number_of_threads_changes_no_bit(tmp_path: Path) -> None:
    files = write(tmp_path, "a.bvh", bvh_text(frames=40)), write(tmp_path, "a.txt", deepmimic_text())
    one = by_threads(1, *files)
    assert len(set(one)) == 2
    assert by_threads(2, *files) == one


def test_the_number_of_threads_changes_no_bit_of_captured_clips(data_dir: Path) -> None:
    files = data_dir / "deepmimic" / "humanoid3d_kick.txt", data_dir / "pairs" / "18_01.bvh"
    assert by_threads(1, *files) == by_threads(2, *files)
