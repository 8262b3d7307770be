"""Punches, blocks and dodges against what is published: speeds, durations, heights, order of the joints, symmetry."""

import mujoco
import numpy as np
import pytest

from simprep.library import library_entries, library_motion
from simprep.library.boxing.block import Block
from simprep.library.boxing.hook import Hook
from simprep.library.boxing.jab_and_cross import StraightPunch
from simprep.motion.edit import mirror
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.rotations import rotation_matrix

BY_NAME = {entry.name: entry for entry in library_entries()}
NEW = ("jab", "cross", "hook", "uppercut")
PUNCHES = tuple(name for name in BY_NAME if name.startswith(NEW))
BLOCKS = tuple(name for name, entry in BY_NAME.items() if entry.family == "block")
DODGES = tuple(name for name, entry in BY_NAME.items() if entry.family == "dodge")

PEAK_SPEED_M_S = {
    # junior mean less two SD to elite mean plus two SD: 6.32 +- 0.42 and 7.16 +- 0.48 (Liu et al. 2022, PMC9798280)
    "jab": (5.48, 8.12),
    # juniors' rear crosses 7.0 to 7.5 (doi 10.1177/1747954120952574) to Olympic straights 9.14 (Walilko et al. 2005)
    "cross": (7.0, 9.2),
    # Olympic hooks 11.0 +- 3.4, hand (Viano et al. 2005, Neurosurgery 57:1154)
    "hook": (7.6, 14.4),
    # no measurement at hand; the design range, below the hooks of Olympic boxers
    "uppercut": (7.0, 11.0),
}
# load and drive together, and return: design ranges; published per punch is only their order (Piorkowski et al. 2011)
DELIVERY_S = {"jab": (0.18, 0.31), "cross": (0.28, 0.42), "hook": (0.30, 0.46), "uppercut": (0.32, 0.48)}
RETURN_S = {"jab": (0.20, 0.30), "cross": (0.30, 0.40), "hook": (0.30, 0.45), "uppercut": (0.30, 0.45)}
# a punch to the body lowers the COM by 0.12 m in the delivery: in free fall this alone takes sqrt(4 h / g) = 0.22 s
BODY_EXTRA_S = 0.16


def fist(motion, kinematics, side):
    """(T, 3) middle of the fist [m]."""
    hand = motion.character.segment(f"{side}_hand")
    offset = np.array(motion.character.model.site(f"{side}_hand").pos)
    return kinematics.xpos[:, hand] + rotation_matrix(kinematics.xquat[:, hand]) @ offset


def in_thorax(motion, kinematics, point):
    """(T, 3) the same point as the thorax sees it."""
    thorax = motion.character.segment("thorax")
    turn = rotation_matrix(kinematics.xquat[:, thorax])
    return np.einsum("tji,tj->ti", turn, point - kinematics.xpos[:, thorax])


def solved(name):
    motion = library_motion(name)
    return motion, forward_kinematics(motion.qpos, motion.character), BY_NAME[name].parameters


def test_the_upper_body_families_are_complete():
    assert len(PUNCHES) == 14  # with punch_left and punch_right, the crosses to the head: 16
    assert {name for name, entry in BY_NAME.items() if entry.family == "punch"} == {
        *PUNCHES, "punch_left", "punch_right",
    }  # fmt: skip
    assert sorted(BLOCKS) == ["block_high_left", "block_high_right", "block_low_left", "block_low_right"]
    assert sorted(DODGES) == [
        "shoulder_roll", "slip_left", "slip_right", "sway_back", "weave_left", "weave_right",
    ]  # fmt: skip


@pytest.mark.parametrize("name", PUNCHES)
def test_punches_are_as_fast_and_as_long_as_published(name):
    motion, kinematics, parameters = solved(name)
    kind, side, body = parameters["type"], parameters["side"], parameters["height"] == "body"
    at = fist(motion, kinematics, side)
    speed = np.linalg.norm(np.gradient(at, 1 / motion.fps, axis=0), axis=1)
    target, impact = motion.events["target"], motion.events["impact"]
    low, high = PEAK_SPEED_M_S[kind]
    assert low <= speed.max() <= high
    assert abs(int(speed.argmax()) - impact) <= 3
    if kind in ("jab", "cross"):  # at contact: 4.87 +- 0.39 (juniors) to 5.56 +- 0.61 (elite), two SD (Liu et al. 2022)
        assert 4.09 <= speed[impact] <= 6.78
    else:
        assert speed[impact] > 0.7 * speed.max()
    low, high = DELIVERY_S[kind]
    assert low <= (impact - target) / motion.fps <= high + BODY_EXTRA_S * body
    local = in_thorax(motion, kinematics, at)
    home = np.linalg.norm(local - local[target - 3], axis=1) < 0.05
    back = impact + int(np.argmax(home[impact:]))
    low, high = RETURN_S[kind]
    assert low - 0.1 <= (back - impact) / motion.fps <= high + BODY_EXTRA_S * body
    assert speed[: target - 2].max() < 3.0
    assert speed[target - 3] < 0.15


