"""Every seeded fault is found on built-in motions, and clean motions raise nothing."""

from dataclasses import replace

import numpy as np
import pytest
from faults import FAULTS, Fault, once

from simprep.character import SIDES
from simprep.check.dynamics import frame_rate, pendulum_height
from simprep.check.motion_check import check_motion
from simprep.check.subject import subject
from simprep.library.registry import library_motion
from simprep.motion.kinematics import body_clearance, forward_kinematics
from simprep.motion.load import import_motion
from simprep.motion.motion import Motion
from simprep.primitive_robot import primitive_robot

CLEAN = (
    "stand", "walk", "walk_fast", "walk_backward", "walk_turn_left", "walk_left", "turn_right", "step_forward", "punch_left",
    "hook_right_head", "uppercut_left_body", "block_low_left", "weave_right", "kick_front", "roundhouse_left_body",
    "guard_left_lead_forward", "crawl", "duck", "jump", "jump_far", "get_up_prone",
)  # fmt: skip
CAPTURED = (
    "deepmimic/humanoid3d_walk.txt", "deepmimic/humanoid3d_run.txt", "deepmimic/humanoid3d_kick.txt",
    "deepmimic/humanoid3d_jump.txt", "deepmimic/sie_humanoid3d_run_left08.txt", "bandai-namco/walk_normal_001.bvh",
    "bandai-namco/run_normal_001.bvh", "bandai-namco/punch_normal_001.bvh", "deepmimic/humanoid3d_getup_faceup.txt",
)  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_each_fault_is_found(fault: Fault) -> None:
    for base in fault.bases:
        motion = once(library_motion(base))
        raised = check_motion(fault.apply(motion)).raised
        assert set(raised) & set(fault.raised), f"{base}: {raised}"
        assert not set(check_motion(motion).raised) & set(fault.raised), base


@pytest.mark.parametrize("name", CLEAN)
def test_clean_motions_raise_nothing(name: str) -> None:
    assert check_motion(library_motion(name)).raised == ()


HELD_OUT = ("pairs/18_01.bvh", "pairs/19_01.bvh")
"""Clips that no threshold was looked at on."""


@pytest.mark.parametrize("name", CAPTURED + HELD_OUT)
def test_captured_motions_raise_nothing(name: str, data_dir) -> None:
    assert check_motion(import_motion(data_dir / name).motion).raised == ()


@pytest.mark.parametrize(
    "name", ["xyzw read as wxyz", "y up", "root reversed", "left and right swapped", "joints breadth first"]
)
def test_faults_are_found_on_another_body(name: str, data_dir) -> None:
    motion = import_motion(data_dir / "deepmimic/humanoid3d_walk.txt", character=primitive_robot()).motion
    fault = next(one for one in FAULTS if one.name == name)
    assert check_motion(once(motion)).raised == ()
    assert set(check_motion(fault.apply(once(motion))).raised) & set(fault.raised)


def test_a_finding_says_where() -> None:
    motion = once(library_motion("walk"))
    fault = next(one for one in FAULTS if one.name == "joint 10 deg over its limit")
    finding = check_motion(fault.apply(motion)).finding("joint range")
    assert finding.part == "left_knee_flexion"
    assert len(motion) // 2 <= finding.frame < len(motion) // 2 + 12
    assert finding.value == pytest.approx(10.0, abs=1e-6)
    assert finding.verdict == "fail"


@pytest.mark.parametrize(("turn_deg", "walks"), [(0.0, True), (30.0, True), (60.0, False), (-100.0, False)])
def test_steps_that_turn_the_body_around_are_no_walk(turn_deg: float, walks: bool) -> None:
    """Eight steps at twice a walk's rate, each 0.4 m long: all the same but for the heading."""
    body = library_motion("stand").character
    seconds_a_step, steps, fps = 0.27, 8, 60.0
    frames = round(seconds_a_step * steps * fps)
    step = np.arange(frames) / (seconds_a_step * fps)
    qpos = np.tile(body.standing_qpos, (frames, 1))
    qpos[:, 0] = 0.4 * step
    half = np.radians(turn_deg) * step / 2
    qpos[:, 3:7] = np.column_stack([np.cos(half), np.zeros(frames), np.zeros(frames), np.sin(half)])
    stands = np.column_stack([(step.astype(int) + side) % 2 == 0 for side in (0, 1)])
    motion = Motion(qpos, fps, stands, character=body)
    one = subject(motion)
    one.__dict__["standing"] = stands  # whose feet stand is given, not found
    value = frame_rate(one)[1].value
    assert (
        (value == pytest.approx(1 / seconds_a_step * np.sqrt(pendulum_height(one) / 9.81), rel=0.1))
        if walks
        else value is None
    )


def test_an_arm_that_turns_around_in_coordinates_only_is_no_fault_of_a_person() -> None:
    """Three hinges reach an orientation in two ways; a person's shoulder is one joint, a robot's has three motors."""
    stand = library_motion("stand")
    body = stand.character
    qpos = np.repeat(stand.qpos[:1], 40, axis=0)
    joints = 7 + body.joint_indices(body.group("left_arm")[:3])
    middle = joints[np.argsort([body.model.jnt_bodyid[1:][joint - 7] for joint in joints], kind="stable")][1]
    one = np.array([0.3, 0.8, 0.2])
    other = np.where(joints == middle, np.pi - one, one + np.pi)
    qpos[:20, joints], qpos[20:, joints] = one, other
    motion = Motion(qpos, 60.0, np.ones((40, 2), bool), character=body)
    assert check_motion(motion).finding("joint velocity").verdict == "pass"
    motors = replace(body, velocity_limits=(40.0,) * len(body.joints))
    assert check_motion(replace(motion, character=motors)).finding("joint velocity").verdict == "fail"


def test_who_lies_and_slides_does_not_stand_on_soles_in_the_air() -> None:
    stand = library_motion("stand")
    body = stand.character
    qpos = np.repeat(stand.qpos[:1], 40, axis=0)
    qpos[:, 3:7] = [np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0]  # on the back
    for side in SIDES:
        hip = body.joint(body.group(f"{side}_leg")[0])
        qpos[:, 7 + hip] = 1.5 * np.sign(body.limits[hip].sum())
    qpos[:, 0] = np.linspace(0, 1, 40)
    qpos[:, 2] -= body_clearance(qpos, body).min(axis=1)
    motion = Motion(qpos, 60.0, np.zeros((40, 2), bool), character=body)
    assert forward_kinematics(qpos, body).foot_points[..., 2].min() > 0.3
    assert check_motion(motion).finding("footing").value is None
