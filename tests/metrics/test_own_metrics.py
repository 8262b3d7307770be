"""Metrics of a user's own beside ours, and the table that they make together."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from metric_cases import run_of, swaying_motion

import simprep
from simprep.metrics.evaluate import MOTION_KEYS, RUN_KEYS
from simprep.motion.edit import cut


class HighestSpeed:
    """A metric with a setting."""

    def __init__(self, axis):
        self.axis = axis

    def __call__(self, run):
        return run.qvel[:, self.axis].max()  # a numpy number


OWN = {"root_y_m": lambda subject: float(subject.qpos[:, 1].max()), "nothing_m": lambda subject: np.nan}


def test_own_metrics_come_after_ours_in_mapping_json_and_table():
    motion = swaying_motion(120.0)
    run = run_of(motion, motion)
    numbers = simprep.evaluate_run(run, own={**OWN, "speed_m_s": HighestSpeed(1), "steps": lambda run: run.steps})
    assert tuple(numbers) == (*RUN_KEYS, "root_y_m", "nothing_m", "speed_m_s", "steps")
    assert numbers["root_y_m"] == pytest.approx(0.04, rel=1e-3)
    assert numbers["speed_m_s"] == pytest.approx(0.04 * 2 * np.pi * 0.7, rel=0.01)
    assert (numbers["nothing_m"], numbers["steps"]) == (None, 240)
    assert {name: numbers[name] for name in RUN_KEYS} == simprep.evaluate_run(run)
    assert json.loads(json.dumps(numbers, allow_nan=False)) == numbers
    kinematic = simprep.evaluate_motion(motion, own=OWN)
    assert tuple(kinematic) == (*MOTION_KEYS, *OWN)
    assert kinematic["root_y_m"] == numbers["root_y_m"]
    assert numbers.table().splitlines()[-2:] == [
        f"{'speed_m_s':33}  {numbers['speed_m_s']:>6.4g}",
        f"{'steps':33}  {'240':>6}",
    ]


def test_what_has_no_numbers_is_not_given_to_own_metrics():
    motion = swaying_motion(120.0)

    def never(subject):
        raise AssertionError("measured")

    diverged = run_of(motion, motion, end="diverged")
    assert simprep.evaluate_run(diverged, own={"x_m": never})["x_m"] is None
    assert simprep.evaluate_motion(cut(motion, 0, 2), own={"x_m": never})["x_m"] is None


def test_a_name_of_ours_and_a_value_that_is_none_are_refused():
    motion = swaying_motion(60.0)
    with pytest.raises(simprep.SettingError, match="'mpjpe_mm' is one of simprep's"):
        simprep.evaluate_run(run_of(motion, motion), own={"mpjpe_mm": lambda run: 0.0})
    with pytest.raises(simprep.SettingError, match="'path_m' gave a ndarray; valid: a number"):
        simprep.evaluate_motion(motion, own={"path_m": lambda motion: motion.qpos[:, 0]})


def test_a_table_of_several():
    text = simprep.metrics_table({"pd": {"end": "fell", "mpjpe_mm": 41.237}, "mpc": {"end": "done", "x_m": True}})
    assert text.splitlines() == [
        "metric       pd   mpc",
        "end        fell  done",
        "mpjpe_mm  41.24     -",
        "x_m           -  True",
    ]


def test_the_documented_examples_run(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    page = (Path(__file__).resolve().parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
    names = {}
    for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(code, names)
    assert (tmp_path / "kick.png").is_file()
    assert capsys.readouterr().out.splitlines()[-1].startswith("lowest_root_m ")
