"""What a body did, step by step, in arrays that grow."""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.physics.bodies import SceneBody
from simprep.physics.ground import LEAST_LOAD_N, GroundReader


class BodyRecorder:
    """States, controls and floor contacts of one body, named as in `simprep.physics.run.BodyRun`.

    Args:
        steps: how many to expect; the arrays grow where there are more.
        model: of the simulated world.
        body: which body.
    """

    def __init__(self, steps: int, model: mujoco.MjModel, body: SceneBody) -> None:
        self.body, self.ground = body, GroundReader(model, body)
        joints = len(body.joint_names)
        self._states = {
            "qpos": np.zeros((steps + 1, body.qpos.stop - body.qpos.start)),
            "qvel": np.zeros((steps + 1, body.qvel.stop - body.qvel.start)),
        }
        self._steps: dict[str, NDArray[Any]] = {
            "target": np.zeros((steps, joints)),
            "torque": np.zeros((steps, joints)),
            "ground_force": np.zeros((steps, 3)),
            "foot_force": np.zeros((steps, 2, 3)),
            "centre_of_pressure": np.full((steps, 2), np.nan),
            "foot_contact": np.zeros((steps, 2), dtype=bool),
            "penetration": np.zeros(steps),
        }

    def state(self, index: int, data: mujoco.MjData) -> None:
        """Note the state of an index."""
        if index == len(self._states["qpos"]):
            _double(self._states)
        states = self._states
        states["qpos"][index], states["qvel"][index] = data.qpos[self.body.qpos], data.qvel[self.body.qvel]

    def step(self, step: int, data: mujoco.MjData) -> None:
        """Note what acted during a step; `data` is taken after it."""
        if step == len(self._steps["target"]):
            _double(self._steps)
        rows, controls = self._steps, self.body.controls
        rows["target"][step], rows["torque"][step] = data.ctrl[controls], data.actuator_force[controls]
        reading = self.ground.read(data)
        rows["ground_force"][step] = reading.force
        rows["foot_force"][step] = reading.foot_force
        rows["centre_of_pressure"][step] = reading.centre_of_pressure
        rows["foot_contact"][step] = reading.foot_force[:, 2] > LEAST_LOAD_N
        rows["penetration"][step] = reading.penetration

    def arrays(self, taken: int) -> dict[str, NDArray[Any]]:
        """The first `taken` steps of what was noted, and one state more."""
        states = {name: rows[: taken + 1] for name, rows in self._states.items()}
        return {**states, **{name: rows[:taken] for name, rows in self._steps.items()}}


def _double(arrays: dict[str, NDArray[Any]]) -> None:
    for name, rows in arrays.items():
        arrays[name] = np.concatenate([rows, np.zeros_like(rows)])
