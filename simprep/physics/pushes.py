"""External forces for robustness tests; reported as assist in every result."""

from dataclasses import dataclass

import mujoco
import numpy as np

from simprep.errors import SettingError


@dataclass(frozen=True)
class Push:
    """An external force on one body.

    Attributes:
        body: name of the segment in the scene: `pelvis` of a single body, `a_pelvis` of several.
        start: time of its beginning [s].
        duration: how long [s].
        force: (x, y, z) in the world frame, at the segment's COM [N].
    """

    body: str
    start: float
    duration: float
    force: tuple[float, float, float]


class PushApplier:
    """Applies pushes at their times.

    Raises:
        SettingError: a push on an unknown segment.
    """

    def __init__(self, model: mujoco.MjModel, pushes: tuple[Push, ...]) -> None:
        self._pushes = [(push, _body_id(model, push.body)) for push in pushes]
        self.largest = 0.0

    def apply(self, data: mujoco.MjData) -> None:
        """Set the external forces of the coming step."""
        for _, body in self._pushes:
            data.xfrc_applied[body] = 0.0
        for push, body in self._pushes:
            if push.start <= data.time < push.start + push.duration:
                data.xfrc_applied[body, :3] += push.force
                self.largest = max(self.largest, float(np.linalg.norm(push.force)))


def _body_id(model: mujoco.MjModel, name: str) -> int:
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if index < 0:
        raise SettingError(
            f"push on unknown body {name!r}; valid: {', '.join(model.body(i).name for i in range(1, model.nbody))}"
        )
    return int(index)
