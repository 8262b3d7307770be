"""The yardstick is what it was; nothing here measures time."""

import hashlib

import mujoco
import numpy as np
import pytest

from bench import in_yardsticks
from simprep.physics.yardstick import YARDSTICK, YARDSTICK_BATCH, YARDSTICK_ROLLOUT, Yardstick

SHA256 = "a7ac17962795122e4ea69fa7595d059d180d313874b0e132b386a971cd9173b6"


def test_the_yardstick_is_frozen():
    text = YARDSTICK.read_bytes().replace(b"\r\n", b"\n")
    assert hashlib.sha256(text).hexdigest() == SHA256, (
        "never edit simprep/physics/yardstick.xml: its times would not compare"
    )


def test_the_yardstick_has_the_sizes_of_the_planner_it_was_made_from():
    model = Yardstick().model
    assert (model.nq, model.nv, model.nu) == (33, 32, 26)  # 37 hinges without the planner's eleven, and a free root
    assert (model.nbody, model.ngeom, model.npair) == (18, 30, 27)
    assert model.opt.timestep == pytest.approx(1 / 120, rel=1e-6)
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert model.body_mass.sum() == pytest.approx(75.0, abs=0.01)


def test_the_yardstick_steps_from_standing_without_warnings():
    yardstick = Yardstick()
    poses = yardstick.rollout()
    assert poses.shape == (YARDSTICK_BATCH, YARDSTICK_ROLLOUT, yardstick.model.nq)
    assert np.isfinite(poses).all()
    assert (poses[:, -1, 2] > 0.9).all()  # it stands for the whole of a rollout ...
    assert np.abs(poses[0, -1, :3] - yardstick.model.qpos0[:3]).max() > 1e-4  # ... and is really simulated
    np.testing.assert_array_equal(poses, np.broadcast_to(poses[0], poses.shape))
    np.testing.assert_array_equal(yardstick.rollout(), poses)
    assert not yardstick.batch.warning[:, :, 1].any()


def test_numbers_become_multiples_of_the_yardstick():
    numbers = {"fight_fps": 500.0, "sim_steps_per_s_2": 1e5, "mpc_s_per_s": 1.2, "analysis_s": 60.0}
    assert in_yardsticks(numbers, 2.0) == {
        "fight_frames_per_yardstick": 1000.0,
        "sim_steps_per_yardstick_2": 2e5,
        "mpc_yardsticks": 0.6,
        "analysis_yardsticks": 30.0,
    }
