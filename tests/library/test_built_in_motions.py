"""Every built-in motion: limits, feet, contacts, balance, speeds, norms, determinism, symmetry."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull, QhullError

from simprep.character import SIDES
from simprep.errors import UnknownNameError
from simprep.humanoid_model import GRAVITY, humanoid
from simprep.library import library_entries, library_motion, library_names
from simprep.library.parts.balance import ground_reaction
from simprep.motion.contacts import stances
from simprep.motion.edit import mirror, repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.preparation.reference_posture import reference_posture

BOXING = tuple(entry.name for entry in library_entries() if entry.family in ("punch", "block", "dodge"))
JUMPS = tuple(entry.name for entry in library_entries() if entry.family == "jump")
TARGETS = (
    *BOXING,
    "kick_front",
    "kick_front_head_right",
    "kick_low_right",
    "roundhouse_right_body",
    "roundhouse_right_head",
    "side_kick_right_body",
    "side_kick_right_low",
    "knee_right",
    *(entry.name for entry in library_entries() if entry.family in ("crawl", "duck", "jump")),
)
HANDS_AND_KNEES = "crawl_hands_knees"
"""The one motion in which more than the feet bears load."""
SPEED_CAPS_DEG = {
    "hip": 600, "knee": 1100, "ankle": 700, "lumbar": 500, "thorax": 500, "neck": 500, "head": 500, "shoulder": 1100,
    "elbow": 1300, "forearm": 1500, "wrist": 1500,
}  # fmt: skip
"""Practical caps of human joint speeds [deg/s]."""


def played(name: str):
    """The motion, three cycles of it if it is a loop, with its kinematics."""
    motion = library_motion(name)
    motion = repeat(motion, 3) if motion.loop else motion
    return motion, forward_kinematics(motion.qpos, motion.character)


def outside(points: np.ndarray, point: np.ndarray) -> float:
    """Distance of a point on the floor from the convex hull of others; 0 inside."""
    try:
        hull = points[ConvexHull(points).vertices]
    except QhullError:
        hull = points[[int(np.argmin(points @ [1.0, 0.3])), int(np.argmax(points @ [1.0, 0.3]))]]
    edges = np.roll(hull, -1, axis=0) - hull
    to = point - hull
    if len(hull) > 2 and (edges[:, 0] * to[:, 1] - edges[:, 1] * to[:, 0] >= 0).all():
        return 0.0
    share = np.clip(np.sum(to * edges, axis=1) / np.maximum(np.sum(edges**2, axis=1), 1e-12), 0, 1)
    return float(np.linalg.norm(to - share[:, None] * edges, axis=1).min())


def hands_and_knees_on_the_floor(kinematics, frame: int) -> np.ndarray:
    """Points (N, 2) under fists and knees that are on the floor, 15 mm of clearance allowed (they have no skin)."""
    knees, wrists, elbows = (
        kinematics.xpos[frame, [humanoid().segment(f"{side}_{part}") for side in SIDES]]
        for part in ("shank", "hand", "forearm")
    )
    along = (wrists - elbows) / np.linalg.norm(wrists - elbows, axis=1, keepdims=True)
    fists = wrists + 0.055 * along  # middle of the fist, 42 mm thick; the shank is 52 mm thick
    return np.concatenate([knees[knees[:, 2] < 0.052 + 0.015], fists[fists[:, 2] < 0.042 + 0.015]])[:, :2]


def test_names_and_unknown_name():
    assert library_names()[:2] == ("stand", "walk")
    assert set(TARGETS) < set(library_names())
    with pytest.raises(UnknownNameError, match=r"unknown built-in motion 'moonwalk'; valid: stand, walk"):
        library_motion("moonwalk")


@pytest.mark.parametrize("name", library_names())
def test_every_motion_obeys_the_body_and_the_floor(name):
    motion, kinematics = played(name)
    assert motion.name == name
    assert motion.fps == 60
    low, high = motion.character.model.jnt_range[1:].T
    assert (motion.qpos[:, 7:] >= low).all()
    assert (motion.qpos[:, 7:] <= high).all()
    speed = np.degrees(np.abs(motion.velocities()[:, 6:])).max(axis=0)
    for hinge, fastest in zip(motion.character.joints, speed):
        part = hinge.removeprefix("left_").removeprefix("right_").partition("_")[0]
        assert fastest <= SPEED_CAPS_DEG[part], (hinge, fastest)
    # no body part but the feet touches the floor, and these by a millimetre at most
    assert kinematics.foot_points[..., 2].min() > -1e-3
    assert kinematics.xpos[:, 1:, 2].min() > 0.015
    lowest = kinematics.foot_points[..., 2].min(axis=2)
    for side in (0, 1):
        contact = motion.contacts[:, side]
        assert lowest[contact, side].max(initial=0.0) < 1e-3
        whole = [swing for swing in stances(~contact) if swing[0] > 0 and swing[1] < len(motion)]
        for first, after in whole:
            quarter = (after - first) // 4
            assert lowest[first + quarter : after - quarter, side].min(initial=1.0) > 5e-3
        for first, after in stances(contact):
            carried = kinematics.foot_points[first:after, side]
            down = carried[..., 2] < 1e-3
            for part in range(carried.shape[1]):
                still = carried[down[:, part], part, :2]
                assert len(still) == 0 or np.ptp(still, axis=0).max() < 5e-3, (name, SIDES[side], part)


@pytest.mark.parametrize("name", library_names())
def test_every_motion_is_dynamically_plausible(name):
    motion, kinematics = played(name)
    force, zmp = ground_reaction(kinematics, motion.fps, motion.character)
    middle = slice(len(motion) // 3, 2 * len(motion) // 3) if library_motion(name).loop else slice(1, -1)
    weight = GRAVITY * motion.character.model.body_mass.sum()
    assert force[middle, 2].min() > -0.01 * weight
    assert force[middle, 2].max() < (4.2 if name in JUMPS else 1.6) * weight
    flat = np.hypot(force[middle, 0], force[middle, 1])
    # within friction 1, except between frames of which one is in flight
    loaded = ~np.convolve(~motion.contacts.any(axis=1), np.ones(3), mode="same").astype(bool)[middle]
    assert (flat <= 0.75 * force[middle, 2])[loaded].all()
    distances = []
    for frame in range(len(motion))[middle]:
        points = kinematics.foot_points[frame][motion.contacts[frame]]
        points = points[points[..., 2] < 4e-3][:, :2]
        if name in (HANDS_AND_KNEES, "get_up_prone") and len(hands_and_knees_on_the_floor(kinematics, frame)):
            continue  # has its own test
        if len(points) and np.isfinite(zmp[frame]).all():
            distances.append(outside(points, zmp[frame]))
    assert len(distances) > 20
    assert np.mean(np.array(distances) > 0.02) <= 0.02
    assert max(distances) < 0.04
    # the COM has no kinks: its acceleration between frames changes no faster than in a landing
    jerk = np.abs(np.diff(force[middle], axis=0)).max() / weight * GRAVITY * motion.fps
    assert jerk < (1500 if name in JUMPS else 400)


def test_walk_is_in_the_norm_ranges_of_young_men():
    walk = library_motion("walk")
    motion, kinematics = played("walk")
    step = (motion.qpos[2 * len(walk), 0] - motion.qpos[len(walk), 0]) / 2
    cadence = 2 * 60 / walk.duration
    assert 1.2 <= step * cadence / 60 <= 1.65
    assert 99 <= cadence <= 113
    assert 0.65 <= step <= 0.83
    feet = kinematics.xpos[:, walk.character.feet]
    strike = {side: walk.events[f"{side}_heel_strike"] + len(walk) for side in SIDES}
    width = feet[strike["left"] + 10, 0, 1] - feet[strike["right"] + 10, 1, 1]
    assert 0.082 <= width <= 0.135
    duty = walk.contacts.mean(axis=0)
    assert ((duty >= 0.58) & (duty <= 0.68)).all()
    assert 0.22 <= walk.contacts.all(axis=1).mean() <= 0.31
    assert 0.025 <= np.ptp(kinematics.com[:, 2]) <= 0.045
    assert 0.02 <= np.ptp(kinematics.com[:, 1]) <= 0.06
    angle = {name: np.degrees(walk.qpos[:, 7 + k]) for k, name in enumerate(walk.character.joints)}
    assert 35 <= np.ptp(angle["left_hip_flexion"]) <= 50
    assert 55 <= angle["left_knee_flexion"].max() <= 72
    assert 25 <= np.ptp(angle["left_shoulder_flexion"]) <= 40
    # arms swing against the legs: the left arm is back when the left heel strikes
    left = strike["left"] % len(walk)
    assert angle["left_shoulder_flexion"][left] < angle["right_shoulder_flexion"][left] - 20
    swing = ~walk.contacts[:, 0]
    clearance = forward_kinematics(walk.qpos, walk.character).foot_points[swing, 0, :, 2].min(axis=1)
    assert clearance[len(clearance) // 3 : 2 * len(clearance) // 3].min() > 0.010


@pytest.mark.parametrize("name", ["stand", "walk"])
def test_loops_close(name):
    loop = library_motion(name)
    assert loop.loop
    velocity = repeat(loop, 3).velocities()
    n = len(loop)
    inside = np.abs(np.diff(velocity[n + 2 : 2 * n - 2], axis=0)).max(axis=0)
    seam = np.abs(np.diff(velocity[2 * n - 2 : 2 * n + 2], axis=0)).max(axis=0)
    assert (seam <= 1.2 * inside + 1e-3).all()


@pytest.mark.parametrize("name", TARGETS)
def test_targets_begin_and_end_standing_with_a_ready_posture_before_the_target(name):
    motion = library_motion(name)
    kinematics = forward_kinematics(motion.qpos, motion.character)
    target = motion.events["target"]
    assert 30 <= target <= 60
    assert motion.contacts[: target + 1].all()
    assert motion.contacts[-1].all()
    velocity = motion.velocities()
    for frame in (0, len(motion) - 1):
        assert np.abs(velocity[frame]).max() < 0.05
        assert kinematics.com[frame, 2] > 0.95
    assert np.abs(velocity[target - 6 : target]).max() < 0.6  # the ready posture is held
    assert kinematics.com[target - 3, 2] < kinematics.com[0, 2] - 0.015  # and lower than standing
    feet = kinematics.foot_points[target - 3].reshape(-1, 3)[:, :2]
    assert outside(feet, kinematics.com[target - 3, :2]) == 0.0
    assert reference_posture(motion).frame > target - 10  # so the scan of the preparation finds this posture


@pytest.mark.parametrize(("name", "hand"), [("punch_right", "right_hand"), ("punch_left", "left_hand")])
def test_punch_speed_and_sequence(name, hand):
    motion, kinematics = played(name)
    speed = np.linalg.norm(np.gradient(kinematics.xpos[:, motion.character.segment(hand)], 1 / 60, axis=0), axis=1)
    assert 5.5 <= speed.max() <= 9.0
    assert abs(int(speed.argmax()) - motion.events["impact"]) <= 2
    side = hand.partition("_")[0]
    velocity = motion.velocities()
    pelvis = int(np.abs(velocity[:, 5]).argmax())
    elbow = int((-velocity[:, 6 + motion.character.joint(f"{side}_elbow_flexion")]).argmax())
    trunk = int(np.abs(velocity[:, 6 + motion.character.joint("thorax_rotation")]).argmax())
    assert pelvis <= trunk <= elbow <= pelvis + 8  # from the ground up, within 130 ms


def test_left_punch_mirrors_the_right():
    left, right = library_motion("punch_left"), mirror(library_motion("punch_right"))
    assert np.array_equal(left.qpos, right.qpos)
    assert np.array_equal(left.contacts, right.contacts)
    assert dict(left.events) == dict(right.events)


def test_kick_chambers_extends_and_stands_on_one_leg():
    motion, kinematics = played("kick_front")
    foot = kinematics.foot_points[:, 1]
    speed = np.linalg.norm(np.gradient(foot, 1 / 60, axis=0), axis=2).max(axis=1)
    assert 8.0 <= speed.max() <= 11.0
    impact = motion.events["impact"]
    assert abs(int(speed.argmax()) - impact) <= 3
    knee = np.degrees(motion.qpos[:, 7 + motion.character.joint("right_knee_flexion")])
    assert 100 <= knee[motion.events["target"] : impact].max() <= 130
    assert 10 <= knee[impact : impact + 6].min() <= 30
    assert 0.7 <= foot[impact, :, 2].max() <= 1.3
    assert motion.contacts[impact].tolist() == [True, False]


def test_jump_height_matches_its_flight_time():
    motion, kinematics = played("jump")
    flight = np.flatnonzero(~motion.contacts.any(axis=1))
    com = kinematics.com[:, 2]
    rise = com[flight].max() - com[flight[0]]
    assert 0.25 <= rise <= 0.35
    seconds = len(flight) / motion.fps
    from_time = np.sqrt(2 * rise / GRAVITY) + np.sqrt(2 * (com[flight].max() - com[flight[-1]]) / GRAVITY)
    assert seconds == pytest.approx(from_time, abs=2.5 / motion.fps)
    fall = np.diff(com[flight[1:-1]], 2) * motion.fps**2
    assert fall == pytest.approx(-GRAVITY, abs=0.02)


def test_duck_and_crawl_go_low_enough():
    for name, drop in (("duck", (0.25, 0.42)), ("crawl", (0.5, 0.9))):
        motion, kinematics = played(name)
        height = kinematics.xpos[:, motion.character.segment("head"), 2]
        assert drop[0] <= height[motion.events["target"]] - height.min() <= drop[1]
    motion, kinematics = played("crawl")
    low = slice(motion.events["low"], motion.events["rise"])
    # crown: 0.14 m above the base of the head, whichever way it points
    top = kinematics.xpos[low, motion.character.segment("head")] + 0.16
    assert top[:, 2].max() < 1.1  # passes under a bar of 1.1 m
    assert np.ptp(kinematics.com[low, 0]) > 0.8


def test_generation_is_deterministic_and_fast():
    import time

    for entry in library_entries():
        first = library_motion(entry.name)
        start = time.process_time()
        again = entry.generate()
        assert time.process_time() - start < 2.0
        assert np.array_equal(first.qpos, again.qpos)
        assert np.array_equal(first.contacts, again.contacts)
