"""What a controller is: something that turns the simulated state into servo targets. And the plain one, `pd`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from simprep.physics.fighters import Fighter, fighter_of_scene
from simprep.physics.reference import Reference


class Controller(Protocol):
    """Chooses servo targets at every simulation step; it never touches the state or applies forces."""

    name: str

    def target(self, step: int, data: Any) -> NDArray[np.float64]:
        """Servo targets for the coming step.

        Args:
            step: index of the current state in the reference.
            data: mujoco.MjData, read only.

        Returns:
            (37,) of one fighter, (74,) of two [rad].
        """
        ...

    def settings(self) -> dict[str, Any]:
        """Configuration, for the record."""
        ...


def feedforward_targets(reference: Reference, model: Any, fighter: Fighter) -> NDArray[np.float64]:
    """Servo targets that reproduce the reference's velocity: q* + (kd / kp) q̇*.

    A servo with torque kp (u - q) - kd q̇ brakes a joint that moves as it should unless the target leads by this much.

    Args:
        reference: what to track, N + 1 steps.
        model: mujoco.MjModel of the scene.
        fighter: who tracks it.

    Returns:
        (N + 1, 37) [rad]. Entry k is the target during step k, taken at its end.
    """
    kp = model.actuator_gainprm[fighter.controls, 0]
    kd = -model.actuator_biasprm[fighter.controls, 2]
    targets = reference.qpos[:, 7:] + (kd / kp) * reference.qvel[:, 6:]
    return np.concatenate([targets[1:], targets[-1:]])


@dataclass
class PdController:
    """Joint servos to the reference, nothing else: the papers' servo and an honest lower bound."""

    references: Sequence[Reference]
    model: Any
    name: str = "pd"

    def __post_init__(self) -> None:
        targets = [
            feedforward_targets(reference, self.model, fighter_of_scene(number))
            for number, reference in enumerate(self.references)
        ]
        self._targets = np.concatenate(targets, axis=1)

    def target(self, step: int, data: Any) -> NDArray[np.float64]:
        """Servo targets for the coming step (see `Controller.target`)."""
        return np.asarray(self._targets[step])

    def settings(self) -> dict[str, Any]:
        """Configuration, for the record."""
        return {"feedforward": "velocity"}
