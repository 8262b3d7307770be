"""Answers, hits, stitches, steadiness and Jensen-Shannon distances against cases worked out by hand."""

import numpy as np
import pytest
from metric_cases import rigid_motion
from scipy.spatial.transform import Rotation

from simprep.duel.labels.labels import Label
from simprep.duel.stream.stream import DuelStream
from simprep.errors import MotionError, SettingError
from simprep.humanoid_model import humanoid
from simprep.metrics.contact import foot_slip, stance_drift
from simprep.metrics.interaction.distributions import KINDS, Counts, distributions, js_distance, js_floor, pooled
from simprep.metrics.interaction.overlap import Hits, Overlaps, count_hits, overlaps, recorded_contacts
from simprep.metrics.interaction.reactions import reactions
from simprep.metrics.interaction.stability import stability
from simprep.metrics.interaction.stitches import Stitches, compare_stitches, stitches
from simprep.metrics.interaction.stream import depths, falls_per_minute
from simprep.motion.edit import move
from simprep.motion.motion import Motion
from simprep.physics.contacts import BodyContact
from simprep.physics.overlap import overlap_of_poses

NEUTRAL = Label(move="L-L").code
PUNCH = Label(move="L-L", left_punch="fwd").code
KICK = Label(move="R-R", right_kick="downup").code
BACK = Label(move="L-L", left_punch="bwd").code
LEAP = Label(move="L-F", jump="up").code


def rows(player, *actions, clip=0):
    """Rows of a table and labels from (first frame, label) ..., the frame after the last."""
    *begun, end = actions
    starts = [start for start, _ in begun]
    table = [(player, a, b, clip) for a, b in zip(starts, [*starts[1:], end])]
    return table, [code for _, code in begun]


def joined(*parts):
    return np.array([row for table, _ in parts for row in table]), np.array(
        [code for _, codes in parts for code in codes]
    )


def pair(a, b):
    return DuelStream((a, b))


def standing(frames, distance=1.2, fps=60.0):
    still = np.zeros((frames, 3))
    return pair(rigid_motion(still, fps), rigid_motion(still + np.array([distance, 0, 0]), fps))


def test_answers_by_the_frame():
    # at 20 frames/s an answer begins 1 to 10 frames after the attack, and no later than the attacker's next action
    ours = rows(0, (0, NEUTRAL), (20, PUNCH), (40, NEUTRAL), (60, PUNCH), (66, BACK), (80, KICK), (95, PUNCH), 100)
    theirs = rows(
        1, (0, NEUTRAL), (20, NEUTRAL), (31, NEUTRAL), (66, NEUTRAL), (85, BACK), (86, LEAP), (91, NEUTRAL), 100
    )
    found = reactions(*joined(ours, theirs), np.array([[0, 100]]), 20.0, 2)
    # 20: answered too early and too late; 60: at the last moment; 80: by no fitting action; 95: time runs out, not counted
    assert found.attacks == 3
    assert found.answered_share == pytest.approx(1 / 3)
    assert found.delay_s == pytest.approx(0.3)
    assert found.answered_by[1] == pytest.approx(1 / 3)
    assert np.isnan(found.answered_by[0])
    assert found.attacks_per_min == (pytest.approx(4 / (99 / 20 / 60)), 0.0)
    # across a seam nothing is answered
    table, codes = joined(rows(0, (0, NEUTRAL), (40, PUNCH), 50), rows(1, (0, NEUTRAL), 50))
    more = joined(rows(0, (50, NEUTRAL), 100, clip=1), rows(1, (50, NEUTRAL), (52, PUNCH), 100, clip=1))
    table, codes = np.concatenate([table, more[0]]), np.concatenate([codes, more[1]])
    assert reactions(table, codes, np.array([[0, 50], [50, 100]]), 20.0, 2).answered_share == 0
    with pytest.raises(MotionError, match="is not one of 1 clips"):
        reactions(table, codes, np.array([[0, 100]]), 20.0, 2)
    with pytest.raises(MotionError, match=r"with \(3,\) labels"):
        reactions(table, codes[:3], np.array([[0, 50], [50, 100]]), 20.0, 2)


