"""Controllers of a user's own, by the documented protocol."""

from typing import Any

import mujoco
import numpy as np
import pytest

from simprep.errors import SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.motion.motion import Motion
from simprep.physics.controller import ControlTask, PdController
from simprep.physics.simulate import simulate, track


def standing(seconds: float = 0.25) -> Motion:
    qpos = np.repeat(humanoid().standing_qpos.copy()[None], round(60 * seconds) + 1, axis=0)
    return Motion(qpos, 60.0, np.ones((len(qpos), 2), dtype=bool), name="standing")


class Noisy:
    """Servos to the reference's angles with noise from the seed; counts what it sees."""

    name = "noisy"

    def __init__(self, task: ControlTask) -> None:
        self._task, self._rng = task, np.random.default_rng(task.seed)
        self._steps: list[int] = []

    def target(self, step: int, data: mujoco.MjData) -> np.ndarray:
        self._steps.append(step)
        assert data.time == pytest.approx(step * self._task.model.opt.timestep)
        out = np.empty(self._task.model.nu)
        for body, reference in zip(self._task.bodies, self._task.references):
            out[body.controls] = reference.qpos[step, body.joint_qpos]
        return out + 0.01 * self._rng.standard_normal(len(out))

    def settings(self) -> dict[str, Any]:
        return {"noise": np.float64(0.01), "steps": len(self._steps)}


def test_a_controller_of_ones_own_moves_one_body_or_many() -> None:
    run = track(standing(), Noisy, seed=7)
    assert (run.controller, run.seed, run.end) == ("noisy", 7, "done")
    assert run.settings == {"noise": 0.01, "steps": run.steps}
    noise = run.target - run.reference_qpos[:-1, 7:]
    assert 0.009 < noise.std() < 0.011
    np.testing.assert_array_equal(noise, track(standing(), Noisy, seed=7).target - run.reference_qpos[:-1, 7:])
    assert np.abs(noise - (track(standing(), Noisy, seed=8).target - run.reference_qpos[:-1, 7:])).max() > 0
    other = standing()
    far = Motion(other.qpos + np.eye(44)[0] * 2.0, 60.0, other.contacts)
    both = simulate((other, far), Noisy, seed=7)
    assert both.settings["steps"] == both.steps
    assert len(both.bodies) == 2


def test_a_function_makes_one_too_and_the_named_ones_are_of_the_same_kind() -> None:
    named = track(standing(), "pd")
    given = track(standing(), lambda task: PdController(task))
    np.testing.assert_array_equal(named.qpos, given.qpos)
    assert given.controller == "pd"


def test_what_is_no_controller_is_refused() -> None:
    class Short(Noisy):
        def target(self, step: int, data: mujoco.MjData) -> np.ndarray:
            return np.zeros(3)

    with pytest.raises(SettingError, match=r"controller 'noisy': target\(\) returned shape \(3,\); valid: \(37,\)"):
        track(standing(), Short)
    with pytest.raises(SettingError, match=r"controller 3; valid: pd, balance, mpc, or a class or function"):
        track(standing(), 3)  # type: ignore[arg-type]
    with pytest.raises(UnknownNameError, match="unknown controller 'lqr'; valid: pd, balance, mpc"):
        track(standing(), "lqr")


def test_targets_that_are_no_numbers_end_the_run() -> None:
    class Broken(Noisy):
        def target(self, step: int, data: mujoco.MjData) -> np.ndarray:
            return super().target(step, data) * (np.nan if step == 10 else 1.0)

    run = track(standing(), Broken)
    assert (run.end, run.steps) == ("diverged", 10)
    assert np.isfinite(run.qpos).all()
