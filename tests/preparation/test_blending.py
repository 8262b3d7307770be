"""Blending weights (Eq. 1), blended angles (Eq. 2) and the heading-tilt split."""

import numpy as np
import pytest

from simprep.errors import SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.motion.rotations import multiply_quat
from simprep.preparation.blending import blending_weight, join_heading, joint_weights, split_heading
from simprep.preparation.settings import CURVES, PreparationSettings

OURS = humanoid()


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("curvature", [0.1, 0.5, 1.0, 2.0, 5.0])
def test_weight_runs_from_exactly_0_to_exactly_1_and_rises(curve, curvature):
    weight = blending_weight(np.linspace(0, 1, 201), curvature, curve)
    assert weight[0] == 0.0
    assert weight[-1] == 1.0
    assert (np.diff(weight) >= 0).all()


def test_curves_at_one_half_are_those_of_the_paper_and_its_mirror_image():
    assert blending_weight(0.5, 0.5, "printed") == pytest.approx((1 - np.sqrt(0.5)) ** 2)
    assert blending_weight(0.5, 0.5, "described") == pytest.approx(1 - (1 - np.sqrt(0.5)) ** 2)
    alpha = np.linspace(0, 1, 50)
    np.testing.assert_array_equal(blending_weight(alpha, 1.0, "described"), alpha)
    for c in (0.3, 0.5, 2.0):
        mirrored = 1 - blending_weight(1 - alpha, c, "printed")
        np.testing.assert_allclose(blending_weight(alpha, c, "described"), mirrored, atol=1e-12)


@pytest.mark.parametrize(("curve", "arms_lead"), [("described", True), ("printed", False)])
def test_arms_lead_the_legs_by_default_and_lag_as_printed(curve, arms_lead):
    root, hinges = joint_weights(np.array([0.5]), OURS, PreparationSettings(curve=curve))
    arm, leg = hinges[0, OURS.joint("left_elbow_flexion")], hinges[0, OURS.joint("left_knee_flexion")]
    assert (arm > leg) == arms_lead
    assert leg == root[0] == 0.5


def test_traditional_blending_has_one_weight_for_all():
    _, hinges = joint_weights(np.array([0.3]), OURS, PreparationSettings(curve="linear"))
    np.testing.assert_array_equal(hinges, np.full((1, len(OURS.joints)), 0.3))


def test_curvature_can_be_set_per_joint():
    settings = PreparationSettings(curvature={"neck_flexion": 1.0, "root": 2.0})
    root, hinges = joint_weights(np.array([0.5]), OURS, settings)
    assert hinges[0, OURS.joint("neck_flexion")] == 0.5
    assert root[0] == blending_weight(0.5, 2.0)
    assert hinges[0, OURS.joint("head_flexion")] == blending_weight(0.5, 0.5)


def test_a_curvature_of_a_joint_that_the_character_lacks_is_refused():
    with pytest.raises(UnknownNameError, match=r"unknown joint 'tail'.*root, lumbar_flexion"):
        joint_weights(np.array([0.5]), OURS, PreparationSettings(curvature={"tail": 1.0}))


def test_heading_and_tilt_rebuild_the_rotation_and_turn_with_the_world():
    rng = np.random.default_rng(0)
    quat = rng.normal(size=(500, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    heading, tilt = split_heading(quat)
    rebuilt = join_heading(heading, tilt)
    np.testing.assert_allclose(np.abs((rebuilt * quat).sum(axis=1)), 1, atol=1e-12)
    turn = np.array([np.cos(0.4), 0, 0, np.sin(0.4)])
    turned_heading, turned_tilt = split_heading(multiply_quat(turn, quat))
    np.testing.assert_allclose(np.cos(turned_heading - heading - 0.8), 1, atol=1e-12)
    np.testing.assert_allclose(turned_tilt, tilt, atol=1e-9)
    # tilt about one axis is the Euler angle, also beyond 90 deg of pitch, where Euler angles are singular
    pitch = np.array([np.cos(0.9), 0, np.sin(0.9), 0])
    np.testing.assert_allclose(split_heading(pitch)[1], [0, 1.8], atol=1e-12)


@pytest.mark.parametrize(
    ("values", "error", "text"),
    [
        ({"curve": "cubic"}, UnknownNameError, "described, printed, linear"),
        ({"curvature": {"root": 0.0}}, SettingError, "valid: above 0"),
        ({"max_steps": -1}, SettingError, "valid: 0 or more"),
        ({"threshold": float("nan")}, SettingError, "valid: 0 or more"),
        ({"root_height": "feet"}, UnknownNameError, "support, mean"),
    ],
)
def test_bad_settings_say_what_is_valid(values, error, text):
    with pytest.raises(error, match=text):
        PreparationSettings(**values)
