"""Pushes and kicks from outside, for robustness tests; reported as assist in every result."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.errors import SettingError
from simprep.physics.bodies import SceneBody
from simprep.random_seed import checked_seed

KICK_EVERY_S = (1.0, 3.0)
KICK_MPS = (0.5, 0.5, 0.2)
KICK_RADPS = (0.52, 0.52, 0.78)
"""Random kicks that robot learners train with: time between two [s], largest change of the root's velocity (forward or
back, sideways, up or down) [m/s], and of its spin (roll, pitch, yaw) [rad/s]."""


@dataclass(frozen=True)
class Push:
    """An external force on one body.

    Attributes:
        body: name of the segment in the scene: `pelvis` of a single body, `a_pelvis` of several.
        start: time of its beginning [s].
        duration: how long [s].
        force: (x, y, z) in the world frame, at the segment's COM [N].

    Raises:
        SettingError: a time that is no number, a duration that is not above 0, or a force that is not three numbers.
    """

    body: str
    start: float
    duration: float
    force: tuple[float, float, float]

    def __post_init__(self) -> None:
        if not (np.isfinite(self.start) and 0 < self.duration < np.inf):
            raise SettingError(f"push at {self.start} s for {self.duration} s; valid: a time, and a duration above 0")
        _check_vector("push: force", self.force)


@dataclass(frozen=True)
class Kick:
    """A sudden change of a root's velocity, by which the whole body changes its own.

    Attributes:
        time: when [s].
        velocity: (x, y, z) added, in the world frame [m/s].
        spin: (x, y, z) added, in the root's frame [rad/s].
        body: number of the body in the scene.

    Raises:
        SettingError: a time that is no number, or a change that is not three numbers.
    """

    time: float
    velocity: tuple[float, float, float]
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    body: int = 0

    def __post_init__(self) -> None:
        if not np.isfinite(self.time):
            raise SettingError(f"kick at {self.time} s; valid: a number")
        _check_vector("kick: velocity", self.velocity)
        _check_vector("kick: spin", self.spin)


def random_kicks(seed: int, duration: float, body: int = 0) -> tuple[Kick, ...]:
    """Kicks at random times, `KICK_EVERY_S` apart, of random directions and sizes up to `KICK_MPS` and `KICK_RADPS`.

    Args:
        seed: of the random numbers.
        duration: no kick is later [s].
        body: who is kicked.

    Raises:
        SettingError: a seed that is no whole number from 0 on, or a duration that is no number.
    """
    if not np.isfinite(duration):
        raise SettingError(f"kicks for {duration} s; valid: a number")
    rng = np.random.default_rng(checked_seed(seed))
    kicks, time = [], float(rng.uniform(*KICK_EVERY_S))
    while time < duration:
        velocity, spin = ((rng.uniform(-1, 1, 3) * most).tolist() for most in (KICK_MPS, KICK_RADPS))
        kicks.append(Kick(time, tuple(velocity), tuple(spin), body))
        time += float(rng.uniform(*KICK_EVERY_S))
    return tuple(kicks)


class PushApplier:
    """Applies pushes and kicks at their times.

    Attributes:
        largest: force so far [N].
        kick_mps: largest change of a root's velocity so far [m/s].
        kick_radps: largest change of its spin so far [rad/s].

    Raises:
        SettingError: a push on an unknown segment, or a kick of an unknown body.
    """

    def __init__(
        self, model: mujoco.MjModel, pushes: tuple[Push, ...], bodies: Sequence[SceneBody], kicks: tuple[Kick, ...] = ()
    ) -> None:
        self._model = model
        self._pushes = [(push, _body_id(model, push.body)) for push in pushes]
        for kick in kicks:
            if not 0 <= kick.body < len(bodies):
                raise SettingError(f"kick of body {kick.body}; valid: 0 to {len(bodies) - 1}")
        self._kicks = sorted(kicks, key=lambda kick: kick.time, reverse=True)
        self._bodies = bodies
        self.largest = self.kick_mps = self.kick_radps = 0.0

    def add(self, push: Push) -> None:
        """One more push; SettingError for an unknown segment."""
        self._pushes.append((push, _body_id(self._model, push.body)))

    def apply(self, data: mujoco.MjData) -> None:
        """Set the external forces of the coming step, and change velocities."""
        for _, body in self._pushes:
            data.xfrc_applied[body] = 0.0
        self._pushes = [one for one in self._pushes if data.time < one[0].start + one[0].duration]
        for push, body in self._pushes:
            if push.start <= data.time < push.start + push.duration:
                data.xfrc_applied[body, :3] += push.force
                self.largest = max(self.largest, float(np.linalg.norm(push.force)))
        while self._kicks and self._kicks[-1].time <= data.time:
            kick = self._kicks.pop()
            root = data.qvel[self._bodies[kick.body].qvel][:6]
            root[:3] += kick.velocity
            root[3:] += kick.spin
            self.kick_mps = max(self.kick_mps, float(np.linalg.norm(kick.velocity)))
            self.kick_radps = max(self.kick_radps, float(np.linalg.norm(kick.spin)))


def _check_vector(what: str, vector: Sequence[float]) -> None:
    if np.shape(vector) != (3,) or not np.isfinite(vector).all():
        raise SettingError(f"{what} {vector}; valid: three numbers, x y z")


def _body_id(model: mujoco.MjModel, name: str) -> int:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if index < 0:
        raise SettingError(
            f"push on unknown body {name!r}; valid: {', '.join(model.body(i).name for i in range(1, model.nbody))}"
        )
    return int(index)
