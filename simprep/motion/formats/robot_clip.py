"""What every reader of robot motion files returns: root and joint angles as the file has them, not yet on a character."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import MotionFileError
from simprep.motion.formats.numbers import LARGEST
from simprep.motion.formats.skeleton import MAX_VALUES

UNIT_TOLERANCE = 0.02
"""A quaternion whose norm is this far from 1 is none."""


@dataclass(frozen=True)
class StoredBodies:
    """Body poses that a file states beside its joint angles; they tell in which order both are.

    Attributes:
        positions: (T, B, 3) [m].
        quats: (T, B, 4) wxyz; None where the file has none.
        names: of the bodies, where the file has them.
        in_root: positions are in the root's frame, not in the world's.
    """

    positions: FloatArray
    quats: FloatArray | None = None
    names: tuple[str, ...] | None = None
    in_root: bool = False


@dataclass(frozen=True)
class RobotClip:
    """A motion of a robot as a file has it, metres and radians, z up.

    Attributes:
        path: the file.
        format: for messages, such as `Unitree CSV`.
        position: (T, 3) root position [m].
        quat: (T, 4) root orientation, wxyz.
        angles: (T, J) joint angles in the file's order [rad].
        joints: their names, where the file has them.
        fps: frames per second, where the file states them [1/s].
        usual_fps: what the format's documentation says where the file states none [1/s].
        bodies: body poses, where the file has them.
        joint_velocity: (T, J) as stored [rad/s]; they tell the true frame rate. None where there are none.
        whole_qpos: the angles are the rest of a whole qpos, whose last seven numbers may be an object's pose.
        notes: the reader's decisions, for the report.
    """

    path: Path
    format: str
    position: FloatArray
    quat: FloatArray
    angles: FloatArray
    joints: tuple[str, ...] | None = None
    fps: float | None = None
    usual_fps: float | None = None
    bodies: StoredBodies | None = None
    joint_velocity: FloatArray | None = None
    whole_qpos: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        frames = len(self.position)
        if frames == 0:
            raise MotionFileError(self.path, "no frames")
        for name, value, width in (("root position", self.position, 3), ("root quaternion", self.quat, 4)):
            if value.shape != (frames, width):
                raise MotionFileError(self.path, f"{name} has shape {value.shape}; valid: ({frames}, {width})")
        if self.angles.ndim != 2 or len(self.angles) != frames:
            raise MotionFileError(self.path, f"joint angles have shape {self.angles.shape}; valid: ({frames}, joints)")
        for name, value in (("root position", self.position), ("joint angle", self.angles), ("quaternion", self.quat)):
            if bad := first_bad(value):
                raise MotionFileError(self.path, f"{name} in frame {bad[0]}, column {bad[1]} is {bad[2]:g}")
        norm = np.linalg.norm(self.quat, axis=1)
        if (wrong := np.abs(norm - 1) > UNIT_TOLERANCE).any():
            frame = int(np.argmax(wrong))
            raise MotionFileError(
                self.path, f"the root quaternion of frame {frame} has norm {norm[frame]:.4g}; valid: 1 (other columns?)"
            )


def first_bad(values: FloatArray) -> tuple[int, int, float] | None:
    """Frame, column and value of the first number of (T, N) that is not finite or is beyond `LARGEST`; None if none is."""
    with np.errstate(invalid="ignore"):
        bad = ~(np.abs(values) <= LARGEST)
    if not bad.any():
        return None
    frame, column = (int(index) for index in np.argwhere(bad)[0][:2])
    return frame, column, float(values[frame, column])


def numeric(path: Path, name: str, value: object, *, ndim: int | None = None) -> FloatArray:
    """An entry of a file as floats.

    Args:
        path: the file, for messages.
        name: of the entry.
        value: what the file holds there.
        ndim: number of axes; None for any.

    Raises:
        MotionFileError: not numbers, too many, or other axes.
    """
    try:
        array = np.asarray(value)
    except ValueError:
        raise MotionFileError(path, f"{name} holds rows of different lengths; valid: an array of numbers") from None
    if array.dtype.kind not in "fiu" or array.size > MAX_VALUES:
        raise MotionFileError(path, f"{name} holds {array.size} {array.dtype}; valid: up to {MAX_VALUES} numbers")
    if ndim is not None and array.ndim != ndim:
        raise MotionFileError(path, f"{name} has shape {array.shape}; valid: {ndim} axes")
    return np.asarray(array, dtype=np.float64)


def all_unit(quat: FloatArray) -> bool:
    """Whether every row of (T, 4) has the norm of a quaternion."""
    return bool((np.abs(np.linalg.norm(quat, axis=1) - 1) < UNIT_TOLERANCE).all())


def stated_fps(path: Path, value: object) -> float:
    """A frame rate that a file states as a number or a list of one [1/s].

    Raises:
        MotionFileError: anything else, or not above 0.
    """
    rates = numeric(path, "fps", value).ravel()
    if len(rates) != 1 or not (np.isfinite(rates[0]) and rates[0] > 0):
        raise MotionFileError(path, f"fps is {np.array2string(rates[:4])}; valid: one number above 0")
    return float(rates[0])


def wxyz(quat: FloatArray) -> FloatArray:
    """Quaternions (..., 4) xyzw as wxyz."""
    return np.ascontiguousarray(quat[..., [3, 0, 1, 2]])


def xyzw(quat: FloatArray) -> FloatArray:
    """Quaternions (..., 4) wxyz as xyzw."""
    return np.ascontiguousarray(quat[..., [1, 2, 3, 0]])
