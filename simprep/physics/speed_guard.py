"""Motors that stop pushing at their largest speed: servo targets limited so that torque falls off, then brakes."""

from collections.abc import Sequence

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.physics.bodies import SceneBody

TAPER = 0.1
"""Share of the largest speed over which the torque that speeds a joint up falls to zero; as far beyond, it brakes fully.

It is more where full torque would change the speed by more in one step.
"""


class SpeedGuard:
    """Keeps the motors of bodies that have `velocity_limits` from turning faster; others are left alone.

    Args:
        model: of the simulated world.
        bodies: its bodies.
    """

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[SceneBody]) -> None:
        self._limited = [body for body in bodies if body.character.velocity_limits]
        self._torque = [model.actuator_forcerange[body.controls, 1] for body in self._limited]
        self._most = [np.array(body.character.velocity_limits) for body in self._limited]
        dt = float(model.opt.timestep)
        self._width = [
            np.maximum(TAPER * most, torque * dt / model.dof_M0[body.qvel][body.joint_qvel])
            for body, torque, most in zip(self._limited, self._torque, self._most)
        ]

    def limit(self, targets: FloatArray, data: mujoco.MjData) -> FloatArray:
        """Servo targets (controls,) of all bodies, changed for joints near their largest speed [rad].

        Args:
            targets: as the controller wants them [rad].
            data: the state.
        """
        for body, torque, most, width in zip(self._limited, self._torque, self._most, self._width):
            velocity = data.qvel[body.qvel][body.joint_qvel]
            fast = np.flatnonzero(np.abs(velocity) > most - width)
            if not len(fast):
                continue
            targets = targets.copy()
            own = targets[body.controls]
            kp, kd = body.character.gains[fast].T
            at, speed = data.qpos[body.qpos][body.joint_qpos][fast], velocity[fast]
            share = np.clip((most[fast] - np.abs(speed)) / width[fast], -1.0, 1.0)
            bound = at + (np.sign(speed) * share * torque[fast] + kd * speed) / kp
            own[fast] = np.where(speed > 0, np.minimum(own[fast], bound), np.maximum(own[fast], bound))
            targets[body.controls] = own
        return targets
