"""The gate on simprep itself: shipped baselines hold without a fault, and six faults do not get past them.

Ensembles under `mpc` take minutes: `scripts/gate_study.py` runs them, and 20 re-runs without a fault.
"""

from pathlib import Path

import pytest

from gating.checks import GOLDEN_STEPS, GOLDENS, before_physics
from gating.faults import FAULTS, NO_FAULT
from simprep.regression.baseline import read_baseline
from simprep.regression.compare import compare
from simprep.regression.environment import here
from simprep.regression.measured import cases_of, numbers
from simprep.regression.states import states_of

SHIPPED = Path(__file__).with_suffix("")
BEFORE_PHYSICS = "test_before_physics"


def golden_name(name):
    return f"test_states_{name}_"


def failures(baseline, cases, strict):
    found = compare(here(cases), read_baseline(SHIPPED / f"{baseline}.json"), strict)
    return {row.metric for row in found.failures}


def test_before_physics(stability_regression):
    stability_regression.check(before_physics(NO_FAULT))


@pytest.mark.parametrize("name", GOLDENS)
def test_states(name, stability_regression):
    stability_regression.golden(GOLDENS[name](NO_FAULT), steps=GOLDEN_STEPS[name])


@pytest.mark.parametrize(
    ("fault", "metric"),
    [
        ("optimiser off", "prepared_com_cos_mm"),
        ("COM off by 2 cm", "residual_torque_p95_nm"),
        ("frame rate misread", "duration_s"),
    ],
)
def test_metrics_before_physics_show(fault, metric):
    cases = cases_of([(BEFORE_PHYSICS, 0, numbers(before_physics(FAULTS[fault])))])
    assert metric in failures(BEFORE_PHYSICS, cases, strict=False)


@pytest.mark.parametrize(
    ("fault", "run"),
    [
        ("kp -20 %", "walking"),
        ("ankle limit -30 %", "landing"),
        ("friction -40 %", "slipping"),
        ("COM off by 2 cm", "walking"),
        ("frame rate misread", "walking"),
    ],
)
def test_states_show(fault, run):
    found = failures(golden_name(run), states_of(GOLDENS[run](FAULTS[fault]), GOLDEN_STEPS[run]), strict=True)
    assert len(found) > 20
