"""Is the file read as it was meant: quaternion order, vertical axis, heading, sides, joint order, units.

Each misreading is undone by way of trial. Bodies touch the floor, standing feet stay, and joints keep within their
ranges; a misreading breaks that, and the right reading restores it. A motion is misread if some other reading is better
by far.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray, IndexArray
from simprep.character import Character
from simprep.check.finding import FAIL, PASS, WARN, Finding
from simprep.check.subject import Subject
from simprep.motion.formats.robot_order import breadth_first
from simprep.motion.kinematics import body_clearance, forward_kinematics
from simprep.motion.rotations import continuous_quat, multiply_quat

PAIRS = 80
"""Pairs of consecutive frames that are compared."""
FLOOR_M, SLIDE_MPS, RANGE_DEG, TURN_RADPS = 0.01, 0.05, 1.0, 3.0
"""What counts as one unit of error: distance from the floor, speed of the stillest sole point, mean excess over joint
ranges, and speed of the root's turning."""
LARGEST = 30.0
"""No single error counts for more than this, so that each can be outweighed."""
NEAR_M = 0.03
WARN_GAIN, FAIL_GAIN = 1.5, 3.0
"""Units by which another reading must be better."""
BETTER = 0.5
"""And at most this share of the error may remain."""

Reading = Callable[[FloatArray, Character], FloatArray]


def _quat(order: tuple[int, ...]) -> Reading:
    return lambda qpos, _: _with(qpos, quat=qpos[:, 3:7][:, list(order)])


def _with(qpos: FloatArray, position: FloatArray | None = None, quat: FloatArray | None = None) -> FloatArray:
    out = qpos.copy()
    if position is not None:
        out[:, :3] = position
    if quat is not None:
        out[:, 3:7] = quat
    return out


def _turned(axis: tuple[float, float, float], angle: float, position_only: bool = False) -> Reading:
    """The whole motion turned in the world."""
    turn = Rotation.from_rotvec(np.array(axis) * angle)
    quat = turn.as_quat(scalar_first=True)

    def apply(qpos: FloatArray, _: Character) -> FloatArray:
        turned = None if position_only else multiply_quat(np.broadcast_to(quat, (len(qpos), 4)), qpos[:, 3:7])
        return _with(qpos, qpos[:, :3] @ turn.as_matrix().T, turned)

    return apply


def _about_face(qpos: FloatArray, _: Character) -> FloatArray:
    return _with(qpos, quat=multiply_quat(qpos[:, 3:7], np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(qpos), 4))))


def _back_and_forth(qpos: FloatArray, _: Character) -> FloatArray:
    """The root's way played backwards beside the joints."""
    return np.concatenate([qpos[::-1, :7], qpos[:, 7:]], axis=1)


def _swapped(mirrored: bool, legs_only: bool = False) -> Reading:
    """Left and right exchanged, as angles are or with the signs of a mirror image."""

    def apply(qpos: FloatArray, character: Character) -> FloatArray:
        index, sign = character.mirror_map
        out = qpos.copy()
        angles = qpos[:, 7:][:, index] * (sign if mirrored else 1.0)
        sided = index != np.arange(len(index))
        if legs_only:
            sided = sided & np.isin(np.arange(len(index)), character.lower_joints)
        out[:, 7:][:, sided] = angles[:, sided]
        return out

    return apply


def _reordered(inverse: bool) -> Reading:
    def apply(qpos: FloatArray, character: Character) -> FloatArray:
        order = breadth_first(character)[0]
        out = qpos.copy()
        if inverse:
            out[:, 7 + order] = qpos[:, 7:]
        else:
            out[:, 7:] = qpos[:, 7 + order]
        return out

    return apply


READINGS: dict[str, tuple[str, Reading]] = {
    "quaternion xyzw read as wxyz": ("quaternion order", _quat((3, 0, 1, 2))),
    "quaternion wxyz read as xyzw": ("quaternion order", _quat((1, 2, 3, 0))),
    "quaternion inverted": ("quaternion order", lambda qpos, _: _with(qpos, quat=qpos[:, 3:7] * [1.0, -1.0, -1.0, -1.0])),
    "y up": ("vertical axis", _turned((1.0, 0.0, 0.0), np.pi / 2)),
    "y up in the root's position": ("vertical axis", _turned((1.0, 0.0, 0.0), np.pi / 2, True)),
    "x up": ("vertical axis", _turned((0.0, 1.0, 0.0), -np.pi / 2)),
    "upside down": ("vertical axis", _turned((1.0, 0.0, 0.0), np.pi)),
    "root faces backwards": ("root direction", _about_face),
    "root travels backwards": ("root direction", lambda qpos, _: _with(qpos, qpos[:, :3] * [-1.0, -1.0, 1.0])),
    "root's x reversed": ("root direction", lambda qpos, _: _with(qpos, qpos[:, :3] * [-1.0, 1.0, 1.0])),
    "root's y reversed": ("root direction", lambda qpos, _: _with(qpos, qpos[:, :3] * [1.0, -1.0, 1.0])),
    "root's x and y exchanged": ("root direction", lambda qpos, _: _with(qpos, qpos[:, [1, 0, 2]])),
    "root's way played backwards": ("root direction", _back_and_forth),
    "left and right exchanged": ("left and right", _swapped(False)),
    "left and right exchanged and mirrored": ("left and right", _swapped(True)),
    "left and right leg exchanged": ("left and right", _swapped(False, True)),
    "joints breadth first read as depth first": ("joint order", _reordered(True)),
    "joints depth first read as breadth first": ("joint order", _reordered(False)),
    "angles in degrees": ("units", lambda qpos, _: np.concatenate([qpos[:, :7], np.radians(qpos[:, 7:])], axis=1)),
    "position in centimetres": ("units", lambda qpos, _: _with(qpos, qpos[:, :3] / 100)),
    "position in millimetres": ("units", lambda qpos, _: _with(qpos, qpos[:, :3] / 1000)),
}  # fmt: skip
"""How a file may have been misread, each with its check and how to undo it."""
CHECKS = tuple(dict.fromkeys(check for check, _ in READINGS.values()))


