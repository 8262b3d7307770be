"""Preparation as a whole: ends of alpha, travel, planted feet, reference posture, scenarios, errors."""

from dataclasses import replace

import numpy as np
import pytest

from simprep import prepare as exported
from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.contacts import stances
from simprep.motion.edit import move, yaw
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.preparation import ARMS, AlphaProfile, build_scenario, scenario
from simprep.preparation.prepare import extend, prepare
from simprep.preparation.reference_posture import reference_posture
from simprep.preparation.settings import PreparationSettings


def slide(motion: Motion) -> float:
    """Farthest that a carrying foot point moves on the floor within a stance, from frame to frame, summed [m]."""
    points = forward_kinematics(motion.qpos, motion.character).foot_points
    worst = 0.0
    for side in (0, 1):
        for first, after in stances(motion.contacts[:, side]):
            stance = points[first:after, side]
            carries = stance[..., 2] <= stance[..., 2].min(axis=1, keepdims=True) + 0.002
            step = np.linalg.norm(np.diff(stance[..., :2], axis=0), axis=-1)
            both = carries[1:] & carries[:-1]
            worst = max(worst, float(np.where(both, step, 0.0).sum(axis=0).max(initial=0.0)))
    return worst


def test_exported():
    assert exported is prepare


def test_alpha_0_returns_the_locomotion_exactly(walk, punch):
    prepared = prepare(walk, punch, 0.0).motion
    np.testing.assert_array_equal(prepared.qpos, walk.qpos)
    np.testing.assert_array_equal(prepared.contacts, walk.contacts)


def test_alpha_1_gives_the_reference_posture_standing_still(walk, punch):
    prepared = prepare(walk, punch, 1.0, duration=2.0, optimise=False).motion
    reference = reference_posture(punch)
    np.testing.assert_allclose(prepared.qpos[:, 7:], np.tile(reference.qpos[7:], (len(prepared), 1)), atol=1e-9)
    assert np.ptp(prepared.qpos[:, :2], axis=0).max() < 1e-12
    assert np.ptp(prepared.qpos[:, 2]) < 1e-9
    assert prepared.contacts.all()  # both feet rest although the walk lifts them


def test_root_height_of_equation_5_bobs_with_the_swing_foot(walk, punch):
    paper = prepare(walk, punch, 1.0, settings=PreparationSettings(root_height="mean"), optimise=False)
    ours = prepare(walk, punch, 1.0, optimise=False)
    assert np.ptp(ours.motion.qpos[:, 2]) < 1e-9
    assert np.ptp(paper.motion.qpos[:, 2]) > 0.01


def test_travel_is_scaled_by_what_is_left_of_the_locomotion(walk, punch):
    whole = prepare(walk, punch, 0.0, duration=2.0).motion.qpos
    half = prepare(walk, punch, 0.5, duration=2.0, optimise=False).motion.qpos
    np.testing.assert_allclose(half[:, :2] - half[0, :2], 0.5 * (whole[:, :2] - whole[0, :2]), atol=2e-3)


def test_result_turns_and_moves_with_the_locomotion(walk, punch):
    moved = move(walk, translation=(3.0, -2.0), turn=1.1)
    a = move(prepare(walk, punch, 0.6).motion, translation=(0, 0), turn=1.1)
    b = move(prepare(moved, punch, 0.6).motion, translation=(-3.0, 2.0))
    np.testing.assert_allclose(a.qpos[:, :3], b.qpos[:, :3], atol=1e-6)
    np.testing.assert_allclose(a.qpos[:, 7:], b.qpos[:, 7:], atol=1e-4)


def test_heading_of_the_reference_posture_does_not_matter(walk, punch):
    a = prepare(walk, punch, 0.7, optimise=False).motion
    b = prepare(walk, move(punch, turn=2.0), 0.7, optimise=False).motion
    np.testing.assert_allclose(a.qpos, b.qpos, atol=1e-9)
    assert np.abs(yaw(a.qpos[:, 3:7])).max() < 0.3


@pytest.mark.parametrize("alpha", [0.3, 0.7])
def test_supporting_feet_slide_no_more_than_in_the_locomotion(walk, punch, alpha):
    prepared = prepare(walk, punch, alpha, duration=3.0, optimise=False)
    assert slide(prepared.motion) <= slide(extend(walk, len(prepared.motion))) + 1e-3
    assert prepared.record.foot_error.max() < 1e-3
    assert forward_kinematics(prepared.motion.qpos, prepared.motion.character).foot_points[..., 2].min() > -1e-3


def test_feet_neither_jump_nor_bounce_when_contacts_change(walk, punch):
    prepared = prepare(walk, punch, 0.6, duration=3.0, optimise=False).motion
    own = extend(walk, len(prepared))

    def largest_jump(motion):
        return np.abs(np.diff(forward_kinematics(motion.qpos, motion.character).foot_points, n=2, axis=0)).max()

    assert largest_jump(prepared) < 1.5 * largest_jump(own)


def test_reference_posture_meets_its_conditions_and_says_why(punch):
    found = reference_posture(punch)
    assert found.found
    assert found.frame <= found.target_frame == 40
    assert "COM inside the support polygon" in found.reason
    # the lunge is marked too late: the scan has to go back to where the COM is over the feet
    late = reference_posture(replace(punch, events={"target": 89}))
    assert late.found
    # a foot leaves the floor from frame 1 on: only frame 0 has its contacts
    contacts = punch.contacts.copy()
    contacts[1:, 0] = False
    assert reference_posture(replace(punch, contacts=contacts)).frame == 0
    contacts[:] = False
    none = reference_posture(replace(punch, contacts=contacts))
    assert not none.found
    assert none.frame == 0
    assert "COM inside the support polygon: 0" in none.reason


