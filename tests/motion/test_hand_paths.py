"""Hands that a file leaves open: they stay over the floor, and turn slowly where the file's arms turn slowly."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simprep.humanoid_model import humanoid
from simprep.motion.closed_form import closed_form
from simprep.motion.hand_paths import TURN_S, hand_of, hand_path, lead_hands
from simprep.motion.kinematics import body_clearance, forward_kinematics
from simprep.motion.retarget import solve
from simprep.motion.targets import Targets
from tests.motion.test_retargeting import own_targets

FPS = 60.0
DISTAL = ("forearm_pronation", "wrist_flexion", "wrist_deviation")


def propped(wrist: float, turn_deg: float, seconds: float = 8.0) -> Targets:
    """A body on its hands, the trunk nearly level: the arms hang down to the floor, the right one turns to and fro.

    The wrists are `wrist` above the floor at the lowest [m], nearer than the hands are long, and no hand is told.
    """
    body = humanoid()
    t = np.arange(0, seconds, 1 / FPS)
    qpos = np.tile(body.standing_qpos.copy(), (len(t), 1))
    qpos[:, 3:7] = Rotation.from_euler("Y", 80, degrees=True).as_quat(scalar_first=True)
    for name, angle in (
        ("right_shoulder_flexion", 80 + 5 * np.sin(t)),
        ("left_shoulder_flexion", 80),
        ("right_shoulder_rotation", turn_deg * np.sin(2 * np.pi * t / seconds)),
        ("right_elbow_flexion", 2),
    ):
        qpos[:, 7 + body.joint(name)] = np.radians(angle)
    heights = forward_kinematics(qpos, body).xpos[:, [body.segment(f"{side}_hand") for side in ("left", "right")], 2]
    qpos[:, 2] -= heights.min() - wrist
    return replace(own_targets(qpos, FPS), oriented=np.array([True, False, False, True, True]))


@pytest.mark.parametrize("wrist", [0.05, 0.07])
@pytest.mark.parametrize("turn_deg", [30.0, 90.0])
def test_hands_on_the_floor_turn_slowly(wrist: float, turn_deg: float) -> None:
    """Shoulders turn at 1.2 rad/s at most; frame by frame, wrists were solved to turn at 97 to 158 rad/s."""
    targets = propped(wrist, turn_deg)
    found = solve(targets, np.zeros((len(targets.positions), 2), dtype=bool), humanoid()).qpos
    speed = np.abs(np.diff(found[:, 7:], axis=0)) * FPS
    joints = [humanoid().joint(f"{side}_{name}") for side in ("left", "right") for name in DISTAL]
    assert speed[:, joints].max() < 6
    hands = [humanoid().segment(f"{side}_hand") for side in ("left", "right")]
    assert body_clearance(found)[:, hands].min() > -0.003


def test_a_hand_turns_over_no_faster_than_it_should() -> None:
    """An upright forearm that turns all around over the floor: the hand must turn over, and takes its time."""
    hand = hand_of(humanoid(), "right")
    assert hand is not None
    angle = np.linspace(0, 4 * np.pi, 240)
    up = np.column_stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.full(240, np.sqrt(1 - 0.09))])
    found = hand_path(hand, np.full(240, 0.036), up, FPS, (False, False))
    assert np.ptp(found[:, 1]) > 2  # from one side of the wrist to the other
    assert (np.abs(np.diff(found, axis=0)) * FPS).max() < 1.5 / TURN_S
    assert (found >= hand.low).all()
    assert (found <= hand.high).all()


def test_the_frame_rate_does_not_change_the_way() -> None:
    hand = hand_of(humanoid(), "left")
    assert hand is not None
    t = np.linspace(0, 2, 481)
    height = 0.06 + 0.05 * np.cos(np.pi * t)
    up = Rotation.from_rotvec(np.outer(0.4 * np.sin(2 * t), [1.0, 0.0, 0.0])).as_matrix()[:, 2]
    fast = hand_path(hand, height, up, 240.0, (False, False))
    slow = hand_path(hand, height[::4], up[::4], 60.0, (False, False))
    assert np.abs(fast[::4] - slow).max() < np.radians(3)


def test_told_hands_and_hands_in_the_air_stay_as_they_are() -> None:
    targets = propped(0.05, 30.0, seconds=2.0)
    start = closed_form(targets, humanoid())
    led, firm = lead_hands(start, np.array([True, True]), FPS, humanoid())
    assert np.array_equal(led, start)
    assert not firm.any()
    led, firm = lead_hands(start, np.array([True, False]), FPS, humanoid())
    changed = [name for name, moved in zip(humanoid().joints, np.ptp(led - start, axis=0)[7:]) if moved > 0]
    assert changed
    assert set(changed) <= {f"right_{name}" for name in DISTAL}
    start[:, 2] += 0.2
    led, firm = lead_hands(start, np.array([False, False]), FPS, humanoid())
    assert np.array_equal(led, start)
    assert not firm.any()
