"""Motions and files for the tests of formats, made here: poses of a character, parameters of SMPL."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simprep.character import SIDES, Character
from simprep.motion.motion import Motion

Array = NDArray[np.float64]


def random_motion(character: Character, frames: int = 40, fps: float = 50.0, seed: int = 0) -> Motion:
    """Every joint swings slowly within its limits, the root turns all round and travels."""
    rng = np.random.default_rng(seed)
    t = np.arange(frames)[:, None] / fps
    middle, half = character.limits.mean(axis=1), np.diff(character.limits, axis=1)[:, 0] / 2
    phase, rate = rng.uniform(0, 2 * np.pi, len(middle)), rng.uniform(0.5, 2.0, len(middle))
    angles = middle + 0.95 * half * np.sin(phase + rate * t * 2 * np.pi)
    root = np.concatenate([t, 0.3 * np.sin(t), 0.9 + 0.1 * np.cos(t)], axis=1)
    turn = Rotation.from_euler("zyx", np.concatenate([3 * t, 0.4 * np.sin(2 * t), 0.3 * t], axis=1))
    quat = turn.as_quat(scalar_first=True)
    quat *= np.where(quat[:, :1] < 0, -1, 1)
    return Motion(np.concatenate([root, quat, angles], axis=1), fps, np.zeros((frames, 2), bool), character=character)


TO_MODEL = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Our axes (x forward, y left, z up) to those of SMPL's body (z forward, x left, y up)."""
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""SMPL's axes to AMASS's world."""


def smpl_walk(frames: int = 90, fps: float = 60.0) -> dict[str, Array]:
    """A person who walks in place, arms hanging, in AMASS's axes: `root_orient`, `pose_body`, `trans`."""
    names = ("left_hip", "right_hip", "spine1", "left_knee", "right_knee", "spine2", "left_ankle", "right_ankle", "spine3",
             "left_foot", "right_foot", "neck", "left_collar", "right_collar", "head", "left_shoulder", "right_shoulder",
             "left_elbow", "right_elbow", "left_wrist", "right_wrist")  # fmt: skip
    t = np.arange(frames) / fps
    body = np.zeros((frames, 21, 3))
    for side, sign in zip(SIDES, (1.0, -1.0)):
        swing = sign * np.sin(2 * np.pi * t)
        body[:, names.index(f"{side}_hip"), 0] = -0.35 * swing - 0.1  # about x, to the left: negative is forward
        body[:, names.index(f"{side}_knee"), 0] = 0.5 + 0.4 * swing
        body[:, names.index(f"{side}_shoulder"), 2] = -sign * np.radians(75)  # from the T-pose down
        body[:, names.index(f"{side}_elbow"), 1] = -sign * (0.6 + 0.2 * swing)
    root = np.tile(Rotation.from_matrix(Z_UP).as_rotvec(), (frames, 1))
    trans = np.stack([np.zeros(frames), -0.2 * t, np.full(frames, 0.95)], axis=1)
    return {"root_orient": root, "pose_body": body.reshape(frames, 63), "trans": trans}


def save(path: Path, **arrays: object) -> Path:
    """Write an .npz."""
    np.savez(path, **arrays)  # type: ignore[arg-type]
    return path


def trc_text(names: tuple[str, ...], positions: Array, fps: float, units: str = "m") -> str:
    """A TRC file of positions (T, J, 3); NaN becomes an empty field."""
    count = len(names)
    lines = [
        "PathFileType\t4\t(X/Y/Z)\ta.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{fps:g}\t{fps:g}\t{len(positions)}\t{count}\t{units}\t{fps:g}\t1\t{len(positions)}",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"X{n}\tY{n}\tZ{n}" for n in range(1, count + 1)),
        "",
    ]
    for frame, row in enumerate(positions):
        fields = ["" if np.isnan(value) else f"{value:.6f}" for value in row.ravel()]
        lines.append("\t".join([str(frame + 1), f"{frame / fps:.6f}", *fields]))
    return "\n".join(lines) + "\n"
