"""The largest push survived: bisection, direction, what is simulated, and `simprep push` from wish to files."""

import json
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from simprep.cli.main import main
from simprep.errors import SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.edit import move
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion
from simprep.physics.mpc_settings import MpcSettings
from simprep.physics.pushes import Push
from simprep.physics.run import Assist
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track
from simprep.study import push_limits as module
from simprep.study.push_limits import PushSettings, largest_survived, push_limits

FPS = 30.0


def standing(seconds, name="still"):
    frames = round(seconds * FPS) + 1
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], frames, axis=0)
    return Motion(qpos, FPS, np.ones((frames, 2), bool), name=name)


class FakeTrack:
    """Survives what is weaker than a limit, which depends on the world's direction of the push and on the seed."""

    def __init__(self, limit):
        self.limit, self.calls = limit, []

    def __call__(self, motion, controller, seed, settings):
        (push,) = settings.pushes
        self.calls.append((motion, push))
        force = float(np.linalg.norm(push.force))
        angle = np.degrees(np.arctan2(push.force[1], push.force[0])) % 360
        end = "done" if force <= self.limit(angle, seed) else "fell"
        return replace(short_run(), end=end, fallen=None if end == "done" else 0, assist=Assist(force_n=force))


@lru_cache(maxsize=1)
def short_run():
    return track(standing(0.1), "pd")


@pytest.fixture
def fake(monkeypatch):
    def install(limit):
        track = FakeTrack(limit)
        monkeypatch.setattr(module, "track", track)
        return track

    return install


@pytest.mark.parametrize("limit", [0.0, 3.0, 19.9, 20.1, 333.3, 512.0, 780.0, 799.0])
@pytest.mark.parametrize("tolerance", [20.0, 1.0, 900.0])
def test_bisection_brackets_the_limit(limit, tolerance):
    tried = {}
    found = largest_survived(lambda force: tried.setdefault(force, force <= limit), 800.0, tolerance)
    assert found <= limit < found + tolerance
    assert found == 0 or tried[found]
    assert any(not survived and force - found <= tolerance for force, survived in tried.items())
    assert len(tried) <= np.ceil(np.log2(max(800 / tolerance, 1))) + 1


def test_bisection_returns_the_largest_only_if_it_was_survived():
    tried = []
    assert largest_survived(lambda force: not tried.append(force), 800.0, 20.0) == 800.0
    assert tried[-1] == 800.0


def test_limits_by_direction_and_seed(fake):
    runs = fake(lambda angle, seed: (900, 100 + 200 * seed, 50)[round(angle / 90)])
    settings = PushSettings(1.5, (0.0, 90.0, 180.0), tolerance_n=2.0, largest_n=800.0)
    limits = push_limits(standing(4), settings)
    table = limits.by_direction()
    assert table["directions_deg"] == [0.0, 90.0, 180.0]
    assert table["at_least"] == [True, False, False]
    for key, values in {"max_force_n": (800, 300, 50), "low_n": (800, 100, 50), "high_n": (800, 500, 50)}.items():
        np.testing.assert_array_less(0, table[key])
        np.testing.assert_allclose(table[key], values, atol=2.0)
    assert [len(forces) for forces in limits.force_n] == [3, 3, 3]
    assert limits.assist_n == 800 == max(np.linalg.norm(push.force) for _, push in runs.calls)
    assert limits == push_limits(standing(4), settings)


def test_a_motion_that_falls_unpushed_has_the_limit_0_without_a_search(fake):
    runs = fake(lambda angle, seed: -1 if seed == 1 else 500)
    limits = push_limits(standing(4), PushSettings(1.0, (0.0, 90.0), seeds=(0, 1)))
    assert limits.fell_unpushed == (False, True)
    assert [forces[1] for forces in limits.force_n] == [0, 0]
    assert min(forces[0] for forces in limits.force_n) > 480
    assert len(runs.calls) < 2 + 2 * 8


