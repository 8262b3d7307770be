"""Motions on disk: the same bits back, whatever is wrong with the cache only means making them anew."""

import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from simprep.humanoid_model import mjcf_folder
from simprep.library import cache, library_entries
from simprep.library.cache import cached_motion, code_key
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("SIMPREP_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(cache, "_IMPORTED_AT", np.inf)  # someone may be editing while the tests run
    return tmp_path / "cache"


class Generator:
    """A library motion, counting how often it is made."""

    def __init__(self, name: str) -> None:
        self.entry = next(entry for entry in library_entries() if entry.name == name)
        self.made = 0

    def __call__(self) -> Motion:
        self.made += 1
        return self.entry.generate()


def identical(a: Motion, b: Motion) -> bool:
    same = (a.fps, dict(a.events), a.name, a.source, a.loop, a.character) == (
        b.fps, dict(b.events), b.name, b.source, b.loop, b.character,
    )  # fmt: skip
    return same and a.qpos.tobytes() == b.qpos.tobytes() and a.contacts.tobytes() == b.contacts.tobytes()


@pytest.mark.parametrize("name", ["walk", "kick_front", "punch_left"])
def test_the_loaded_motion_is_the_generated_one(name, folder):
    generate = Generator(name)
    made = cached_motion(name, generate)
    loaded = cached_motion(name, generate)
    assert generate.made == 1
    assert made is not loaded
    assert identical(made, loaded)
    assert identical(loaded, generate())
    assert [path.name for path in folder.rglob("*") if path.is_file()] == [f"{name}.npz"]


def test_a_damaged_or_foreign_file_is_replaced(folder, tmp_path):
    generate = Generator("duck")
    good = cached_motion("duck", generate)
    (path,) = folder.rglob("*.npz")
    content = path.read_bytes()
    flipped = bytearray(content)
    flipped[len(content) // 2] ^= 0xFF
    other = save_motion(replace(good, name="jump"), tmp_path / "other.npz").read_bytes()
    bad = (b"", b"not an archive", content[: len(content) // 2], bytes(flipped), other)
    for number, damage in enumerate(bad, 2):
        path.write_bytes(damage)
        assert identical(cached_motion("duck", generate), good)
        assert generate.made == number
        assert identical(cached_motion("duck", generate), good)
        assert generate.made == number


def test_a_folder_that_cannot_be_written_only_means_no_cache(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("SIMPREP_CACHE_DIR", str(tmp_path / "file"))
    generate = Generator("duck")
    assert identical(cached_motion("duck", generate), cached_motion("duck", generate))
    assert generate.made == 2

    def refuse(*args, **kwargs):
        raise PermissionError("read-only")

    monkeypatch.setenv("SIMPREP_CACHE_DIR", str(tmp_path / "fine"))
    monkeypatch.setattr("simprep.files.tempfile.mkstemp", refuse)
    assert cached_motion("duck", generate).name == "duck"
    assert generate.made == 3


def test_the_key_follows_code_and_model_and_newer_code_keeps_nothing(folder, monkeypatch, tmp_path):
    generate = Generator("duck")
    cached_motion("duck", generate)
    package = tmp_path / "simprep"
    real = code_key.__wrapped__()
    shutil.copytree(os.path.dirname(cache.__file__), package / "library")
    shutil.copytree(os.path.dirname(sys.modules["simprep.motion"].__file__), package / "motion")
    for name in ("character", "humanoid_model"):
        shutil.copy(sys.modules[f"simprep.{name}"].__file__, package / f"{name}.py")
    shutil.copytree(mjcf_folder(), package / "mjcf")
    monkeypatch.setattr(cache, "mjcf_folder", lambda: package / "mjcf")
    monkeypatch.setattr(cache.simprep, "__file__", str(package / "__init__.py"))
    assert code_key.__wrapped__() == real
    for changed in (
        "library/duck.py",
        "motion/formats/bvh.py",
        "character.py",
        "humanoid_model.py",
        "mjcf/humanoid.xml",
    ):
        before = code_key.__wrapped__()
        with (package / changed).open("a") as stream:
            stream.write("\n")
        assert code_key.__wrapped__() != before
    # code newer than this process: its motions belong to no key
    monkeypatch.setattr(cache, "_IMPORTED_AT", time.time() - 60)
    assert cache.edited_since_import()
    shutil.rmtree(folder)
    cached_motion("duck", generate)
    assert not list(folder.rglob("*.npz"))


def test_only_the_newest_versions_are_kept(folder):
    for number in range(6):
        old = folder / "motions" / f"old{number}"
        old.mkdir(parents=True)
        os.utime(old, (number, number))
    cached_motion("duck", Generator("duck"))
    assert {path.name for path in (folder / "motions").iterdir()} == {code_key(), "old5", "old4", "old3"}


def test_a_second_process_loads_what_the_first_made(folder):
    code = (
        "from simprep.library import cache, library_motion; import hashlib\n"
        "cache._IMPORTED_AT = float('inf')\n"
        "motion = library_motion('jump')\n"
        "print(hashlib.sha256(motion.qpos.tobytes()).hexdigest(), dict(motion.events))"
    )
    spoil = "import simprep.library.jump as j; j.build_movement = None\n"  # generating would fail
    first = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    second = subprocess.run([sys.executable, "-c", spoil + code], capture_output=True, text=True, check=True).stdout
    assert first == second
    assert [path.name for path in folder.rglob("*.npz")] == ["jump.npz"]
