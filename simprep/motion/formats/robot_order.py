"""In which order a file has a robot's joints and bodies: by names, by the bodies that it stores, or as documented.

Simulators count a robot's parts depth first (MuJoCo: a whole leg, then the next) or breadth first (Isaac: both hips,
then what hangs on them). A file read in the other order maps every angle to a wrong joint without an error. Forward
kinematics tells: only in the right order do the joint angles give the bodies that the file stores.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from simprep.arrays import FloatArray, IndexArray
from simprep.character import Character
from simprep.errors import MotionFileError
from simprep.motion.formats.robot_clip import RobotClip, StoredBodies, wxyz
from simprep.motion.kinematics import forward_kinematics

SAMPLES = 40
"""Frames that are compared."""
SAME_M = 0.005
"""Bodies nearer than this on average are the same: models of one robot differ by some millimetres [m]."""
OTHER_ROBOT_M = 0.05
"""Bodies farther than this on average are another robot's [m]."""
TURN_WEIGHT_M = 0.1
"""An angle of 1 rad between two bodies counts as this distance; some bodies share their origin [m]."""


_WRISTS_OF_29 = (*19 * (False,), *3 * (True,), *4 * (False,), *3 * (True,))
"""Which of 29 joints (legs, waist, arms) are the wrists that the 23 lack."""
KNOWN_SHARE = 1.5
"""A known order is taken if it fits at most this many times worse than the best order of all."""


@dataclass(frozen=True)
class Order:
    """How a file's columns belong to a character.

    Attributes:
        joints: (J,) joint of the character of each column of the file's angles; -1 for a column that it lacks.
        quat: (T, 4) root orientation, wxyz; the clip's, unless the stored bodies show that its components are swapped.
        notes: how it was found.
    """

    joints: IndexArray
    quat: FloatArray
    notes: tuple[str, ...]


def breadth_first(character: Character) -> tuple[IndexArray, IndexArray]:
    """Joints (J,) and segments (S,) of a character breadth first: children in the order of their parents."""
    model = character.model
    children: dict[int, list[int]] = {}
    for body in range(2, model.nbody):
        children.setdefault(int(model.body_parentid[body]), []).append(body)
    queue = [1]
    for body in queue:  # grows while it is read
        queue += children.get(body, [])
    segments = np.array(queue, dtype=np.intp) - 1
    joints = [
        joint - 1
        for body in queue
        for joint in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
        if joint > 0
    ]
    return np.array(joints, dtype=np.intp), segments


def find_order(clip: RobotClip, character: Character) -> Order:
    """Which joint each column of a clip is.

    Names decide where the file has them. Else the stored bodies decide between depth first and breadth first. Without
    either the order is the model's, as documented for these formats; a warning says if the other fits the limits better.

    Args:
        clip: as read.
        character: whose motion it is.

    Raises:
        MotionFileError: unknown names, a number of joints that does not fit, or bodies of another robot.
    """
    orders = (
        {"by name": _by_name(clip, clip.joints, character)}
        if clip.joints is not None
        else joint_orders(clip, character)
    )
    if clip.bodies is not None:
        return _by_bodies(clip, clip.bodies, character, orders)
    name, joints = next(iter(orders.items()))
    notes = [f"joints taken {name}" if clip.joints is not None else f"joints taken in the order of the model ({name})"]
    if len(orders) > 1:
        beyond = {key: limit_excess(clip.angles, index, character) for key, index in orders.items()}
        other = list(orders)[1]
        if beyond[name] > 0.02 and beyond[other] < 0.2 * beyond[name]:
            notes.append(
                f"joint order doubtful: {name}, angles are beyond their limits by {np.degrees(beyond[name]):.1f} deg on "
                f"average, {other} by {np.degrees(beyond[other]):.1f}"
            )
    return Order(joints, clip.quat, tuple(notes))


def joint_orders(clip: RobotClip, character: Character) -> dict[str, IndexArray]:
    """Possible orders of a file's unnamed joints, by name, the usual one first.

    A file may leave out the wrists: the 23 of 29 joints of ASAP and PBHC. A character of those 23 takes a file of 29.

    Raises:
        MotionFileError: a number of joints that fits neither.
    """
    count, joints = clip.angles.shape[1], len(character.joints)
    broad = breadth_first(character)[0]
    wristless = np.array([index for index, name in enumerate(character.joints) if "wrist" not in name], dtype=np.intp)
    if count == joints:
        return {"depth first": np.arange(joints, dtype=np.intp), "breadth first": broad}
    if count == len(wristless):
        return {
            "depth first, without wrists": wristless,
            "breadth first, without wrists": broad[np.isin(broad, wristless)],
        }
    if (count, joints) == (len(_WRISTS_OF_29), _WRISTS_OF_29.count(False)):
        columns = np.full(count, -1, dtype=np.intp)
        columns[~np.array(_WRISTS_OF_29)] = np.arange(joints)
        return {"depth first, wrists left out": columns}
    fewer = f" or {len(wristless)} without wrists" if len(wristless) < joints else ""
    raise MotionFileError(clip.path, f"{count} joints; valid: {joints}{fewer} of {character.name}")


def limit_excess(angles: FloatArray, joints: IndexArray, character: Character) -> float:
    """Mean distance of angles (T, J) from the ranges of the joints (J,) they are taken for, 0 within [rad]."""
    low, high = character.limits[joints].T
    return float(np.maximum(np.maximum(low - angles, angles - high), 0.0)[:, joints >= 0].mean())