@dataclass(frozen=True)
class Plausibility:
    """How far a reading is from what bodies do.

    Attributes:
        floor: mean distance of the lowest point from the floor.
        slide: median speed of the stillest sole point near the floor.
        ranges: mean excess over the joints' ranges.
        turning: median speed of the root's turning.
    All in the units of this module.
    """

    floor: float
    slide: float
    ranges: float
    turning: float

    @property
    def total(self) -> float:
        """Sum of all errors."""
        return self.floor + self.slide + self.ranges + self.turning


def plausibility(qpos: FloatArray, fps: float, character: Character, frames: IndexArray) -> Plausibility:
    """Error of a reading over pairs of frames.

    Args:
        qpos: (T, nq).
        fps: frames per second [1/s].
        character: who moves.
        frames: (P,) first frame of each pair.
    """
    pairs = np.stack([qpos[frames], qpos[frames + 1]], axis=1)  # (P, 2, nq)
    norm = np.linalg.norm(pairs[..., 3:7], axis=-1, keepdims=True)
    pairs[..., 3:7] /= norm
    flat = pairs.reshape(-1, qpos.shape[1])
    clearance = body_clearance(flat, character).min(axis=1).reshape(-1, 2)[:, 0]
    points = forward_kinematics(flat, character).foot_points.reshape(len(frames), 2, -1, 3)
    lowest = np.minimum(clearance, points[:, 0, :, 2].min(axis=1))
    speed = np.linalg.norm(points[:, 1] - points[:, 0], axis=-1) * fps
    near = points[:, 0, :, 2] < lowest[:, None] + NEAR_M
    stillest = np.where(near, speed, np.inf).min(axis=1)
    stillest = stillest[np.isfinite(stillest)]
    low, high = character.limits.T
    angles = flat[:, 7:]
    beyond = np.degrees(np.maximum(np.maximum(low - angles, angles - high), 0.0))
    quat = continuous_quat(flat[:, 3:7]).reshape(-1, 2, 4)
    turn = 2 * np.arccos(np.clip(np.abs((quat[:, 0] * quat[:, 1]).sum(axis=-1)), 0.0, 1.0)) * fps
    values = (
        float(np.abs(clearance).mean()) / FLOOR_M,
        (float(np.median(stillest)) if len(stillest) else 0.0) / SLIDE_MPS,
        float(beyond.mean()) / RANGE_DEG,
        max(0.0, float(np.median(turn)) / TURN_RADPS - 1.0),
    )
    return Plausibility(*(min(value, LARGEST) for value in values))


def conventions(subject: Subject) -> tuple[Finding, ...]:
    """One finding for each kind of misreading (`CHECKS`); only the best reading's is not a pass."""
    qpos, character = subject.motion.qpos, subject.character
    frames = np.unique(np.linspace(0, len(qpos) - 2, PAIRS).astype(int))
    as_is = plausibility(qpos, subject.fps, character, frames)
    tried = {
        name: plausibility(read(qpos, character), subject.fps, character, frames)
        for name, (_, read) in READINGS.items()
    }
    best = min(tried, key=lambda name: tried[name].total)
    gain = as_is.total - tried[best].total
    found = gain > WARN_GAIN and tried[best].total < BETTER * as_is.total
    same = [name for name in tried if tried[name].total < tried[best].total + 0.1 * gain]
    guilty = {READINGS[name][0] for name in same} if found else set()
    out = []
    for check in CHECKS:
        gains = [as_is.total - tried[name].total for name in READINGS if READINGS[name][0] == check]
        names = " or ".join(name for name in same if READINGS[name][0] == check)
        verdict = PASS if check not in guilty else FAIL if gain > FAIL_GAIN else WARN
        note = (
            f"looks like: {names} (error {as_is.total:.1f}, so read {tried[best].total:.1f})" if check in guilty else ""
        )
        out.append(Finding(check, verdict, max(0.0, max(gains)), "units of error", WARN_GAIN, FAIL_GAIN, note=note))
    return tuple(out)
