"""A controller of your own for `track`: servos that lean the ankles against a fall, compared with plain ones.

    python examples/own_controller.py

The ankle strategy (Horak and Nashner 1986): a standing body that sways forward presses its toes down. Plain joint
servos (`pd`) do not know where the body is and let it tip over. The protocol is in `simprep/physics/controller.py`.
"""

import mujoco
import numpy as np

import simprep
from simprep.physics.controller import ControlTask, PdController

ANGLE_PER_METRE = 2.0  # [rad/m]
ANGLE_PER_SPEED = 0.5  # [rad s/m]


class AnkleStrategy:
    """Plain servos, with the ankles' targets corrected by how far the pelvis is ahead of where it should be."""

    name = "ankle_strategy"

    def __init__(self, task: ControlTask) -> None:
        self._reference = task.references[0]
        self._servos = PdController(task)
        joints = task.bodies[0].joint_names
        self._ankles = [joints.index(f"{side}_ankle_dorsiflexion") for side in ("left", "right")]

    def target(self, step: int, data: mujoco.MjData) -> np.ndarray:
        """Servo targets of the coming step [rad]; the body looks along x."""
        ahead = data.qpos[0] - self._reference.qpos[step, 0]
        faster = data.qvel[0] - self._reference.qvel[step, 0]
        targets = self._servos.target(step, data).copy()
        targets[self._ankles] -= ANGLE_PER_METRE * ahead + ANGLE_PER_SPEED * faster
        return targets

    def settings(self) -> dict[str, object]:
        """What the run's record says of this controller."""
        return {"angle_per_metre": ANGLE_PER_METRE, "angle_per_speed": ANGLE_PER_SPEED}


stand = simprep.library_motion("stand")
for controller in ("pd", AnkleStrategy):
    run = simprep.track(stand, controller=controller)
    print(f"{run.controller:15} {run.end} after {run.end_s:.2f} of {stand.duration:.2f} s")
