"""Fights that are simulated while they are drawn: bodies that are elsewhere, strikes, blows, falls and getting up."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from simprep.duel.fight.balance import BalanceWatch
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.duel.fight.falls import Fall, blow_before, blows, collision_before
from simprep.duel.fight.floor_move import FloorMove, GradualMove, fit_move, move_between
from simprep.duel.fight.getting_up import PRONE, SUPINE, lying, roll_over, way_up
from simprep.duel.fight.hits import JudgedContact
from simprep.duel.fight.live import CATCHES, DOWN, REACTS, WAITS, LiveFight, LiveSettings
from simprep.duel.fight.modes import begin_fight
from simprep.duel.fight.pace import AS_RECORDED, Pace, PaceSettings, pace_of
from simprep.duel.fight.placement import place
from simprep.duel.fight.strikes import bent, strike_of
from simprep.duel.labels.labels import Label
from simprep.duel.model.action_features import FloorFrame
from simprep.duel.model.fight_model import FightModel
from simprep.duel.model.structures import couple, link_actions
from simprep.duel.model.tracks import pair_tracks
from simprep.duel.model.transition_model import train
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import PRESETS
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.metrics.interaction.run import run_metrics
from simprep.motion.edit import move, yaw
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.rotations import wrap_angle
from simprep.motion.turns import turned
from simprep.physics.contacts import BodyContact
from simprep.physics.mpc_settings import MpcSettings
from simprep.physics.settings import SimulationSettings
from simprep.physics.tracker import Tracker
from simprep.physics.tracker_state import TrackerState

QUIET = LiveSettings(reach_m=0.0, pace=None, react_s=0.0, off_m=0.0, acceleration=np.inf)
NEVER = FloorMove(np.zeros(2), 0.0, np.zeros(2))


@pytest.fixture(scope="module")
def model():
    example = make_synthetic(replace(PRESETS["kickboxing"], clips=3, clip_s=30.0), seed=5)
    player, start, end, clip = example.truth.table.T
    graph = couple(link_actions(player, start, end, example.truth.codes, clip))
    return FightModel(train(graph, pair_tracks(example.stream)), example.stream)


@pytest.fixture(scope="module")
def examples(model):
    return ExampleMotions.of(model.stream, model.model)


class Stub:
    """Bodies that are exactly where a move has them, at all times: a tracker without physics."""

    timestep = 1 / 480
    end = ""

    def __init__(self, *moves, touches=(), fallen=None):
        self.moves, self.touches, self.step_number = moves or (NEVER, NEVER), list(touches), 0
        self.given = [np.empty((0, 0)), np.empty((0, 0))]
        self.fallen = fallen or (lambda time: {})
        self.poses = {}  # where a body lies
        self.anew = []

    def extend(self, *motions, since_s=0.0, anew=False):
        first = round(since_s / self.timestep)
        assert first >= self.step_number
        for player, motion in enumerate(motions):
            if motion is not None:
                old = self.given[player]
                if len(old) and first > len(old):
                    old = np.concatenate([old, np.repeat(old[-1:], first - len(old), axis=0)])
                self.given[player] = np.concatenate([old[:first], motion.qpos]) if first else motion.qpos
                if anew:
                    self.anew.append((player, motion))

    def step(self):
        self.step_number += 1

    def contacts(self, since_s=0.0):
        time = self.step_number * self.timestep
        return tuple(one for one in self.touches if since_s <= one.start_s <= time)

    def fall_reasons(self):
        return self.fallen(self.step_number * self.timestep)

    @property
    def state(self):
        reference = tuple(one[min(self.step_number, len(one) - 1)] for one in self.given)
        bodies = tuple(
            self.poses.get(player, own.poses(one[None], np.ones(1))[0])
            for player, (own, one) in enumerate(zip(self.moves, reference))
        )
        return TrackerState(
            self.step_number * self.timestep, bodies, (), reference, (), tuple(self.fall_reasons()), self.end
        )

    def run(self, whole=False):
        return None


def begun(model, examples, tracker, seconds, settings=QUIET, seed=1, mode="automatic", **more):
    live = LiveFight(begin_fight(model, mode, seed, examples=examples, **more), seed, tracker, settings=settings)
    live.run(seconds)
    return live


# ---- moves -----------------------------------------------------------------------------------------------------------


def test_a_move_is_found_again_and_undone():
    rng = np.random.default_rng(0)
    points, wanted = rng.normal(size=(5, 2)), FloorMove(np.array([0.3, -0.1]), 0.5, np.array([1.0, 2.0]))
    found = fit_move(points, wanted.points(points), rng.uniform(0.1, 1, 5))
    assert found.turn == pytest.approx(0.5)
    np.testing.assert_allclose(found.points(points), wanted.points(points), atol=1e-12)
    qpos = np.tile(humanoid().standing_qpos, (40, 1))
    qpos[:, :2] = rng.normal(size=(40, 2))
    gradual = GradualMove(wanted, 5, 20)
    share = gradual.share(np.arange(40))
    moved = wanted.poses(qpos, share)
    np.testing.assert_allclose(moved[:6], qpos[:6], atol=1e-12)
    np.testing.assert_allclose(moved[25:, :2], wanted.points(qpos[25:, :2]), atol=1e-12)
    np.testing.assert_allclose(wanted.undone(moved, share), qpos, atol=1e-12)
    assert gradual.ahead(5).turn == pytest.approx(0.5)
    assert gradual.ahead(25).size_m == 0
    assert replace(gradual, until=15).ahead(10).turn == pytest.approx(0.5 * (share[15] - share[10]))


def test_moves_are_no_faster_than_allowed_and_leave_small_errors_alone():
    big = FloorMove(np.array([3.0, 4.0]), -2.0, np.zeros(2))
    part = GradualMove(big.within(0.5, 0.5, 1.2), 0, 30)
    path = part.move.points(np.zeros((31, 2)), part.share(np.arange(31)))
    assert 60 * np.linalg.norm(np.diff(path, axis=0), axis=1).max() == pytest.approx(0.5, rel=0.01)
    assert 60 * np.abs(np.diff(part.share(np.arange(31)) * part.move.turn)).max() == pytest.approx(1.2, rel=0.01)
    soft = GradualMove(big.within(0.5, 10.0, 1.2, 3.8), 0, 30)
    path = soft.move.points(np.zeros((31, 2)), soft.share(np.arange(31)))
    assert 3600 * np.linalg.norm(np.diff(path, n=2, axis=0), axis=1).max() == pytest.approx(3.8, rel=0.01)
    small = FloorMove(np.array([0.02, 0.0]), 0.04, np.zeros(2)).beyond(0.03, 0.05)
    assert (small.size_m, small.turn) == (0, 0)


def test_who_leans_has_not_moved_and_who_stands_elsewhere_has():
    body = humanoid()
    standing = body.standing_qpos
    elsewhere = FloorMove(np.array([0.2, 0.1]), 0.4, standing[:2]).poses(standing[None], np.ones(1))[0]
    found = move_between(standing, elsewhere, np.array([True, True]), body)
    np.testing.assert_allclose(found.points(standing[:2]), elsewhere[:2], atol=1e-9)
    assert found.turn == pytest.approx(0.4)
    leaning = standing.copy()
    leaning[7 + body.joint("lumbar_flexion")] += 0.5
    assert move_between(standing, leaning, np.array([True, True]), body).size_m < 0.03


# ---- drawing by where bodies are -------------------------------------------------------------------------------------


def test_bodies_that_are_where_they_should_be_change_nothing(model, examples):
    live = begun(model, examples, Stub(), 3.0)
    plain = begin_fight(model, "automatic", 1, examples=examples)
    plain.run(3.0)
    fight, other = live.made.fight(3.0), plain.fight(3.0)
    for one, two in zip(fight.stream.players, other.stream.players):
        np.testing.assert_array_equal(one.qpos, two.qpos)
    # what the bodies were told to follow is what was drawn
    for player, given in enumerate(live.tracker.given):
        np.testing.assert_allclose(given[: 2 * 480 : 8], fight.stream.players[player].qpos[:120], atol=1e-9)
    again = begun(model, examples, Stub(), 3.0)
    np.testing.assert_array_equal(again.tracker.given[0], live.tracker.given[0])


def test_the_next_action_begins_where_the_body_is_and_is_placed_by_where_both_are(model, examples):
    """A stands 0.3 m away and is turned by 30 degrees, all the time."""
    away = FloorMove(np.array([0.3, 0.0]), np.radians(30), np.zeros(2))
    free = replace(QUIET, speed=10.0, spin=30.0, dead_m=0.0, dead_rad=0.0)
    made = begin_fight(model, "automatic", 1, examples=examples)
    tracker = Stub(away, NEVER)
    live = LiveFight(made, 1, tracker, settings=free)
    told = []
    choose = made.bout.choosers[0].choose

    class Watching:
        def choose(self, situation, rng):
            frame = round(situation.time * 60)
            told.append((situation, [made.bout.pose(player, frame).copy() for player in (0, 1)]))
            return choose(situation, rng)

    live.bout.choosers = (Watching(), live.bout.choosers[1])
    live.run(0.2)
    before = live.bout.ends[0]
    pose = live.bout.pose(0, before).copy()
    state = tracker.state
    offset = live.offset(0, state)
    np.testing.assert_allclose(offset.points(state.reference_qpos[0][:2]), state.bodies_qpos[0][:2], atol=1e-6)
    assert np.degrees(offset.turn) == pytest.approx(30, abs=0.01)
    known = len(told)
    live.run(1.5)
    situation, (own, other) = told[known]
    frame = round(situation.time * 60)
    assert frame == before
    np.testing.assert_allclose(situation.position, offset.points(pose[:2]), atol=1e-6)
    assert wrap_angle(situation.heading - yaw(pose[3:7])) == pytest.approx(np.radians(30), abs=1e-6)
    coms = [forward_kinematics(one[None], humanoid()).com[0, :2] for one in (own, other)]
    np.testing.assert_allclose(situation.frame.origin, np.mean(coms, axis=0), atol=1e-6)
    np.testing.assert_allclose(own[:2], situation.position, atol=1e-9)
    result = live.result()
    drawn, resting = result.fight.stream.players[0].qpos, result.resting.players[0].qpos
    assert np.linalg.norm(drawn[60, :2] - resting[60, :2]) > 0.2
    np.testing.assert_allclose(drawn[:5], resting[:5], atol=1e-9)


def test_what_a_user_asks_for_is_known_only_from_then_on(model, examples):
    live = begun(model, examples, Stub(), 0.5, mode="interactive")
    live.made.avatar.request("left kick", time=live.time)
    live.run(4.0)
    answer = live.made.avatar.answers[0]
    assert answer.begins > 0.5
    assert answer.choices <= 2
    assert Label.from_code(examples.actions.label[answer.example]).left_kick in ("up", "downup")


# ---- strikes ---------------------------------------------------------------------------------------------------------


def test_a_bent_strike_meets_its_target_where_the_example_did(examples):
    index = next(one for one in range(examples.known) if strike_of(examples, one) is not None)
    strike, actions = strike_of(examples, index), examples.actions
    player = int(actions.player[index])
    part = slice(int(actions.start[index]), int(actions.end[index]))
    root, body = examples.qpos[player, part], humanoid()
    example_frame = FloorFrame(examples.frames.origin[index], examples.frames.toward[index])
    opponent = examples.qpos[1 - player, part][strike.frame].copy()
    opponent[:2] += [0.1, 0.15]
    told = (root[:, :2], float(yaw(root[0, 3:7])), example_frame, root[0, :2], float(yaw(root[0, 3:7])), example_frame)
    plain = place(*told, len(root))
    # the recording placed where it was is no miss
    assert np.linalg.norm(plain.position - root[:, :2], axis=1).max() < 1e-9
    aim = bent(strike, plain, strike.frame, opponent, body, 0.3)
    made = place(*told, len(root), aim)
    at = strike.frame
    hand = made.position[at] + turned(strike.way, float(made.turn[at]))
    target = forward_kinematics(opponent[None], body).xipos[0, strike.target, :2]
    share = min(1.0, aim.frames / max(min(aim.frames, len(root) - 1), 1))
    assert share == 1
    np.testing.assert_allclose(hand - target, turned(strike.offset, float(made.turn[at])), atol=1e-6)
    short = bent(strike, plain, at, opponent, body, 0.05)
    assert np.linalg.norm(short.position - plain.position[at]) == pytest.approx(0.05)
    # however soon the strike: the root does not leap (by up to 0.3 m in a frame, as it did)
    opponent[0] += 5.0
    for frame in (0, 1, 3, at):
        aim = bent(strike, plain, frame, opponent, body, 0.3)
        drift = place(*told, len(root), aim, most=1e-3).position - plain.position
        assert np.linalg.norm(np.diff(drift, n=2, axis=0), axis=1).max() <= 1e-3


# ---- blows and falls -------------------------------------------------------------------------------------------------


def touch(start, impulse, attack=0, attacker=0, verdict="hit"):
    contact = BodyContact(start, 0.03, (0, 1), ("left_hand", "thorax"), impulse, 900.0, 5.0, (0, 0, 1.2), 0.01)
    return JudgedContact(**contact.__dict__, verdict=verdict, attacker=attacker, attack=attack)


def test_a_pace_shows_frames_later_and_finds_them_again():
    pace = Pace(np.array([0.0, 1.0, 3.0, 4.0]))
    assert pace.at(1.5) == 2.0
    np.testing.assert_allclose(pace.source(np.array([0.0, 2.0, 4.0, 5.5])), [0.0, 1.5, 3.0, 4.5])
    np.testing.assert_array_equal(AS_RECORDED.source(np.array([0.3, 7.0])), [0.3, 7.0])


def feet_speed(examples, index, times):
    """(F,) of the faster foot against the pelvis [m/s], and whether a foot stands."""
    found, body = examples.excerpt(index, times), examples.bodies[int(examples.actions.player[index])]
    place = forward_kinematics(found.qpos, body).xpos
    way = place[:, body.feet] - place[:, [body.segment("pelvis")]]
    return np.linalg.norm(np.gradient(way, 1 / examples.fps, axis=0), axis=-1).max(axis=1), found.contacts.any(axis=1)


def test_feet_are_slowed_to_the_limits_and_slow_actions_are_left_alone(examples):
    limits = PaceSettings()
    slowed = 0
    for index in range(120):
        length = int(examples.actions.end[index] - examples.actions.start[index])
        pace = pace_of(examples, index, limits)
        most = limits.strike if examples.attacks[index] else limits.back
        speed, stands = feet_speed(examples, index, np.arange(length + 1.0))
        if pace is AS_RECORDED:
            assert not (speed[stands] > most).any()
            continue
        slowed += 1
        assert pace.shown[-1] > length
        flight = max(speed[~stands], default=0.0)  # nothing is slowed there, nor at once where it ends
        after, stands = feet_speed(examples, index, pace.source(np.arange(round(pace.shown[-1]) + 1.0)))
        assert after[1:-1][stands[1:-1]].max() < max(1.15 * most, flight)
    assert 3 < slowed < 60


def test_contacts_of_one_attack_are_one_blow_and_falls_after_hard_ones_are_knock_downs():
    found = blows(
        [
            touch(1.0, (9.0, 0, 0)),
            touch(1.02, (9.0, 0, 0)),
            touch(4.0, (3.0, 0, 0), 5, 1),
            touch(5, (50, 0, 0), -1, -1, "unintended"),
        ]
    )
    assert [(one.player, one.impulse_ns) for one in found] == [(1, 18.0), (0, 3.0)]
    assert found[1].impulse[0] == -3.0  # B's blow on A
    assert Fall(1, 1.9, "", blow_before(found, 1, 1.9)).knock_down
    assert not Fall(1, 2.2, "", blow_before(found, 1, 2.2)).knock_down
    assert not Fall(0, 4.1, "", blow_before(found, 0, 4.1)).knock_down


def test_collisions_that_throw_over_are_told_apart_from_falls_without():
    own = [touch(1.0, (10.0, 0, 0), -1, -1, "unintended"), touch(1.05, (0, 12.0, 0), 3, 1)]
    long = replace(touch(4.0, (90.0, 0, 0), -1, -1, "unintended"), duration_s=0.5)
    assert collision_before([*own, long], 1, 1.8) == pytest.approx(np.hypot(10, 12))
    assert collision_before(own, 0, 1.8) == pytest.approx(np.hypot(10, 12))  # both get the same impulse
    assert collision_before(own, 1, 1.15) == 0.0  # too late to be the reason
    assert collision_before(own, 1, 2.2) == 0.0  # too long ago
    assert collision_before([long], 1, 4.8) == 0.0  # leaning
    fall = Fall(1, 1.8, "the head is low", 0.0, collision_before(own, 1, 1.8))
    assert (fall.after_collision, fall.knock_down) == (True, False)
    assert "collided with 16 N s" in fall.words
    assert not Fall(1, 1.8, "", 20.0, 20.0).after_collision
    assert not Fall(1, 1.8, "", 0.0, 14.0).after_collision


def test_who_is_struck_reacts(model, examples):
    quiet = begun(model, examples, Stub(), 6.0, replace(QUIET, react_s=0.12))
    hit = next(
        one
        for one in quiet.bout.actions
        if one.player == 0 and Label.from_code(one.label).left_punch in ("fwd", "bwdfwd", "fwdbwd") and one.start > 60
    )
    at = (hit.start + 3) / 60
    contact = BodyContact(at, 0.03, (0, 1), ("left_hand", "thorax"), (12.0, 0, 0), 900.0, 5.0, (0, 0, 1.2), 0.01)
    live = begun(model, examples, Stub(touches=[contact]), 6.0, replace(QUIET, react_s=0.12))
    answers = [one for one in live.bout.actions if one.note == REACTS]
    assert [one.player for one in answers] == [1]
    assert 0.1 <= answers[0].start / 60 - at <= 0.2
    assert not Label.from_code(answers[0].label).attacks
    # the bodies are told in time
    live.result()


def test_balance_is_the_extrapolated_centre_of_mass_over_the_feet():
    pose, stands = humanoid().standing_qpos.copy(), np.array([True, True])
    watch = BalanceWatch(humanoid(), 60.0)
    aside = pose.copy()
    aside[:2] += 3.0
    assert watch.error_m(aside, pose, stands) == 0.0
    assert watch.error_m(aside, pose, stands) < 1e-9  # elsewhere is not out of balance
    aside[0] += 1.2 / 60
    height = forward_kinematics(pose[None]).com[0, 2]
    assert watch.error_m(aside, pose, stands) == pytest.approx(1.2 * np.sqrt(height / 9.81), rel=1e-6)
    leaning = pose.copy()
    leaning[3:7] = Rotation.from_rotvec([0.0, 0.1, 0.0]).as_quat(scalar_first=True)
    watch = BalanceWatch(humanoid(), 60.0)
    watch.error_m(leaning, pose, stands)
    both = forward_kinematics(np.stack([leaning, pose]))
    over = both.com[:, :2] - both.xpos[:, humanoid().feet, :2].mean(axis=1)
    wanted = min(np.linalg.norm(np.diff(one, axis=0)) for one in (over, both.com[:, :2]))
    assert watch.error_m(leaning, pose, stands) == pytest.approx(wanted, rel=1e-6)
    assert wanted > 0.005


def test_who_is_out_of_balance_breaks_off_and_what_follows_is_moved_to_the_body(model, examples):
    class Pushed(Stub):
        """From 3 to 3.25 s the second body is carried away with 1.6 m/s."""

        @property
        def state(self):
            found = super().state
            away = found.bodies_qpos[1].copy()
            away[0] += 1.6 * np.clip(found.time - 3.0, 0.0, 0.25)
            return replace(found, bodies_qpos=(found.bodies_qpos[0], away))

    settings = replace(QUIET, react_s=0.12, dead_m=0.0, dead_rad=0.0)
    breaking = [
        (seed, begun(model, examples, Pushed(), 5.0, replace(settings, off_m=0.35), seed)) for seed in (1, 2, 3)
    ]
    for seed, live in breaking:
        answers = [one for one in live.bout.actions if one.note == CATCHES]
        assert {one.player for one in answers} == {1}
        assert 3.1 <= answers[0].start / 60 <= 3.5
        assert not Label.from_code(answers[0].label).attacks
        left = begun(model, examples, Pushed(), 5.0, settings, seed)
        assert not [one for one in left.bout.actions if one.note == CATCHES]
        # it is sooner where the body is
        frame = answers[0].start + 30
        moved = [
            sum(one.move.size_m for one in fight.bout._tracks[1].moves if one.first < frame) for fight in (live, left)
        ]
        assert moved[0] > moved[1]


# ---- down and up -----------------------------------------------------------------------------------------------------


def test_lying_and_the_way_up_begin_where_the_body_is():
    body, known = humanoid(), library_motion("get_up_prone")
    lies = move(known, (2.0, -1.0), 0.7).qpos[0].copy()
    lies[7 + body.joint("left_elbow_flexion")] -= 0.2
    assert lying(lies, body) == PRONE
    up = way_up(lies, body)
    np.testing.assert_allclose(up.qpos[0], lies, atol=1e-12)
    assert up.qpos[-1, 2] > 0.85
    assert np.linalg.norm(up.qpos[-1, :2] - lies[:2]) < 1.2
    steps = np.abs(np.diff(up.qpos[:, 7:], axis=0)).max() * up.fps
    assert steps < 10, "a jump"
    on_back = humanoid().standing_qpos.copy()
    on_back[3:7] = [np.sqrt(0.5), 0, -np.sqrt(0.5), 0]
    assert lying(on_back, body) == SUPINE
    for angle in (0.9, -0.9):
        tilted = on_back.copy()
        tilt = Rotation.from_rotvec([angle, 0, 0]) * Rotation.from_quat(on_back[3:7], scalar_first=True)
        tilted[3:7] = tilt.as_quat(scalar_first=True)
        over = roll_over(tilted, body)
        np.testing.assert_allclose(over.qpos[0], tilted, atol=1e-12)
        assert lying(over.qpos[-1], body) == PRONE
        turns = Rotation.from_quat(over.qpos[:, 3:7], scalar_first=True)
        assert (turns[1:] * turns[:-1].inv()).magnitude().sum() == pytest.approx(np.pi - 0.9, abs=0.3), "the long way"
        # without slipping: to the side on which the front goes down
        assert np.sign(over.qpos[-1, 1] - tilted[1]) == -np.sign(angle)
        for side in (-1, 1):  # away from the other
            over = roll_over(tilted, body, np.add(tilted[:2], [0.0, side]))
            assert np.sign(over.qpos[-1, 1] - tilted[1]) == -side
            assert lying(over.qpos[-1], body) == PRONE


def test_who_falls_gets_up_and_the_fight_goes_on(model, examples):
    lies = library_motion("get_up_prone").qpos[0]
    tracker = Stub(fallen=lambda time: {1: "the head is low"} if 1.0 <= time < 3.5 else {})
    made = begin_fight(model, "automatic", 1, examples=examples)
    live = LiveFight(made, 1, tracker, settings=QUIET)
    live.run(1.2)
    assert [one.player for one in live.falls] == [1]
    tracker.poses[1] = lies
    live.run(6.0)
    del tracker.poses[1]  # it follows what it is told
    live.run(16.0)
    (fall,) = live.falls
    assert (fall.lay, fall.tries, fall.knock_down) == (PRONE, 1, False)
    assert 6 < fall.up_s < 14
    fight = live.result().fight
    assert [one.note for one in fight.actions if one.note] == [WAITS, DOWN]
    assert [one for one in fight.actions if one.start > 60 * fall.up_s + 30], "nobody went on"
    (_, rest), (_, up) = tracker.anew
    np.testing.assert_allclose(rest.qpos[0], lies, atol=1e-12)
    np.testing.assert_allclose(up.qpos[0], lies, atol=1e-9)


def test_who_cannot_get_up_stays_down_and_the_fight_can_still_be_read(model, examples):
    tracker = Stub(fallen=lambda time: {0: "the head is low"} if time >= 1.0 else {})
    on_back = humanoid().standing_qpos.copy()
    on_back[2:7] = [0.1, np.sqrt(0.5), 0, -np.sqrt(0.5), 0]
    tracker.poses[0] = on_back
    live = begun(model, examples, tracker, 5.0, replace(QUIET, tries=0))
    (fall,) = live.falls
    assert (fall.lay, fall.up_s, fall.tries) == (SUPINE, None, 0)
    assert "stays down" in fall.words
    result = live.result()
    assert len(result.fight.stream) == 300
    assert [(one.player, one.note) for one in result.fight.actions if one.note] == [(0, DOWN), (1, WAITS)]
    live.run(6.0)  # and it goes on, though nothing happens
    assert len(live.result().fight.stream) == 360


# ---- with physics ----------------------------------------------------------------------------------------------------


def test_a_simulated_fight_is_whole_and_the_same_at_any_number_of_threads(model, examples):
    runs = []
    for threads in (1, 2):
        cheap = MpcSettings(samples=12, refined=6, iterations=1, replan=0.05, first_rounds=1, threads=threads)
        tracker = Tracker(examples.bodies, None, 3, settings=SimulationSettings(mpc=cheap))
        runs.append(begun(model, examples, tracker, 0.8, LiveSettings(dead_m=0.0, dead_rad=0.0)).result())
    one, two = runs
    assert one.run.end_s == pytest.approx(47 / 60, abs=0.01)
    for a, b in zip(one.run.bodies, two.run.bodies):
        np.testing.assert_array_equal(a.qpos, b.qpos)
    # the reference that was followed is what was drawn, moved to where the bodies were
    steps = np.arange(40) * 8
    for number, body in enumerate(one.run.bodies):
        error = body.reference_qpos[steps, :2] - one.tracked.stream.players[number].qpos[:40, :2]
        assert np.abs(error).max() < 0.02
    assert np.abs(one.fight.stream.players[0].qpos[40, :2] - one.resting.players[0].qpos[40, :2]).max() > 1e-4
    found = run_metrics(one.run, one.tracked, None, one.falls, 2.0, one.resting)
    assert found.falls_per_min == pytest.approx(len(one.falls) / one.run.end_s * 60)
    assert found.assist_n == 0
