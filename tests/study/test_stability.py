"""Stability by dose: which runs are made, what their ends say, and `simprep stability` from wish to files."""

import json
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from simprep.cli.main import main
from simprep.errors import SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion
from simprep.physics.run import Assist
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track
from simprep.study import push_limits
from simprep.study import stability as module
from simprep.study.doses import StabilitySettings
from simprep.study.limit_runs import LimitRuns
from simprep.study.stability import launch_of, mid_stance_of, stability
from simprep.study.stability_page import stability_headline, stability_page
from simprep.study.stability_results import content_of

FPS = 30.0


def standing(seconds=4.0, **events):
    """Standing on both feet, on the left one alone from 1.0 to 1.5 s."""
    frames = round(seconds * FPS) + 1
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], frames, axis=0)
    contacts = np.ones((frames, 2), bool)
    contacts[30:46, 1] = False
    return Motion(qpos, FPS, contacts, name="still", events=events)


class FakeTrack:
    """Completes by a rule of the settings and the seed."""

    def __init__(self, completes):
        self.completes, self.calls = completes, []

    def __call__(self, motion, controller, seed, settings):
        force = float(np.linalg.norm(settings.pushes[-1].force)) if settings.pushes else 0.0
        self.calls.append((motion, controller, seed, settings, force))
        end = "done" if self.completes(settings, seed, force) else "fell"
        return replace(short_run(), end=end, fallen=None if end == "done" else 0, assist=Assist(force_n=force))


@lru_cache(maxsize=1)
def short_run():
    return track(standing(0.1), "pd")


@pytest.fixture
def fake(monkeypatch):
    def install(completes):
        track = FakeTrack(completes)
        monkeypatch.setattr(module, "track", track)
        monkeypatch.setattr(push_limits, "track", track)
        return track

    return install


def rule(settings, seed, force):
    m = settings.mismatch
    return (
        force <= 120 + 40 * seed
        and (m.friction or 1.0) >= 0.3
        and m.strength >= 0.55
        and m.noise <= 1.2 + seed
        and settings.mpc.horizon >= 0.2
        and settings.mpc.samples >= 11
    )


def test_every_measure_finds_its_limit(fake):
    runs = fake(rule)
    result = stability(standing(target=60), StabilitySettings(directions_deg=(0.0, 90.0), halvings=6), "mpc")
    doses = result.doses()
    assert doses["dose_push_launch_n"] == pytest.approx(160, abs=2)
    assert doses["dose_push_stance_least_n"] == pytest.approx(160, abs=2)
    assert doses["dose_friction"] == pytest.approx(0.3, abs=0.01)
    assert doses["dose_strength"] == pytest.approx(0.55, abs=0.01)
    assert doses["dose_noise"] == pytest.approx(2.2, abs=0.1)
    assert doses["dose_horizon_s"] == pytest.approx(0.2, abs=0.01)
    assert doses["dose_samples"] == 11
    assert result.runs == len(runs.calls)
    assert not result.falls_undisturbed
    content = content_of(result)["measures"]["push_launch"]
    assert content["low_n"] == pytest.approx([120, 120], abs=2)
    assert content["high_n"] == pytest.approx([200, 200], abs=2)
    assert content["completed_share"] == pytest.approx([1, 1, 1, 1 / 3, 0, 0, 0])
    assert content["monotone_share"] == 1.0
    json.dumps(content, allow_nan=False)


def test_every_simulation_is_told_before_it_begins(fake):
    told = []
    track = fake(rule)
    settings = StabilitySettings(("push_launch", "friction"), directions_deg=(0.0,), seeds=(3,), halvings=1)
    stability(
        standing(target=60), settings, "mpc", on_progress=lambda what, done, total: told.append((what, done, total))
    )
    assert len(told) == len(track.calls)
    assert told[0] == ("push_launch, 0 degrees, seed 3: 0 N", 0, 2)
    assert any(what.startswith("friction, seed 3: 0.") and done == 1 for what, done, _ in told)


def test_what_has_no_random_numbers_is_run_once_and_lacks_what_mpc_has(fake):
    runs = fake(lambda settings, seed, force: settings.mismatch.noise < 3)
    result = stability(standing(), StabilitySettings(("friction", "noise"), seeds=(4, 5)), "balance")
    assert [one.seeds for one in result.measured] == [(4,), (4, 5)]
    undisturbed = [call for call in runs.calls if call[3] == SimulationSettings()]
    assert len(undisturbed) == 2  # once for each seed, for all measures
    with pytest.raises(UnknownNameError, match="unknown measure of balance 'horizon'; valid: push_launch, "):
        stability(standing(), StabilitySettings(("horizon",)), "balance")


def test_a_motion_that_falls_anyway_takes_nothing(fake):
    runs = fake(lambda settings, seed, force: False)
    result = stability(standing(target=60), StabilitySettings(directions_deg=(0.0, 90.0), seeds=(0,)), "balance")
    assert result.falls_undisturbed
    assert result.doses() == {
        "dose_push_launch_n": 0, "dose_push_launch_least_n": 0, "dose_push_stance_n": 0, "dose_push_stance_least_n": 0,
        "dose_friction": 1.0, "dose_strength": 1.0, "dose_noise": 0.0,
    }  # fmt: skip
    assert len(runs.calls) == 3  # at each moment once, and the whole


