"""Margins of each step: against a pendulum whose answer is known, mirrored, and on a captured walk."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from metric_cases import rigid_motion

import simprep
from simprep.cli.main import main
from simprep.humanoid_model import GRAVITY
from simprep.library import library_motion
from simprep.metrics.balance import balance, extrapolated_com
from simprep.metrics.margins import NODES, normalised_curves, step_margins
from simprep.motion.edit import cut, mirror, move, repeat
from simprep.motion.load import load_motion

STEP_S, HEIGHT_M, WIDTH_M, LENGTH_M = 0.5, 0.9, 0.08, 0.25


def pendulum_walk(turn: float = 0.0):
    """A walk of the linear inverted pendulum: feet 8 cm from the line, the COM a hyperbola about the foot that stands.

    Symmetric steps: the sideways COM ends a step with the speed that begins the next one, mirrored. The XcoM of a hyperbola
    that begins at b, d from the foot, is d exp(omega t) from it.
    """
    fps, omega = 60.0, np.sqrt(GRAVITY / HEIGHT_M)
    time = np.arange(round(5 * STEP_S * fps) + 1) / fps
    number = np.minimum((time / STEP_S + 1e-9).astype(int), 4)
    side = number % 2  # 0: left stands
    t = time - number * STEP_S
    half = omega * STEP_S / 2
    y = WIDTH_M * (
        1 - np.cosh(omega * t - half) / np.cosh(half)
    )  # from the middle line towards the foot, 0 at its ends
    speed = -WIDTH_M * omega * np.sinh(omega * t - half) / np.cosh(half)
    sign = np.where(side == 0, 1.0, -1.0)
    advance = 0.5
    com = np.stack([advance * time, sign * y, np.full(len(time), HEIGHT_M)], axis=1)
    velocity = np.stack([np.full(len(time), advance), sign * speed, 0 * time], axis=1)
    motion = rigid_motion(np.stack([advance * time, 0 * time, 0 * time], axis=1), fps)
    motion = move(replace(motion, contacts=np.stack([side == 0, side == 1], axis=1)), turn=turn)
    foot = np.array([[-0.1, -0.03], [-0.1, 0.03], [0.15, 0.03], [0.15, -0.03]])
    placed = np.empty((len(time), 2, 4, 2))
    for which, outward in ((0, 1.0), (1, -1.0)):
        placed[:, which] = foot + np.stack([advance * STEP_S * number, 0 * time + outward * WIDTH_M], axis=1)[:, None]
    c, s = np.cos(turn), np.sin(turn)
    rotate = np.array([[c, s], [-s, c]])
    com[:, :2], velocity[:, :2] = com[:, :2] @ rotate, velocity[:, :2] @ rotate
    series = replace(
        balance(motion), com=com, xcom=extrapolated_com(com, velocity), foot_points=placed.reshape(-1, 8, 2) @ rotate
    )
    return motion, series, omega, advance


@pytest.mark.parametrize("turn", [0.0, 2.0])
def test_a_pendulum_has_the_margins_that_it_must_have(turn):
    motion, series, omega, advance = pendulum_walk(turn)
    margins = step_margins(motion, series)
    assert [one.side for one in margins.steps] == ["right", "left", "right", "left"]
    assert [one.touchdown_s for one in margins.steps] == pytest.approx([0.5, 1.0, 1.5, 2.0])
    distance = WIDTH_M * (1 - np.tanh(omega * STEP_S / 2))  # of the XcoM from the foot at touch-down
    for one in margins.steps:
        assert one.ml_m == pytest.approx(distance + 0.03, abs=1e-9)
        assert one.front_m == pytest.approx(0.15 - advance / omega, abs=1e-9)
        assert one.back_m == pytest.approx(0.1 + advance / omega, abs=1e-9)
        assert one.pendulum_m == HEIGHT_M
    # in a stance the distance from the foot grows by exp(omega t)
    curves = normalised_curves(margins)
    assert {name.rsplit("_", 2)[0] for name in curves} == {"right_1", "left_1", "right_2"}
    curve, t = curves["right_1_ml_m"], np.linspace(0, STEP_S, NODES)
    assert curve[:90] == pytest.approx((0.03 + distance * np.exp(omega * t))[:90], abs=2e-4)
    cycle = normalised_curves(margins, cycle=True)
    assert set(cycle) == {f"{side}_1_{one}_m" for side in ("left", "right") for one in ("ml", "front", "back")}
    assert np.isfinite(cycle["right_1_ml_m"][:50]).all()
    assert np.isnan(cycle["right_1_ml_m"][52:]).all()  # the foot is in the air


def test_mirrored_is_left_for_right_and_a_run_of_a_walk_is_like_it():
    walk = cut(repeat(library_motion("walk"), 3), 0, 150)
    own, mirrored = (step_margins(one, balance(one)).steps for one in (walk, mirror(walk)))
    assert len(own) == len(mirrored) >= 4
    for a, b in zip(own, mirrored):
        assert {a.side, b.side} == {"left", "right"}
        for name in ("touchdown_s", "ml_m", "ml_least_m", "front_m", "back_m", "pendulum_m"):
            assert getattr(a, name) == pytest.approx(getattr(b, name), abs=1e-6), name
        assert 0.03 < a.ml_least_m <= a.ml_m < 0.12
        assert a.front_m + a.back_m == pytest.approx(0.215, abs=0.02)  # the sole's length
    numbers, swapped = simprep.evaluate_motion(walk), simprep.evaluate_motion(mirror(walk))
    for name in ("ml", "front", "back"):
        assert numbers[f"step_margin_{name}_left_mm"] == pytest.approx(
            swapped[f"step_margin_{name}_right_mm"], abs=1e-3
        )


def test_a_captured_walk(data_dir):
    motion = load_motion(data_dir / "cmu" / "bvh" / "002_01.bvh")
    steps = step_margins(motion, balance(motion)).steps
    assert {one.side for one in steps} == {"left", "right"}
    inner = [one for one in steps if np.isfinite(one.liftoff_s)]
    assert all(0.0 < one.ml_m < 0.2 for one in inner)
    assert all(one.back_m > 0 for one in inner)  # walking on: the XcoM is ahead of the heel that lands


def test_the_command_writes_what_it_prints(tmp_path, capsys):
    assert main(["margins", "walk", "--seconds", "3", "--json", "-o", str(tmp_path)]) == 0
    content = json.loads(capsys.readouterr().out)
    assert {"com_model", "base_of_support", "pendulum_length", "sign", "event"} <= set(content["definitions"])
    with (tmp_path / "steps.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(content["steps"]) == sum(content["n_steps"].values())
    left = [float(row["ml_m"]) for row in rows if row["side"] == "left"]
    assert content["step_margin_ml_left_mm"] == pytest.approx(1e3 * np.mean(left), rel=1e-6)
    lines = (tmp_path / "curves.mot").read_text().splitlines()
    table = lines[lines.index("endheader") + 1 :]
    assert len(table) == 102
    assert table[0].split("\t")[0] == "time"
    with (tmp_path / "curves.csv").open() as stream:
        curves = list(csv.reader(stream))
    assert [*curves[0][1:]] == table[0].split("\t")[1:]
    assert float(curves[1][1]) == pytest.approx(left[0], rel=1e-6)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(content["files"])
    assert {"curves.png", "report.html"} <= set(content["files"])
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert f"the mean margin is {content['step_margin_ml_left_mm']:.0f} mm sideways" in page
    assert "left foot at " in page  # the touch-downs are marked in the replay
    assert main(["margins", "stand", "--quiet", "-o", str(tmp_path / "stand")]) == 0
    assert "no foot lands" in capsys.readouterr().err
    assert "stand has no steps" in (tmp_path / "stand" / "report.html").read_text(encoding="utf-8")


def test_without_pictures_none_is_drawn(tmp_path, capsys):
    assert main(["margins", "walk", "--seconds", "2", "--no-pictures", "--json", "-o", str(tmp_path)]) == 0
    files = {path.name for path in tmp_path.iterdir()}
    assert (
        files
        == {"metrics.json", "steps.csv", "curves.csv", "curves.mot"}
        == set(json.loads(capsys.readouterr().out)["files"])
    )


def test_a_run_is_measured_as_it_is(tmp_path, capsys):
    simprep.track(cut(repeat(library_motion("walk"), 2), 0, 60), controller="pd").save(tmp_path / "run.npz")
    assert main(["margins", str(tmp_path), "--json", "-o", str(tmp_path / "out")]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["simulated"]
    assert content["steps"][0]["side"] == "right"
    assert main(["margins", str(tmp_path), "--seconds", "2"]) == 2
    assert "a run is measured as it is" in capsys.readouterr().err
    assert Path(tmp_path / "out" / "curves.mot").is_file()
    assert "simulated with pd" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
