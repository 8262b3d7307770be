"""A body that is not ours goes the whole way: imported, prepared, tracked, validated; and is refused where fights are."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from generated_clips import bvh_of, orientations

import simprep
from simprep.character import SIDES, Character
from simprep.characters import character_of_name
from simprep.duel.stream.store import save_stream
from simprep.duel.stream.stream import DuelStream
from simprep.errors import MotionError, MotionFileError, SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.motion.edit import cut, mirror, repeat
from simprep.motion.kinematics import body_clearance, forward_kinematics
from simprep.motion.load import import_motion
from simprep.motion.motion import Motion
from simprep.primitive_robot import primitive_robot
from simprep.study.plan import ARMS

ROOT = Path(__file__).resolve().parents[1]
CAPTURED = ("deepmimic/humanoid3d_walk.txt", "deepmimic/humanoid3d_kick.txt", "bandai-namco/punch_normal_001.bvh")


@pytest.fixture
def robot() -> Character:
    return primitive_robot()


def as_bvh(motion: Motion, path: Path) -> Path:
    """A motion of ours as the file of a foreign skeleton."""
    turn = orientations(motion.qpos)
    text = bvh_of(
        motion.qpos, turn, np.random.default_rng(3), round(motion.fps), "cmu", "t", "y", 0.01, 3, inserted=False
    )
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def moves(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int]:
    """Folder with a walk and a jab of the robot, imported from foreign files; and the frame in which the jab begins."""
    folder = tmp_path_factory.mktemp("robot")
    walk = replace(repeat(simprep.library_motion("walk"), 2), loop=False)
    jab = simprep.library_motion("jab_left_head")
    for name, motion in (("walk", cut(walk, 0, 72)), ("jab", jab)):
        simprep.save_motion(
            simprep.load_motion(as_bvh(motion, folder / f"{name}.bvh"), character=primitive_robot(), fps=60),
            folder / f"{name}.npz",
        )
    return folder, round(jab.events["target"] * 60 / jab.fps)


def test_it_is_another_body(robot: Character) -> None:
    ours = humanoid()
    assert len(robot.joints) == 29
    assert not set(robot.joints) & set(ours.joints)
    first_leg, first_arm = (robot.joint(robot.group(f"left_{limb}")[0]) for limb in ("leg", "arm"))
    assert first_leg < first_arm  # ours has its arms first
    assert robot != ours
    axes = dict(zip(robot.joints, robot.model.jnt_axis[1:]))
    about = {"roll": [1, 0, 0], "pitch": [0, 1, 0], "yaw": [0, 0, 1], "knee": [0, 1, 0], "elbow": [0, 1, 0]}
    assert all(axis.tolist() == about[name.rpartition("_")[2]] for name, axis in axes.items())
    knee = robot.joint("left_knee")
    np.testing.assert_allclose(np.degrees(robot.limits[knee]), [-3, 150])
    np.testing.assert_allclose([*robot.gains[knee], robot.torque_limits[knee]], [300, 20, 150])
    assert character_of_name("primitive_robot") == robot
    with pytest.raises(UnknownNameError, match=r"character 'centaur'.*humanoid, primitive_robot"):
        character_of_name("centaur")
    with pytest.raises(SettingError, match=r"simprep_primitive_robot.* has no 'neck'.*it has pelvis, thorax"):
        robot.segment("neck")
    assert body_clearance(robot.standing_qpos[None], robot).min() == pytest.approx(0, abs=1e-12)


def test_a_mirrored_pose_is_mirrored_in_space(robot: Character) -> None:
    rng = np.random.default_rng(5)
    qpos = np.tile(robot.standing_qpos, (4, 1))
    low, high = robot.model.jnt_range[1:].T
    qpos[:, 7:] = rng.uniform(low, high, (4, len(low)))
    motion = Motion(qpos, 30.0, np.ones((4, 2), bool), character=robot)
    one, other = (forward_kinematics(m.qpos, robot) for m in (motion, mirror(motion)))
    swap = robot.mirror_segments
    np.testing.assert_allclose(other.xpos[:, swap], one.xpos * [1, -1, 1], atol=1e-9)


@pytest.mark.parametrize("name", CAPTURED)
def test_captured_clips_are_imported(robot: Character, data_dir: Path, name: str) -> None:
    result = import_motion(data_dir / name, character=robot)
    assert result.motion.character == robot
    assert not result.report.doubtful, result.report.warnings
    assert set(result.report.check.limbs) == {
        f"{side}_{part}" for side in SIDES for part in ("upper_arm", "forearm", "thigh", "shank")
    }
    assert body_clearance(result.motion.qpos, robot).min() > -0.01


def test_imports_and_runs_are_read_back(moves: tuple[Path, int], robot: Character, tmp_path: Path) -> None:
    walk = simprep.read_motion(moves[0] / "walk.npz")
    assert walk.character == robot
    run = simprep.track(walk[:30], "pd")
    assert run.qpos.shape[1] == robot.nq
    assert simprep.read_run(simprep.save_run(run, tmp_path / "run.npz")) == run


def test_files_refuse_a_character_that_they_cannot_name(robot: Character, tmp_path: Path) -> None:
    motion = Motion(
        np.tile(robot.standing_qpos, (4, 1)), 30.0, np.ones((4, 2), bool), character=replace(robot, name="mine")
    )
    with pytest.raises(MotionError, match=r"a file cannot name <Character mine.*; valid: simprep_humanoid, "):
        motion.save(tmp_path / "mine.npz")
    assert not list(tmp_path.iterdir())


def test_postures_are_optimised(moves: tuple[Path, int]) -> None:
    folder, first = moves
    walk, jab = (simprep.read_motion(folder / f"{name}.npz") for name in ("walk", "jab"))
    jab = replace(jab, events={"target": first})
    plain, optimised = (simprep.prepare(walk, jab, 1.0, optimise=optimise) for optimise in (False, True))
    legs = 7 + walk.character.lower_joints
    np.testing.assert_array_equal(plain.motion.qpos[:, legs], optimised.motion.qpos[:, legs])
    distance = [simprep.evaluate_motion(one.motion)["com_cos_mm"] for one in (plain, optimised)]
    assert distance[1] < distance[0]


def test_mpc_stays_up_from_walk_to_jab(moves: tuple[Path, int]) -> None:
    folder, first = moves
    arguments = ["--locomotion", "walk.npz", "--target", "jab.npz", "--target-frame", str(first), "--alpha", "1"]
    done = subprocess.run(
        [sys.executable, "-m", "simprep.cli.main", "validate", *arguments, "--no-pictures", "-o", "study", "--json"],
        capture_output=True, text=True, cwd=folder, env={**os.environ, "PYTHONPATH": str(ROOT)}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    cases = json.loads(done.stdout)["cases"]
    assert len(cases) == 2 * len(ARMS)
    for case in cases:
        assert case["success"] == (case["controller"] == "mpc"), case


def test_fights_refuse_it(moves: tuple[Path, int], tmp_path: Path) -> None:
    jab = simprep.read_motion(moves[0] / "jab.npz")
    with pytest.raises(
        MotionFileError, match=r"player A is <Character simprep_primitive_robot.* made for simprep_humanoid"
    ):
        save_stream(DuelStream((jab, jab)), tmp_path / "stream.npz")


def test_the_planner_leaves_out_its_wrists(robot: Character) -> None:
    from simprep.physics.planner import build_planner
    from simprep.scene import SceneSettings, build_scene

    scene = SceneSettings((robot, humanoid()))
    world = build_scene(scene)
    planner = build_planner(world, scene, 1 / 120)
    kept = {planner.model.joint(index).name for index in range(planner.model.njnt)}
    everything = {world.joint(index).name for index in range(world.njnt)}
    fused = {f"a_{name}" for name in robot.fused} | {f"b_{name}" for name in humanoid().fused}
    assert everything - kept == fused
    assert [mujoco.mj_id2name(world, mujoco.mjtObj.mjOBJ_BODY, segment) for segment in planner.fused] == [
        "b_neck",
        "b_head",
    ]
