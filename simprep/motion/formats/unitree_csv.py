"""CSV of robot motions without a header, as Unitree published its retargeted walks: root, quaternion xyzw, joint angles.

A line is a frame: root position [m], root quaternion (xyzw), joint angles [rad] in the order of the robot's joints. The
frame rate is not in the file; the published set has 30 frames per second.
"""

import re
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import MotionFileError
from simprep.motion.formats.numbers import number
from simprep.motion.formats.robot_clip import RobotClip, wxyz, xyzw
from simprep.motion.formats.text import lines_of, open_text
from simprep.motion.motion import Motion

FORMAT = "Unitree CSV"
USUAL_FPS = 30.0
_ROOT = 7
_SEPARATORS = re.compile(r"\s*[,;\t]\s*|\s+")


def is_headless_csv(text: str) -> bool:
    """Whether the first line of a text with anything in it holds numbers only, eight or more."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    tokens = _SEPARATORS.split(first.strip().rstrip(",;"))
    return len(tokens) > _ROOT and all(_is_number(token) for token in tokens)


def read_unitree_csv(path: Path) -> RobotClip:
    """Read a file.

    Raises:
        MotionFileError: unreadable, no numbers, lines of different lengths, or a root quaternion that is none.
    """
    rows: list[list[float]] = []
    with open_text(path, FORMAT) as stream:
        for line, text in lines_of(path, stream):
            if not text.strip():
                continue
            tokens = _SEPARATORS.split(text.strip().rstrip(",;"))
            if rows and len(tokens) != len(rows[0]):
                raise MotionFileError(path, f"{len(tokens)} values; valid: {len(rows[0])} as in the first line", line)
            if len(tokens) <= _ROOT:
                raise MotionFileError(path, f"{len(tokens)} values; valid: 7 of the root and the joint angles", line)
            try:
                rows.append([float(token) for token in tokens])
            except ValueError:
                rows.append([number(path, token, "a value", line) for token in tokens])
    values: FloatArray = np.array(rows, dtype=np.float64).reshape(len(rows), -1)
    if not len(values):
        raise MotionFileError(path, "no frames")
    return RobotClip(
        path, FORMAT, values[:, :3], wxyz(values[:, 3:_ROOT]), values[:, _ROOT:], usual_fps=USUAL_FPS,
        notes=("root quaternion read as xyzw, as the format has it",),
    )  # fmt: skip


def write_unitree_csv(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write a motion with 9 decimals; returns what is lost."""
    values = np.concatenate([motion.qpos[:, :3], xyzw(motion.qpos[:, 3:7]), motion.qpos[:, 7:]], axis=1)
    np.savetxt(path, values, fmt="%.9f", delimiter=",")
    return (f"the frame rate: give {motion.fps:g} when the file is read", "contacts and events")


def _is_number(token: str) -> bool:
    try:
        float(token)
    except ValueError:
        return False
    return "_" not in token
