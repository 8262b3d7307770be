"""Where a robot's joint centres are: of hip and shoulder, whose three axes rarely meet in one point, and of the rest."""

from collections.abc import Mapping

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.character import SIDES, Frame
from simprep.robots.description import RobotDescription

_BALLS = {"thigh": ("hip", "pelvis"), "upper_arm": ("shoulder", "thorax")}
_HINGED = {
    "shank": ("knee_flexion",), "foot": ("ankle_dorsiflexion", "ankle_inversion"), "forearm": ("elbow_flexion",),
    "hand": ("wrist_flexion", "wrist_deviation", "forearm_pronation"),
}  # fmt: skip
_TRUNK = {"abdomen": "lumbar", "thorax": "lumbar", "neck": "neck", "head": "head"}


def joint_centres(model: mujoco.MjModel, description: RobotDescription) -> Mapping[str, Frame]:
    """Frames of the roles (`Character.frames`), parallel to the world in the reference pose.

    A hip or shoulder is the point on its flexion axis right above knee or elbow, carried by pelvis or thorax: the limb then
    hangs down from it. Of several joints of an ankle, wrist or waist the last tells the centre. The pelvis is in the middle
    between the hips.

    Args:
        model: of `simprep.robots.model.build_robot`.
        description: what its parts are.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    at: dict[str, tuple[int, FloatArray]] = {}  # body and place in the world

    def joints(names: list[str]) -> list[int]:
        """Ids in model order of the joints of some movements, as far as there are any."""
        return sorted(model.joint(description.movements[name]).id for name in names if name in description.movements)

    for role, body in description.roles.items():
        number = model.body(body).id
        side, _, part = role.partition("_")
        if side not in SIDES:
            turns = joints([f"{_TRUNK.get(role)}_{turn}" for turn in ("flexion", "bending", "rotation")])
            turns = [one for one in turns if role != "abdomen" or model.jnt_bodyid[one] == number]
            at[role] = number, data.xanchor[turns[-1]] if turns else data.xpos[number]
        elif part in _BALLS:
            ball, carrier = _BALLS[part]
            named = joints([f"{side}_{ball}_{turn}" for turn in ("flexion", "abduction", "rotation")])
            if named:
                flexion = (joints([f"{side}_{ball}_flexion"]) or named)[0]
                below = joints([f"{side}_{'knee' if part == 'thigh' else 'elbow'}_flexion"]) or named[-1:]
                centre = nearest_point(
                    data.xanchor[flexion], data.xaxis[flexion], data.xanchor[below[0]], np.array([0.0, 0.0, 1.0])
                )
                at[role] = _carrier(model, description, carrier, named[0]), centre
            else:
                at[role] = number, data.xpos[number]
        else:
            turns = joints([f"{side}_{movement}" for movement in _HINGED[part]])
            at[role] = number, data.xanchor[turns[-1]] if turns else data.xpos[number]
    hips = (at["left_thigh"][1] + at["right_thigh"][1]) / 2
    at["pelvis"] = at["pelvis"][0], hips
    for role, (body, place) in description.frames.items():
        number = model.body(body).id
        at[role] = number, data.xpos[number] + data.xmat[number].reshape(3, 3) @ np.array(place)
    return {role: _in_body(model, data, *one) for role, one in at.items()}


def _carrier(model: mujoco.MjModel, description: RobotDescription, role: str, first: int) -> int:
    """The body of a role, or else the one that carries a limb's first joint."""
    return (
        int(model.body_parentid[model.jnt_bodyid[first]])
        if role not in description.roles
        else model.body(description.roles[role]).id
    )


def nearest_point(point: FloatArray, axis: FloatArray, other: FloatArray, other_axis: FloatArray) -> FloatArray:
    """Point (3,) on a line that is nearest to another one; the line's own point if they are parallel.

    Args:
        point: (3,) on the line.
        axis: (3,) its direction (unit).
        other: (3,) on the other line.
        other_axis: (3,) its direction (unit).
    """
    normal = np.cross(axis, other_axis)
    if normal @ normal < 0.01:
        return np.array(point)
    along = np.cross(other - point, other_axis) @ normal / (normal @ normal)
    return np.asarray(point + along * axis)


def _in_body(model: mujoco.MjModel, data: mujoco.MjData, body: int, place: FloatArray) -> Frame:
    x, y, z = ((place - data.xpos[body]) @ data.xmat[body].reshape(3, 3)).tolist()
    quat = np.zeros(4)
    mujoco.mju_negQuat(quat, data.xquat[body])
    w, i, j, k = quat.tolist()
    return model.body(body).name, (x, y, z), (w, i, j, k)
