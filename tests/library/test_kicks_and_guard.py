"""Kicks and guard against published ranges: speeds, times, heights, angles; symmetry; footwork that goes somewhere.

Sources of the ranges: foot speed 5.2 to 18.3 m/s over five kicks (review, Sports 12:74, 2024); roundhouse of masters 12.3
m/s (J Mens Health 18:138, 2022); front kick about 8 to 11 m/s, chamber and contact angles, support-foot turn and phase
times: rules of thumb, no measured source found; leg 80 % extended at peak foot speed (Wasik 2011, J Hum Kinet 30:13).
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simprep.character import SIDES
from simprep.library import library_motion
from simprep.library.kicks.parts import flexion_towards
from simprep.library.registry import library_entries
from simprep.motion.edit import mirror, repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.rotations import axis_rotation

# foot speed [m/s], highest point of the foot at contact [m], knee flexion at contact [deg]
RANGES = {
    "kick_front": ((8, 11), (0.8, 1.2), (10, 35)),
    "kick_front_head_right": ((8, 14), (1.4, 1.7), (10, 35)),
    "kick_low_right": ((8, 13), (0.45, 0.75), (30, 50)),
    "roundhouse_right_body": ((10, 14), (1.0, 1.3), (10, 40)),
    "roundhouse_right_head": ((10, 14), (1.45, 1.75), (10, 40)),
    "side_kick_right_body": ((6, 12), (0.95, 1.25), (10, 40)),
    "side_kick_right_low": ((5.2, 12), (0.4, 0.7), (10, 45)),
}
LEFT = {
    "kick_front": "kick_front_left", "kick_front_head_right": "kick_front_head_left", "kick_low_right": "kick_low_left",
    "roundhouse_right_body": "roundhouse_left_body", "roundhouse_right_head": "roundhouse_left_head",
    "side_kick_right_body": "side_kick_left_body", "side_kick_right_low": "side_kick_left_low",
    "knee_right": "knee_left",
}  # fmt: skip
DIRECTIONS = {"forward": (1, 0), "backward": (-1, 0), "left": (0, 1), "right": (0, -1)}


def angle(motion, name):
    return np.degrees(motion.qpos[:, 7 + motion.character.joint(name)])


def speed_of(points):
    return np.linalg.norm(np.gradient(points, 1 / 60, axis=0), axis=-1)


def test_all_sixteen_kicks_and_ten_guards_are_there():
    families = {}
    for entry in library_entries():
        families.setdefault(entry.family, set()).add(entry.name)
    assert families["kick"] == {*LEFT, *LEFT.values()}
    leads = [f"guard_{side}_lead" for side in SIDES]
    assert families["guard"] == {*leads, *(f"{lead}_{direction}" for lead in leads for direction in DIRECTIONS)}


@pytest.mark.parametrize("name", RANGES)
def test_kick_against_published_ranges(name):
    speeds, heights, knees = RANGES[name]
    motion = library_motion(name)
    kinematics = forward_kinematics(motion.qpos, motion.character)
    foot = kinematics.foot_points[:, 1]
    speed = speed_of(foot).max(axis=1)
    impact, target = motion.events["impact"], motion.events["target"]
    assert speeds[0] <= speed.max() <= speeds[1]
    assert abs(int(speed.argmax()) - impact) <= 4
    assert heights[0] <= foot[impact, :, 2].max() <= heights[1]
    knee = angle(motion, "right_knee_flexion")
    assert knees[0] <= knee[impact] <= knees[1]
    assert 100 <= knee[target:impact].max() <= 135  # chamber
    assert knee[impact : impact + 30].max() > 80  # the leg is pulled back before it is put down
    # foot off the floor to contact 0.25 to 0.45 s in the literature; side kicks chamber longer
    lift = np.flatnonzero(~motion.contacts[:, 1])[0]
    assert 0.3 <= (impact - lift) / 60 <= (0.65 if "side" in name else 0.55)
    assert motion.contacts[impact].tolist() == [True, False]
    # the strike goes forward, into the midline
    assert 0.85 <= foot[impact, :, 0].max() <= 1.6
    assert abs(foot[impact, :, 1].mean()) < 0.15
    # at peak speed the leg is about 80 % of its length, at contact more
    hip, ankle = (kinematics.xpos[:, motion.character.segment(f"right_{part}")] for part in ("thigh", "foot"))
    length = np.linalg.norm(ankle - hip, axis=1) / 0.867
    assert 0.7 <= length[speed.argmax()] <= 0.97
    assert 0.85 <= length[impact] <= 1.0


@pytest.mark.parametrize(
    ("name", "turns", "leans"),
    [
        ("roundhouse_right_body", (60, 120), (20, 45)),
        ("roundhouse_right_head", (60, 120), (20, 45)),
        ("kick_low_right", (60, 120), (10, 45)),
        ("side_kick_right_body", (88, 150), (20, 45)),
        ("side_kick_right_low", (88, 150), (15, 45)),
    ],
)
def test_standing_foot_turns_and_the_trunk_leans_away(name, turns, leans):
    motion = library_motion(name)
    kinematics = forward_kinematics(motion.qpos, motion.character)
    impact, segment = motion.events["impact"], motion.character.segment
    turn = Rotation.from_quat(kinematics.xquat[impact, segment("left_foot")], scalar_first=True)
    forward = turn.apply([1.0, 0.0, 0.0])
    assert turns[0] <= np.degrees(np.arctan2(forward[1], forward[0])) <= turns[1]
    trunk = kinematics.xpos[impact, segment("neck")] - kinematics.xpos[impact, segment("pelvis")]
    assert leans[0] <= np.degrees(np.arccos(trunk[2] / np.linalg.norm(trunk))) <= leans[1]
    hands = kinematics.xpos[impact, segment("left_hand")]
    assert hands[2] > kinematics.xpos[impact, segment("thorax"), 2]  # one hand stays up


def test_roundhouse_turns_the_pelvis_before_the_hip_before_the_knee():
    motion = library_motion("roundhouse_right_body")
    velocity = motion.velocities()
    pelvis = int(velocity[:, 5].argmax())
    extension = int((-velocity[:, 6 + motion.character.joint("right_knee_flexion")]).argmax())
    hip = int(velocity[:, 6 + motion.character.joint("right_hip_abduction")][pelvis:].argmax()) + pelvis
    assert pelvis < hip <= extension


def test_knee_strike_height_and_speed():
    motion = library_motion("knee_right")
    knee = forward_kinematics(motion.qpos, motion.character).xpos[:, motion.character.segment("right_shank")]
    impact = motion.events["impact"]
    assert 1.0 <= knee[impact:, 2].max() <= 1.35
    assert 3.0 <= speed_of(knee).max() <= 8.0
    assert angle(motion, "right_knee_flexion")[impact] > 100


@pytest.mark.parametrize(("right", "left"), LEFT.items())
def test_left_kicks_mirror_the_right(right, left):
    one, other = library_motion(left), mirror(library_motion(right))
    assert np.array_equal(one.qpos, other.qpos)
    assert np.array_equal(one.contacts, other.contacts)
    assert dict(one.events) == dict(other.events)


@pytest.mark.parametrize("direction", DIRECTIONS)
@pytest.mark.parametrize("lead", SIDES)
def test_footwork_steps_the_nearer_foot_first_and_keeps_the_stance(lead, direction):
    loop = library_motion(f"guard_{lead}_lead_{direction}")
    assert loop.loop
    motion = repeat(loop, 2)
    kinematics = forward_kinematics(motion.qpos, motion.character)
    n = len(loop)
    travel = kinematics.com[n, :2] - kinematics.com[0, :2]
    towards = np.array(DIRECTIONS[direction], dtype=float)
    assert 0.15 <= travel @ towards <= 0.35
    assert abs(travel @ towards[::-1]) < 1e-5
    assert loop.contacts.any(axis=1).all()  # no flight
    rear = "right" if lead == "left" else "left"
    nearer = SIDES.index({"forward": lead, "backward": rear}.get(direction, direction))
    first = [int(np.flatnonzero(~loop.contacts[:, side])[0]) for side in (0, 1)]
    assert first[nearer] < first[1 - nearer]
    feet = kinematics.xpos[:, motion.character.feet, :2]
    apart = np.linalg.norm(feet[:, 0] - feet[:, 1], axis=1)
    assert apart.min() > 0.25  # feet never come together or cross
    hands = kinematics.xpos[:, [motion.character.segment(f"{side}_hand") for side in SIDES], 2]
    assert hands.min() > kinematics.xpos[:, motion.character.segment("thorax"), 2].max()


@pytest.mark.parametrize("lead", SIDES)
def test_guard_bounces_and_closes(lead):
    names = [f"guard_{lead}_lead", *(f"guard_{lead}_lead_{direction}" for direction in DIRECTIONS)]
    for name in names:
        loop = library_motion(name)
        velocity = repeat(loop, 3).velocities()
        n = len(loop)
        inside = np.abs(np.diff(velocity[n + 2 : 2 * n - 2], axis=0)).max(axis=0)
        seam = np.abs(np.diff(velocity[2 * n - 2 : 2 * n + 2], axis=0)).max(axis=0)
        assert (seam <= 1.2 * inside + 1e-3).all()
    com, standing = (
        forward_kinematics(motion.qpos, motion.character).com[:, 2]
        for motion in (library_motion(names[0]), library_motion("stand"))
    )
    assert 0.005 <= np.ptp(com) <= 0.03
    assert 0.04 <= standing.mean() - com.mean() <= 0.08


def test_flexion_brings_the_thigh_into_the_plane():
    for abduction, hike, turn in ((58.0, 34.0, 61.0), (40.0, 20.0, 70.0), (10.0, 0.0, 30.0)):
        f, a, h, t = np.radians([flexion_towards(abduction, hike, turn), abduction, hike, turn])
        # right leg: abduction about -x, flexion about -y; the pelvis rolled right side up
        thigh = axis_rotation("x", -h) @ axis_rotation("y", -f) @ axis_rotation("x", -a) @ [0.0, 0.0, -1.0]
        assert np.arctan2(-thigh[1], thigh[0]) == pytest.approx(t, abs=1e-9)
