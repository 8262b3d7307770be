"""The planner names its contacts with the floor instead of looking for them: the same ones, with the same parameters."""

from typing import Any

import mujoco
import numpy as np
import pytest

from simprep.humanoid_model import humanoid
from simprep.physics.planner import build_planner
from simprep.physics.step_timers import without_step_timers
from simprep.primitive_robot import primitive_robot
from simprep.scene import Obstacle, SceneSettings, build_scene

OBSTACLES = (
    Obstacle("box", (0.3, 0.0, 0.3), (0.2, 0.2, 0.3)),
    Obstacle("ball", (-0.3, 0.0, 0.1), (0.11, 0.11, 0.11), ball=True, mass=0.4),
    Obstacle("pad", (-0.3, 0.4, 1.0), (0.2, 0.2, 0.2), soft=True),
)
SCENES = {
    "one body": SceneSettings(),
    "slippery floor": SceneSettings(friction=0.6),
    "rough floor": SceneSettings(friction=1.3),
    "two bodies": SceneSettings(bodies=(humanoid(), humanoid())),
    "objects": SceneSettings(obstacles=OBSTACLES),
    "robot": SceneSettings(bodies=(primitive_robot(),)),
}


def floor_contacts(model: mujoco.MjModel, data: mujoco.MjData) -> list[tuple[Any, ...]]:
    rows = []
    for contact in data.contact[: data.ncon]:
        names = [model.geom(geom).name for geom in contact.geom]
        if "floor" in names:
            other = contact.geom[1 - names.index("floor")]
            parameters = np.concatenate([contact.solref, contact.solimp, contact.friction, [contact.dist]])
            rows.append((model.body(model.geom_bodyid[other]).name, int(contact.dim), *np.round(parameters, 9)))
    return sorted(rows)


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_contacts_with_the_floor_are_those_of_the_world(scene: SceneSettings) -> None:
    world = build_scene(scene)
    planner = build_planner(world, scene, 1 / 96)
    rng, model, seen = np.random.default_rng(0), planner.model, 0
    full, reduced = mujoco.MjData(world), mujoco.MjData(model)
    for _ in range(60):
        full.qpos[:] = world.qpos0
        for body in planner.bodies:
            first = planner.qpos[body.qpos.start]
            full.qpos[first : first + 2] += rng.normal(0, 0.3, 2)
            full.qpos[first + 2] -= rng.uniform(0, 0.9)
            turn = rng.normal(size=4) + np.eye(4)[0] * 2
            full.qpos[first + 3 : first + 7] = turn / np.linalg.norm(turn)
        reduced.qpos[:] = full.qpos[planner.qpos]
        mujoco.mj_forward(world, full)
        mujoco.mj_forward(model, reduced)
        expected = floor_contacts(world, full)
        assert floor_contacts(model, reduced) == expected
        seen += len(expected)
    assert seen > 100


def test_a_step_without_timers_is_the_same_step() -> None:
    model = build_scene()
    states = []
    for timed in (True, False, True):
        data = mujoco.MjData(model)
        if timed:
            mujoco.mj_step(model, data, nstep=100)
        else:
            with without_step_timers():
                mujoco.mj_step(model, data, nstep=100)
        states.append((data.qpos.copy(), data.timer[mujoco.mjtTimer.mjTIMER_STEP].duration))
    np.testing.assert_array_equal(states[0][0], states[1][0])
    assert min(states[0][1], states[2][1]) > 0  # the clock is back
