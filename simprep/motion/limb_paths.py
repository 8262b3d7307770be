"""Joint angles of arms and legs over a whole clip, from the directions of their two bones.

A limb here is three hinges of shoulder or hip and one of elbow or knee. Two bone directions have two solutions in
closed form; in the second, the first hinge is half a turn away, as for an arm raised in a V. Where limits forbid both,
the nearest poses are found from several starts. Dynamic programming chooses among the solutions by error and
continuity. A last fit of all frames at once settles what directions leave open, such as the twist of a straight limb.
The frame rate does not matter: errors are integrated over time, changes are weighed by speed, and sudden turns are
solved at a higher rate.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import solveh_banded
from scipy.ndimage import maximum_filter1d
from scipy.spatial.transform import Rotation

from simprep.arrays import BoolArray, FloatArray, IndexArray
from simprep.character import Character
from simprep.motion.rotations import cross

SMOOTHNESS_S = 0.004
"""Weight of hinge speed [s]: a sine of 20 rad/s loses 0.6 % of its amplitude."""
REST = 0.02
"""Weight of the hinge angles themselves: what nothing else decides goes to 0 within SMOOTHNESS_S / REST = 0.2 s."""
SWITCH = 5e-4
"""Price of a turn when branches are chosen [s rad]: half a turn is worth 13 degrees of error for 0.03 s."""
LEAST_WORTH = np.radians(5.0)
"""Smoothness may cost at most this error [rad]."""
LEAST_JUMP = 1.0
"""A hinge that turns by more than this between frames has changed its branch [rad]."""
TURNING_FPS = 120.0
"""Lowest frame rate at which limbs that change their branch are solved [1/s]."""
FAR = 0.3
"""A branch farther than this outside the limits is not searched if the other one is exact [rad]."""
EXACT = 2e-3
"""Smaller errors of direction count as none [rad]."""
UPRIGHT_AXIS = 1 - 1e-9
"""An axis whose largest component is less than this leans [1]."""
_EULER_ORDERS: dict[tuple[int, ...], Literal["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"]] = {
    (0, 1, 2): "XYZ", (0, 2, 1): "XZY", (1, 0, 2): "YXZ", (1, 2, 0): "YZX", (2, 0, 1): "ZXY", (2, 1, 0): "ZYX",
}  # fmt: skip
SETTLED = 1e-3
"""A fit that moves no hinge by more than this has settled [rad]."""


@dataclass(frozen=True)
class Limb:
    """Geometry of one limb. Angles count from the reference pose, in which limbs are straight and hang down.

    Attributes:
        joints: (4,) indices of its hinges among the character's joints, outwards.
        axes: (4, 3) axes of its hinges in the reference pose: about y, x and z in any order, then about y. They may lean.
        zero: (4,) angles of the reference pose [rad].
        low: (4,) lower limits [rad].
        high: (4,) upper limits [rad].
        upper: (3,) direction of the first bone at rest (unit).
        lower: (3,) direction of the second bone at rest (unit).
    """

    joints: IndexArray
    axes: FloatArray
    zero: FloatArray
    low: FloatArray
    high: FloatArray
    upper: FloatArray
    lower: FloatArray

    @classmethod
    def of_character(cls, character: Character, names: tuple[str, str, str]) -> "Limb":
        """A limb of a body.

        Args:
            character: the body.
            names: roles of the segments of the first bone, the second bone and the limb's end.
        """
        model = character.model
        side = names[0].partition("_")[0]
        group = character.group(f"{side}_leg" if names[0].endswith("thigh") else f"{side}_arm")
        joints = np.sort(character.joint_indices(group[:4]))
        zero = model.qpos0[7 + joints]
        low, high = model.jnt_range[1 + joints].T - zero
        bones = [character.rest_offset(name) for name in names[1:]]
        bones = [bone / np.linalg.norm(bone) for bone in bones]
        return cls(joints, character.reference_axes[joints], zero, low, high, bones[0], bones[1])

    @property
    def order(self) -> tuple[int, ...]:
        """The axis, 0 to 2, that each of the first three hinges turns about, or leans from."""
        return tuple(np.abs(self.axes[:3]).argmax(axis=1).tolist())

    @property
    def leans(self) -> bool:
        """Whether some hinge's axis is no coordinate axis."""
        return bool((np.abs(self.axes).max(axis=1) < UPRIGHT_AXIS).any())

    def directions(self, angles: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Bone directions upper and lower (..., 3), in the parent's frame, and the derivatives of both (..., 6, 4).

        Args:
            angles: (..., 4) hinge angles [rad].
        """
        shape = angles.shape[:-1]
        axes = np.empty((*shape, 4, 3))
        upper = np.empty((*shape, 3))
        columns: list[FloatArray] = []
        for hinge, (axis, columns) in enumerate(self._turning(angles)):
            axes[..., hinge, :] = axis
            if hinge == 2:
                upper = self.upper[0] * columns[0] + self.upper[1] * columns[1] + self.upper[2] * columns[2]
        lower = self.lower[0] * columns[0] + self.lower[1] * columns[1] + self.lower[2] * columns[2]
        jacobian = np.zeros((*shape, 6, 4))
        jacobian[..., :3, :3] = np.swapaxes(cross(axes[..., :3, :], upper[..., None, :]), -1, -2)
        jacobian[..., 3:, :] = np.swapaxes(cross(axes, lower[..., None, :]), -1, -2)
        return upper, lower, jacobian

    def orientation(self, angles: FloatArray) -> FloatArray:
        """Orientation (..., 3, 3) of the second bone in the parent's frame, at angles (..., 4) [rad]."""
        *_, (_, columns) = self._turning(angles)
        return np.stack(columns, axis=-1)

    def _turning(self, angles: FloatArray) -> Iterator[tuple[FloatArray, list[FloatArray]]]:
        """After each hinge: its axis (..., 3) and the three columns (..., 3) of the orientation."""
        columns = [np.broadcast_to(row, (*angles.shape[:-1], 3)) for row in np.eye(3)]
        cosine, sine = np.cos(angles)[..., None], np.sin(angles)[..., None]
        for hinge in range(4):
            axis = int(np.abs(self.axes[hinge]).argmax())
            if abs(self.axes[hinge, axis]) < UPRIGHT_AXIS:
                direction, columns = _turned_about(
                    self.axes[hinge], columns, cosine[..., hinge, :], sine[..., hinge, :]
                )
                yield direction, columns
                continue
            sign = float(self.axes[hinge, axis])
            a, b = (axis + 1) % 3, (axis + 2) % 3
            c, s = cosine[..., hinge, :], sign * sine[..., hinge, :]
            turned = list(columns)
            turned[a] = c * columns[a] + s * columns[b]
            turned[b] = c * columns[b] - s * columns[a]
            yield sign * columns[axis], turned
            columns = turned

    def residual(self, angles: FloatArray, wanted: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Difference to the wanted directions (..., 6), and its Jacobian (..., 6, 4)."""
        upper, lower, jacobian = self.directions(angles)
        return np.concatenate([upper, lower], axis=-1) - wanted, jacobian


def limb_path(limb: Limb, upper: FloatArray, lower: FloatArray, fps: float) -> FloatArray:
    """Hinge angles (T, 4) of a limb through a clip, within the limits [rad].

    Where limits force a change of branch and a smooth way would cost more than `LEAST_WORTH`, the path is cut: the limb
    turns over between two frames.

    Args:
        limb: its geometry.
        upper: (T, 3) direction of the first bone in the frame of the parent (unit).
        lower: (T, 3) direction of the second.
        fps: frames per second [1/s].
    """
    wanted = np.concatenate([upper, lower], axis=-1)
    chosen = _best_path(limb, candidates(limb, wanted), wanted, fps)
    links = np.ones(max(len(chosen) - 1, 0))
    fitted = smooth_path(limb, chosen, wanted, fps, links)
    stride = int(np.ceil(TURNING_FPS / fps - 1e-3))
    if stride > 1 and (np.abs(np.diff(fitted, axis=0))[:, [0, 1, 3]] > LEAST_JUMP).any():
        return limb_path(limb, _between(upper, stride), _between(lower, stride), stride * fps)[::stride]
    costly: BoolArray = np.greater(worst_angle(limb, fitted, wanted), worst_angle(limb, chosen, wanted) + LEAST_WORTH)
    if len(chosen) > 1 and costly.any():
        jump = np.abs(np.diff(chosen, axis=0))[:, [0, 1, 3]].max(axis=1)
        near = maximum_filter1d(costly, 2 * round(0.1 * fps) + 1)
        links[(jump > LEAST_JUMP) & (near[1:] | near[:-1])] = 0.0
        fitted = smooth_path(limb, chosen, wanted, fps, links)
    return fitted


def _between(directions: FloatArray, stride: int) -> FloatArray:
    """Directions (T, 3) with `stride` - 1 more between each two."""
    share = np.arange(stride)[:, None] / stride
    ways = directions[:-1, None] * (1 - share) + directions[1:, None] * share  # (T - 1, stride, 3)
    out = np.concatenate([ways.reshape(-1, 3), directions[-1:]])
    return np.asarray(out / np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-12))


def worst_angle(limb: Limb, angles: FloatArray, wanted: FloatArray) -> FloatArray:
    """Angle (...) between bone and wanted direction, the larger of both bones [rad]."""
    residual, _ = limb.residual(angles, wanted)
    chord = np.maximum(np.linalg.norm(residual[..., :3], axis=-1), np.linalg.norm(residual[..., 3:], axis=-1))
    return np.asarray(2 * np.arcsin(np.minimum(chord / 2, 1.0)))


def candidates(limb: Limb, wanted: FloatArray) -> FloatArray:
    """Hinge angles (T, 4, 4), within the limits, of poses that reach two bone directions or come near [rad].

    The four are two branches, each with its twist at the nearer and at the farther end of its range if outside it.

    Args:
        limb: its geometry.
        wanted: (T, 6) directions of both bones in the frame of the parent.
    """
    ahead, aside, up = wanted[:, :3].T
    out = np.empty((len(wanted), 4, 4))
    middle = (limb.low + limb.high) / 2
    signs = np.sign(limb.axes[range(3), limb.order])
    turn_about_z = limb.order.index(2)
    for branch in range(2):
        tilt = np.arcsin(np.clip(aside, -1, 1))
        swing = np.arctan2(-ahead, -up)
        if branch:
            tilt, swing = np.pi - tilt, swing + np.pi
        frame = _turn(np.array([0.0, 1.0, 0.0]), swing) @ _turn(np.array([1.0, 0.0, 0.0]), tilt)
        local = np.einsum("tji,tj->ti", frame, wanted[:, 3:])
        bent = 1.0 if middle[3] >= 0 else -1.0  # sign of a fold
        fold = -np.sign(limb.axes[3, 1]) * bent  # elbows fold forward, knees backward
        twist = np.arctan2(fold * local[:, 1], fold * local[:, 0])
        bend = np.arctan2(np.hypot(local[:, 0], local[:, 1]), -local[:, 2])
        hinges = [swing, tilt, twist] if limb.order == (1, 0, 2) else _in_order(limb, frame, twist, branch)
        angles = np.stack([hinges[0] * signs[0], hinges[1] * signs[1], hinges[2] * signs[2], bend * bent], axis=-1)
        angles[:, :3] = middle[:3] + (angles[:, :3] - middle[:3] + np.pi) % (2 * np.pi) - np.pi
        inside = np.clip(angles, limb.low, limb.high)
        out[:, 2 * branch] = out[:, 2 * branch + 1] = inside
        missed = np.abs(inside - angles) > 1e-9
        z = turn_about_z
        other_end = np.where(angles[:, z] < middle[z], limb.high[z], limb.low[z])
        out[:, 2 * branch + 1, z] = np.where(missed[:, z], other_end, inside[:, z])
    # by the angle of the bones: the twist of a straight limb does not matter
    error = worst_angle(limb, out, wanted[:, None])
    best = error.argmin(axis=1)
    rows = np.arange(len(out))
    # a branch far outside the limits is not worth a search if another is inside
    hopeless = (error > FAR) & (error[rows, best] < EXACT)[:, None] & (not limb.leans)
    out = np.where(hopeless[..., None], out[rows, best][:, None], out)
    frames, which = np.nonzero((error > EXACT) & ~hopeless)
    if len(frames):
        out[frames, which] = _nearest(limb, out[frames, which], wanted[frames])
    return out


def _in_order(limb: Limb, frame: FloatArray, twist: FloatArray, branch: int) -> list[FloatArray]:
    """Angles (T,) about the axes of a limb's first three hinges, in their order, of the frame (T, 3, 3) twisted about z."""
    turn = Rotation.from_matrix(frame @ _turn(np.array([0.0, 0.0, 1.0]), twist))
    order = _EULER_ORDERS[limb.order]
    first, second, third = turn.as_euler(order).T
    if branch:  # the other solution
        return [first + np.pi, np.pi - second, third + np.pi]
    return [first, second, third]


def _turned_about(
    axis: FloatArray, columns: list[FloatArray], cosine: FloatArray, sine: FloatArray
) -> tuple[FloatArray, list[FloatArray]]:
    """A leaning axis (3,) in a frame with these columns, and the columns after a turn about it (Rodrigues)."""
    direction = axis[0] * columns[0] + axis[1] * columns[1] + axis[2] * columns[2]
    turned = [
        cosine * column + sine * cross(direction, column) + (1 - cosine) * axis[number] * direction
        for number, column in enumerate(columns)
    ]
    return direction, turned


def _nearest(limb: Limb, angles: FloatArray, wanted: FloatArray, steps: int = 12) -> FloatArray:
    """Poses (N, 4) within the limits, each with the least direction error near a given one."""
    damping = np.full(len(angles), 1e-3)
    residual, jacobian = limb.residual(angles, wanted)
    error = (residual**2).sum(axis=-1)
    for _ in range(steps):
        gradient = np.einsum("nij,ni->nj", jacobian, residual)
        held = ((angles <= limb.low) & (gradient > 0)) | ((angles >= limb.high) & (gradient < 0))
        free = jacobian * ~held[:, None, :]
        hessian = np.swapaxes(free, -1, -2) @ free
        hessian[:, range(4), range(4)] += damping[:, None] + held
        change = np.linalg.solve(hessian, -(gradient * ~held)[..., None])[..., 0]
        trial = np.clip(angles + change, limb.low, limb.high)
        new_residual, new_jacobian = limb.residual(trial, wanted)
        new_error = (new_residual**2).sum(axis=-1)
        better = new_error < error
        damping = np.where(better, damping * 0.3, damping * 10)
        settled = (np.abs(trial - angles).max(axis=1) < SETTLED) | (damping > 1e3)
        angles = np.where(better[:, None], trial, angles)
        residual = np.where(better[:, None], new_residual, residual)
        jacobian = np.where(better[:, None, None], new_jacobian, jacobian)
        error = np.where(better, new_error, error)
        if settled.all():
            break
    return angles


def _best_path(limb: Limb, choices: FloatArray, wanted: FloatArray, fps: float) -> FloatArray:
    """The path through the candidates (T, K, 4) with the least error and change."""
    residual, _ = limb.residual(choices, wanted[:, None])
    error = (residual**2).sum(axis=-1) / fps  # (T, K)
    # the twist of a straight limb is free, so its jumps cost nothing
    free = np.sin(choices[..., 3]) ** 2
    change = choices[1:, None] - choices[:-1, :, None]  # (T - 1, from, to, 4)
    square = change**2
    square[..., 2] *= np.minimum(free[1:, None], free[:-1, :, None])
    step = SWITCH * np.sqrt(square.sum(axis=-1))
    total = error[0]
    came_from = np.empty((len(step), choices.shape[1]), dtype=np.intp)
    for frame in range(len(step)):
        through = total[:, None] + step[frame]
        came_from[frame] = through.argmin(axis=0)
        total = through.min(axis=0) + error[frame + 1]
    path = np.empty(len(choices), dtype=np.intp)
    path[-1] = total.argmin()
    for frame in range(len(step) - 1, -1, -1):
        path[frame] = came_from[frame, path[frame + 1]]
    return np.asarray(choices[np.arange(len(choices)), path])


def smooth_path(
    limb: Limb, angles: FloatArray, wanted: FloatArray, fps: float, links: FloatArray, steps: int = 15
) -> FloatArray:
    """Hinge angles (T, 4) of all frames, fitted at once within the limits [rad].

    Minimises the time integral of |direction error|^2 + (SMOOTHNESS_S * speed)^2 + (REST * angle)^2 by a projected
    Gauss-Newton method with banded normal equations.

    Args:
        limb: its geometry.
        angles: (T, 4) where to start [rad].
        wanted: (T, 6) directions of both bones in the frame of the parent.
        fps: frames per second [1/s].
        links: (T - 1,) 1 between frames that belong together, 0 where the path is cut.
        steps: largest number of steps.
    """
    count = len(angles)
    stiffness = (SMOOTHNESS_S * fps) ** 2 * links  # (T - 1,)
    ends = np.concatenate([[0.0], stiffness, [0.0]])
    neighbours = ends[1:] + ends[:-1]

    def cost(at: FloatArray, residual: FloatArray) -> float:
        change = (np.diff(at, axis=0) ** 2).sum(axis=1)
        return float((residual**2).sum() + stiffness @ change + REST**2 * (at**2).sum())

    damping = 1e-4
    residual, jacobian = limb.residual(angles, wanted)
    value = cost(angles, residual)
    for _ in range(steps):
        pull = neighbours[:, None] * angles
        pull[1:] -= stiffness[:, None] * angles[:-1]
        pull[:-1] -= stiffness[:, None] * angles[1:]
        gradient = np.einsum("tij,ti->tj", jacobian, residual) + pull + REST**2 * angles
        held = ((angles <= limb.low) & (gradient > 0)) | ((angles >= limb.high) & (gradient < 0))
        free = jacobian * ~held[:, None, :]
        blocks = np.swapaxes(free, -1, -2) @ free  # (T, 4, 4)
        banded = np.zeros((5, 4 * count))  # upper form: row 4 - d holds diagonal d
        diagonal = blocks[:, range(4), range(4)] + neighbours[:, None] + REST**2 + damping
        banded[4] = np.where(held, 1.0, diagonal).ravel()
        for distance in range(1, 4):
            for column in range(distance, 4):
                banded[4 - distance, column::4] = blocks[:, column - distance, column]
        coupled = ~held[1:] & ~held[:-1]
        banded[0, 4:] = np.where(coupled, -stiffness[:, None], 0.0).ravel()
        change = solveh_banded(banded, -(gradient * ~held).ravel(), check_finite=False).reshape(count, 4)
        trial = np.clip(angles + change, limb.low, limb.high)
        new_residual, new_jacobian = limb.residual(trial, wanted)
        new_value = cost(trial, new_residual)
        if new_value < value:
            moved = float(np.abs(trial - angles).max())
            angles, residual, jacobian, value, damping = trial, new_residual, new_jacobian, new_value, damping * 0.3
            if moved < SETTLED:
                break
        else:
            damping *= 10
            if damping > 1e2:
                break
    return angles


def _turn(axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Rotations (..., 3, 3) about a fixed unit axis by angles (...)."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(
        np.eye(3) + np.sin(angle)[..., None, None] * skew + (1 - np.cos(angle))[..., None, None] * (skew @ skew)
    )
