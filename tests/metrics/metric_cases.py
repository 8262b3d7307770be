"""Motions and runs with known metrics, shared by the metrics tests."""

import numpy as np

from simprep.humanoid_model import humanoid
from simprep.motion.motion import Motion, differentiate
from simprep.physics.run import DONE, BodyRun, Run


def rigid_motion(root: np.ndarray, fps: float, contact: bool = True) -> Motion:
    """The standing pose carried along a root path, (T, 3) relative to standing at the origin."""
    qpos = np.tile(humanoid().standing_qpos.copy(), (len(root), 1))
    qpos[:, :3] += root
    return Motion(qpos, fps, np.full((len(root), 2), contact))


def swaying_motion(fps: float, seconds: float = 2.0) -> Motion:
    """Feet roughly in place, trunk and arms swinging at under 2 Hz, the right foot off the floor for a while."""
    time = np.arange(int(seconds * fps) + 1) / fps
    qpos = np.tile(humanoid().standing_qpos.copy(), (len(time), 1))
    qpos[:, 0] += 0.03 * np.sin(2 * np.pi * 0.5 * time)
    qpos[:, 1] += 0.04 * np.sin(2 * np.pi * 0.7 * time)
    for name, size, frequency in (
        ("lumbar_flexion", 0.3, 1.0), ("thorax_rotation", 0.3, 1.3), ("left_shoulder_flexion", 0.8, 1.5),
        ("right_elbow_flexion", 0.5, 1.1), ("left_hip_flexion", 0.05, 0.5),
    ):  # fmt: skip
        qpos[:, 7 + humanoid().joint(name)] = size * (1 - np.cos(2 * np.pi * frequency * time)) / 2
    contacts = np.ones((len(time), 2), dtype=bool)
    contacts[(time > 0.795) & (time < 1.195), 1] = False
    return Motion(qpos, fps, contacts, events={"launch": round(fps)})


def run_of(motion: Motion, reference: Motion, end: str = DONE, fallen: int | None = None, **arrays: np.ndarray) -> Run:
    """A run that went through the poses of `motion` while tracking `reference` (both at the simulation rate)."""
    steps, joints = len(motion) - 1, len(motion.character.joints)
    values = {
        "qpos": motion.qpos, "qvel": differentiate(motion.qpos, motion.fps, motion.character),
        "reference_qvel": np.zeros((steps + 1, motion.character.nv)),
        "target": np.zeros((steps, joints)), "torque": np.zeros((steps, joints)),
        "torque_limit": np.full(joints, 100.0), "ground_force": np.tile([0.0, 0.0, 735.0], (steps, 1)),
        "foot_force": np.zeros((steps, 2, 3)), "centre_of_pressure": np.zeros((steps, 2)),
        "foot_contact": motion.contacts[1:], "penetration": np.zeros(steps),
    }  # fmt: skip
    body = BodyRun(reference=reference, **(values | arrays))
    return Run((body,), "test", 0, 1 / motion.fps, end, "made up", fallen, wall_s=3.0)