@pytest.mark.parametrize("turn", [0.0, 70.0, -135.0])
def test_directions_are_those_of_the_heading(fake, turn):
    runs = fake(lambda angle, seed: 500)
    motion = move(standing(4), turn=float(np.radians(turn)))
    push_limits(motion, PushSettings(1.0, (0.0, 90.0), seeds=(0,)))
    forces = np.array([push.force for _, push in runs.calls if np.any(push.force)])
    assert not forces[:, 2].any()
    heading = np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
    units = forces[:, :2] / np.linalg.norm(forces, axis=1, keepdims=True)
    half = len(units) // 2
    np.testing.assert_allclose(units[:half], np.tile(heading, (half, 1)), atol=1e-9)
    np.testing.assert_allclose(units[half:], np.tile([-heading[1], heading[0]], (half, 1)), atol=1e-9)


@pytest.mark.parametrize(
    ("at", "start", "seconds", "watched"),
    [(0.5, 0.5, 3.7, 3.0), (3.0, 1.0, 4.2, 3.0), (9.5, 1.0, 1.5, 0.3), (2.01, 1.01, 4.23, 3.0)],
)
def test_a_little_before_and_after_the_push_is_simulated(fake, at, start, seconds, watched):
    runs = fake(lambda angle, seed: 500)
    motion = standing(10)
    limits = push_limits(motion, PushSettings(at, (0.0,), seeds=(0,)))
    clip, push = runs.calls[-1]
    assert (push.body, push.duration) == ("pelvis", 0.2)
    assert push.start == pytest.approx(start, abs=1 / FPS)
    assert clip.duration == pytest.approx(seconds, abs=1.5 / FPS)
    assert limits.watched_s == pytest.approx(watched, abs=1.5 / FPS)
    assert clip.duration == pytest.approx(push.start + 0.2 + limits.watched_s)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"segment": "tail"}, "unknown segment 'tail'; valid: pelvis, "),
        ({"at_s": 3.9}, r"push from 3.9 to 4.1 s; valid: within still, 0 to 4 s"),
        ({"at_s": float("nan")}, "valid: within still"),
        ({"directions_deg": ()}, "push directions .*at least one"),
        ({"seeds": (1, 1)}, "push seeds .*all different"),
        ({"duration_s": 0.0}, "push duration_s 0; valid: above 0"),
        ({"largest_n": float("inf")}, "push largest_n inf"),
        ({"tolerance_n": -1.0}, "push tolerance_n -1"),
    ],
)
def test_wrong_wishes_say_what_is_valid(change, words):
    with pytest.raises((SettingError, UnknownNameError), match=words):
        push_limits(standing(4), replace(PushSettings(1.0), **change), "pd")


def test_the_limit_holds_in_the_simulation():
    motion, settings = standing(0.8), PushSettings(0.2, (0.0,), largest_n=4000.0, tolerance_n=250.0, seeds=(0,))
    ((force,),) = push_limits(motion, settings, "pd").force_n
    assert 0 < force < 4000
    for newtons, end in ((force, "done"), (force + 250, "fell")):
        pushes = (Push("pelvis", 0.2, 0.2, (newtons, 0.0, 0.0)),)
        assert track(motion, "pd", settings=SimulationSettings(pushes=pushes)).end == end


def test_the_same_seeds_give_the_same_limits_with_mpc():
    cheap = SimulationSettings(mpc=MpcSettings(samples=8, refined=5, iterations=1, horizon=0.1, replan=0.1, harder=()))
    settings = PushSettings(0.2, (90.0,), largest_n=4000.0, tolerance_n=600.0, seeds=(3,))
    limits = [push_limits(standing(0.6), settings, simulation=cheap) for _ in range(2)]
    assert limits[0] == limits[1]
    assert limits[0].assist_n > 0


@pytest.fixture
def still_file(tmp_path):
    return str(save_motion(standing(4), tmp_path / "still.npz"))


