"""Real clips through the whole import: the bars of agreement, residual, speed, and the state of the ground contact."""

import time
from pathlib import Path

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from simprep.character import SIDES
from simprep.humanoid_model import humanoid
from simprep.motion.contacts import detect_contacts, stances
from simprep.motion.edit import resample
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.load import ImportResult, import_motion
from simprep.motion.motion import Motion

CLIPS = (
    *(f"deepmimic/humanoid3d_{name}.txt" for name in ("walk", "run", "punch", "kick", "jump", "crawl")),
    *(f"cmu/asfamc/02_0{take}.amc" for take in (1, 3, 4, 5)),
    *(
        f"cmu/bvh/{take}.bvh"
        for take in ("002_01", "002_02", "002_03", "002_04", "002_05", "003_01", "007_01", "007_04")
    ),
    *(
        f"bandai-namco/{name}_normal_001.bvh"
        for name in ("walk", "walk-left", "walk-right", "walk-back", "run", "punch", "kick")
    ),
    "pairs/18_01.bvh",
    "pairs/19_01.bvh",
)


@pytest.fixture(scope="module")
def load(data_dir: Path):
    """Import a clip once; the second value is how long it took [s]."""
    done: dict[str, tuple[ImportResult, float]] = {}

    def get(name: str) -> tuple[ImportResult, float]:
        if name not in done:
            if not done:
                import_motion(data_dir / CLIPS[0])  # the libraries' own first-call cost
            start = time.process_time()
            result = import_motion(data_dir / name)
            done[name] = result, time.process_time() - start
        return done[name]

    return get


@pytest.mark.parametrize("name", CLIPS)
def test_every_clip_meets_the_bars(load, name: str) -> None:
    result, seconds = load(name)
    motion, report = result.motion, result.report
    assert report.residual_mm <= (35 if "crawl" in name else 25)
    assert report.duration_s >= 5 * seconds
    model = humanoid().model
    low, high = model.jnt_range[1:].T
    assert (motion.qpos[:, 7:] >= low - 1e-6).all()
    assert (motion.qpos[:, 7:] <= high + 1e-6).all()
    # no flips: the fastest human joints (a boxer's elbow, a kicker's knee) stay below 35 rad/s
    assert np.abs(np.diff(motion.qpos[:, 7:], axis=0)).max() * motion.fps < 35
    points = forward_kinematics(motion.qpos).foot_points
    assert points[..., 2].min() > -0.005
    standing = points[..., 2].min(axis=2)[motion.contacts]
    assert len(standing) > 0
    assert np.percentile(standing, 95) < 0.006  # stance feet do not float
    assert lowest_of_body(motion).min() > -0.01


@pytest.mark.parametrize("name", [name for name in CLIPS if "walk" in name or "02_01" in name or "run" in name])
def test_stance_feet_of_gait_stand_still(load, name: str) -> None:
    motion = load(name)[0].motion
    points = forward_kinematics(motion.qpos).foot_points
    drift = [
        stance_drift(points[first:after, side]) for side in (0, 1) for first, after in stances(motion.contacts[:, side])
    ]
    assert np.median(drift) < 0.005
    # a few stances of walking sideways turn on the foot
    assert np.mean(np.array(drift) < 0.005) >= (0.6 if "left" in name or "right" in name else 0.99)


def test_one_take_in_two_formats_is_one_motion(load) -> None:
    """CMU 02_01 as ASF/AMC at 120 Hz and as another laboratory's BVH at 60 Hz, aligned in time and in plan."""
    a = load("cmu/asfamc/02_01.amc")[0].motion
    b = load("cmu/bvh/002_01.bvh")[0].motion
    first = forward_kinematics(a.qpos).xpos
    second = forward_kinematics(resample(b, a.fps).qpos).xpos
    best = min(
        aligned_distance(first[max(0, lag) : max(0, lag) + n], second[max(0, -lag) : max(0, -lag) + n])
        for lag in range(-12, 13)
        for n in [min(len(first), len(second)) - 12]
    )
    assert best < 0.040
    # and the trunk and legs agree in the mean as joint angles, in spite of other joints in the spine
    n = min(len(a), len(b))
    difference = np.abs((a.qpos[:n] - b.qpos[:n]).mean(axis=0))
    for name in (
        "lumbar_flexion",
        "thorax_flexion",
        "left_hip_flexion",
        "right_knee_flexion",
        "left_ankle_dorsiflexion",
    ):
        assert difference[7 + humanoid().joint(name)] < np.radians(15)


