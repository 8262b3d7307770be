"""`simprep fight`, as a user runs it."""

import csv
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from simprep.cli.main import main
from simprep.duel.model.fight_model import save_fight_model
from simprep.duel.model.structures import couple, link_actions
from simprep.duel.model.tracks import pair_tracks
from simprep.duel.model.transition_model import train
from simprep.duel.stream.store import read_stream
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import PRESETS
from simprep.physics.store import read_run
from simprep.physics.yardstick import Yardstick

KEYS = [
    "fps_kinematic", "s_per_s", "falls_per_min", "mpjpe_mm", "penetration_mm", "foot_slip_ratio", "facing_error_deg",
    "answered_share", "hits", "js", "assist_n", "falls_unprovoked_per_min", "falls_after_collision_per_min", "knock_downs_per_min",
    "strike_miss_mm",
    "reacted_share", "pair_yardsticks", "facing_head_deg",
]  # fmt: skip
PHYSICS = (
    "s_per_s", "falls_per_min", "mpjpe_mm", "foot_slip_ratio", "assist_n", "falls_unprovoked_per_min",
    "knock_downs_per_min", "falls_after_collision_per_min",
)  # fmt: skip


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    example = make_synthetic(replace(PRESETS["kickboxing"], clips=3, clip_s=30.0), seed=5)
    player, start, end, clip = example.truth.table.T
    graph = couple(link_actions(player, start, end, example.truth.codes, clip))
    folder = tmp_path_factory.mktemp("model")
    save_fight_model(train(graph, pair_tracks(example.stream)), example.stream, folder)
    return folder


def run(capsys, *arguments):
    code = main(["fight", *map(str, arguments)])
    return code, *capsys.readouterr()


def test_a_fight_without_physics_has_all_keys_and_files(model, tmp_path, capsys):
    code, out, err = run(
        capsys, "--model", model, "--seconds", 4, "--seed", 2, "--no-physics", "--no-pictures", "-o", tmp_path, "--json"
    )
    assert code == 0, err
    found = json.loads(out)
    assert list(found) == KEYS
    assert list(found["penetration_mm"]) == ["kinematic_mean", "simulated_mean", "simulated_max"]
    assert list(found["hits"]) == ["intended", "unintended"]
    assert list(found["js"]) == ["bigram", "distance", "facing"]
    assert all(found[key] is None for key in PHYSICS)
    assert 0 < found["js"]["distance"] <= 1
    assert {path.name for path in tmp_path.iterdir()} == {"fight.npz", "actions.csv", "metrics.json"}
    whole = json.loads((tmp_path / "metrics.json").read_text())
    assert {key: whole[key] for key in KEYS} == found
    stream = read_stream(tmp_path / "fight.npz")
    assert len(stream) == round(4 * stream.fps)
    with (tmp_path / "actions.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == whole["actions"]
    assert {row["player"] for row in rows} == {"A", "B"}
    assert max(float(row["end_s"]) for row in rows) == pytest.approx(4.0, abs=1e-3)
    # the same seed, the same fight
    run(
        capsys,
        "--model",
        model / "model.npz",
        "--seconds",
        4,
        "--seed",
        2,
        "--no-physics",
        "--no-pictures",
        "-o",
        tmp_path / "b",
    )
    for one, two in zip(stream.players, read_stream(tmp_path / "b" / "fight.npz").players):
        np.testing.assert_array_equal(one.qpos, two.qpos)


@pytest.mark.parametrize("more", [(), ("--no-feedback",)])
def test_a_simulated_fight_writes_its_run_and_contacts(model, tmp_path, capsys, monkeypatch, more):
    monkeypatch.setattr(Yardstick, "seconds", lambda _: 2.0)
    timed = () if more else ("--yardstick",)
    code, out, err = run(
        capsys,
        "--model",
        model,
        "--seconds",
        0.6,
        "--preset",
        "live",
        "--no-pictures",
        "-o",
        tmp_path,
        "--json",
        *more,
        *timed,
    )
    assert code == 0, err
    found = json.loads(out)
    assert list(found) == KEYS
    assert found["pair_yardsticks"] == (None if more else found["s_per_s"] / 2.0)
    assert found["assist_n"] == 0.0
    assert all(found[key] is not None and math.isfinite(found[key]) for key in PHYSICS if key != "foot_slip_ratio")
    written = {path.name for path in tmp_path.iterdir()}
    assert {"fight.npz", "tracked.npz", "run.npz", "simulated.npz", "contacts.csv", "actions.csv"} <= written
    simulated = read_run(tmp_path)
    assert simulated.end_s == pytest.approx(0.6, abs=0.05)
    assert simulated == read_run(tmp_path / "run.npz")
    assert [one.reference.name for one in simulated.bodies] == ["fight_A", "fight_B"]
    # posture optimisation moves arms and trunk, and neither root nor legs
    before, after = (read_stream(tmp_path / name).players[0].qpos for name in ("fight.npz", "tracked.npz"))
    np.testing.assert_array_equal(before[:, :7], after[:, :7])
    assert np.abs(before - after).max() > 1e-3


def test_requests_are_followed(model, tmp_path, capsys):
    script = tmp_path / "wishes.csv"
    script.write_text("time_s,action,x_m,y_m\n0.5,left kick,,\n3,right punch,0.1,0.2\n")
    code, _, err = run(
        capsys, "--model", model, "--mode", "interactive", "--requests", script, "--player", "B", "--seconds", 6,
        "--no-physics", "--no-pictures", "-o", tmp_path / "out",
    )  # fmt: skip
    assert code == 0, err
    with (tmp_path / "out" / "actions.csv").open() as file:
        answers = [row for row in csv.DictReader(file) if row["request"]]
    assert [(row["player"], row["request"]) for row in answers] == [
        ("B", "left kick"),
        ("B", "right punch to (0.10, 0.20)"),
    ]
    assert answers[0]["left_kick"] in ("up", "downup")
    assert answers[1]["right_punch"] in ("fwd", "bwdfwd", "fwdbwd")


def test_passive_mode_with_pictures(model, tmp_path, capsys):
    code, _, err = run(
        capsys, "--model", model, "--mode", "passive", "--seconds", 3, "--no-physics", "-o", tmp_path
    )  # fmt: skip
    assert code == 0, err
    record = json.loads((tmp_path / "metrics.json").read_text())["record"]
    assert record["learned_until_frame"] > 0
    assert (tmp_path / "timeline.png").exists() or "no time line" in err
    assert (tmp_path / "strip.png").exists() or "no film strip" in err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--seconds", "0"), "--seconds 0; valid: 0.1 to 3600"),
        (("--seed", "-1"), "--seed -1; valid: 0 or more"),
        (("--model", "nowhere"), "no such file"),
        (("--gloves", "--no-physics"), "--gloves with --no-physics; valid: with a simulation"),
        (("--mode", "interactive"), "needs --requests CSV"),
        (("--requests", "wishes.csv"), "valid: with --mode interactive"),
        (("--mode", "interactive", "--requests", "nowhere.csv"), "nowhere.csv: no such file"),
        (("--mode", "friendly"), "friendly"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(capsys, tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, *arguments)
    assert code == 2
    assert said in err
    assert "Traceback" not in err
    assert not out
    assert not list(tmp_path.iterdir())
