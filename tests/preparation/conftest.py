"""A walk and a made-up punch for the preparation tests."""

from dataclasses import replace

import numpy as np
import pytest

from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import load_motion
from simprep.motion.motion import Motion

GUARD = {
    "lumbar_flexion": 0.15, "thorax_rotation": 0.3,
    "left_shoulder_flexion": 0.9, "left_elbow_flexion": 2.0, "left_shoulder_abduction": 0.2,
    "right_shoulder_flexion": 0.6, "right_elbow_flexion": 2.2, "right_shoulder_rotation": 0.3,
    "left_hip_flexion": 0.55, "left_knee_flexion": 0.6, "left_ankle_dorsiflexion": 0.05,
    "right_hip_flexion": -0.05, "right_knee_flexion": 0.25, "right_ankle_dorsiflexion": 0.30,
}  # fmt: skip
PUNCH = {"right_shoulder_flexion": 1.5, "right_elbow_flexion": 0.2, "thorax_rotation": 0.5, "lumbar_flexion": 0.5}
FPS = 60.0
MARKED = 40


@pytest.fixture(scope="session")
def walk() -> Motion:
    return library_motion("walk")


@pytest.fixture(scope="session")
def punch() -> Motion:
    """Standing in guard, from frame 40 on a lunging punch; both feet stay on the floor."""
    qpos = np.tile(humanoid().standing_qpos.copy(), (90, 1))
    phase = np.clip((np.arange(90) - MARKED) / 15, 0, 1)
    lunge = phase**3 * (10 - 15 * phase + 6 * phase**2)
    for name, angle in GUARD.items():
        qpos[:, 7 + humanoid().joint(name)] = angle
    for name, angle in PUNCH.items():
        qpos[:, 7 + humanoid().joint(name)] += lunge * (angle - GUARD[name])
    for _ in range(2):
        points = forward_kinematics(qpos, humanoid()).foot_points
        qpos[:, 2] -= points[..., 2].min(axis=(1, 2))
    return Motion(qpos, FPS, np.ones((90, 2), bool), events={"target": MARKED}, name="punch", source="test")


@pytest.fixture(scope="session", params=[("punch", 8), ("kick", 8)], ids=["punch", "kick"])
def real_pair(request, data_dir) -> tuple[Motion, Motion]:
    """Captured walk, and captured punch or kick."""
    name, frame = request.param
    folder = data_dir / "deepmimic"
    target = load_motion(folder / f"humanoid3d_{name}.txt")
    return load_motion(folder / "humanoid3d_walk.txt"), replace(target, events={"target": frame})