@pytest.mark.parametrize("coupled", [False, True])
def test_chance_is_what_independent_fighters_score(coupled):
    rng = np.random.default_rng(5)
    edges = [np.cumsum(rng.integers(15, 60, 4000)) for _ in range(2)]
    end = int(min(edge[-1] for edge in edges))
    codes = [rng.choice([NEUTRAL, PUNCH, BACK, LEAP], len(edge)) for edge in edges]
    if coupled:  # B begins something neutral 12 frames after each of A's attacks
        extra = edges[0][codes[0] == PUNCH] + 12
        edges[1] = np.concatenate([extra, edges[1]])  # where both begin, the answer is kept
        codes[1] = np.concatenate([np.full(len(extra), NEUTRAL), codes[1]])
        edges[1], kept = np.unique(edges[1], return_index=True)
        codes[1] = codes[1][kept]
    parts = [
        rows(player, (0, BACK), *((int(a), int(b)) for a, b in zip(edge, code) if a < end - 1), end)
        for player, (edge, code) in enumerate(zip(edges, codes))
    ]
    found = reactions(*joined(*parts), np.array([[0, end]]), 60.0, 2)
    if coupled:
        assert found.answered_by[1] == 1
        assert found.answered_share > found.chance_share + 0.15
    else:
        assert found.attacks > 1500
        assert found.chance_share == pytest.approx(found.answered_share, abs=0.04)


def test_overlap_is_that_of_physics_whoever_is_first_and_none_at_arms_length():
    near = pair(*(standing(3, 0.2).players))
    depth = overlap_of_poses([m.qpos for m in near.players], [m.character for m in near.players])
    found = overlaps(near.players)
    np.testing.assert_allclose(found.deepest, depth)
    assert depth[0] > 0.02
    again = overlaps(near.players[::-1])
    order = np.lexsort((again.segments[:, 0], again.segments[:, 1], again.frame))
    np.testing.assert_array_equal(again.segments[order][:, ::-1], found.segments)
    far = overlaps(standing(3, 1.5).players)
    assert len(far.frame) == 0
    assert far.deepest.tolist() == [0, 0, 0]
    half = depths(np.array([0.0, 0.02, 0.04, 0.0]))
    assert (half.mean_mm, half.mean_inside_mm, half.max_mm, half.share) == (15, 30, 40, 0.5)


def touching(stream, *contacts):
    """Overlaps from (first frame, frame after, segment of A, segment of B)."""
    index = stream.players[0].character.segment
    found = sorted((t, index(a), index(b)) for first, after, a, b in contacts for t in range(first, after))
    frames, a, b = np.array(found).T
    bodies = np.tile([0, 1], (len(frames), 1))
    return Overlaps(len(stream), frames, bodies, np.stack([a, b], axis=1), np.full(len(frames), 0.01))


def test_hits_by_what_was_meant():
    stream = standing(100)
    characters = [one.character for one in stream.players]
    table, codes = joined(
        rows(0, (0, NEUTRAL), (20, PUNCH), (40, BACK), (60, KICK), (80, NEUTRAL), 100), rows(1, (0, NEUTRAL), 100)
    )

    def hits(*contacts, grace_s=0.0):
        found = touching(stream, *contacts)
        return count_hits(found, characters, stream.fps, stream.bounds, table, codes, grace_s)

    assert hits((25, 35, "left_hand", "thorax")) == Hits(intended=1, unintended=0, blocked=0)
    assert hits((25, 35, "left_hand", "right_forearm")) == Hits(0, 0, 1)
    # forearm on an arm, then through to the head; still inside while the fist returns
    assert hits((25, 50, "left_forearm", "left_hand"), (30, 60, "left_hand", "head")) == Hits(1, 0, 0)
    assert hits((25, 35, "right_hand", "thorax")) == Hits(0, 1, 0)  # the other hand
    assert hits((43, 50, "left_hand", "thorax")) == Hits(0, 1, 0)  # no longer an attack ...
    assert hits((43, 50, "left_hand", "thorax"), grace_s=0.1) == Hits(1, 0, 0)  # ... but that of a limb that is late
    assert hits((62, 64, "right_thigh", "right_hand")) == Hits(0, 1, 0)  # not what a kick lands with
    # a foot on a thigh; thigh against foot in the same contact of two legs
    assert hits((62, 64, "right_foot", "left_thigh"), (62, 64, "right_thigh", "left_foot")) == Hits(1, 0, 0)
    # one contact of two legs, interrupted for 5 frames = 0.083 s; one of leg and trunk
    legs = (0, 3, "left_shank", "left_foot"), (8, 12, "left_thigh", "left_foot")
    assert hits(*legs, (0, 3, "left_shank", "pelvis")) == Hits(0, 2, 0)
    assert hits(legs[0], (9, 12, "left_shank", "left_foot")) == Hits(0, 2, 0)
    none = overlaps(stream.players)
    assert count_hits(none, characters, stream.fps, stream.bounds, table, codes) == Hits(0, 0, 0)
    # a third fighter: whom a blow of the first meets does not matter, and a contact of the others is none of it
    bodies = np.array([[0, 2], [1, 2], [0, 1]])
    index = characters[0].segment
    for other, rest in (("thorax", Hits(1, 1, 0)), ("left_hand", Hits(0, 1, 1))):
        parts = np.array(
            [[index("left_hand"), index(other)], [index("head"), index("head")], [index("left_forearm")] * 2]
        )
        three = Overlaps(100, np.array([25, 25, 30]), bodies, parts, np.full(3, 0.01))
        assert count_hits(three, characters * 2, stream.fps, stream.bounds, table, codes) == rest
    with pytest.raises(MotionError):
        count_hits(none, characters[:1], stream.fps, stream.bounds, table, codes)


