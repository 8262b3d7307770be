"""The equations of the inverse kinematics for many poses at once: errors, their derivatives, points near the floor.

The columns of a derivative are the character's degrees of freedom. The arms' rows move the arms alone; where nothing else
moves them either, the equations fall apart into three systems, which are solved by themselves.
"""

from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.character import ROLES, SIDES, Character
from simprep.geoms import bearing_points
from simprep.motion.rotations import multiply_quat
from simprep.motion.targets import ORIENTED

PLACE = {role: slice(3 * number, 3 * number + 3) for number, role in enumerate(ROLES)}
"""Rows of a body's position in the stacked error."""
TURN = {
    ROLES[index]: slice(3 * (len(ROLES) + number), 3 * (len(ROLES) + number) + 3)
    for number, index in enumerate(ORIENTED)
}
"""Rows of a body's rotation vector, world axes: the first two tilt it, the third is its heading."""
ROWS = 3 * (len(ROLES) + len(ORIENTED))
BONES = np.array([ROLES.index(f"{side}_{part}") for side in SIDES for part in ("forearm", "hand")])
"""Roles whose position counts from the role before them: the arms' bones by their directions."""
HANDS = np.array([ROLES.index(f"{side}_hand") for side in SIDES])


@dataclass(frozen=True)
class Pose:
    """What the equations need of B poses.

    Attributes:
        xpos: (B, bodies, 3) origins of the model's bodies [m].
        xmat: (B, bodies, 3, 3) their orientations.
        anchors: (B, C, 3) points that the turning degrees of freedom turn about: the root's three, then the hinges [m].
        axes: (B, C, 3) their axes.
        geoms: (B, G, 3) centres of the geoms [m].
        geom_mats: (B, G, 3, 3) their orientations.
    """

    xpos: FloatArray
    xmat: FloatArray
    anchors: FloatArray
    axes: FloatArray
    geoms: FloatArray
    geom_mats: FloatArray


@dataclass(frozen=True)
class System:
    """Rows and columns that are solved together, and where the derivative has entries.

    Attributes:
        rows: rows of the stacked error.
        columns: degrees of freedom.
        place: of each entry triple of a position: its role, its turning column, and its reference (an anchor, or a body
            after them), then where it belongs in the derivative: first row and column.
        turn: of each entry triple of an orientation: its turning column, first row and column.
        shift: rows and columns of the root's translation.
    """

    rows: IndexArray
    columns: IndexArray
    place: tuple[IndexArray, IndexArray, IndexArray, IndexArray, IndexArray]
    turn: tuple[IndexArray, IndexArray, IndexArray]
    shift: tuple[IndexArray, IndexArray]


class Equations:
    """Errors and derivatives of a character's poses.

    Args:
        character: the body.
    """

    def __init__(self, character: Character) -> None:
        self.model = character.model
        data = self.data = mujoco.MjData(self.model)
        self.bodies, self.above, self.systems = structure(character)
        self.turned = self.bodies[list(ORIENTED)]
        self._flat = [
            part.reshape(-1)
            for part in (data.xpos, data.xmat, data.xanchor, data.xaxis, data.geom_xpos, data.geom_xmat)
        ]
        self._ends = np.cumsum([0, *(part.size for part in self._flat)]).tolist()

    def poses(self, qpos: FloatArray) -> Pose:
        """Kinematics of poses (B, nq)."""
        rows = np.empty((len(qpos), self._ends[-1]))
        model, data = self.model, self.data
        own = data.qpos
        for pose, row in zip(qpos, rows):
            own[:] = pose
            mujoco.mj_kinematics(model, data)
            np.concatenate(self._flat, out=row)
        parts = [rows[:, first:after] for first, after in zip(self._ends, self._ends[1:])]
        count = len(qpos)
        xpos, xmat = parts[0].reshape(count, -1, 3), parts[1].reshape(count, -1, 3, 3)
        anchors, axes = parts[2].reshape(count, -1, 3), parts[3].reshape(count, -1, 3)
        # the root turns about its own axes
        root = np.broadcast_to(xpos[:, 1:2], (count, 3, 3))
        anchors = np.concatenate([root, anchors[:, 1:]], axis=1)
        axes = np.concatenate([np.swapaxes(xmat[:, 1], -1, -2), axes[:, 1:]], axis=1)
        return Pose(xpos, xmat, anchors, axes, parts[4].reshape(count, -1, 3), parts[5].reshape(count, -1, 3, 3))

    def errors(self, pose: Pose, positions: FloatArray, orientations: FloatArray) -> FloatArray:
        """Current minus target (B, ROWS): positions (of the arms' bones: vectors) [m], then rotation vectors [rad].

        Args:
            pose: the poses.
            positions: (B, 17, 3) of the roles [m].
            orientations: (B, 5, 3, 3) of the roles in `ORIENTED`.
        """
        off = pose.xpos[:, self.bodies] - positions
        off[:, BONES] -= off[:, BONES - 1]
        turn = rotation_vectors(pose.xmat[:, self.turned] @ np.swapaxes(orientations, -1, -2))
        return np.concatenate([off.reshape(len(off), -1), turn.reshape(len(off), -1)], axis=1)

    def derivative(self, pose: Pose, system: System) -> FloatArray:
        """Derivative of a system's errors (B, rows, columns); that of a rotation vector is exact at the target."""
        out = np.zeros((len(pose.xpos), len(system.rows), len(system.columns)))
        roles, turning, reference, row, column = system.place
        points = np.concatenate([pose.anchors, pose.xpos[:, self.bodies]], axis=1)
        arms = points[:, pose.anchors.shape[1] + roles] - points[:, reference]
        axes = pose.axes[:, turning]
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            out[:, row + i, column] = axes[..., j] * arms[..., k] - axes[..., k] * arms[..., j]
        turning, row, column = system.turn
        for i in range(3):
            out[:, row + i, column] = pose.axes[:, turning, i]
        out[(slice(None), *system.shift)] = 1.0
        return out