def test_optimised_preparation_is_deterministic(walk, punch):
    alpha = np.linspace(0, 1, 80)
    a, b = prepare(walk, punch, alpha), prepare(walk, punch, alpha)
    np.testing.assert_array_equal(a.motion.qpos, b.motion.qpos)


def test_scenario_arms_share_timing_and_the_end(walk, punch):
    results = {arm: build_scenario(walk, punch, AlphaProfile(1.0, 0.5, 0.8, 0.5), arm) for arm in ARMS}
    first = results["none"].motion
    own = max(np.abs(np.diff(motion.qpos[:, 7:], n=2, axis=0)).max() for motion in (walk, punch))
    launch = results["none"].launch
    for arm, result in results.items():
        motion = result.motion
        assert len(motion) == len(first)
        assert (
            dict(motion.events)
            == dict(first.events)
            == {"rise": 30, "launch": launch, "target": motion.events["target"]}
        )
        assert motion.events["target"] - launch == 40 - result.reference.frame
        # starts unprepared, ends in the target's own posture apart from the legs, which keep their footholds
        np.testing.assert_array_equal(motion.qpos[:12], first.qpos[:12])
        np.testing.assert_allclose(motion.qpos[:30], first.qpos[:30], atol=0.02)  # a foot may already aim elsewhere
        np.testing.assert_allclose(motion.qpos[-1, 7:32], punch.qpos[-1, 7:32], atol=1e-9)
        step = np.abs(np.diff(motion.qpos[:, 7:], n=2, axis=0))[launch - 5 : launch + 25].max()
        assert step <= 1.05 * own, f"{arm} jumps by {step} rad at the launch"
        points = forward_kinematics(motion.qpos, motion.character).foot_points
        assert points[..., 2].min() > -0.005
    speed = {
        arm: np.linalg.norm(r.motion.qpos[launch - 1, :2] - r.motion.qpos[launch - 4, :2]) * 20
        for arm, r in results.items()
    }
    assert speed["none"] > 0.8
    assert max(speed["blended"], speed["optimised"], speed["traditional"]) < 0.01
    elbow = 7 + humanoid().joint("left_elbow_flexion")
    assert results["blended"].motion.qpos[50, elbow] > results["traditional"].motion.qpos[50, elbow] + 0.2


def test_scenario_on_captured_motion(real_pair):
    for arm in ("none", "optimised"):
        motion = scenario(*real_pair, 1.0, arm)
        launch = motion.events["launch"]
        assert np.isfinite(motion.qpos).all()
        assert np.abs(np.diff(motion.qpos[:, 7:], axis=0))[launch - 5 : launch + 5].max() < 0.35
        assert np.linalg.norm(np.diff(motion.qpos[:, :3], axis=0), axis=1).max() < 0.12


def test_clip_that_is_no_loop_shortens_the_scenario_or_is_refused(walk, punch):
    clip = replace(extend(walk, 180), loop=False)
    motion = scenario(clip, punch, 0.5, "blended")
    assert motion.events["launch"] < 180
    with pytest.raises(MotionError, match="it is no loop"):
        scenario(replace(clip, qpos=clip.qpos[:40], contacts=clip.contacts[:40], events={}), punch, 0.5, "blended")


def test_errors_say_what_to_do(walk, punch):
    with pytest.raises(MotionError, match=r"--target-frame N\), valid: 0 to 89"):
        prepare(walk, replace(punch, events={}), 0.5)
    with pytest.raises(SettingError, match=r"alpha runs from 0\.5 to 1\.5; valid: 0 to 1"):
        prepare(walk, punch, np.array([0.5, 1.5]))
    with pytest.raises(SettingError, match="valid: 0 to 1"):
        prepare(walk, punch, float("nan"))
    with pytest.raises(SettingError, match="leave out one"):
        prepare(walk, punch, np.zeros(5), duration=1.0)
    with pytest.raises(MotionError, match="different bodies"):
        prepare(walk, replace(punch, character=humanoid(1.6, 60.0)), 0.5)
    with pytest.raises(MotionError, match="no loop"):
        prepare(replace(walk, loop=False), punch, np.zeros(1000))
    with pytest.raises(UnknownNameError, match="none, traditional, blended, optimised"):
        scenario(walk, punch, 0.5, "both")
    with pytest.raises(SettingError, match="valid: 0 to 1"):
        scenario(walk, punch, 1.5, "none")


@pytest.mark.parametrize("name", ["kick_front", "crawl", "duck", "jump"])
def test_half_prepared_scenarios_of_built_in_targets_stay_on_the_floor(walk, name):
    motion = scenario(walk, library_motion(name), 0.5, "optimised")
    points = forward_kinematics(motion.qpos, motion.character).foot_points
    assert points[..., 2].min() > -0.005
    assert motion.events["rise"] < motion.events["launch"] < motion.events["target"] + 1
    on_floor = points[..., 2].min(axis=2)[motion.contacts]
    assert np.quantile(on_floor, 0.99) < 0.03
