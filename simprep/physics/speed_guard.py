"""Motors that do not turn faster than they can: servo targets limited so that no step ends above the largest speed.

What a drive's speed limiter does: it knows speed, acceleration and torque, and so by how much less torque would keep the
joints at their largest speeds. Its motors push by that much less, or brake, with no more torque than they have. Joints of a
chain swing each other, so they are looked at together.
"""

from collections.abc import Sequence

import mujoco
import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.character import SPEED_SHARE
from simprep.physics.bodies import SceneBody

ROUNDS = 5
"""How often joints are added that would be too fast once others are slowed."""


class SpeedGuard:
    """Keeps the joints of bodies that have `velocity_limits` within `SPEED_SHARE` of these; other bodies are left alone.

    Args:
        model: of the simulated world.
        bodies: its bodies.
    """

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[SceneBody]) -> None:
        self._model, self._dt = model, float(model.opt.timestep)
        self._limited = [body for body in bodies if body.character.velocity_limits]
        self._dofs = [body.qvel.start + body.joint_qvel for body in self._limited]
        self._torque = [model.actuator_forcerange[body.controls, 1] for body in self._limited]
        self._most = [
            SPEED_SHARE * np.array(body.character.velocity_limits)[body.joint_qvel - 6] for body in self._limited
        ]

    def limit(self, targets: FloatArray, data: mujoco.MjData) -> FloatArray:
        """Servo targets (controls,) of all bodies, changed where joints would pass their largest speed [rad].

        Args:
            targets: as the controller wants them [rad].
            data: the state, with the accelerations and torques of the last step.
        """
        for body, dofs, torque, most in zip(self._limited, self._dofs, self._torque, self._most):
            speed = data.qvel[dofs]
            at = data.qpos[body.qpos][body.joint_qpos]
            kp, kd = body.character.gains.T
            wanted = np.clip(kp * (targets[body.controls] - at) - kd * speed, -torque, torque)
            allowed = wanted
            for acceleration in (data.qacc, data.qacc_smooth):  # contacts push as in the last step; they let go
                allowed = allowed + self._less(data, acceleration, dofs, allowed, torque, most)
            if (allowed != wanted).any():
                targets = targets.copy()
                changed = at + (allowed + kd * speed) / kp
                targets[body.controls] = np.where(allowed != wanted, changed, targets[body.controls])
        return targets

    def _less(
        self,
        data: mujoco.MjData,
        acceleration: FloatArray,
        dofs: IndexArray,
        wanted: FloatArray,
        torque: FloatArray,
        most: FloatArray,
    ) -> FloatArray:
        """Change of the motors' torques (joints,), against the motion, that keeps the joints at their speeds [N m].

        Args:
            data: the state.
            acceleration: (nv,) in the last step, by all that acts but what the motors change [rad/s^2].
            dofs: (joints,) entries of the joints in it.
            wanted: (joints,) torques [N m].
            torque: (joints,) largest ones [N m].
            most: (joints,) largest speeds [rad/s].
        """
        model, dt, speed = self._model, self._dt, data.qvel[dofs]
        change = np.zeros((1, model.nv))
        change[0, dofs] = wanted - data.qfrc_actuator[dofs]
        mujoco.mj_solveM(model, data, change, change)
        coming = speed + dt * (acceleration[dofs] + change[0, dofs])
        less, then = np.zeros(len(dofs)), coming
        slowed = np.zeros(len(dofs), dtype=bool)
        for _ in range(ROUNDS):
            fast = np.abs(then) > most * (1 + 1e-9)
            if not (fast & ~slowed).any():
                break
            slowed |= fast
            which = np.flatnonzero(slowed)
            response = np.zeros((len(which), model.nv))
            response[np.arange(len(which)), dofs[which]] = 1.0
            mujoco.mj_solveM(model, data, response, response)  # acceleration for each torque of 1 N m
            response = response[:, dofs]
            sign = np.sign(coming[which])
            needed = np.linalg.solve(response[:, which].T, (sign * most[which] - coming[which]) / dt)
            needed = sign * np.minimum(sign * needed, 0.0)  # it brakes; it never pushes
            less[which] = np.clip(wanted[which] + needed, -torque[which], torque[which]) - wanted[which]
            then = coming + dt * (response.T @ less[which])
        return less
