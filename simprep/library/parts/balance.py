"""Zero-moment point of a motion, and the COM path for a planned one.

Cart-table model (Kajita et al. 2003, ICRA, eq. 5): p = x - z x'' / (g + z''), with the vertical acceleration; in flight
(g + z'' = 0) it becomes x'' = 0, a ballistic path. The differenced equation, as a boundary value problem, gives the one
bounded COM path for a planned ZMP (Kagami et al. 2002, Autonomous Robots 12).
"""

import numpy as np
from scipy.linalg import solve_banded
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.humanoid_model import GRAVITY, humanoid
from simprep.motion.kinematics import Kinematics


def second_difference(x: FloatArray, fps: float) -> FloatArray:
    """Central second differences (T, ...) over axis 0, zero at both ends, where a motion is at rest; `fps` in 1/s."""
    out = np.zeros_like(x)
    out[1:-1] = (x[2:] - 2 * x[1:-1] + x[:-2]) * fps**2
    return out


def ground_reaction(
    kinematics: Kinematics, fps: float, character: Character = humanoid()
) -> tuple[FloatArray, FloatArray]:
    """Force and zero-moment point that a kinematic motion needs from the floor (z = 0), second-order accurate.

    Args:
        kinematics: of T >= 3 frames.
        fps: frames per second [1/s].
        character: the body.

    Returns:
        (T, 3) force [N] and (T, 2) zero-moment point [m]; the first and last frame repeat their neighbours. The point
        is NaN where the vertical force is below 5 % of the weight.
    """
    model = character.model
    mass, inertia, segments = model.body_mass[1:], model.body_inertia[1:], len(character.segments)
    x = kinematics.xipos
    rotation = Rotation.from_quat(kinematics.xquat.reshape(-1, 4), scalar_first=True)
    frame = Rotation.from_quat(np.tile(model.body_iquat[1:], (len(x), 1)), scalar_first=True)
    axes = (rotation * frame).as_matrix().reshape(len(x), segments, 3, 3)
    tensor = np.einsum("tbij,bj,tbkj->tbik", axes, inertia, axes)
    matrices = rotation.as_matrix().reshape(len(x), segments, 3, 3)
    step = Rotation.from_matrix((matrices[1:] @ np.swapaxes(matrices[:-1], -1, -2)).reshape(-1, 3, 3))
    spin = step.as_rotvec().reshape(-1, segments, 3) * fps
    velocity = np.diff(x, axis=0) * fps
    momentum = np.einsum("b,tbi->ti", mass, velocity)
    middle = (x[1:] + x[:-1]) / 2
    angular = np.einsum("b,tbi->ti", mass, np.cross(middle, velocity))
    angular += np.einsum("tbij,tbj->ti", (tensor[1:] + tensor[:-1]) / 2, spin)
    total = mass.sum()
    force = np.diff(momentum, axis=0) * fps + [0.0, 0.0, total * GRAVITY]
    moment = np.diff(angular, axis=0) * fps + np.cross(kinematics.com[1:-1], [0.0, 0.0, total * GRAVITY])
    vertical = np.where(force[:, 2] > 0.05 * total * GRAVITY, force[:, 2], np.nan)
    point = np.stack([-moment[:, 1], moment[:, 0]], axis=-1) / vertical[:, None]
    return np.pad(force, ((1, 1), (0, 0)), mode="edge"), np.pad(point, ((1, 1), (0, 0)), mode="edge")


def cart_table_zmp(com: FloatArray, fps: float) -> FloatArray:
    """Zero-moment point (T, 2) of the COM alone, angular momentum neglected [m].

    It is NaN where the vertical force is below 5 % of the weight.

    Args:
        com: (T, 3) [m].
        fps: frames per second [1/s].
    """
    acceleration = second_difference(com, fps)
    lift = GRAVITY + acceleration[:, 2]
    lift = np.where(lift > 0.05 * GRAVITY, lift, np.nan)
    return np.asarray(com[:, :2] - com[:, 2:] * acceleration[:, :2] / lift[:, None])


def com_from_zmp(
    zmp: FloatArray,
    height: FloatArray,
    fps: float,
    shift: FloatArray | None = None,
    settle: float = 0.5,
    turn: float = 0.0,
) -> FloatArray:
    """Horizontal COM path (T, 2) whose cart-table ZMP is the planned one [m].

    Args:
        zmp: (T, 2) planned ZMP [m].
        height: (T,) COM height [m].
        fps: frames per second [1/s].
        shift: (2,) travel per period of a periodic motion [m]; None for one that begins and ends at rest over its ZMP.
        settle: time at each end in which a smooth bump corrects the ZMP, so that the COM is at rest there [s].
        turn: turn per period of a periodic motion, to the left [rad].
    """
    if shift is not None:
        # a few periods either side: the boundary's influence fades by exp(-omega t)
        cycles = 4
        long = np.concatenate([later_period(zmp, k, shift, turn) for k in range(-cycles, cycles + 1)])
        lift = GRAVITY + np.tile(_periodic_second_difference(height, fps), 2 * cycles + 1)
        path = _solve(long, np.tile(height, 2 * cycles + 1), lift, fps)
        return path[cycles * len(zmp) : (cycles + 1) * len(zmp)]
    lift = GRAVITY + second_difference(height, fps)
    n = len(zmp)
    window = min(round(settle * fps), n // 2)
    bump = np.zeros((n, 2))
    wave = np.sin(np.pi * np.arange(window) / window) ** 2
    bump[:window, 0], bump[n - window :, 1] = wave, wave[::-1]
    path = _solve(zmp, height, lift, fps)
    answer = _solve(bump, height, lift, fps)
    rates = np.array([answer[1] - answer[0], answer[-1] - answer[-2]])
    weights = np.linalg.solve(rates, -np.array([path[1] - path[0], path[-1] - path[-2]]))
    return np.asarray(path + answer @ weights)


def later_period(points: FloatArray, periods: int, shift: FloatArray, turn: float = 0.0) -> FloatArray:
    """Points of a cyclic motion some periods later: each period turns about the origin, then shifts.

    Args:
        points: (..., 2) or (..., 3); a third coordinate stays [m].
        periods: how many; negative: earlier.
        shift: (2,) travel per period [m].
        turn: per period, to the left [rad].
    """
    out = np.array(points)
    if turn == 0.0:
        out[..., :2] = points[..., :2] + periods * shift
        return out
    centre = np.linalg.solve(np.eye(2) - rotation_2d(turn), shift)  # the point that the period's turn leaves in place
    out[..., :2] = (points[..., :2] - centre) @ rotation_2d(periods * turn).T + centre
    return out


def rotation_2d(angle: float) -> FloatArray:
    """Rotation (2, 2) on the floor by an angle to the left [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def _periodic_second_difference(x: FloatArray, fps: float) -> FloatArray:
    return np.asarray((np.roll(x, -1) - 2 * x + np.roll(x, 1)) * fps**2)


def _solve(zmp: FloatArray, height: FloatArray, lift: FloatArray, fps: float) -> FloatArray:
    """COM path of a planned ZMP with x = p at both ends (tridiagonal system)."""
    stiff = height * fps**2
    bands = np.zeros((3, len(zmp)))
    bands[1] = lift + 2 * stiff
    bands[0, 2:] = -stiff[1:-1]
    bands[2, :-2] = -stiff[1:-1]
    bands[1, [0, -1]] = 1.0
    right = lift[:, None] * zmp
    right[[0, -1]] = zmp[[0, -1]]
    return np.asarray(solve_banded((1, 1), bands, right))