def test_three_who_stand_together_overlap_in_pairs():
    first, second = standing(2, 0.2).players
    third = move(second, (0.15, 0.0), 0.0)
    found = overlaps([first, second, third])
    pairs = {tuple(one) for one in found.bodies.tolist()}
    assert pairs == {(0, 1), (1, 2)} | ({(0, 2)} & pairs)
    for a, b in pairs:
        own = (found.bodies == (a, b)).all(axis=1)
        two = overlaps([(first, second, third)[k] for k in (a, b)])
        np.testing.assert_array_equal(found.segments[own], two.segments)
        np.testing.assert_array_equal(found.depth[own], two.depth)


def test_recorded_contacts_fall_on_frames():
    def contact(start, duration, a, b):
        return BodyContact(start, duration, (0, 1), (a, b), (1.0, 0.0, 0.0), 10.0, 1.0, (0.0, 0.0, 1.0), 0.01)

    brief = contact(0.5, 1 / 480, "left_hand", "head")  # too short for a frame at 20 per second
    late = contact(4.9, 2.0, "head", "right_foot")  # goes on beyond the end
    stream = standing(100, fps=20.0)
    characters = [one.character for one in stream.players]
    found = recorded_contacts([late, brief], characters, len(stream), stream.fps)
    assert found.frame.tolist() == [10, 98, 99]
    assert [stream.players[0].character.segments[k] for k in found.segments[0]] == ["left_hand", "head"]
    assert found.bodies.tolist() == [[0, 1]] * 3
    assert len(recorded_contacts([], characters, len(stream), stream.fps).frame) == 0


def test_jensen_shannon_distance():
    def counts(**numbers):
        return Counts(np.array([int(key[1:]) for key in numbers]), np.array(list(numbers.values()), dtype=float))

    one = counts(k1=2, k5=6)
    assert js_distance(one, one) == 0
    assert js_distance(one, counts(k1=1, k5=3)) == 0  # shares count
    assert js_distance(one, counts(k2=1, k3=9)) == pytest.approx(1)
    # (1, 0) and (1/2, 1/2): half of (log 4/3 + (log 2/3)/2 + (log 2)/2) = 0.311 bits
    expected = 0.5 * (np.log2(4 / 3) + 0.5 * np.log2(2 / 3) + 0.5 * np.log2(2))
    assert js_distance(counts(k1=3), counts(k1=4, k2=4)) == pytest.approx(np.sqrt(expected))
    assert np.isnan(js_distance(one, Counts(np.empty(0, np.int64), np.empty(0))))


def test_what_is_counted_of_a_fight():
    fps = 60.0
    stream = standing(120, 1.23)
    table, codes = joined(
        rows(0, (0, NEUTRAL), (30, PUNCH), (60, BACK), 120), rows(1, (0, NEUTRAL), (40, KICK), (60, NEUTRAL), 120)
    )
    found = distributions(stream, table, codes)
    assert found.bigram.total == found.cross_bigram.total == 4
    assert found.kind_bigram.total == 4
    assert found.distance.numbers.tolist() == [pytest.approx(120 / fps)]
    assert found.distance.keys.tolist() == [12]  # 1.2 to 1.3 m
    # both face x: A straight at B, B away from A
    assert found.facing.numbers.tolist() == pytest.approx([2, 2])
    moved = distributions(standing(120, 1.29), table, codes)
    assert js_distance(found.distance, moved.distance) == 0
    assert js_distance(found.distance, distributions(standing(120, 1.31), table, codes).distance) == pytest.approx(1)
    # the same labels, but B acts later: edges stay, cross edges change
    late = joined(
        rows(0, (0, NEUTRAL), (30, PUNCH), (60, BACK), 120), rows(1, (0, NEUTRAL), (70, KICK), (90, NEUTRAL), 120)
    )
    other = distributions(stream, *late)
    assert js_distance(found.bigram, other.bigram) == 0
    assert js_distance(found.cross_bigram, other.cross_bigram) > 0.3
    twice = pooled([found, found])
    assert twice.bigram.total == 8
    assert js_distance(twice.cross_bigram, found.cross_bigram) == 0
    # the second half does what the first did
    again = np.concatenate([table, table + np.array([0, 120, 120, 0])])
    halves = js_floor(standing(240, 1.23), again, np.concatenate([codes, codes]))
    assert halves == dict.fromkeys(KINDS, 0.0)
    with pytest.raises(SettingError, match="half of the stream"):
        js_floor(stream, table, codes, 1.5)
    with pytest.raises(SettingError, match="at least one"):
        pooled([])


