"""A simulated world that differs from what controllers know: other masses, friction and motors, late and noisy states."""

from collections import deque
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import SettingError
from simprep.physics.bodies import SceneBody
from simprep.scene import SceneSettings, build_scene

LONGEST_DELAY_S = 0.2
"""Oldest states that a controller may be told [s]."""
_NOISE = {"position": 0.01, "orientation": 0.02, "hinges": 0.01, "velocity": 0.1, "spin": 0.2, "hinge_velocity": 0.5}
"""Standard deviations at noise 1 [m, rad, rad, m/s, rad/s, rad/s]: what robot learners usually train with."""


@dataclass(frozen=True)
class Mismatch:
    """How the simulated world differs from the controller's model of it; the defaults are no difference.

    Attributes:
        mass_scale: factor on masses and inertias of all bodies.
        friction: sliding friction coefficient of the floor; None: the scene's.
        strength: factor on the motors' torque limits.
        delay_s: age of the state that the controller is told, rounded to whole steps [s].
        noise: of that state, as a multiple of 1 cm and 0.02 rad of the root, 0.01 rad of each hinge, and 0.1 m/s,
            0.2 rad/s and 0.5 rad/s of their velocities (standard deviations of normal numbers).

    Raises:
        SettingError: a number out of range.
    """

    mass_scale: float = 1.0
    friction: float | None = None
    strength: float = 1.0
    delay_s: float = 0.0
    noise: float = 0.0

    def __post_init__(self) -> None:
        friction = 1.0 if self.friction is None else self.friction
        for name, value, low, high in (
            ("mass_scale", self.mass_scale, 0.2, 5.0),
            ("friction", friction, 0.01, 5.0),
            ("strength", self.strength, 0.05, 10.0),
            ("delay_s", self.delay_s, 0.0, LONGEST_DELAY_S),
            ("noise", self.noise, 0.0, 20.0),
        ):
            if not low <= value <= high:
                raise SettingError(f"mismatch: {name} {value}; valid: {low:g} to {high:g}")

    def record(self) -> dict[str, float | None]:
        """In JSON's types, for the record."""
        return asdict(self)

    def world(self, scene: SceneSettings) -> mujoco.MjModel:
        """Model of the simulated world; without a difference the same as `build_scene(scene)`."""
        model = build_scene(scene if self.friction is None else replace(scene, friction=self.friction))
        if self.mass_scale != 1.0:
            model.body_mass[:] *= self.mass_scale
            model.body_inertia[:] *= self.mass_scale
            mujoco.mj_setConst(model, mujoco.MjData(model))
        model.actuator_forcerange[:] *= self.strength
        return model


class Observer:
    """What a controller is told: the state of some steps ago, with noise.

    Args:
        model: the controller's model of the world.
        bodies: the scene's.
        mismatch: age and noise.
        rng: of the noise.
    """

    def __init__(
        self, model: mujoco.MjModel, bodies: Sequence[SceneBody], mismatch: Mismatch, rng: np.random.Generator
    ) -> None:
        self.delay = round(mismatch.delay_s / model.opt.timestep)
        self._model, self._bodies, self._noise, self._rng = model, bodies, mismatch.noise, rng
        self._told = mujoco.MjData(model) if self.delay or self._noise else None
        self._states: deque[tuple[FloatArray, FloatArray, float]] = deque(maxlen=self.delay + 1)

    def observe(self, data: mujoco.MjData) -> mujoco.MjData:
        """The state as a controller is told it, at the present step; to be called at every step."""
        told = self._told
        if told is None:
            return data
        self._states.append((data.qpos.copy(), data.qvel.copy(), float(data.time)))
        told.qpos[:], told.qvel[:], told.time = self._states[0]
        for body in self._bodies if self._noise else ():
            self._disturb(told.qpos[body.qpos], told.qvel[body.qvel])
        mujoco.mj_kinematics(self._model, told)
        return told

    def _disturb(self, qpos: FloatArray, qvel: FloatArray) -> None:
        scale = {name: self._noise * value for name, value in _NOISE.items()}
        draw = self._rng.normal
        qpos[:3] += draw(0, scale["position"], 3)
        mujoco.mju_quatIntegrate(qpos[3:7], draw(0, scale["orientation"], 3), 1.0)
        qpos[7:] += draw(0, scale["hinges"], len(qpos) - 7)
        qvel[:3] += draw(0, scale["velocity"], 3)
        qvel[3:6] += draw(0, scale["spin"], 3)
        qvel[6:] += draw(0, scale["hinge_velocity"], len(qvel) - 6)