def test_moments_of_pushes_come_from_events_and_contacts():
    motion = standing(target=60)
    assert launch_of(motion) == 2.0
    assert mid_stance_of(motion, 2.0) == pytest.approx(1.25, abs=1 / FPS)
    assert launch_of(standing()) is None
    assert launch_of(standing(target=60, launch=30)) == 1.0
    walk = library_motion("walk")
    at = mid_stance_of(walk)
    assert walk.contacts[round(at * walk.fps)].sum() == 1
    both = Motion(motion.qpos, FPS, np.ones((len(motion), 2), bool))
    assert mid_stance_of(both) is None


def test_what_a_motion_lacks_is_said(fake):
    fake(rule)
    result = stability(standing(), StabilitySettings(("push_launch", "friction")), "balance")
    assert [one.name for one in result.measured] == ["friction"]
    assert dict(result.left_out) == {"push_launch": "no event `launch` or `target`"}


def test_settings_out_of_range():
    with pytest.raises(SettingError, match="21 halvings; valid: 0 to 20"):
        StabilitySettings(halvings=21)
    with pytest.raises(SettingError, match=r"push seeds .*all different"):
        StabilitySettings(seeds=(1, 1))


def test_the_limits_hold_in_the_simulation_and_again():
    duck = library_motion("duck")
    crouch = duck.qpos[duck.events["peak"]]
    motion = Motion(np.repeat(crouch[None], 25, axis=0), FPS, np.ones((25, 2), bool), name="crouch")
    settings = StabilitySettings(("strength",), seeds=(0,), halvings=1)
    result = stability(motion, settings, "balance")
    assert result == stability(motion, settings, "balance")
    ((limit,),) = result.measured[0].limits
    assert limit.completed[0]
    assert not limit.completed[-1]  # motors of a tenth cannot bear the body
    assert limit.failed < limit.survived < 1.0


def test_stability_writes_numbers_and_a_picture(fake, tmp_path, capsys):
    fake(rule)
    path = save_motion(standing(target=60), tmp_path / "still.npz")
    out = tmp_path / "out"
    arguments = ["stability", str(path), "--controller", "balance", "--directions", "4", "--json", "-o", str(out)]
    assert main(arguments) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed == json.loads((out / "metrics.json").read_text())
    assert printed["schema"] == "simprep.stability/1"
    assert printed["measures"]["push_stance"]["directions_deg"] == [0, 90, 180, 270]
    assert printed["dose_friction"] == pytest.approx(0.3, abs=0.02)
    assert printed["files"] == ["metrics.json", "stability.png", "report.html"]
    assert (out / "stability.png").read_bytes().startswith(b"\x89PNG")


def test_the_page_shows_the_runs_at_each_limit(fake):
    fake(rule)
    runs, settings = LimitRuns(), StabilitySettings(directions_deg=(0.0, 90.0), halvings=3)
    result = stability(standing(target=60), settings, "mpc", on_run=runs.add)
    for one in result.measured:
        for direction, row in zip(one.directions_deg or (None,), one.limits):
            search = (one.name, direction)
            assert (runs.survived[search][0], runs.failed[search][0]) == (row[0].survived, row[0].failed)
            assert (runs.survived[search][1].end, runs.failed[search][1].end) == ("done", "fell")
    page = stability_page("still", result, settings, runs, [], {})
    assert len(page.replays) == len(result.measured) == 7
    labels = [actor.label for actor in page.replays[2].actors]
    assert labels == ["friction 0.3, survived", "friction 0.287, not survived"]
    assert [flash.label for flash in page.replays[0].flashes] == ["112 N", "125 N"]  # of the first seed
    assert page.headline.startswith("It survives pushes of 150 N at the launch, ")
    assert "friction down to 0.3," in page.headline


def test_a_motion_that_falls_anyway_says_so_on_the_page(fake):
    fake(lambda settings, seed, force: False)
    runs, settings = LimitRuns(), StabilitySettings(("friction",), seeds=(0,))
    result = stability(standing(), settings, "balance", on_run=runs.add)
    assert "Without any disturbance it is not always completed either." in stability_headline(result)
    (replay,) = stability_page("still", result, settings, runs, [], {}).replays
    assert [actor.label for actor in replay.actors] == ["friction 1, not survived"]


@pytest.mark.parametrize(
    ("wish", "words"),
    [
        (["--controller", "pd", "--measures", "samples"], "unknown measure of pd 'samples'; valid: push_launch"),
        (["--seeds", "0"], "--seeds 0; valid: 1 to 1000"),
        (["--directions", "0"], "--directions 0; valid: 1 to 360"),
        (["--segment", "tail"], "unknown segment 'tail'; valid: pelvis"),
        (["--halvings", "-1"], "-1 halvings; valid: 0 to 20"),
    ],
)
def test_a_bad_wish_is_one_line_and_nothing_is_written(wish, words, tmp_path, capsys):
    assert main(["stability", "kick_front", *wish, "-o", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert words in printed.err
    assert printed.err.count("\n") == 1
    assert not (tmp_path / "out").exists()