@pytest.mark.parametrize("name", PUNCHES)
def test_punches_land_on_chin_and_solar_plexus_ahead(name):
    motion, kinematics, parameters = solved(name)
    head, thorax = motion.character.segment("head"), motion.character.segment("thorax")
    target, impact = motion.events["target"], motion.events["impact"]
    point = fist(motion, kinematics, parameters["side"])[impact]
    crown = kinematics.xpos[target, head, 2] + 0.14
    chin = crown - 0.204  # vertex to mid-gonion, de Leva 1996 scaled to 1.75 m
    if parameters["height"] == "head":
        assert chin - 0.07 <= point[2] <= crown  # an uppercut hits the chin from below with a fist of 4 cm radius
    else:
        # between the rim of the pelvis and the lower end of the sternum of someone in the same guard
        pelvis = kinematics.xpos[target, 0, 2]
        assert pelvis + 0.10 <= point[2] <= kinematics.xpos[target, thorax, 2]
        assert kinematics.com[impact, 2] < kinematics.com[target - 3, 2] - (0.02 if "uppercut" in name else 0.08)
    assert abs(point[1]) < 0.10
    assert point[0] > kinematics.xpos[impact, head, 0] + 0.25
    joint = motion.character.joint(f"{parameters['side']}_elbow_flexion")
    elbow = np.degrees(motion.qpos[impact : impact + 5, 7 + joint])
    if parameters["type"] in ("jab", "cross"):
        assert 15 <= elbow.min() <= 35
    else:
        assert 70 <= elbow[0] <= 112


@pytest.mark.parametrize("name", PUNCHES)
def test_punches_start_at_the_hips_and_end_at_the_fist(name):
    motion, kinematics, parameters = solved(name)
    head = motion.character.segment("head")
    side = parameters["side"]
    target, impact = motion.events["target"], motion.events["impact"]
    # the drive: from where the pelvis starts to turn towards the punch
    velocity = motion.velocities()
    towards = {("jab", "left"): -1, ("hook", "left"): -1, ("cross", "left"): -1, ("uppercut", "left"): -1}
    sign = towards.get((parameters["type"], side), 1)
    drive = slice(target + 4, impact + 6)
    pelvis = int((sign * velocity[drive, 5]).argmax())
    trunk = int((sign * velocity[drive, 6 + motion.character.joint("thorax_rotation")]).argmax())
    at = fist(motion, kinematics, side)
    arm = np.linalg.norm(np.gradient(in_thorax(motion, kinematics, at), 1 / motion.fps, axis=0), axis=1)
    assert pelvis <= trunk <= int(arm[drive].argmax()) + 1
    assert 0 <= int(arm[drive].argmax()) - pelvis <= 9  # within 150 ms: 20 to 50 ms a link
    # the face stays on the opponent
    ahead = rotation_matrix(kinematics.xquat[target : impact + 6, head])[:, :, 0]
    assert np.degrees(np.arctan2(np.abs(ahead[:, 1]), ahead[:, 0])).max() < 25
    # the other hand stays up: within 20 cm of the chin's height
    other = fist(motion, kinematics, "left" if side == "right" else "right")[impact]
    assert abs(other[2] - (kinematics.xpos[impact, head, 2] - 0.06)) < 0.2


def test_straights_are_delivered_sooner_than_hooks():
    """Piorkowski et al. 2011, Sports Biomech (pubmed 21560747): straights arrive sooner, hooks are faster."""

    def delivery(name):
        events = library_motion(name).events
        return events["impact"] - events["target"]

    assert delivery("jab_left_head") < delivery("hook_left_head") < delivery("uppercut_right_head")
    assert delivery("jab_left_body") < delivery("cross_right_body")


