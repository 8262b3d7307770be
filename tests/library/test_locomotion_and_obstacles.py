"""Walking in directions, turning, stepping, crawls, ducks and jumps: speeds, heights and clearances, symmetry, seams."""

import numpy as np
import pytest
from test_built_in_motions import hands_and_knees_on_the_floor, outside, played

from simprep.character import SIDES
from simprep.humanoid_model import GRAVITY
from simprep.library import jump as jumps
from simprep.library import library_entries, library_motion
from simprep.library.parts.balance import com_from_zmp, ground_reaction, later_period
from simprep.library.walking.directions import BACKWARD, CURVE, FAST
from simprep.motion.edit import loop_displacement, mirror, repeat
from simprep.motion.kinematics import forward_kinematics

CROWN_M = 0.16
"""Crown above the base of the head, whichever way it points."""


def test_families_have_their_motions():
    count = {family: 0 for family in ("locomotion", "crawl", "duck", "jump")}
    for entry in library_entries():
        if entry.family in count:
            count[entry.family] += 1
    assert count == {"locomotion": 14, "crawl": 3, "duck": 3, "jump": 6}


@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_cyclic_com_path_continues_over_the_seam(turn):
    # the COM of a cyclic plan obeys the cart-table equation across the seam, turned or not
    fps, frames = 60.0, 66
    angle = 2 * np.pi * np.arange(frames) / frames
    zmp = np.column_stack([np.arange(frames) / frames, 0.1 * np.sin(angle)])
    shift = np.array([1.0, 0.2])
    height = 0.95 + 0.02 * np.cos(2 * angle)
    path = com_from_zmp(zmp, height, fps, shift, turn=turn)
    padded = np.concatenate([later_period(path[-1:], -1, shift, turn), path, later_period(path[:1], 1, shift, turn)])
    lift = GRAVITY + (np.roll(height, -1) - 2 * height + np.roll(height, 1)) * fps**2
    acceleration = (padded[2:] - 2 * path + padded[:-2]) * fps**2
    residual = path - height[:, None] * acceleration / lift[:, None] - zmp
    # four periods to either side: what is left of their ends, exp(-4 omega T) = 1e-6, times h fps^2 / g = 350
    assert np.abs(residual[1:-1]).max() < 1e-9
    assert np.abs(residual).max() < 2e-3


@pytest.mark.parametrize(
    ("name", "speed", "cadence"),
    [
        ("walk_fast", (1.65, 2.20), (118, 141)),  # norm table of men 18-29 y, fast pace
        ("walk_backward", (-1.1, -0.5), (80, 113)),
        ("walk_turn_left", (0.85, 1.20), (86, 113)),  # slow to normal pace
    ],
)
def test_speed_and_cadence(name, speed, cadence):
    loop = library_motion(name)
    _, step = loop_displacement(loop)
    style = {"walk_fast": FAST, "walk_backward": BACKWARD, "walk_turn_left": CURVE}[name]
    along = float(np.linalg.norm(step)) * (1 if step[0] > 0 else -1)
    assert speed[0] <= along / loop.duration <= speed[1]
    assert cadence[0] <= 120 / loop.duration <= cadence[1]
    if not style.turn_deg:
        assert abs(along) == pytest.approx(2 * style.step_length, abs=2e-3)
    duty = loop.contacts.mean(axis=0)
    assert ((duty > 0.54) & (duty < 0.72)).all()


def test_curved_walk_turns_by_its_yaw_and_closes():
    loop = library_motion("walk_turn_left")
    turn, _ = loop_displacement(loop)
    assert np.degrees(turn) == pytest.approx(CURVE.turn_deg, abs=0.1)
    three, n = repeat(loop, 3), len(loop)
    points = forward_kinematics(three.qpos, three.character).foot_points
    for side in (0, 1):  # a stance that spans the seam does not slip
        for seam in (n, 2 * n):
            if three.contacts[seam - 3 : seam + 3, side].all():
                part = points[seam - 3 : seam + 3, side]
                still = part[:, (part[..., 2] < 1e-3).all(axis=0)]
                assert np.ptp(still[..., :2], axis=0).max(initial=0.0) < 2e-3


