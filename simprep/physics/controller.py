"""What a controller is: it turns the simulated state into servo targets. Also the plain one, `pd`.

A controller is any class or function that takes a `ControlTask` and returns an object with the members of `Controller`:

    class Still:
        name = "still"

        def __init__(self, task: ControlTask) -> None:
            self._targets = np.zeros(task.model.nu)

        def target(self, step: int, data: mujoco.MjData) -> np.ndarray:
            return self._targets

        def settings(self) -> dict[str, object]:
            return {}

    run = simprep.track(walk, controller=Still)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.physics.bodies import SceneBody
from simprep.physics.reference import Reference
from simprep.scene import SceneSettings


@dataclass(frozen=True)
class ControlTask:
    """What a controller is asked to do.

    Attributes:
        model: of the simulated world; read only. A step lasts `model.opt.timestep` [s].
        scene: what the model was built from.
        bodies: where each body's state and actuators are in the model.
        references: what each body is to track, one state for each step.
        seed: for the controller's random generator; the same seed must give the same targets.
        delay: age of the states that the controller is told, in steps.
    """

    model: mujoco.MjModel
    scene: SceneSettings
    bodies: tuple[SceneBody, ...]
    references: tuple[Reference, ...]
    seed: int
    delay: int = 0


class Controller(Protocol):
    """Chooses servo targets at every simulation step. It never touches the state or applies forces.

    A controller that simulates may have an attribute `simulation_s`: the computing time of that so far [s]. One that knows
    better than the motion's first frames how fast the bodies start has a method `start(data)`, called once, with the bodies
    on their references: it returns the velocities (nv,) to start with, and states in its settings what it changed. One that can
    track a motion that is still being made (`simprep.physics.tracker`) has a method `follow(references, shift)`: from
    now on these are the references, and indices in them are greater by `shift` than in the ones before.
    """

    name: str
    """For tables, files and the record."""

    def target(self, step: int, data: mujoco.MjData) -> FloatArray:
        """Servo targets for the coming step, (model.nu,) joint angles of all bodies' actuators [rad].

        Args:
            step: index of the current state in the references.
            data: the state, as old as `ControlTask.delay` says; read only.
        """
        ...

    def settings(self) -> dict[str, Any]:
        """Configuration in JSON's types, for the record; read when the run has ended."""
        ...


class ControllerFactory(Protocol):
    """Makes the controller of one run: a class, or a function."""

    def __call__(self, task: ControlTask, /) -> Controller:
        """Make the controller of a task."""
        ...


def feedforward_targets(reference: Reference, body: SceneBody) -> FloatArray:
    """Servo targets (N + 1, controls) that reproduce the reference's velocity, q* + (kd / kp) q̇* [rad].

    A servo with torque kp (u - q) - kd q̇ brakes its joint unless the target leads by this much. Entry k is the target
    during step k, taken at its end.

    Args:
        reference: what to track, N + 1 steps.
        body: who tracks it.
    """
    kp, kd = body.character.gains.T
    targets = reference.qpos[:, body.joint_qpos] + (kd / kp) * reference.qvel[:, body.joint_qvel]
    return np.concatenate([targets[1:], targets[-1:]])


class PdController:
    """Joint servos to the reference, nothing else: the papers' servo, a lower bound for other controllers."""

    name = "pd"

    def __init__(self, task: ControlTask) -> None:
        self._bodies = task.bodies
        self.follow(task.references, 0)

    def follow(self, references: Sequence[Reference], shift: int) -> None:
        """Track other references from now on (see `Controller`)."""
        del shift  # nothing is remembered from step to step
        targets = [feedforward_targets(one, body) for one, body in zip(references, self._bodies)]
        self._targets = np.concatenate(targets, axis=1)

    def target(self, step: int, data: mujoco.MjData) -> FloatArray:
        """Servo targets for the coming step (see `Controller.target`)."""
        return np.asarray(self._targets[step])

    def settings(self) -> dict[str, Any]:
        """Configuration, for the record."""
        return {"feedforward": "velocity"}
