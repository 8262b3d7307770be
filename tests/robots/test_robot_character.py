"""A robot's MJCF and TOML make a character: the same kinematics, servos with its limits, soles on the floor."""

import pickle
from dataclasses import replace
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
import pytest
from robot_models import ARMATURE, TORQUE_NM, robot_xml, toml_of, write_robot

import simprep
from simprep.archive import open_archive
from simprep.character import SIDES
from simprep.errors import MotionError, MotionFileError
from simprep.motion.edit import cut, mirror, repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.transfer import transferred
from simprep.robots.load import load_robot
from simprep.robots.resolve import shipped_robots
from simprep.robots.source import read_robot_model


def random_poses(robot: simprep.Character, count: int = 5) -> np.ndarray:
    rng = np.random.default_rng(7)
    root = np.column_stack([rng.normal(size=(count, 3)), np.tile([1.0, 0, 0, 0], (count, 1))])
    return np.column_stack([root, rng.uniform(*robot.limits.T, (count, len(robot.joints)))])


@pytest.mark.parametrize("degrees", [False, True])
def test_joint_angles_mean_what_they_mean_in_the_file(tmp_path: Path, degrees: bool) -> None:
    path = write_robot(tmp_path, robot_xml(degrees=degrees))
    robot = load_robot(path)
    _, source = read_robot_model(path)
    assert robot.limits == pytest.approx(np.tile([-2.5, 2.5], (21, 1)))
    own, theirs = mujoco.MjData(robot.model), mujoco.MjData(source)
    for qpos in random_poses(robot):
        own.qpos[:], theirs.qpos[:] = qpos, qpos
        mujoco.mj_kinematics(robot.model, own)
        mujoco.mj_kinematics(source, theirs)
        for name in robot.segments:
            np.testing.assert_allclose(own.body(name).xpos, theirs.body(name).xpos, atol=1e-12)
            np.testing.assert_allclose(own.body(name).xmat, theirs.body(name).xmat, atol=1e-12)


@pytest.mark.parametrize("feet", ["capsules", "box", "mesh", "spheres"])
def test_it_stands_on_soles_where_its_feet_are(tmp_path: Path, feet: str) -> None:
    robot = load_robot(write_robot(tmp_path, robot_xml(feet)))
    points = forward_kinematics(robot.standing_qpos[None], robot).foot_points[0]  # (2, N, 3)
    np.testing.assert_allclose(points[..., 2], 0.0, atol=1e-12)
    ends = {"capsules": (-0.05, 0.12), "box": (-0.055, 0.125), "mesh": (-0.045, 0.135), "spheres": (-0.05, 0.12)}[feet]
    radius = robot.model.geom_size[robot.sole_geoms, 0]
    ankle = forward_kinematics(robot.standing_qpos[None], robot).xpos[0, list(robot.feet)]
    reach = radius if feet in ("box", "mesh") else 0.0  # corners of boxes and meshes lie within the spheres
    along = points[..., 0] - ankle[:, None, 0]
    assert along.min() == pytest.approx(ends[0] + np.min(reach), abs=1e-6)
    assert along.max() == pytest.approx(ends[1] - np.min(reach), abs=1e-6)
    elbow = robot.segment("left_forearm")
    hand = robot.skeleton.rest_offset("left_hand")
    np.testing.assert_allclose(hand, [0, 0, -0.2], atol=1e-12)  # hanging, though it points forward at 0
    assert robot.standing_qpos[7 + robot.joint("left_elbow")] == pytest.approx(np.pi / 2)
    assert robot.segments[elbow] == "left_forearm"


@pytest.mark.parametrize(
    ("kind", "kp", "kd"),
    [
        ("position", 70.0, 4.0),
        ("general", 60.0, 3.0),
        ("motor", ARMATURE * (20 * np.pi) ** 2, 4 * ARMATURE * 20 * np.pi),
    ],
)
def test_every_hinge_gets_one_servo_with_the_robots_limits(tmp_path: Path, kind: str, kp: float, kd: float) -> None:
    robot = load_robot(write_robot(tmp_path, robot_xml(actuators=kind)))
    model = robot.model
    assert [model.actuator(number).name for number in range(model.nu)] == list(robot.joints)
    np.testing.assert_allclose(robot.gains, np.tile([kp, kd], (21, 1)))
    np.testing.assert_allclose(model.actuator_biasprm[:, 1], -kp)
    wanted = [next(value for part, value in TORQUE_NM.items() if part in name) for name in robot.joints]
    np.testing.assert_allclose(robot.torque_limits, wanted)
    np.testing.assert_allclose(model.dof_armature[6:], ARMATURE)


