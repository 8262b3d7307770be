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
from simprep.physics.fighters import Fighter, fighter_of_scene
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
        controls: indices of its actuators among the world's.
        hinges: indices into `HINGES` of the hinges that each humanoid keeps.
        dofs: indices into the qvel of one full humanoid that each keeps.
        fighters: where each humanoid's quantities are in the reduced model.
        fused: model ids of the fixed bodies whose posture is copied from the world at every plan.
    """

    model: Any
    qpos: NDArray[np.intp]
    qvel: NDArray[np.intp]
    controls: NDArray[np.intp]
    hinges: NDArray[np.intp]
    dofs: NDArray[np.intp]
    fighters: tuple[Fighter, ...]
    fused: tuple[int, ...]

    def fused_orientations(self, data: Any) -> Iterator[tuple[int, NDArray[np.float64]]]:
        """Orientation relative to its parent of each fixed body in the world's present state.

        Args:
            data: mujoco.MjData of the world (its body ids are the same).

        Yields:
            (model body id, (4,) quaternion wxyz).
        """
        inverse, relative = np.zeros(4), np.zeros(4)
        for body in self.fused:
            mujoco.mju_negQuat(inverse, data.xquat[self.model.body_parentid[body]])
            mujoco.mju_mulQuat(relative, inverse, data.xquat[body])
            yield body, relative


def build_planner(scene: SceneSettings, timestep: float) -> Planner:
    """Planner model of a scene.

    Args:
        scene: the simulated world, with one humanoid or two.
        timestep: step of the planner [s].
    """
    spec = scene_spec(replace(scene, timestep=timestep))
    for part in [*spec.actuators, *spec.joints]:
        if part.name.endswith(FIXED_ENDINGS):
            spec.delete(part)
    model = spec.compile()
    kept = np.array([index for index, name in enumerate(HINGES) if not name.endswith(FIXED_ENDINGS)], dtype=np.intp)
    dofs = np.append(np.arange(6), 6 + kept)
    numbers = range(len(scene.bodies))
    world = [fighter_of_scene(number) for number in numbers]
    fused = [body for body in range(model.nbody) if model.body(body).name.endswith(_FUSED_BODIES)]
    return Planner(
        model=model,
        qpos=np.concatenate([fighter.qpos.start + np.append(np.arange(7), 7 + kept) for fighter in world]),
        qvel=np.concatenate([fighter.qvel.start + dofs for fighter in world]),
        controls=np.concatenate([fighter.controls.start + kept for fighter in world]),
        hinges=kept,
        dofs=dofs,
        fighters=tuple(fighter_of_scene(number, len(kept)) for number in numbers),
        fused=tuple(fused),
    )
