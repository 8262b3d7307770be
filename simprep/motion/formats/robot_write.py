"""Writing motions of a robot for the tools that learn from them: BeyondMimic, mjlab, and GMR without a pickle."""

from pathlib import Path
from typing import Any

import numpy as np

from simprep.arrays import FloatArray, IndexArray
from simprep.motion.formats.robot_clip import xyzw
from simprep.motion.formats.robot_order import breadth_first
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.motion import Motion, differentiate
from simprep.motion.rotations import rotation_matrix

LOST = "contacts and events"
"""What these formats cannot keep."""


def body_arrays(motion: Motion, joints: IndexArray, segments: IndexArray) -> dict[str, Any]:
    """What BeyondMimic and mjlab store, in the given orders: joint and body poses, and their velocities.

    Velocities are central differences at the frame rate; those of bodies are of their origins, in the world.

    Args:
        motion: of a robot.
        joints: (J,) joint of each column.
        segments: (S,) segment of each body.
    """
    kinematics = forward_kinematics(motion.qpos, motion.character)
    qvel = differentiate(motion.qpos, motion.fps, motion.character)
    return {
        "fps": np.array([motion.fps if motion.fps % 1 else int(motion.fps)]),
        "joint_pos": motion.qpos[:, 7:][:, joints],
        "joint_vel": qvel[:, 6:][:, joints],
        "body_pos_w": kinematics.xpos[:, segments],
        "body_quat_w": kinematics.xquat[:, segments],
        "body_lin_vel_w": _slope(kinematics.xpos, motion.fps)[:, segments],
        "body_ang_vel_w": _angular_velocity(kinematics, motion.fps)[:, segments],
    }


def write_beyondmimic(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write joints and bodies breadth first, as Isaac has them; returns what is lost."""
    _save(path, body_arrays(motion, *breadth_first(motion.character)))
    return (LOST,)


def write_mjlab(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write joints and bodies depth first, as MuJoCo has them; returns what is lost."""
    joints, segments = len(motion.character.joints), len(motion.character.segments)
    _save(path, body_arrays(motion, np.arange(joints), np.arange(segments)))
    return (LOST,)


def write_gmr(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write GMR's keys as an .npz, which holds arrays only: no program can be in it; returns what is lost."""
    still = motion.qpos.copy()
    still[:, :7] = 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
    arrays = {
        "fps": np.array(motion.fps),
        "root_pos": motion.qpos[:, :3],
        "root_rot": xyzw(motion.qpos[:, 3:7]),
        "dof_pos": motion.qpos[:, 7:],
        "local_body_pos": forward_kinematics(still, motion.character).xpos,
        "link_body_list": np.array(motion.character.segments),
        "joint_names": np.array(motion.character.joints),
    }
    _save(path, arrays)
    return (LOST,)


def write_holosoma(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write `qpos` with the position first, wxyz, as MuJoCo has it, and `fps`; returns what is lost."""
    _save(path, {"qpos": motion.qpos, "fps": np.array(motion.fps)})
    return (LOST,)


def _save(path: Path, arrays: dict[str, Any]) -> None:
    with path.open("wb") as stream:
        np.savez_compressed(stream, **arrays)


def _slope(values: FloatArray, fps: float) -> FloatArray:
    return np.gradient(values, 1 / fps, axis=0) if len(values) > 1 else np.zeros_like(values)


def _angular_velocity(kinematics: Kinematics, fps: float) -> FloatArray:
    """Angular velocity (T, S, 3) of every segment in the world, by central differences [rad/s]."""
    turn = rotation_matrix(kinematics.xquat)
    rate = _slope(turn, fps) @ np.swapaxes(turn, -1, -2)  # skew-symmetric but for the error of the difference
    return np.stack(
        [
            (rate[..., 2, 1] - rate[..., 1, 2]) / 2,
            (rate[..., 0, 2] - rate[..., 2, 0]) / 2,
            (rate[..., 1, 0] - rate[..., 0, 1]) / 2,
        ],
        axis=-1,
    )