class Floor:
    """Keeps colliding points above the floor: J_z dq >= -height for every point near it.

    Args:
        equations: of the character.
        near: points higher than this are left out [m].
    """

    def __init__(self, equations: Equations, near: float = 0.06) -> None:
        model = equations.model
        points = [
            (geom, *one) for geom in np.flatnonzero(model.geom_contype).tolist() for one in bearing_points(model, geom)
        ]
        owner, centres, radii = zip(*points)
        self.near = near
        self.owner, self.centres, self.radius = np.array(owner), np.array(centres), np.array(radii)
        self.above = equations.above[model.geom_bodyid[self.owner]]  # (P, C)

    def rows(self, pose: Pose) -> tuple[IndexArray, FloatArray, FloatArray]:
        """Pose (K,), row (K, nv) and height (K,) [m] of every point near the floor, pose by pose: row dq >= -height."""
        turn = pose.geom_mats[:, self.owner, 2]  # (B, P, 3)
        height = pose.geoms[:, self.owner, 2] + (turn * self.centres).sum(axis=-1) - self.radius
        which, point = np.nonzero(height < self.near)
        owner = self.owner[point]
        offset = np.einsum("kij,kj->ki", pose.geom_mats[which, owner], self.centres[point])
        centre = pose.geoms[which, owner] + offset
        arm = centre[:, None, :2] - pose.anchors[which, :, :2]
        axes = pose.axes[which]
        out = np.zeros((len(which), 3 + axes.shape[1]))
        out[:, 2] = 1.0
        out[:, 3:] = (axes[..., 0] * arm[..., 1] - axes[..., 1] * arm[..., 0]) * self.above[point]
        return which, out, height[which, point]


def rotation_vectors(matrices: FloatArray) -> FloatArray:
    """Rotation vectors (..., 3) of matrices (..., 3, 3), short of half a turn; faster than scipy's."""
    entries = matrices.reshape(*matrices.shape[:-2], 9)
    axis = entries[..., [7, 2, 3]] - entries[..., [5, 6, 1]]  # 2 sin(angle) times the axis
    sine = np.sqrt(np.add.reduce(axis * axis, axis=-1)) / 2
    angle = np.arctan2(sine, (np.add.reduce(entries[..., ::4], axis=-1) - 1) / 2)
    return np.asarray(axis * (angle / np.maximum(2 * sine, 1e-12))[..., None])


def integrated(qpos: FloatArray, change: FloatArray) -> FloatArray:
    """Poses (B, nq) moved by (B, nv): `mj_integratePos` for many."""
    out = np.empty_like(qpos)
    out[:, :3] = qpos[:, :3] + change[:, :3]
    out[:, 7:] = qpos[:, 7:] + change[:, 6:]
    half = np.linalg.norm(change[:, 3:6], axis=1, keepdims=True) / 2
    turn = np.concatenate([np.cos(half), change[:, 3:6] / 2 * np.sinc(half / np.pi)], axis=1)
    quat = multiply_quat(qpos[:, 3:7], turn)
    out[:, 3:7] = quat / np.linalg.norm(quat, axis=1, keepdims=True)
    return out


