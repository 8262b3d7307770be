"""`simprep validate` for real: one small study through the command, nothing replaced, its numbers made again from its files."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import simprep
from simprep.motion.edit import cut, repeat
from simprep.study.plan import ARMS

ROOT = Path(__file__).resolve().parents[2]
MOTIONS = [f"jab_left_head_a100_{arm}" for arm in ARMS]


def validate(folder: Path) -> dict:
    """The smallest study there is: a step and a half from a file, one target, one level, both controllers."""
    walk = replace(repeat(simprep.library_motion("walk"), 2), loop=False)
    simprep.save_motion(cut(walk, 0, 72), folder / "steps.npz")
    arguments = [
        "--locomotion",
        "steps.npz",
        "--target",
        "jab_left_head",
        "--alpha",
        "1",
        "-o",
        "study",
        "--json",
        "--yardstick",
    ]
    done = subprocess.run(
        [sys.executable, "-m", "simprep.cli.main", "validate", *arguments],
        capture_output=True, text=True, cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("validate")
    return validate(folder), folder / "study"


def test_every_case_is_simulated_without_help(study):
    printed, folder = study
    written = json.loads((folder / "metrics.json").read_text())
    assert printed["complete"]
    assert printed["assist"] == {"force_n": 0.0, "torque_nm": 0.0}
    assert written["cases"] == printed["cases"]
    assert [(case["arm"], case["controller"]) for case in printed["cases"]] == [
        (arm, controller) for controller in ("pd", "mpc") for arm in ARMS
    ]


def test_mpc_stays_up_and_plain_servos_fall(study):
    for case in study[0]["cases"]:
        assert case["success"] == (case["controller"] == "mpc"), case
        assert case["end"] == ("done" if case["controller"] == "mpc" else "fell")
        assert 0 < case["mpjpe_mm"] < (50 if case["controller"] == "mpc" else 500)


def test_costs_are_in_yardsticks(study):
    content = study[0]
    for case in content["cases"]:
        assert case["yardsticks"] == pytest.approx(case["cpu_s_per_s"] / 2 / content["yardstick_s"])
    costs = {case["controller"]: case["yardsticks"] for case in content["cases"] if case["arm"] == "optimised"}
    assert 0 < costs["pd"] < costs["mpc"]


def test_all_files_are_there(study):
    _, folder = study
    written = json.loads((folder / "metrics.json").read_text())
    found = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert found == {*written["files"], "metrics.json"}
    simulated = {f"{name}_{controller}" for name in MOTIONS for controller in ("pd", "mpc")}
    assert {path.stem for path in (folder / "motions").iterdir()} == {*MOTIONS, *simulated}


def test_the_numbers_before_physics_follow_from_the_written_motions(study):
    printed, folder = study
    for row, name in zip(printed["motions"], MOTIONS, strict=True):
        again = simprep.evaluate_motion(simprep.load_motion(folder / "motions" / f"{name}.npz"))
        assert row["arm"] in name
        assert {key: row[key] for key in again} == pytest.approx(again, nan_ok=True)


def test_preparation_is_worth_something_before_physics(study):
    rows = {row["arm"]: row for row in study[0]["motions"]}
    assert rows["optimised"]["prepared_com_cos_mm"] < rows["blended"]["prepared_com_cos_mm"]
    assert rows["blended"]["prepared_margin_of_stability_mm"] > rows["none"]["prepared_margin_of_stability_mm"]
