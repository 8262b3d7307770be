"""Retargeting and footholds: our own body must come back, and feet must stand where they stood."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simprep.character import Character
from simprep.humanoid_model import humanoid
from simprep.motion.closed_form import closed_form
from simprep.motion.foot_passage import place_feet
from simprep.motion.footholds import FootPoses, sole_points
from simprep.motion.ground import place_on_floor
from simprep.motion.import_check import check_import
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.retarget import RetargetSettings, solve
from simprep.motion.targets import ORIENTED, Targets


def own_targets(qpos: np.ndarray, fps: float = 60.0, character: Character = humanoid()) -> Targets:
    """Targets taken from our own body."""
    pose = forward_kinematics(qpos, character)
    turn = Rotation.from_quat(pose.xquat[:, ORIENTED].reshape(-1, 4), scalar_first=True).as_matrix()
    return Targets(pose.xpos, turn.reshape(len(qpos), len(ORIENTED), 3, 3), np.ones(5, dtype=bool), fps, None)


def residual_mm(qpos: np.ndarray, targets: Targets) -> float:
    return check_import(qpos, np.zeros(len(qpos), dtype=bool), targets, humanoid()).residual_mm


def boxing(frames: int = 60) -> np.ndarray:
    """A standing body that swings arms, trunk and head."""
    t = np.linspace(0, 2 * np.pi, frames)
    qpos = np.tile(humanoid().standing_qpos.copy(), (frames, 1))
    for name, centre, amplitude, phase in (
        ("left_shoulder_flexion", 0.8, 0.6, 0.0),
        ("left_shoulder_abduction", 0.3, 0.3, 1.0),
        ("left_shoulder_rotation", 0.2, 0.4, 2.0),
        ("left_elbow_flexion", 1.2, 0.5, 0.5),
        ("right_shoulder_flexion", 0.5, 0.7, 3.0),
        ("right_elbow_flexion", 1.5, 0.6, 2.0),
        ("lumbar_rotation", 0.0, 0.3, 0.0),
        ("thorax_flexion", 0.1, 0.2, 1.0),
        ("neck_rotation", 0.0, 0.3, 1.5),
        ("left_knee_flexion", 0.6, 0.3, 0.0),
        ("left_hip_flexion", 0.4, 0.2, 0.0),
        ("right_hip_abduction", 0.2, 0.1, 0.0),
    ):
        qpos[:, 7 + humanoid().joint(name)] = centre + amplitude * np.sin(t + phase)
    return qpos


def test_our_own_motion_comes_back() -> None:
    qpos = boxing()
    targets = own_targets(qpos)
    none = np.zeros((len(qpos), 2), dtype=bool)
    exact = RetargetSettings(posture_cost=1e-5, tolerance=1e-6)
    solution = solve(targets, none, humanoid(), exact, floor=False)
    found = solution.qpos
    assert not solution.unsettled.any()
    assert residual_mm(found, targets) < 0.1
    elbow = 7 + humanoid().joint("left_elbow_flexion")
    assert found[:, elbow] == pytest.approx(qpos[:, elbow], abs=2e-3)
    # with the working settings a little is given to smoothness
    assert residual_mm(solve(targets, none, humanoid(), floor=False).qpos, targets) < 4


def test_closed_form_start_is_near_for_bent_limbs() -> None:
    """Random poses with bent elbows and knees within the limits: the start is near enough to converge to them."""
    rng = np.random.default_rng(3)
    model = humanoid().model
    low, high = model.jnt_range[1:].T
    qpos = np.tile(humanoid().standing_qpos.copy(), (40, 1))
    qpos[:, 7:] = rng.uniform(0.5 * low, 0.5 * high, (40, 37))
    for side in ("left", "right"):
        qpos[:, 7 + humanoid().joint(f"{side}_elbow_flexion")] = rng.uniform(0.4, 2.0, 40)
        qpos[:, 7 + humanoid().joint(f"{side}_knee_flexion")] = rng.uniform(0.4, 2.0, 40)
    turn = Rotation.random(40, random_state=5)
    qpos[:, 3:7] = turn.as_quat(scalar_first=True)
    targets = own_targets(qpos)
    alone = [slice(frame, frame + 1) for frame in range(40)]  # the poses have nothing to do with each other
    start = np.concatenate([
        closed_form(replace(targets, positions=targets.positions[f], orientations=targets.orientations[f]), humanoid())
        for f in alone
    ])  # fmt: skip
    distance = np.linalg.norm(forward_kinematics(start).xpos - targets.positions, axis=-1).mean(axis=1)
    assert np.median(distance) < 0.06
    assert (start[:, 7:] >= low - 1e-9).all()
    assert (start[:, 7:] <= high + 1e-9).all()


def test_a_floating_body_is_set_down_and_a_sunken_one_lifted() -> None:
    for error in (-0.07, 0.11):
        qpos = boxing()
        qpos[:, 2] += error
        qpos[:, 7 + humanoid().joint("left_knee_flexion")] = 0
        qpos[:, 7 + humanoid().joint("left_hip_flexion")] = 0
        qpos[:, 7 + humanoid().joint("right_hip_abduction")] = 0
        placed = place_on_floor(own_targets(qpos), humanoid())
        lowest = forward_kinematics(placed.qpos).foot_points[..., 2].min(axis=2)
        assert lowest == pytest.approx(np.zeros_like(lowest), abs=2e-3)
        assert placed.contacts.all()
        assert residual_mm(placed.qpos, own_targets(qpos)) < 8


def feet_of(position: np.ndarray, rotation: np.ndarray) -> FootPoses:
    """The same path for the left foot, and a right foot that always stands."""
    still = np.tile([0.0, -0.2, 0.073], (len(position), 1))
    eye = np.tile(np.eye(3), (len(position), 1, 1))
    return FootPoses(np.stack([position, still], axis=1), np.stack([rotation, eye], axis=1))


@pytest.mark.parametrize("fps", [30.0, 60.0, 120.0])
def test_a_sliding_foot_rolls_without_sliding(fps: float) -> None:
    """One stance, with heel strike, flat foot and toe-off, that drifts by 4 cm and floats by 1 cm."""
    n = round(0.8 * fps)
    t = np.linspace(0, 1, n)
    pitch = np.interp(t, [0, 0.15, 0.25, 0.7, 0.8, 1], [-0.4, -0.3, 0, 0, 0.3, 0.8])
    rotation = Rotation.from_euler("y", pitch[:, None]).as_matrix()
    position = np.stack([0.04 * t, 0.1 + 0 * t, 0.083 + 0 * t], axis=1)
    feet = feet_of(position, rotation)
    lowest = sole_points(feet, humanoid())[:, 0, :, 2].min(axis=1)
    position[:, 2] += 0.01 - lowest
    contacts = np.ones((n, 2), dtype=bool)
    knees = feet.position + np.array([0.05, 0.0, 0.43])
    hips = knees + np.array([-0.05, 0.0, 0.42])
    placed, kept = place_feet(feet_of(position, rotation), hips, knees, contacts, fps, humanoid())
    # it lets go when its rigid toe would push the leg too far up, late in the push-off
    held = kept[:, 0]
    assert held[: round(0.8 * n)].all()
    assert kept[:, 1].all()
    points = sole_points(placed, humanoid())[:, 0]
    assert points[held, :, 2].min(axis=1) == pytest.approx(np.zeros(held.sum()), abs=1e-9)
    assert points[..., 2].min() > -1e-9
    points = points[held]
    for point in range(4):
        down = points[points[:, point, 2] < 0.001, point, :2]
        assert len(down) == 0 or np.linalg.norm(down - down[0], axis=1).max() < 0.004
    tilt = Rotation.from_matrix(placed.rotation[:, 0]).as_euler("ZYX")[:, 1]
    assert tilt[0] == pytest.approx(-0.4, abs=0.1)  # the roll stays, but for what the legs ask
    assert tilt.max() > 0.5


def test_corrections_fade_smoothly_into_the_swing() -> None:
    fps, n = 60.0, 120
    t = np.arange(n) / fps
    x = np.where(
        t < 0.7, 0.02 * t, np.where(t < 1.2, 0.014 + 0.8 * (0.5 - 0.5 * np.cos(np.pi * (t - 0.7) / 0.5)), 0.814)
    )
    z = 0.09 + np.where((t > 0.7) & (t < 1.2), 0.08 * np.sin(np.pi * (t - 0.7) / 0.5) ** 2, 0)
    position = np.stack([x, 0.1 + 0 * t, z], axis=1)
    contacts = np.ones((n, 2), dtype=bool)
    contacts[(t >= 0.7) & (t <= 1.2), 0] = False
    eye = np.tile(np.eye(3), (n, 1, 1))
    feet = feet_of(position, eye)
    knees = feet.position + np.array([0.05, 0.0, 0.43])
    placed, _ = place_feet(feet, knees + np.array([-0.05, 0.0, 0.42]), knees, contacts, fps, humanoid())
    path = placed.position[:, 0]
    # no pops: accelerations stay in the range of the source's own
    before = np.abs(np.diff(position, 2, axis=0)).max() * fps**2
    assert np.abs(np.diff(path, 2, axis=0)).max() * fps**2 < 2 * before
    stance = path[t < 0.69]
    assert np.abs(stance - stance[0]).max() < 1e-9
    assert sole_points(placed, humanoid())[..., 2].min() > -1e-9


def test_another_body(tmp_path: Path) -> None:
    """A small person imports the same clip with its own leg length and stays on the floor."""
    from motion_files import bvh_text, write

    from simprep.motion.load import import_motion

    small = humanoid(1.5, 50.0)
    result = import_motion(write(tmp_path, "a.bvh", bvh_text()), character=small)
    assert result.motion.character == small
    assert result.motion.qpos[0, 2] == pytest.approx(small.standing_qpos.copy()[2], abs=0.03)
    assert result.report.residual_mm < 10
    assert len(humanoid().segments) == 17
