"""A user's own clips: sidecars beside motion files, errors that name the file and what is valid."""

from dataclasses import replace

import numpy as np
import pytest
from motion_files import bvh_text

from simprep.cli.main import main
from simprep.cli.resolve import resolve_motion
from simprep.errors import MotionFileError, SettingError, UnknownNameError
from simprep.library import library_motion, library_names
from simprep.library.user import all_entries, find_entry
from simprep.motion.load import load_motion
from simprep.motion.store import save_motion

GOOD = 'family = "kick"\nterms = "my own recording"\nevents = {target = 0.2, impact = 0.5}\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A library with one clip, `my_kick`: 30 frames at 30 per second."""
    monkeypatch.setenv("SIMPREP_CACHE_DIR", str(tmp_path / "cache"))
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "my_kick.bvh").write_text(bvh_text())
    (folder / "my_kick.toml").write_text(GOOD)
    return folder


def test_a_clip_is_found_by_name_loaded_with_its_events_and_cached(folder, monkeypatch):
    entry = find_entry("my_kick", folder)
    assert (entry.family, entry.terms) == ("kick", "my own recording")
    motion = entry.generate()
    plain = load_motion(folder / "my_kick.bvh")
    assert motion.qpos.tobytes() == plain.qpos.tobytes()
    assert dict(motion.events) == {"target": 6, "impact": 15}
    assert motion.name == "my_kick"
    assert [entry.name for entry in all_entries(folder)] == [*library_names(), "my_kick"]

    monkeypatch.setenv("SIMPREP_LIBRARY", str(folder))
    assert resolve_motion("my_kick", pytest.fail).qpos.tobytes() == plain.qpos.tobytes()
    assert resolve_motion("walk", pytest.fail) is library_motion("walk")
    (folder / "my_kick.bvh").write_text(bvh_text(frames=40))  # another clip: the cached import is not taken
    assert len(resolve_motion("my_kick", pytest.fail)) == 40


def test_what_the_sidecar_says_goes_to_the_import(folder):
    turned = bvh_text().replace("LeftUpLeg", "thigh_one")
    (folder / "my_kick.bvh").write_text(turned)
    with pytest.raises(MotionFileError, match="left_thigh"):
        find_entry("my_kick", folder).generate()
    extra = (
        'name = "swing"\nsummary = "swings"\nfps = 15\nup = "y"\nscale = 0.01\n[joint_map]\nleft_thigh = "thigh_one"\n'
    )
    (folder / "my_kick.toml").write_text(GOOD + extra)
    entry = find_entry("swing", folder)
    motion = entry.generate()
    assert (entry.summary, motion.fps, dict(motion.events)) == ("swings", 15, {"target": 3, "impact": 8})
    (folder / "map.json").write_text('{"left_thigh": "thigh_one"}')
    (folder / "my_kick.toml").write_text(GOOD + 'joint_map = "map.json"\n')
    assert find_entry("my_kick", folder).generate().fps == 30


def test_a_motion_of_our_own_keeps_its_events(folder):
    jump = library_motion("jump")
    save_motion(replace(jump, name="other"), folder / "hop.npz")
    (folder / "hop.toml").write_text('family = "jump"\nterms = "Apache-2.0"\nevents = {landing = 2.5}\n')
    hop = find_entry("hop", folder).generate()
    assert np.array_equal(hop.qpos, jump.qpos)
    assert dict(hop.events) == {**jump.events, "landing": 150}


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('family = "kick"\n', ("no terms of use", 'terms = "my own recording"')),
        ('family = "kick"\nterms = " "\n', ("no terms of use",)),
        ('terms = "mine"\n', ("no family", "locomotion, guard, punch, kick")),
        ('family = "kik"\nterms = "mine"\n', ("family 'kik'", "punch, kick, block")),
        (GOOD + "speed = 3\n", ("unknown key 'speed'", "family, terms, name, summary, events, fps")),
        ("family = kick\n", ("not valid TOML", "line 1")),
        (GOOD.replace("0.5", "7.0"), ("event 'impact' at 7 s", "0 to 0.97 s")),
        (GOOD.replace("0.5", "-0.1"), ("event 'impact' at -0.1 s", "0 to 0.97 s")),
        (GOOD.replace("0.5", '"late"'), ("event 'impact' = 'late'", "a time in seconds")),
        (GOOD + 'fps = "fast"\n', ("fps = 'fast'", "a number")),
        (GOOD + 'up = "w"\n', ("up axis 'w'", "z, y, x")),
        (GOOD + "scale = -1\n", ("scale -1", "1e-06 to 1000")),
        (GOOD + 'joint_map = {left_thing = "LeftUpLeg"}\n', ("left_thing", "left_thigh")),
        (GOOD + 'name = "a/b"\n', ("name 'a/b'", "letters, digits")),
        (GOOD + 'name = "walk"\n', ("another motion 'walk'", "different name")),
    ],
)
def test_a_bad_sidecar_is_one_line_that_names_it_and_exit_2(content, words, folder, capsys):
    (folder / "my_kick.toml").write_text(content)
    assert main(["library", "show", "my_kick", "--library", str(folder)]) == 2
    printed = capsys.readouterr()
    assert not printed.out
    assert printed.err.count("\n") == 1
    assert str(folder / "my_kick.toml") in printed.err
    for word in words:
        assert word in printed.err


def test_missing_and_ambiguous_clips_names_and_folders(folder, monkeypatch):
    (folder / "gone.toml").write_text(GOOD)
    with pytest.raises(
        MotionFileError, match=r"gone.toml: no clip beside it; valid: exactly one of gone.npz, gone.bvh"
    ):
        all_entries(folder)
    assert find_entry("walk", folder).generate() is library_motion("walk")  # built-in ones work all the same
    (folder / "gone.bvh").write_text(bvh_text())
    (folder / "gone.amc").write_text("")
    with pytest.raises(MotionFileError, match=r"gone.toml: clips gone.amc, gone.bvh beside it"):
        all_entries(folder)
    (folder / "gone.amc").unlink()
    (folder / "gone.toml").write_text(GOOD + 'name = "my_kick"')
    with pytest.raises(MotionFileError, match="another motion 'my_kick'"):
        all_entries(folder)
    (folder / "gone.toml").write_text(GOOD)
    with pytest.raises(UnknownNameError, match=r"unknown motion 'nothing'; valid: stand, walk.*, gone, my_kick"):
        find_entry("nothing", folder)
    monkeypatch.setenv("SIMPREP_LIBRARY", str(folder / "nowhere"))
    with pytest.raises(SettingError, match=r"SIMPREP_LIBRARY=.*nowhere: no such folder"):
        all_entries()
    with pytest.raises(SettingError, match=r"--library .*elsewhere: no such folder"):
        all_entries(folder / "elsewhere")


def test_real_clips_make_a_library(data_dir, tmp_path):
    clips = {"kick_normal_001": ("kick", "CC BY-NC 4.0"), "walk_normal_001": ("locomotion", "CC BY-NC 4.0")}
    for stem, (family, terms) in clips.items():
        (tmp_path / f"{stem}.bvh").symlink_to((data_dir / "bandai-namco" / f"{stem}.bvh").resolve())
        (tmp_path / f"{stem}.toml").write_text(f'family = "{family}"\nterms = "{terms}"\n')
    for stem in clips:
        motion = find_entry(stem, tmp_path).generate()
        assert motion.qpos.tobytes() == load_motion(data_dir / "bandai-namco" / f"{stem}.bvh").qpos.tobytes()
