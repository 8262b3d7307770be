"""`simprep library`: what it lists, shows and draws, for people and machines."""

import json

import numpy as np
import pytest
from motion_files import bvh_text

from simprep.cli.main import main
from simprep.library import library_entries, library_motion, library_names
from simprep.library.facts import fist_positions, motion_facts
from simprep.library.walking.walk import WalkStyle
from simprep.motion.edit import repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.report.gl import NoGlError, find_backend


def said(arguments, capsys):
    assert main(["library", *arguments, "--json"]) == 0
    printed = capsys.readouterr()
    assert printed.out.count("\n") == 1
    return json.loads(printed.out)


@pytest.mark.parametrize("command", ["list", "show", "render", "fetch"])
def test_every_command_explains_itself_with_an_example(command, capsys):
    assert main(["library", command, "--help"]) == 0
    assert f"Example: simprep library {command}" in capsys.readouterr().out


def test_list_is_a_json_list_of_every_motion(capsys):
    content = said(["list"], capsys)
    assert {item["name"] for item in content} == set(library_names())
    for item in content:
        motion = library_motion(item["name"])
        assert {"name", "family", "duration_s", "events"} <= set(item) <= {
            "name", "family", "duration_s", "events", "parameters", "source",
        }  # fmt: skip
        assert item["duration_s"] == motion.duration
        assert item["events"] == {name: frame / motion.fps for name, frame in motion.events.items()}
    families = [item["family"] for item in content]
    assert families == sorted(families, key=families.index)  # family by family


def test_list_for_people_and_by_family(capsys):
    kicks = [entry.name for entry in library_entries() if entry.family == "kick"]
    assert [item["name"] for item in said(["list", "--family", "kick"], capsys)] == kicks
    assert main(["library", "list", "--family", "kick"]) == 0
    table = capsys.readouterr().out
    assert all(name in table for name in kicks)
    assert f"{len(kicks)} motion" in table
    assert "walk" not in table
    assert main(["library", "list", "--family", "kicks"]) == 2
    assert "unknown family 'kicks'; valid: locomotion, guard, punch" in capsys.readouterr().err


def test_a_users_clip_is_listed_shown_and_tracked_by_name(tmp_path, capsys, monkeypatch):
    (tmp_path / "my_kick.bvh").write_text(bvh_text())
    (tmp_path / "my_kick.toml").write_text('family = "kick"\nterms = "my own recording"\nevents = {impact = 0.5}\n')
    option = ["--library", str(tmp_path)]
    mine = said(["list", "--family", "kick", *option], capsys)[-1]
    assert (mine["name"], mine["events"], mine["source"]) == ("my_kick", {"impact": 0.5}, "BVH file my_kick.bvh")
    assert main(["library", "show", "my_kick", *option]) == 0
    assert "my own recording" in capsys.readouterr().out
    arguments = ["track", "my_kick", "--controller", "pd", "--json", "--no-pictures", "-o", str(tmp_path / "out")]
    assert main([*arguments, *option]) == 0
    assert json.loads(capsys.readouterr().out)["motion"] == "my_kick"
    monkeypatch.setenv("SIMPREP_LIBRARY", str(tmp_path))
    assert said(["show", "my_kick"], capsys)["terms"] == "my own recording"


def test_show_tells_what_the_motion_is(capsys):
    content = said(["show", "punch_right"], capsys)
    motion = library_motion("punch_right")
    kinematics = forward_kinematics(motion.qpos, motion.character)
    hand = kinematics.xpos[:, motion.character.segment("right_hand")]
    wrist = np.linalg.norm(np.gradient(hand, 1 / motion.fps, axis=0), axis=1).max()
    assert wrist * 0.8 < content["peak_fist_speed_m_s"]["right"] < wrist * 1.5
    assert content["events_s"]["impact"] == motion.events["impact"] / motion.fps
    assert content["parameters"]["side"] == "right"
    assert content["terms"] == ""
    fists = fist_positions(kinematics, motion.character)
    assert np.linalg.norm(fists[:, 1] - hand, axis=1) == pytest.approx(0.0866)  # the site of the model


def test_facts_of_a_loop_are_those_of_one_cycle():
    walk = library_motion("walk")
    one, long = motion_facts(walk), motion_facts(repeat(walk, 5))
    assert one.travel_m[0] == pytest.approx(2 * WalkStyle().step_length, abs=0.002)
    assert one.path_m >= one.travel_m[0]
    assert long.travel_m[0] == pytest.approx(5 * one.travel_m[0], rel=1e-4)
    assert long.path_m == pytest.approx(5 * one.path_m, rel=1e-4)
    assert one.peak_foot_speed_m_s == pytest.approx(long.peak_foot_speed_m_s)
    assert one.turn_deg == pytest.approx(0, abs=1e-3)
    assert one.flight_s == 0
    jump = library_motion("jump")
    facts = motion_facts(jump)
    assert facts.flight_s == pytest.approx((jump.events["landing"] - jump.events["take_off"]) / 60, abs=2 / 60)
    assert facts.stances_s["left"][-1][1] == jump.duration


def test_render_draws_a_sheet_for_each_family(tmp_path, capsys):
    try:
        find_backend()
    except NoGlError as problem:
        pytest.skip(str(problem))
    from PIL import Image

    content = said(["render", "duck", "punch_left", "punch_right", "-o", str(tmp_path)], capsys)
    assert content == {"motions": 3, "files": [str(tmp_path / "punch.png"), str(tmp_path / "duck.png")]}
    with Image.open(tmp_path / "punch.png") as punch, Image.open(tmp_path / "duck.png") as duck:
        assert punch.width == duck.width
        assert punch.height == 2 * duck.height
        strip = np.asarray(duck.convert("RGB")).astype(int)
    assert np.abs(strip[30:170, :120] - strip[30:170, 600:720]).max() > 40  # stands, then ducks
    assert main(["library", "render", "walk", "--family", "kick", "-o", str(tmp_path)]) == 2
    assert "no motion of family 'kick' among walk" in capsys.readouterr().err


def test_render_without_gl_is_a_message_before_any_work(tmp_path, capsys, monkeypatch):
    def nothing():
        raise NoGlError("no GL library to draw with; on Debian or Ubuntu: apt install libegl1")

    monkeypatch.setattr("simprep.report.gl.find_backend", nothing)
    monkeypatch.setattr("simprep.cli.library._load", pytest.fail)
    assert main(["library", "render", "-o", str(tmp_path / "out")]) == 2
    assert "apt install libegl1" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
