"""The fixture as a user meets it: a project of its own, baselines beside the test, options as those of pytest-regressions."""

import json
import tomllib
from pathlib import Path

import pytest

import simprep.regression.compare
import simprep.regression.ensemble
import simprep.regression.states
import simprep.regression.tables  # noqa: F401  # loaded before tests run inside this one, which forget what they loaded

pytest_plugins = ("pytester",)
PLUGIN = "simprep.regression.plugin"
WALK = """
import random

def numbers(seed):
    rng = random.Random(seed)
    return {{"success": True, "mpjpe_mm": {mean} + rng.gauss(0, 0.5), "notes": "text"}}

def test_walk(stability_regression):
    stability_regression.check(numbers)
"""
STANDING = """
from dataclasses import replace
import numpy as np
import simprep

def test_standing(stability_regression):
    body = simprep.humanoid()
    still = simprep.Motion(np.repeat(body.standing_qpos[None], 4, axis=0), 30.0, np.ones((4, 2), bool), name="still")
    scene = simprep.SceneSettings(timestep=1 / 480 * {scale})
    run = simprep.track(still, "pd", settings=simprep.SimulationSettings(scene=scene))
    stability_regression.golden(run, steps=20)
"""


@pytest.fixture
def project(pytester, monkeypatch):
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)
    pytester.makeini("[pytest]\naddopts = -p no:cacheprovider")

    def run(*arguments, plugins=(PLUGIN,)):
        return pytester.runpytest_inprocess(*(word for name in plugins for word in ("-p", name)), *arguments)

    return pytester, run


def walk(pytester, mean=20.0):
    pytester.makepyfile(test_walk=WALK.format(mean=mean))
    return pytester.path / "test_walk" / "test_walk.json"


def test_the_first_run_writes_the_second_passes_and_a_changed_one_fails_with_a_table(project):
    pytester, run = project
    baseline = walk(pytester)
    first = run()
    first.assert_outcomes(failed=1)
    first.stdout.fnmatch_lines(["*no baseline yet, written now*", f"*{baseline.name}"])
    content = json.loads(baseline.read_text())
    assert content["cases"]["test_walk"]["seeds"] == list(range(10))
    assert {"mujoco", "numpy", "simprep"} <= set(content["versions"])
    run().assert_outcomes(passed=1)
    walk(pytester, 23.0)
    changed = run()
    changed.assert_outcomes(failed=1)
    changed.stdout.fnmatch_lines(
        ["1 numbers moved", "*before*now*change*allowed*", "*test_walk*mpjpe_mm*worse*", "*the program or its input*"]
    )
    assert json.loads(baseline.read_text()) == content


def test_force_regen_writes_and_fails_where_numbers_moved_and_regen_all_writes_and_passes(project):
    pytester, run = project
    baseline = walk(pytester)
    run("--force-regen").assert_outcomes(failed=1)
    before = baseline.read_text()
    run("--force-regen").assert_outcomes(passed=1)
    assert baseline.read_text() == before
    walk(pytester, 23.0)
    run("--force-regen").assert_outcomes(failed=1)
    run().assert_outcomes(passed=1)
    walk(pytester, 26.0)
    run("--regen-all", "--stability-reason", "softer feet").assert_outcomes(passed=1)
    run().assert_outcomes(passed=1)
    reasons = [change["reason"] for change in json.loads(baseline.read_text())["history"]]
    assert reasons == ["first baseline", "pytest --force-regen", "softer feet"]


def test_the_number_of_seeds_is_an_option(project):
    pytester, run = project
    baseline = walk(pytester)
    run("--regen-all", "--stability-seeds", "6").assert_outcomes(passed=1)
    assert json.loads(baseline.read_text())["cases"]["test_walk"]["seeds"] == list(range(6))
    other = run("--stability-seeds", "12")
    other.assert_outcomes(passed=1)
    bad = run("--stability-seeds", "0")
    bad.stdout.fnmatch_lines(["*--stability-seeds 0; valid: 1 or more*"])


def test_a_golden_is_the_same_to_a_millionth(project):
    pytester, run = project
    pytester.makepyfile(test_standing=STANDING.format(scale=1))
    run("--regen-all").assert_outcomes(passed=1)
    content = json.loads((pytester.path / "test_standing" / "test_standing.json").read_text())
    assert list(content["cases"]) == ["step 4", "step 8", "step 12", "step 16", "step 20"]
    run().assert_outcomes(passed=1)
    pytester.makepyfile(test_standing=STANDING.format(scale=1.0001))
    changed = run()
    changed.assert_outcomes(failed=1)
    changed.stdout.fnmatch_lines(["*step 4*qvel*moved*", "* more"])


def test_one_test_with_two_checks_names_the_second(project):
    pytester, run = project
    body = 'def test_two(stability_regression):\n    for name in {names}:\n        stability_regression.check({{"a": 1}}, basename=name)\n'
    pytester.makepyfile(test_two=body.format(names=(None, None)))
    run("--regen-all").stdout.fnmatch_lines(["*share the baseline test_two.json; give one a basename*"])
    pytester.makepyfile(test_two=body.format(names=(None, "other")))
    run("--regen-all").assert_outcomes(passed=1)
    assert {path.name for path in (pytester.path / "test_two").iterdir()} == {"test_two.json", "other.json"}


@pytest.mark.parametrize("order", [("rival", PLUGIN), (PLUGIN, "rival")])
def test_options_are_shared_with_a_plugin_that_has_them_too(project, order):
    pytester, run = project
    pytester.syspathinsert()
    pytester.makepyfile(
        rival="def pytest_addoption(parser):\n"
        "    group = parser.getgroup('regressions')\n"
        "    for name in ('--force-regen', '--regen-all'):\n"
        "        group.addoption(name, action='store_true', default=False, help='theirs')\n"
    )
    baseline = walk(pytester)
    run("--regen-all", plugins=order).assert_outcomes(passed=1)
    assert baseline.is_file()
    run(plugins=order).assert_outcomes(passed=1)


def test_help_names_the_options(project):
    _, run = project
    run("--help").stdout.fnmatch_lines(["*--stability-seeds=N*", "*--force-regen*", "*--regen-all*"])


def test_an_installation_brings_the_plugin_and_pytest_loads_it_once():
    """The entry point has the module's own name, so that `-p` of the same name and the entry point are one plugin."""
    project = tomllib.loads((Path(__file__).resolve().parents[2] / "pyproject.toml").read_text())["project"]
    assert project["entry-points"]["pytest11"] == {PLUGIN: PLUGIN}
    assert not [name for name in project["dependencies"] if name.startswith("pytest")]