def test_stitches_of_a_sway_and_of_a_step_of_velocity():
    fps = 120.0
    time = np.arange(int(4 * fps)) / fps
    sway = np.stack([0.1 * np.sin(2 * np.pi * time), 0 * time, 0 * time], axis=1)
    step = np.stack([np.maximum(time - 2.0, 0) * 0.5, 0 * time, 0 * time], axis=1)
    stream = pair(rigid_motion(sway, fps), rigid_motion(step + np.array([2, 0, 0]), fps))
    table = np.array([(0, 0, 210, 0), (0, 210, 480, 0), (1, 0, 120, 0), (1, 120, 240, 0), (1, 240, 480, 0)])
    found = stitches(stream, table)
    assert len(found) == 3  # beginnings of the clip are none
    # A at 1.75 s, where the sway turns; B at 1 s stands, and at 2 s jumps from 0 to 0.5 m/s: v / (sigma sqrt(2 pi))
    damping = np.exp(-((2 * np.pi * 0.02) ** 2) / 2)
    expected = [0.1 * (2 * np.pi) ** 2 * damping, 0.0, 0.5 / (0.02 * np.sqrt(2 * np.pi))]
    # a spline through the corner overshoots by 1.5 %
    np.testing.assert_allclose(found.linear, expected, rtol=0.02, atol=1e-6)
    assert found.angular.max() < 1e-6
    assert found.hinge.max() < 1e-6
    assert len(stitches(stream, table, table[:, 1] == 240)) == 1
    same = Stitches(2 * found.linear, found.linear, found.linear)
    ratio = compare_stitches(same, Stitches(found.linear, found.linear, found.linear))
    assert ratio["linear_p95_ratio"] == pytest.approx(2)
    assert ratio["hinge_median_ratio"] == pytest.approx(1)


def test_steadiness_of_a_nodding_and_of_a_spinning_body():
    fps, seconds = 120.0, 10.0
    time = np.arange(int(fps * seconds)) / fps
    nod, spin = np.radians(20) * np.sin(2 * np.pi * time), 3.0 * time
    turns = Rotation.from_euler("ZY", np.column_stack([spin, nod]))
    quat = np.tile(turns.as_quat(scalar_first=True)[:, None], (1, len(humanoid().segments), 1))
    quat[::7] *= -1  # the same rotations
    found = stability([quat], [humanoid()], np.array([[0, len(time)]]), fps)
    assert found.pelvis_tilt_deg == found.trunk_tilt_deg == pytest.approx(20 / np.sqrt(2), rel=1e-3)
    # the spin is about the vertical and does not count; 20 ms of smoothing take 0.8 % off 1 Hz
    assert found.pelvis_rate_deg_s == pytest.approx(20 / np.sqrt(2) * 2 * np.pi, rel=0.03)


def test_stances_one_by_one():
    fps = 60.0
    time = np.arange(121) / fps
    slide = rigid_motion(np.stack([0.3 * time, 0 * time, 0 * time], axis=1), fps)
    contacts = slide.contacts.copy()
    contacts[50:70, 0] = False
    slide = Motion(slide.qpos, fps, contacts)
    slip = foot_slip(slide)
    assert len(slip.stance_travel_m) == slip.stance_count == 3
    assert sum(slip.stance_travel_m) == pytest.approx(slip.travel_m)
    # 48 intervals inside each half of the left foot's contact, 120 of the right's
    np.testing.assert_allclose(slip.stance_travel_m, [0.3 * 48 / fps, 0.3 * 49 / fps, 0.6], rtol=1e-9)
    # from the middle of the first to the middle of the last third
    np.testing.assert_allclose(stance_drift(slide)[2], 0.3 * 81 / fps)
    # noise adds to the path and not to the drift
    rng = np.random.default_rng(0)
    noisy = rigid_motion(np.column_stack([0.003 * rng.normal(size=(121, 2)), 0 * time]), fps)
    assert foot_slip(noisy).mm_per_stance > 300
    assert stance_drift(noisy).max() < 0.003


def test_falls_per_minute():
    assert falls_per_minute([("done", 10.0), ("fell", 4.0), ("diverged", 1.0)]) == pytest.approx(4.0)
    assert np.isnan(falls_per_minute([]))