@pytest.mark.parametrize("name", BLOCKS)
def test_blocks_stand_in_time_and_stay(name):
    motion, kinematics, parameters = solved(name)
    head, thorax = motion.character.segment("head"), motion.character.segment("thorax")
    target, impact = motion.events["target"], motion.events["impact"]
    assert 0.2 <= (impact - target) / motion.fps <= 0.3
    side = parameters["side"]
    at = fist(motion, kinematics, side)
    elbow = kinematics.xpos[:, motion.character.segment(f"{side}_forearm")]
    local = in_thorax(motion, kinematics, at)
    held = slice(impact, impact + 6)
    assert np.linalg.norm(local[held] - local[impact], axis=1).max() < 0.01
    if parameters["height"] == "high":  # the forearm upright beside the head: elbow below the chin, fist at the temple
        assert (at[held, 2] > kinematics.xpos[held, head, 2] + 0.03).all()
        assert (at - elbow)[impact, 2] > 0.8 * np.linalg.norm((at - elbow)[impact])
        assert np.linalg.norm((at - kinematics.xpos[:, head])[impact, :2]) < 0.28
    else:  # the forearm covers the ribs: elbow lower than the fist, both between pelvis and shoulder
        assert kinematics.xpos[impact, 0, 2] < elbow[impact, 2] < at[impact, 2]
        assert at[impact, 2] < kinematics.xpos[impact, thorax, 2] + 0.05


def test_dodges_take_the_head_off_the_line():
    """A fist of 9 cm and a head of 16 cm miss by 13 cm; a drop of 25 to 35 cm clears a hook."""
    moved = {}
    for name in DODGES:
        motion, kinematics, _ = solved(name)
        target, peak = motion.events["target"], motion.events["peak"]
        at = kinematics.xpos[:, motion.character.segment("head")]
        head = at - at[target - 3]
        moved[name] = head
        assert 0.25 <= (peak - target) / motion.fps <= 0.47
        assert np.linalg.norm(head[peak]) > 0.10
        assert np.linalg.norm(head[peak:], axis=1).min() < 0.02  # and comes back
        assert motion.contacts.all()
    peak = {name: moved[name][library_motion(name).events["peak"]] for name in DODGES}
    assert peak["slip_left"][1] > 0.13
    assert peak["slip_right"][1] < -0.13
    assert -0.36 < peak["weave_left"][2] < -0.25
    assert moved["weave_left"][:, 1].max() > 0.13
    assert moved["weave_right"][:, 1].min() < -0.13
    assert peak["sway_back"][0] < -0.15
    assert abs(peak["sway_back"][2]) < 0.06
    # the shoulder roll turns the trunk away until the front shoulder covers the chin
    motion, kinematics, _ = solved("shoulder_roll")
    turn = rotation_matrix(kinematics.xquat[:, motion.character.segment("thorax")])[motion.events["peak"]]
    assert np.degrees(np.arctan2(turn[1, 0], turn[0, 0])) < -60


@pytest.mark.parametrize("name", [n for n in (*PUNCHES, *BLOCKS, *DODGES) if BY_NAME[n].parameters["side"] == "left"])
def test_arms_do_not_pass_through_the_body(name):
    model = library_motion(name).character.model
    data = mujoco.MjData(model)

    def geoms(*bodies):
        return [g for g in range(model.ngeom) if model.body(model.geom_bodyid[g]).name in bodies]

    left, right = (geoms(f"{side}_forearm", f"{side}_hand") for side in ("left", "right"))
    trunk = geoms("head", "neck", "thorax", "abdomen", "pelvis")
    pairs = [(a, b) for a in left + right for b in trunk] + [(a, b) for a in left for b in right]
    for pose in library_motion(name).qpos[::4]:
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        assert min(mujoco.mj_geomDistance(model, data, a, b, 0.05, None) for a, b in pairs) > -0.012


@pytest.mark.parametrize("name", [n for n in (*PUNCHES, *BLOCKS, *DODGES) if "left" in n])
def test_left_and_right_are_mirror_images(name):
    left, right = library_motion(name), library_motion(name.replace("left", "right"))
    reflected = mirror(right)
    assert np.array_equal(left.qpos, reflected.qpos)
    assert np.array_equal(left.contacts, reflected.contacts)
    assert dict(left.events) == dict(right.events)
    assert BY_NAME[name].parameters["side"] == "left"
    assert BY_NAME[name.replace("left", "right")].parameters["side"] == "right"


def test_parameters_change_the_motion_as_they_say():
    far = StraightPunch("jab_left_head", "lead", "head", reach_m=0.60).motion()
    near = library_motion("jab_left_head")
    tip = [fist(m, forward_kinematics(m.qpos, m.character), "left")[:, 0].max() for m in (far, near)]
    assert 0.01 < tip[1] - tip[0] < 0.04
    speed = []
    for turn in (60.0, 88.0):
        motion = Hook("hook_left_head", "head", turn_deg=turn).motion()
        at = fist(motion, forward_kinematics(motion.qpos, motion.character), "left")
        speed.append(np.linalg.norm(np.diff(at, axis=0), axis=1).max() * motion.fps)
    assert speed[1] > speed[0] + 0.5
    slow = Block("block_high_left", "high", close_s=0.35).motion()
    assert slow.events["impact"] - slow.events["target"] == 21
