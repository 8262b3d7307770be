"""The planner's cheaper model of the body: wrists, forearm rotation, neck and head do not move within a look-ahead.

They are light and near their servo targets, so a look-ahead of less than a second loses little without them, and a
simulation step gets a third cheaper. The simulated world always has all 37 hinges.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from simprep.humanoid import HINGES
from simprep.scene import SceneSettings, scene_spec

FIXED_ENDINGS = (
    "wrist_flexion", "wrist_deviation", "forearm_pronation",
    "neck_flexion", "neck_bending", "neck_rotation", "head_flexion", "head_rotation",
)  # fmt: skip
_FUSED_BODIES = ("neck", "head")


@dataclass(frozen=True)
class Planner:
    """A reduced model and which entries of the full state it has.

    Attributes:
        model: mujoco.MjModel.
        qpos: indices into the full qpos.
        qvel: indices into the full qvel.
        hinges: indices into `HINGES` of its actuators.
        fused: model ids of the fixed bodies whose posture is copied from the world at every plan.
    """

    model: Any
    qpos: NDArray[np.intp]
    qvel: NDArray[np.intp]
    hinges: NDArray[np.intp]
    fused: tuple[int, ...]

    def fused_orientations(self, data: Any) -> Iterator[tuple[int, NDArray[np.float64]]]:
        """Orientation relative to its parent of each fixed body in the world's present state.

        Args:
            data: mujoco.MjData of the world (one humanoid; body ids are the same).

        Yields:
            (model body id, (4,) quaternion wxyz).
        """
        inverse, relative = np.zeros(4), np.zeros(4)
        for body in self.fused:
            mujoco.mju_negQuat(inverse, data.xquat[self.model.body_parentid[body]])
            mujoco.mju_mulQuat(relative, inverse, data.xquat[body])
            yield body, relative


def build_planner(scene: SceneSettings, timestep: float) -> Planner:
    """Planner model of a scene with one humanoid.

    Args:
        scene: the simulated world.
        timestep: step of the planner [s].
    """
    spec = scene_spec(replace(scene, timestep=timestep))
    kept = [index for index, name in enumerate(HINGES) if not name.endswith(FIXED_ENDINGS)]
    names = {HINGES[index] for index in kept}
    for part in [*spec.actuators, *(joint for joint in spec.joints if joint.name != "root")]:
        if part.name not in names:
            spec.delete(part)
    model = spec.compile()
    return Planner(
        model=model,
        qpos=np.array([*range(7), *(7 + index for index in kept)], dtype=np.intp),
        qvel=np.array([*range(6), *(6 + index for index in kept)], dtype=np.intp),
        hinges=np.array(kept, dtype=np.intp),
        fused=tuple(model.body(name).id for name in _FUSED_BODIES),
    )