@pytest.mark.parametrize("name", ["deepmimic/humanoid3d_walk.txt", "deepmimic/humanoid3d_run.txt"])
def test_loops_close(load, name: str) -> None:
    motion = load(name)[0].motion
    assert motion.loop
    hinges = motion.qpos[:, 7:]
    steps = np.abs(np.diff(hinges, axis=0)).max(axis=1)
    assert np.abs(hinges[0] - hinges[-1]).max() < 1.3 * steps.max()


def test_inserted_pose_is_dropped_and_reported(load) -> None:
    report = load("cmu/bvh/007_04.bvh")[0].report
    assert report.frames == 224  # of 225
    assert any("inserted rest pose" in warning for warning in report.warnings)
    assert not any("inserted" in warning for warning in load("cmu/bvh/002_01.bvh")[0].report.warnings)


def test_units_axes_and_oddities_are_reported(load) -> None:
    cmu = load("pairs/18_01.bvh")[0].report
    assert cmu.up == "y"
    assert cmu.scale == pytest.approx(0.0254 / 0.45)
    assert cmu.fps == 60
    assert any("frame rate reduced from 120 to 60" in warning for warning in cmu.warnings)
    acclaim = load("cmu/asfamc/02_01.amc")[0].report
    assert acclaim.scale == pytest.approx(0.0254 / 0.45)
    bandai = load("bandai-namco/walk_normal_001.bvh")[0].report
    assert bandai.scale == 0.01
    assert any("inner joints have position channels" in warning for warning in bandai.warnings)
    lost = load("cmu/bvh/002_03.bvh")[0].report
    assert any("vertical movement is lost" in warning for warning in lost.warnings)


def test_contacts_do_not_depend_on_the_frame_rate(load) -> None:
    motion = load("cmu/asfamc/02_01.amc")[0].motion
    at_60 = detect_contacts(motion.qpos, motion.fps)
    for fps in (30.0, 120.0):
        other = resample(motion, fps)
        found = detect_contacts(other.qpos, fps)
        expected = at_60[np.clip(np.round(other.times * motion.fps).astype(int), 0, len(at_60) - 1)]
        assert (found == expected).mean() > 0.95


def test_overrides(data_dir: Path) -> None:
    file = data_dir / "deepmimic" / "humanoid3d_punch.txt"
    fast = import_motion(file, fps=60.0)
    assert fast.report.fps == 60
    assert fast.report.frames == 129  # 64 intervals at 30 Hz
    acclaim = import_motion(data_dir / "cmu" / "asfamc" / "02_03.amc", scale=0.06, up="y", fps=30)
    assert (acclaim.report.scale, acclaim.report.up, acclaim.report.fps) == (0.06, "y", 30)


def aligned_distance(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Mean joint distance after the best turn about the vertical and shift on the floor (Kabsch in the plane)."""
    p, q = a.reshape(-1, 3), b.reshape(-1, 3)
    centre_p, centre_q = p[:, :2].mean(axis=0), q[:, :2].mean(axis=0)
    u = (q[:, :2] - centre_q).T @ (p[:, :2] - centre_p)
    angle = np.arctan2(u[0, 1] - u[1, 0], u[0, 0] + u[1, 1])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = np.concatenate([(q[:, :2] - centre_q) @ turn.T + centre_p, q[:, 2:]], axis=1)
    return float(np.linalg.norm(moved - p, axis=-1).mean())


def stance_drift(points: NDArray[np.float64]) -> float:
    """Largest horizontal travel of a sole point (n, 4, 3) while it is within 3 mm of the floor [m]."""
    out = 0.0
    for point in range(points.shape[1]):
        path = points[points[:, point, 2] < 0.003, point, :2]
        if len(path) > 1:
            out = max(out, float(np.linalg.norm(path - path[0], axis=-1).max()))
    return out


def lowest_of_body(motion: Motion) -> NDArray[np.float64]:
    """Height of the lowest colliding point of each frame (T,) [m], by MuJoCo's own geom positions."""
    model = humanoid().model
    data = mujoco.MjData(model)
    geoms = [g for g in range(model.ngeom) if model.geom_contype[g]]
    assert {f"{side}_heel" for side in SIDES} <= {model.geom(g).name for g in geoms}
    out = np.empty(len(motion))
    for frame, qpos in enumerate(motion.qpos):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        heights = []
        for g in geoms:
            reach = model.geom_size[g, 1] * abs(data.geom_xmat[g, 8]) if model.geom_type[g] == 3 else 0.0
            heights.append(data.geom_xpos[g, 2] - reach - model.geom_size[g, 0])
        out[frame] = min(heights)
    return out