@pytest.mark.parametrize(
    ("left", "right"), [("walk_left", "walk_right"), ("walk_turn_left", "walk_turn_right"), ("turn_left", "turn_right")]
)
def test_left_mirrors_right(left, right):
    one, other = mirror(library_motion(left)), library_motion(right)
    assert np.array_equal(one.qpos, other.qpos)
    assert np.array_equal(one.contacts, other.contacts)
    assert dict(one.events) == dict(other.events)


def test_side_steps_turns_and_steps_go_where_they_say():
    _, step = loop_displacement(library_motion("walk_left"))
    assert step == pytest.approx([0.0, 0.36], abs=2e-3)
    assert (
        library_motion("walk_right").events["right_touch_down"] == library_motion("walk_left").events["left_touch_down"]
    )
    turned = library_motion("turn_left").qpos[-1, 3:7]
    assert 2 * np.degrees(np.arctan2(turned[3], turned[0])) == pytest.approx(90.0, abs=0.5)
    for name, length in (("step_forward", 0.42), ("step_backward", -0.36)):
        motion = library_motion(name)
        x = forward_kinematics(motion.qpos, motion.character).xpos[:, motion.character.feet, 0]
        assert x[-1] - x[0] == pytest.approx([length, length], abs=1e-6)


def test_start_and_stop_join_the_walk():
    walk, start, stop = (library_motion(name) for name in ("walk", "walk_start", "walk_stop"))
    stand = library_motion("stand")
    for joint in (start.qpos[-1], stop.qpos[0]):
        assert np.abs(joint[2:] - walk.qpos[0, 2:]).max() < 2e-3
        assert abs(joint[1] - walk.qpos[0, 1]) < 2e-3
    pace = repeat(walk, 2).velocities()[1:10].mean(axis=0)[:6]
    assert (
        np.abs(
            start.velocities()[-10:-1].mean(axis=0)[:3]
            - repeat(walk, 2).velocities()[len(walk) - 9 : len(walk)].mean(axis=0)[:3]
        ).max()
        < 0.02
    )
    assert np.abs(stop.velocities()[1:10].mean(axis=0)[:3] - pace[:3]).max() < 0.02
    for rest in (start.qpos[0], stop.qpos[-1]):
        assert np.degrees(np.abs(rest[7:] - stand.qpos[0, 7:])).max() < 4.0


@pytest.mark.parametrize(
    ("name", "drop", "down"),
    [
        ("duck_shallow", (0.10, 0.25), (0.25, 0.45)),
        ("duck", (0.25, 0.42), (0.25, 0.45)),  # 25 to 35 cm clears a hook at head height
        ("duck_deep", (0.50, 0.75), (0.40, 0.70)),
    ],
)
def test_duck_depth_and_time(name, drop, down):
    motion, kinematics = played(name)
    height = kinematics.xpos[:, motion.character.segment("head"), 2]
    assert drop[0] <= height[motion.events["target"]] - height.min() <= drop[1]
    assert abs(height[motion.events["peak"]] - height.min()) < 0.01
    assert down[0] <= (motion.events["peak"] - motion.events["target"]) / 60 <= down[1]


@pytest.mark.parametrize("name", [entry.name for entry in library_entries() if entry.family == "jump"])
def test_jumps_rise_as_high_and_far_as_they_say(name):
    motion, kinematics = played(name)
    entry = next(entry for entry in library_entries() if entry.name == name)
    off, land = motion.events["take_off"], motion.events["landing"]
    com = kinematics.com
    rise = com[off:land, 2].max() - com[off, 2]
    assert rise == pytest.approx(entry.parameters["rise_m"], abs=0.03)  # 36 to 52 cm: athletes' best
    assert 0.2 <= rise <= 0.52
    fall = np.diff(com[off + 1 : land - 1, 2], 2) * 60**2
    assert fall == pytest.approx(-GRAVITY, abs=0.05)
    feet = kinematics.xpos[:, motion.character.feet, 0]
    assert feet[-1] - feet[0] == pytest.approx([entry.parameters["distance_m"]] * 2, abs=1e-6)
    speed = (com[land - 1, 0] - com[off + 1, 0]) * 60 / (land - off - 2)
    assert (speed > 0.7) == (name not in ("jump", "jump_high"))