def _plain(name: str) -> str:
    return name.removesuffix("_joint").removesuffix("_link").removesuffix("_dof")


def _by_name(clip: RobotClip, names: tuple[str, ...], character: Character) -> IndexArray:
    if len(names) != clip.angles.shape[1]:
        raise MotionFileError(clip.path, f"{len(names)} joint names for {clip.angles.shape[1]} columns")
    known = {_plain(name): index for index, name in enumerate(character.joints)}
    unknown = [name for name in names if _plain(name) not in known]
    if unknown:
        raise MotionFileError(
            clip.path, f"joint {unknown[0]!r} is none of {character.name}; valid: {', '.join(character.joints)}"
        )
    joints = np.array([known[_plain(name)] for name in names], dtype=np.intp)
    if len(set(joints.tolist())) < len(joints):
        raise MotionFileError(clip.path, "a joint name stands for two columns")
    return joints


def _by_bodies(clip: RobotClip, bodies: StoredBodies, character: Character, orders: dict[str, IndexArray]) -> Order:
    rows = np.unique(np.linspace(0, len(clip.angles) - 1, SAMPLES).astype(int))
    stored = StoredBodies(
        bodies.positions[rows], None if bodies.quats is None else bodies.quats[rows], bodies.names, bodies.in_root
    )

    def matched(clip: RobotClip, stored: StoredBodies) -> list[tuple[float, str, str, IndexArray]]:
        return [
            (*_match(_distances(clip, rows, stored, character, joints), stored, character), name, joints)
            for name, joints in orders.items()
        ]

    found, swapped = matched(clip, stored), False
    if min(one[0] for one in found) > OTHER_ROBOT_M and stored.quats is not None:
        other = replace(clip, quat=wxyz(clip.quat))
        others_found = matched(other, replace(stored, quats=wxyz(stored.quats)))
        if swapped := min(one[0] for one in others_found) < OTHER_ROBOT_M:
            clip, found = other, others_found
    residual, order, name, joints = min(found, key=lambda one: one[0])
    if residual > OTHER_ROBOT_M:
        raise MotionFileError(
            clip.path,
            f"the stored bodies are {100 * residual:.0f} cm from those of {character.name} on average: of another robot",
        )
    others = ", ".join(f"{1e3 * one[0]:.1f} mm {one[2]}" for one in found if one[2] != name)
    notes = [
        f"joints {name}, bodies {order}: the stored bodies are {1e3 * residual:.1f} mm from those of the joint angles"
        + (f" ({others})" if others else "")
    ]
    if swapped:
        notes.append("quaternions are xyzw, not the format's wxyz, as the stored bodies show: read as xyzw")
    if residual > SAME_M:
        notes.append(f"the stored bodies differ by {1e3 * residual:.0f} mm on average: another version of the robot?")
    elif (
        ("breadth" in name) != ("breadth" in order)
        and not (name + order).count("own")
        and "by name" not in (name, order)
    ):
        notes.append(
            "joints and bodies are in different orders: a program that takes both as one order maps targets wrongly"
        )
    return Order(joints, clip.quat, tuple(notes))


def _distances(
    clip: RobotClip, rows: IndexArray, stored: StoredBodies, character: Character, joints: IndexArray
) -> FloatArray:
    """Mean distance of every stored body from every segment (B, S), turns counted too [m]."""
    qpos = np.tile(character.standing_qpos, (len(rows), 1))
    qpos[:, 7 + joints[joints >= 0]] = clip.angles[rows][:, joints >= 0]
    if stored.in_root:
        qpos[:, :7] = 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
    else:
        quat = clip.quat[rows]
        qpos[:, :3], qpos[:, 3:7] = clip.position[rows], quat / np.linalg.norm(quat, axis=1, keepdims=True)
    kinematics = forward_kinematics(qpos, character)
    cost = np.linalg.norm(stored.positions[:, :, None] - kinematics.xpos[:, None], axis=-1)
    if stored.quats is not None:
        norms = np.linalg.norm(stored.quats, axis=-1, keepdims=True)
        quats = stored.quats / np.where(norms > 0, norms, 1.0)
        share = np.abs(np.einsum("tbi,tsi->tbs", quats, kinematics.xquat))
        cost = cost + TURN_WEIGHT_M * 2 * np.arccos(np.clip(share, 0.0, 1.0))
    return np.asarray(cost.mean(axis=0))


def _match(cost: FloatArray, stored: StoredBodies, character: Character) -> tuple[float, str]:
    """Mean cost of the best order of bodies, and its name."""
    count, segments = cost.shape
    rows = np.arange(count)
    if stored.names is not None:
        known = {_plain(name): index for index, name in enumerate(character.segments)}
        pairs = [(row, known[_plain(name)]) for row, name in enumerate(stored.names) if _plain(name) in known]
        if pairs:
            return float(np.mean([cost[pair] for pair in pairs])), "by name"
    options = []
    if count == segments:
        options = [("depth first", rows), ("breadth first", breadth_first(character)[1])]
    scored = [(float(cost[rows, order].mean()), name) for name, order in options]
    row, column = linear_sum_assignment(cost)
    free = float(cost[row, column].mean())
    # bodies at one place make several orders equally good: the known one is meant
    if scored and min(scored)[0] < max(SAME_M, KNOWN_SHARE * free):
        return min(scored)
    return free, f"in an order of their own ({count} of {segments})"
