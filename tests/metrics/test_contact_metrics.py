import numpy as np
import pytest
from metric_cases import rigid_motion, swaying_motion
from scipy.spatial.transform import Rotation

from simprep.humanoid_model import humanoid
from simprep.metrics.contact import FootSlip, floor_penetration, foot_slip, slip_ratio, sphere_slip
from simprep.motion.edit import move, resample
from simprep.motion.motion import Motion


def rolling(slide_speed):
    # a ball of 0.2 m rolling along x at 1.5 m/s, slid on top of that
    time = np.linspace(0, 1, 61)
    centres = np.stack([(1.5 + slide_speed) * time, 0 * time, 0 * time + 0.2], axis=1)
    turns = Rotation.from_rotvec((1.5 / 0.2 * time)[:, None] * [0.0, 1.0, 0.0]).as_matrix()
    return sphere_slip(centres, turns, np.array(0.2))


def test_rolling_is_not_slip_and_sliding_is():
    assert rolling(0.0).sum() == pytest.approx(0, abs=0.005)  # chords of 7 degrees: 0.3 % of the 1.5 m rolled
    assert rolling(0.4).sum() == pytest.approx(0.4, abs=0.005)
    assert rolling(-0.2).sum() == pytest.approx(0.2, abs=0.005)
    assert rolling(-1.5).sum() == 0  # turning on the spot, as a foot pinned by its lowest point does


@pytest.mark.parametrize("fps", [30.0, 60.0, 100.0, 120.0, 480.0])
def test_sliding_body(fps):
    # 0.3 m/s for 2 s with both feet on the floor throughout: 0.6 m for each foot, one stance each
    time = np.arange(int(2 * fps) + 1) / fps
    slip = foot_slip(rigid_motion(np.stack([0.18 * time, 0.24 * time, 0 * time], axis=1), fps))
    assert slip.travel_m == pytest.approx(1.2, rel=0.02)
    assert slip.stance_count == 2
    assert slip.mm_per_stance == pytest.approx(600, rel=0.02)
    assert slip.contact_m_per_s == pytest.approx(0.3, rel=1e-6)


@pytest.mark.parametrize("rolls", [True, False])
def test_foot_rolling_over_its_toe_does_not_slip(rolls):
    # the ankle plantarflexes 40 degrees while the toe sphere rolls on the floor, or turns about its lowest point
    fps = 120.0
    angle = np.radians(40) * (1 - np.cos(np.pi * np.linspace(0, 1, 61))) / 2
    toe, radius = np.array([0.175, -0.058]), 0.015
    c, s = np.cos(angle), np.sin(angle)
    # pitching nose-down by `angle` takes (x, z) to (x c + z s, -x s + z c); rolling advances the toe by radius * angle
    x = toe[0] - (toe[0] * c + toe[1] * s) + rolls * radius * angle
    z = toe[1] - (-toe[0] * s + toe[1] * c)
    motion = rigid_motion(np.stack([x, 0 * x, z], axis=1), fps)
    qpos = motion.qpos.copy()
    for side in ("left", "right"):
        qpos[:, 7 + humanoid().joint(f"{side}_ankle_dorsiflexion")] = -angle
    slip = foot_slip(Motion(qpos, fps, motion.contacts))
    ankle_path = 2e3 * np.abs(np.diff(x)).sum()
    assert slip.mm_per_stance < 3 < 0.1 * ankle_path  # leaving the flat sole costs what the 5 mm band lets through


def test_nothing_counts_outside_contact_and_chatter_is_one_stance():
    time = np.arange(121) / 60.0
    motion = rigid_motion(np.stack([time, 0 * time, 0 * time], axis=1), 60.0)
    contacts = np.zeros((121, 2), dtype=bool)
    contacts[30:61, 0] = True
    contacts[45, 0] = False  # one lost sample
    slip = foot_slip(Motion(motion.qpos, 60.0, contacts))
    assert slip.stance_count == 1
    assert slip.travel_m == pytest.approx(26 / 60)  # 30 intervals, less the lost sample's and the edges'
    flight = foot_slip(rigid_motion(np.zeros((30, 3)), 60.0, contact=False))
    assert flight.travel_m == 0
    assert np.isnan(flight.mm_per_stance)


def test_contacts_of_slow_capture_do_not_add_slip_when_resampled():
    # a foot that stands for 0.5 s between swings at 2 m/s, captured at 30 Hz
    time = np.arange(61) / 30.0
    path = 2 * (np.minimum(time, 0.5) + np.maximum(time - 1, 0))
    motion = rigid_motion(np.stack([path, 0 * time, 0 * time], axis=1), 30.0)
    captured = Motion(motion.qpos, 30.0, np.repeat(((time > 0.49) & (time < 1.01))[:, None], 2, axis=1))
    for fps in (30.0, 60.0, 120.0, 240.0):
        slip = foot_slip(resample(captured, fps))
        assert slip.travel_m == pytest.approx(0, abs=1e-9)
        assert slip.stance_count == 2
        assert slip.contact_s > 0.9


def test_place_heading_and_frame_rate_do_not_matter():
    motion = swaying_motion(120.0)
    slip = foot_slip(motion)
    assert foot_slip(move(motion, (9.0, -3.0), 1.3)).travel_m == pytest.approx(slip.travel_m, rel=1e-9)
    assert foot_slip(swaying_motion(60.0)).travel_m == pytest.approx(slip.travel_m, rel=0.02)


def test_ratio_and_its_floor():
    one = FootSlip(0.030, 4.0, 5.0, 10)
    assert slip_ratio(FootSlip(0.036, 3.0, 4.0, 40), one) == pytest.approx((0.036 / 4) / (0.030 / 5))
    still = FootSlip(0.0, 4.0, 5.0, 10)  # counts as 10 stances of 1 mm
    assert slip_ratio(FootSlip(0.013, 4.0, 5.0, 10), still) == pytest.approx(1.3)
    assert np.isnan(slip_ratio(one, FootSlip(0.0, 0.0, 5.0, 0)))


def test_penetration_of_sunk_and_lying_bodies():
    root = np.zeros((3, 3))
    root[:, 2] = [0.0, -0.02, 0.5]
    assert floor_penetration(rigid_motion(root, 60.0)) == pytest.approx([0, 0.02, 0], abs=1e-5)
    lying = np.repeat(rigid_motion(root[:1], 60.0).qpos, 2, axis=0)
    lying[:, 2] = 0.0
    h = np.sqrt(0.5)
    lying[:, 3:7] = [[h, 0, h, 0], [h, -h, 0, 0]]  # prone: a toe is deepest; on the left side: that shoulder
    expected = [0.175 + 0.015, 0.18 + 0.045]
    assert floor_penetration(Motion(lying, 60.0, np.zeros((2, 2)))) == pytest.approx(expected, abs=1e-6)