@pytest.mark.parametrize("style", [jumps.OVER_LOW, jumps.OVER_HIGH])
def test_feet_clear_the_obstacle(style):
    name = "jump_over_low" if style is jumps.OVER_LOW else "jump_over_high"
    motion, kinematics = played(name)
    half = jumps.OBSTACLE_DEPTH_M / 2
    points = kinematics.foot_points
    over = (points[..., 0].min(axis=2) < style.obstacle_ahead + half) & (
        points[..., 0].max(axis=2) > style.obstacle_ahead - half
    )
    assert over.any(axis=0).all()
    assert not motion.contacts[over].any()
    assert points[..., 2].min(axis=2)[over].min() > style.obstacle + 0.05
    knees = kinematics.xpos[:, [motion.character.segment(f"{side}_shank") for side in SIDES]]
    above = np.abs(knees[..., 0] - style.obstacle_ahead) < half
    assert knees[..., 2][above].min() > style.obstacle + 0.06


def test_crawls_pass_under_their_bars():
    tops = {}
    for name in ("crawl", "crawl_low", "crawl_hands_knees"):
        motion, kinematics = played(name)
        low = slice(motion.events["low"], motion.events["rise"])
        tops[name] = (kinematics.xpos[low, motion.character.segment("head"), 2] + CROWN_M).max()
        assert np.ptp(kinematics.com[low, 0]) > 0.8
    assert tops["crawl_low"] < tops["crawl"] - 0.10


def test_hands_and_knees_crawl_is_diagonal_and_borne():
    motion, kinematics = played("crawl_hands_knees")
    low = slice(motion.events["low"] + 6, motion.events["rise"] - 6)
    speed = np.ptp(kinematics.com[low, 0]) * 60 / (low.stop - low.start)
    assert 0.28 <= speed <= 0.69  # adults on a treadmill
    moving = {
        part: np.abs(np.gradient(kinematics.xpos[low, motion.character.segment(part), 0]) * 60) > 0.3
        for part in ("left_hand", "right_hand", "left_shank", "right_shank")
    }
    for hand, knee in (("left_hand", "right_shank"), ("right_hand", "left_shank")):
        together = (moving[hand] & moving[knee]).sum() / (moving[hand] | moving[knee]).sum()
        assert together > 0.7
    assert not (moving["left_shank"] & moving["right_shank"]).any()
    knees = kinematics.xpos[low][:, [motion.character.segment(f"{side}_shank") for side in SIDES], 2]
    assert knees.min() > 0.05  # above the radius of the shank
    assert knees.min(axis=1).max() < 0.062  # one is always down
    # In diagonal support the body tips over a line and is caught by the next pair, and positions are planned, not forces: the
    # zero-moment point may leave the area of toes, knees and fists for part of a step.
    _, zmp = ground_reaction(kinematics, motion.fps, motion.character)
    distances = []
    for frame in range(1, len(motion) - 1):
        feet = kinematics.foot_points[frame][motion.contacts[frame]].reshape(-1, 3)
        points = np.concatenate([feet[feet[:, 2] < 4e-3][:, :2], hands_and_knees_on_the_floor(kinematics, frame)])
        if len(points) > 2:
            distances.append(outside(points, zmp[frame]))
    assert len(distances) > 0.9 * len(motion)
    assert np.mean(np.array(distances) > 0.02) <= 0.35
    assert np.mean(distances) < 0.03