def _columns_above(model: mujoco.MjModel) -> BoolArray:
    """Which turning degrees of freedom move each body (bodies, C): the root's three, then the hinges."""
    out = np.zeros((model.nbody, model.nv - 3), dtype=bool)
    for body in range(1, model.nbody):
        out[body] = out[model.body_parentid[body]]
        out[body, :3] = True
        for joint in range(1, model.njnt):
            out[body, model.jnt_dofadr[joint] - 3] |= model.jnt_bodyid[joint] == body
    return out


@lru_cache(maxsize=16)
def structure(character: Character) -> tuple[IndexArray, BoolArray, tuple[System, ...]]:
    """Bodies of the roles (17,), which turning degrees of freedom move each body (bodies, C), and the systems."""
    model = character.model
    bodies = np.array([1 + character.segment(role if character.has(role) else "pelvis") for role in ROLES])
    above = _columns_above(model)
    mask = np.ones((ROWS, model.nv), dtype=bool)
    arms = [6 + character.joint_indices(character.group(f"{side}_arm")) for side in SIDES]
    everything = np.arange(model.nv)
    rows = []
    for side, own in zip(SIDES, arms):
        parts = (PLACE[f"{side}_forearm"], PLACE[f"{side}_hand"], TURN[f"{side}_hand"])
        rows.append(np.concatenate([np.arange(part.start, part.stop) for part in parts]))
        mask[np.ix_(rows[-1], np.setdiff1d(everything, own))] = False
    whole = [(np.arange(ROWS), everything)]
    trunk_and_legs = (
        np.setdiff1d(np.arange(ROWS), np.concatenate(rows)), np.setdiff1d(everything, np.concatenate(arms)),
    )  # fmt: skip
    apart = [trunk_and_legs, *zip(rows, arms)] if _shoulders_are_points(character, np.concatenate(arms)) else whole
    return bodies, above, tuple(_system(bodies, above, mask, *part) for part in apart)


def _shoulders_are_points(character: Character, arms: IndexArray) -> bool:
    """Whether the arms' degrees of freedom leave the origins of the upper arms where they are."""
    model = character.model
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0
    data.qpos[7:] += 0.3
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    jacobian = np.zeros((3, model.nv))
    for side in SIDES:
        mujoco.mj_jacBody(model, data, jacobian, None, 1 + character.segment(f"{side}_upper_arm"))
        if np.abs(jacobian[:, arms]).max() > 1e-12:
            return False
    return True


def _system(bodies: IndexArray, above: BoolArray, mask: BoolArray, rows: IndexArray, columns: IndexArray) -> System:
    row_of = {int(row): number for number, row in enumerate(rows)}
    column_of = {int(column): number for number, column in enumerate(columns)}
    turning = above.shape[1]
    place: list[tuple[int, ...]] = []
    turn: list[tuple[int, ...]] = []
    shift: list[tuple[int, ...]] = []
    for number, role in enumerate(ROLES):
        first = PLACE[role].start
        if first not in row_of:
            continue
        for axis in range(3):
            if mask[first + axis, axis] and axis in column_of and number not in HANDS:
                shift.append((row_of[first + axis], column_of[axis]))
        for column in np.flatnonzero(above[bodies[number]]).tolist():
            if 3 + column not in column_of or not mask[first, 3 + column]:
                continue
            # a hand counts from its forearm: what turns both turns the bone between them
            bone = number in HANDS and above[bodies[number - 1], column]
            place.append(
                (number, column, turning + number - 1 if bone else column, row_of[first], column_of[3 + column])
            )
    for body, (_, part) in zip(bodies[list(ORIENTED)], TURN.items()):
        if part.start in row_of:
            for column in np.flatnonzero(above[body]).tolist():
                if 3 + column in column_of and mask[part.start, 3 + column]:
                    turn.append((column, row_of[part.start], column_of[3 + column]))
    five = np.array(place, dtype=np.intp).reshape(-1, 5).T
    three = np.array(turn, dtype=np.intp).reshape(-1, 3).T
    two = np.array(shift, dtype=np.intp).reshape(-1, 2).T
    return System(
        rows, columns, (five[0], five[1], five[2], five[3], five[4]), (three[0], three[1], three[2]), (two[0], two[1])
    )