def test_the_description_overrides_the_file(tmp_path: Path) -> None:
    more = "own_gains = false\nfrequency_hz = 5.0\ndamping_ratio = 1.0\nlocked = ['waist']\nheight_m = 1.1"
    drive = "[[drive]]\njoints = ['*_knee']\narmature = 0.02\ntorque = 33.0\nvelocity = 9.0\n[[drive]]\njoints = ['*']\nvelocity = 8.0\n"
    toml = toml_of(more=more).replace('lumbar_rotation = "waist"\n', "") + drive
    robot = load_robot(write_robot(tmp_path, robot_xml(), toml))
    assert "waist" not in robot.joints
    knee, hip = robot.joint("left_knee"), robot.joint("left_hip_yaw")
    omega = 10 * np.pi
    np.testing.assert_allclose(robot.gains[knee], [0.02 * omega**2, 2 * 0.02 * omega])
    np.testing.assert_allclose(robot.gains[hip], [ARMATURE * omega**2, 2 * ARMATURE * omega])
    assert (robot.torque_limits[knee], robot.torque_limits[hip]) == (33.0, 90.0)
    assert (robot.velocity_limits[knee], robot.velocity_limits[hip]) == (9.0, 8.0)
    assert robot.height_m == 1.1


def test_a_mirrored_pose_is_mirrored_in_space(tmp_path: Path) -> None:
    robot = load_robot(write_robot(tmp_path, robot_xml()))
    qpos = random_poses(robot)
    motion = Motion(qpos, 30.0, np.ones((len(qpos), 2), bool), character=robot)
    one, other = (forward_kinematics(m.qpos, robot) for m in (motion, mirror(motion)))
    np.testing.assert_allclose(
        other.xpos[:, robot.mirror_segments], one.xpos * [1, -1, 1], atol=1e-6
    )  # quats of 7 digits


def test_it_is_pickled_and_found_again(tmp_path: Path) -> None:
    path = write_robot(tmp_path, robot_xml())
    robot = load_robot(path)
    assert pickle.loads(pickle.dumps(robot)) == robot
    motion = Motion(np.tile(robot.standing_qpos, (12, 1)), 30.0, np.ones((12, 2), bool), character=robot)
    file = simprep.save_motion(motion, tmp_path / "motion.npz")
    assert simprep.read_motion(file) == motion
    run = simprep.track(motion, controller="pd")
    assert simprep.read_run(simprep.save_run(run, tmp_path / "run.npz")) == run
    with open_archive(file, "simprep motion", "simprep.motion/1") as (header, _):
        assert header["robot"] == {"mjcf": str(path), "toml": str(path.with_suffix(".toml"))}
        assert header["digest"] == robot.digest
    path.write_text(robot_xml().replace("-0.28", "-0.29"))
    with pytest.raises(MotionFileError, match=r"robot 'synthetic'.*has changed since.*synthetic\.xml.*as they were"):
        simprep.read_motion(file)
    path.unlink()
    with pytest.raises(MotionFileError, match=r"robot 'synthetic'.*synthetic\.xml: no such file"):
        simprep.read_motion(file)


