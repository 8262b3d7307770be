"""What every file reader returns: the world positions and orientations of a foreign skeleton's joints."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.errors import MotionFileError

MAX_VALUES = 40_000_000
"""Largest frames x joints x 9 that a reader accepts: about 300 MB for each array of orientations."""
SMALL_VALUES = 1_000_000
"""Accepted however small the file is: 8 MB."""


@dataclass(frozen=True)
class SourceClip:
    """A motion file as it is: file units, file axes, foreign joint names.

    Attributes:
        path: the file.
        format: its title, such as `BVH`.
        names: J joint names; end sites are called `<parent>_end`.
        parents: (J,) index of each joint's parent, -1 for the root; a parent precedes its children.
        positions: (T, J, 3) joint positions in the world [file unit].
        rotations: (T, J, 3, 3) joint orientations in the world.
        rest_positions: (J, 3) positions in the pose of the file's skeleton section [file unit].
        rest_rotations: (J, 3, 3) orientations in that pose.
        fps: frames per second [1/s].
        unit_m: metres per file unit where the format or the file says so, else None.
        up: vertical axis (`x`, `y` or `z`) where the format says so, else None.
        step: (3,) root displacement over one cycle of a loop [file unit]; None for a clip that does not repeat.
        notes: the reader's decisions, for the report.
        by_part: whether the reader has called the joints by our parts, so that no joint map applies to them.
    """

    path: Path
    format: str
    names: tuple[str, ...]
    parents: IndexArray
    positions: FloatArray
    rotations: FloatArray
    rest_positions: FloatArray
    rest_rotations: FloatArray
    fps: float
    unit_m: float | None = None
    up: str | None = None
    step: FloatArray | None = None
    notes: tuple[str, ...] = ()
    by_part: bool = False


def check_size(path: Path, frames: int, joints: int, file_bytes: int | None = None) -> None:
    """Refuse a clip that takes too much memory, or far more than a file of this size can describe.

    Every number takes at least 2 bytes, and a frame has a number for most joints.

    Args:
        path: the file.
        frames: T.
        joints: J.
        file_bytes: size of the file; None while T is not known from its content.

    Raises:
        MotionFileError: too many frames of too many joints.
    """
    values = 9 * frames * joints
    if values > MAX_VALUES:
        raise MotionFileError(path, f"{frames} frames of {joints} joints: more than can be imported")
    if file_bytes is not None and values > max(SMALL_VALUES, 9 * file_bytes):
        raise MotionFileError(
            path, f"{frames} frames of {joints} joints in a file of {file_bytes} bytes: hardly a joint has values"
        )


def tidy_fps(fps: float) -> float:
    """The whole number of frames per second that a rounded frame time (0.016667 s) means, if within 0.1 %."""
    whole = float(round(fps))
    return whole if whole > 0 and abs(fps - whole) < 1e-3 * whole else fps


def forward(parents: IndexArray, offsets: FloatArray, rotations: FloatArray) -> tuple[FloatArray, FloatArray]:
    """World positions (T, J, 3) and orientations (T, J, 3, 3) of a joint tree.

    Args:
        parents: (J,) parent of each joint, -1 for the root; parents precede children.
        offsets: (J, 3) or (T, J, 3) position of each joint in its parent's frame.
        rotations: (T, J, 3, 3) orientation of each joint in its parent's frame.
    """
    frames, joints = rotations.shape[:2]
    # joint by joint in memory: matrices that lie side by side multiply several times faster
    world, positions = np.empty((joints, frames, 3, 3)), np.empty((joints, frames, 3))
    offsets = np.broadcast_to(offsets, (frames, joints, 3))
    for joint, parent in enumerate(parents):
        if parent < 0:
            world[joint] = rotations[:, joint]
            positions[joint] = offsets[:, joint]
        else:
            np.matmul(world[parent], rotations[:, joint], out=world[joint])
            positions[joint] = positions[parent] + (world[parent] @ offsets[:, joint, :, None])[..., 0]
    return np.swapaxes(positions, 0, 1), np.swapaxes(world, 0, 1)
