"""Identified dynamics of a tracked body: pushed runs, the laws found, and what they predict."""

import numpy as np
import pytest

from simprep.errors import MotionError, SettingError
from simprep.library import library_motion
from simprep.metrics.com_laws import fit_com_laws
from simprep.metrics.sparse_law import HELD_OUT_R2
from simprep.motion.edit import cut
from simprep.study.identified import (
    ExcitationSettings,
    identify,
    laws_record,
    predicted_pushes,
    pushed_runs,
    random_pushes,
)
from simprep.study.push_limits import PushSettings

SETTINGS = ExcitationSettings(runs=3, every_s=0.4, least_n=5, largest_n=20)


@pytest.fixture(scope="module")
def standing():
    motion = library_motion("stand")
    return cut(motion, 0, round(1.6 * motion.fps))


@pytest.fixture(scope="module")
def signals(standing):
    return pushed_runs(standing, SETTINGS, "pd")


def test_the_plant_of_a_simulated_body_is_a_pendulum_with_spin(standing, signals):
    assert len(signals) == 3
    laws = fit_com_laws(signals, np.random.default_rng(0), resamples=20)
    for law in laws.plant:
        assert law.held_out_r2 > 0.95
        assert law.held_out_r2 >= law.baseline_r2 - 0.01
        assert law.of("lever") == pytest.approx(laws.expected_per_s2, rel=0.1)
        assert law.of("spin") == pytest.approx(1.0, abs=0.25)
    assert not any(law.reported for law in laws.loop)  # `pd` is about to fall: there is no law by which it comes back
    record = laws_record(laws)
    for kind in ("plant", "loop"):
        for law in record[kind].values():
            assert ("terms" in law) == law["reported"] == (law["held_out_r2"] >= HELD_OUT_R2)
    rows = predicted_pushes(standing, laws, signals, PushSettings(0.8, (0.0, 90.0, 180.0)))
    assert [row["direction_deg"] for row in rows] == [0.0, 90.0, 180.0]
    for row in rows:
        assert row["capture_n"] == pytest.approx(row["pendulum_n"], rel=0.1)
        assert row["steps_n"] > row["capture_n"] > 50
        assert row["closed_loop_n"] is None or row["closed_loop_n"] <= 1.05 * row["capture_n"]
    assert rows[0]["capture_n"] > rows[2]["capture_n"]  # more foot ahead of the ankle than behind it


def test_pushes_are_those_of_the_seed_and_bad_settings_are_refused(signals):
    one, two = (random_pushes(SETTINGS, 3.0, np.random.default_rng(4)) for _ in range(2))
    assert one == two
    assert all(5 <= np.hypot(*push.force[:2]) <= 20 for push in one)
    assert [push.start for push in one] == pytest.approx(np.arange(0.4, 2.6, 0.4))
    with pytest.raises(SettingError, match="3 or more"):
        ExcitationSettings(runs=2)
    with pytest.raises(SettingError, match="duration_s < every_s"):
        ExcitationSettings(every_s=0.05)
    with pytest.raises(MotionError, match="2 usable runs"):
        identify(signals[:2])