def test_the_digest_does_not_name_a_folder(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    one, other = (load_robot(write_robot(tmp_path / name, robot_xml("mesh"))) for name in "ab")
    assert one == other


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> simprep.Character:
    drive = "[[drive]]\njoints = ['*']\nvelocity = 20.0\n"
    return load_robot(write_robot(tmp_path_factory.mktemp("robot"), robot_xml(), toml_of() + drive))


@pytest.fixture(scope="module")
def walk(robot: simprep.Character) -> Motion:
    two = replace(repeat(simprep.library_motion("walk"), 2), loop=False)
    result = transferred(cut(two, 0, 72), robot)
    assert not result.report.doubtful, result.report.warnings
    assert result.report.residual_mm < 8
    assert len(result.motion) == 72
    return result.motion


def test_a_walk_moves_onto_it(robot: simprep.Character, walk: Motion) -> None:
    kinematics = forward_kinematics(walk.qpos, robot)
    low = kinematics.foot_points[..., 2].min(axis=-1)
    assert low.min() > -1e-3
    assert low[walk.contacts].max() < 2e-3
    slip = np.linalg.norm(np.diff(kinematics.foot_points[..., :2], axis=0), axis=-1).min(axis=-1) * walk.fps
    assert np.median(slip[walk.contacts[1:] & walk.contacts[:-1]]) < 0.02
    assert (walk.qpos[:, 7:] >= robot.limits[:, 0] - 1e-9).all()
    assert (walk.qpos[:, 7:] <= robot.limits[:, 1] + 1e-9).all()
    speed = np.abs(np.diff(walk.qpos[:, 7:], axis=0)) * walk.fps
    assert (speed <= np.array(robot.velocity_limits)).all()


def test_it_walks_within_its_limits(robot: simprep.Character, walk: Motion) -> None:
    run = simprep.track(walk, seed=0)
    metrics = simprep.evaluate_run(run)
    assert run.end == "done"
    assert run.assist.force_n == 0
    assert (np.abs(run.torque) <= run.torque_limit + 1e-9).all()
    assert metrics["peak_speed_share"] < 1
    assert metrics["mpjpe_mm"] < 80


class Jump:
    """Servo targets that jump away from the first pose by some angles [rad]."""

    name = "jump"

    def __init__(self, task: simprep.ControlTask, change: dict[int, float]) -> None:
        self.targets = task.references[0].qpos[0, 7:].copy()
        for joint, angle in change.items():
            self.targets[joint] += angle

    def target(self, step: int, data: mujoco.MjData) -> np.ndarray:
        return self.targets

    def settings(self) -> dict[str, object]:
        return {}


@pytest.mark.parametrize(
    "change",
    [
        {"left_elbow": -2.0},
        {"left_hip_pitch": -2.0, "left_knee": 2.0},
        {"left_shoulder_pitch": -2.0, "left_shoulder_roll": 2.0, "left_elbow": -2.0, "waist": 2.0},
    ],
)
def test_motors_stop_at_their_largest_speed(tmp_path: Path, change: dict[str, float]) -> None:
    """Targets jump by 2 rad: the joints turn as fast as they may, not faster, also where one swings the other."""
    peaks = []
    for limit in (100.0, 6.0):
        toml = toml_of() + f"[[drive]]\njoints = ['*']\nvelocity = {limit}\n"
        robot = load_robot(write_robot(tmp_path, robot_xml(), toml))
        motion = Motion(np.tile(robot.standing_qpos, (15, 1)), 30.0, np.ones((15, 2), bool), character=robot)
        angles = {robot.joint(name): angle for name, angle in change.items()}
        run = simprep.track(motion, controller=partial(Jump, change=angles))
        peaks.append(np.abs(run.qvel[:, 6:]).max())
    assert peaks[0] > 9
    assert 5.4 < peaks[1] <= 6.0


def test_a_motion_goes_there_and_back(robot: simprep.Character, walk: Motion) -> None:
    back = transferred(walk, simprep.humanoid())
    assert not back.report.doubtful, back.report.warnings
    assert back.report.residual_mm < 8
    assert back.motion.events == walk.events


def test_files_of_other_robots_are_not_mixed_up(tmp_path: Path, walk: Motion) -> None:
    with pytest.raises(MotionError):
        Motion(walk.qpos, walk.fps, walk.contacts, character=simprep.humanoid())


@pytest.mark.parametrize("name", sorted(shipped_robots()))
def test_shipped_descriptions_are_complete(name: str) -> None:
    from simprep.robots.description import read_description

    known = read_description(shipped_robots()[name])
    assert known.name == name
    assert known.menagerie.startswith(f"{name}/")
    for side in SIDES:
        for movement in ("hip_flexion", "hip_abduction", "hip_rotation", "knee_flexion", "ankle_dorsiflexion"):
            assert f"{side}_{movement}" in known.movements
        for part in ("upper_arm", "forearm", "hand", "thigh", "shank", "foot"):
            assert f"{side}_{part}" in known.roles
    assert len(set(known.movements.values())) == len(known.movements)


def test_the_g1_is_found_by_its_joints_and_walks(data_dir: Path, g1_model: Path) -> None:
    robot = load_robot(g1_model)
    assert robot.name == "unitree_g1"
    assert len(robot.joints) == 29
    assert robot.torque_limits[robot.joint("left_knee_joint")] == 139
    motion = simprep.load_motion(data_dir / "deepmimic/humanoid3d_walk.txt", character=robot)
    run = simprep.track(replace(repeat(motion, 2), loop=False), seed=0)
    metrics = simprep.evaluate_run(run)
    assert metrics["success"]
    assert metrics["mpjpe_mm"] < 50
    assert metrics["peak_speed_share"] < 1