def test_push_writes_numbers_and_a_plot(fake, still_file, tmp_path, capsys):
    fake(lambda angle, seed: 200 + 100 * seed + angle)
    arguments = ["push", still_file, "--directions", "4", "--at", "1", "-o", str(tmp_path / "out"), "--json"]
    assert main(arguments) == 0
    printed = capsys.readouterr()
    content = json.loads(printed.out)
    assert content == json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert content["schema"] == "simprep.push/1"
    assert (content["directions_deg"], content["duration_s"], content["n"]) == ([0, 90, 180, 270], 0.2, 3)
    np.testing.assert_allclose(content["max_force_n"], [300, 390, 480, 570], atol=20)
    np.testing.assert_allclose(content["low_n"], [200, 290, 380, 470], atol=20)
    np.testing.assert_allclose(content["high_n"], [400, 490, 580, 670], atol=20)
    assert content["assist_n"] > 570
    assert content["warnings"] == ["still ends 2.80 s after the push; a later fall is not seen"]
    assert content["files"] == ["metrics.json", "push.png", "report.html"]
    assert (tmp_path / "out" / "push.png").read_bytes().startswith(b"\x89PNG")
    assert str(tmp_path / "out" / "push.png") in printed.err


def test_the_phase_is_a_share_of_the_motion_and_of_a_cycle(fake, still_file, tmp_path, capsys):
    fake(lambda angle, seed: 100)
    common = ["--directions", "1", "--seeds", "1", "-o", str(tmp_path), "--quiet"]
    assert main(["push", still_file, "--phase", "0.25", *common]) == 0
    assert json.loads((tmp_path / "metrics.json").read_text())["at_s"] == pytest.approx(1.0, abs=0.02)
    assert main(["push", "walk", "--phase", "0.5", *common]) == 0
    cycle = library_motion("walk").duration
    content = json.loads((tmp_path / "metrics.json").read_text())
    assert content["at_s"] == pytest.approx(np.ceil(2 / cycle) * cycle + cycle / 2)
    assert main(["push", still_file, "--phase", "0.5", "--at", "1", *common]) == 2
    assert "--at and --phase both say when" in capsys.readouterr().err
    assert main(["push", still_file, "--phase", "1.5", *common]) == 2
    assert "--phase 1.5; valid: 0 to 1" in capsys.readouterr().err


def test_what_the_numbers_cannot_say_is_a_warning(fake, still_file, tmp_path, capsys):
    fake(lambda angle, seed: -1 if seed == 1 else 1e6)
    assert main(["push", still_file, "--directions", "2", "--seeds", "2", "-o", str(tmp_path), "--at", "0.5"]) == 0
    printed = capsys.readouterr()
    assert "still falls without any push with 1 of 2 seeds" in printed.err
    assert "1600 N, was survived; the limit may lie above it" in printed.err


def test_directions_and_a_force_of_ones_own(fake, still_file, tmp_path, capsys):
    fake(lambda angle, seed: 200 + 100 * seed + angle)
    common = ["--direction", "45", "90", "--at", "1", "-o", str(tmp_path), "--json", "--no-pictures"]
    assert main(["push", still_file, *common]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["directions_deg"] == [45, 90]
    np.testing.assert_allclose(content["max_force_n"], [345, 390], atol=20)
    assert main(["push", still_file, "--force", "350", *common]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["force_n"] == [[0, 0, 350], [0, 350, 350]]  # of three seeds each
    assert content["assist_n"] == 350


def test_a_loop_is_repeated_until_the_push_is_over(fake, tmp_path):
    runs = fake(lambda angle, seed: 100)
    assert (
        main(["push", "stand", "--directions", "1", "--seeds", "1", "--at", "7", "-o", str(tmp_path), "--quiet"]) == 0
    )
    clip, push = runs.calls[0]
    assert (push.start, clip.duration) == pytest.approx((1.0, 4.2), abs=0.05)


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        (["--segment", "tail"], "unknown segment 'tail'; valid: pelvis"),
        (["--at", "9"], "push from 9 to 9.2 s; valid: within still, 0 to 4 s"),
        (["--directions", "0"], "push directions ()"),
        (["--seeds", "0"], "push seeds ()"),
        (["--duration", "0"], "push duration_s 0; valid: above 0"),
    ],
)
def test_a_bad_wish_is_one_line_and_nothing_is_written(still_file, wish, words, tmp_path, capsys):
    assert main(["push", still_file, *wish, "-o", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert printed.err.startswith("simprep: ")
    assert printed.err.count("\n") == 1
    assert words in printed.err
    assert not (tmp_path / "out").exists()
