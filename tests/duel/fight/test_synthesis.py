"""Synthesis of fights: placement, warp, stitching, what a chooser is told, and whole bouts."""

from dataclasses import replace

import numpy as np
import pytest

from simprep.duel.fight.choice import Choice, ModelChooser
from simprep.duel.fight.example_motions import START_OVERLAP_M, ExampleMotions
from simprep.duel.fight.placement import Aim, place
from simprep.duel.fight.stitch import Seam, StitchSettings, inertialise, plan_contacts, plan_steps
from simprep.duel.fight.synthesis import Bout, SynthesisSettings, synthesise
from simprep.duel.fight.time_warp import Warp, WarpSettings, fit_warp
from simprep.duel.labels.labels import Label
from simprep.duel.model.action_features import FloorFrame, action_features
from simprep.duel.model.structures import couple, link_actions
from simprep.duel.model.tracks import pair_tracks
from simprep.duel.model.transition_model import train
from simprep.duel.stream.stream import facing_error, root_distance
from simprep.duel.synthetic.make import make_synthetic
from simprep.duel.synthetic.presets import PRESETS
from simprep.errors import MotionError, SettingError
from simprep.humanoid_model import humanoid
from simprep.metrics.contact import floor_penetration, foot_slip, stance_drift
from simprep.motion.edit import yaw
from simprep.motion.turns import turned
from simprep.physics.overlap import overlap_of_poses

SECONDS = 12.0


@pytest.fixture(scope="module")
def example():
    return make_synthetic(replace(PRESETS["kickboxing"], clips=2, clip_s=30.0), seed=5)


@pytest.fixture(scope="module")
def model(example):
    player, start, end, clip = example.truth.table.T
    graph = couple(link_actions(player, start, end, example.truth.codes, clip))
    return train(graph, pair_tracks(example.stream))


@pytest.fixture(scope="module")
def examples(example, model):
    return ExampleMotions.of(example.stream, model)


@pytest.fixture(scope="module")
def choosers(model):
    return tuple(ModelChooser(player) for player in model.players)


@pytest.fixture(scope="module")
def fight(examples, choosers):
    return synthesise(examples, choosers, SECONDS, np.random.default_rng(1), seed=1)


class Follower:
    """Always performs what was recorded next, and keeps what it was told."""

    def __init__(self, actions):
        self.actions, self.told = actions, []

    def choose(self, situation, rng):
        following = int(self.actions.next[situation.example])
        self.told.append((situation, following))
        return Choice(following)


class Listed:
    """Performs a list of actions."""

    def __init__(self, examples, request=""):
        self.examples, self.request = list(examples), request

    def choose(self, situation, rng):
        return Choice(int(self.examples.pop(0)), self.request)


# ---- placement -------------------------------------------------------------------------------------------------------


def placed(aim=None, longest=np.inf):
    rng = np.random.default_rng(3)
    root = np.cumsum(rng.normal(0, 0.02, (32, 2)), axis=0)
    example_frame = FloorFrame(np.array([0.6, -0.1]), np.array(0.4))
    frame = FloorFrame(np.array([2.0, 1.0]), np.array(-2.5))
    position, facing = np.array([2.3, 1.4]), 2.9
    made = place(root, 0.7, example_frame, position, facing, frame, 30, aim, longest)
    original = frame.world_point(example_frame.point(root))
    return root, made, position, facing - 0.7, original, float(frame.toward - example_frame.toward)


def test_the_first_frame_meets_the_fighter_and_the_last_is_half_way_back():
    root, made, position, here, original, there = placed()
    np.testing.assert_allclose(made.position[0], position, atol=1e-12)
    assert made.turn[0] == pytest.approx(here)
    met = position + turned(root - root[0], here)
    np.testing.assert_allclose(made.position[29], 0.5 * (met[29] + original[29]), atol=1e-12)
    correction = np.angle(np.exp(1j * (there - here)))
    assert made.turn[29] - here == pytest.approx(0.5 * correction)
    # what comes after the last frame drifts no further
    np.testing.assert_allclose(made.turn[30:], made.turn[29], atol=1e-12)


def test_a_drift_begins_and_ends_gently():
    frame = FloorFrame(np.array([2.0, 1.0]), np.array(-2.5))
    made = place(np.ones((32, 2)), 0.7, frame, np.array([2.3, 1.4]), 2.9, frame, 30)
    speed = np.linalg.norm(np.diff(made.position, axis=0), axis=1)
    assert speed[[0, 28]].max() < 0.03 * speed.max()
    assert speed[29:].max() < 1e-12


def test_a_wished_position_is_reached_in_time_or_as_far_as_is_allowed():
    goal = np.array([2.0, 1.9])
    _, made, _, _, _, _ = placed(Aim(goal, 20))
    np.testing.assert_allclose(made.position[20], goal, atol=1e-12)
    root, short, position, here, _, _ = placed(Aim(goal, 20), longest=0.1)
    met = position + turned(root - root[0], here)
    assert np.linalg.norm(short.position[20] - met[20]) == pytest.approx(0.1)
    # the action ends before: a proportional part of the way
    _, part, _, _, _, _ = placed(Aim(goal, 58))
    np.testing.assert_allclose(part.position[29] - met[29], 0.5 * (goal - met[29]), atol=1e-12)


# ---- time warp -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("moment", "wanted"), [(20, 18), (20, 23), (31, 30), (15, 15)])
def test_a_warp_shows_the_moment_when_wanted_within_the_limits_and_smoothly(moment, wanted):
    limits = WarpSettings()
    warp = fit_warp(moment, wanted, limits)
    frames = np.linspace(0, 60, 6001)
    shown = warp.source(frames)
    assert warp.source(np.array([0.0, wanted])) == pytest.approx([0.0, moment])
    speed = np.diff(shown) / np.diff(frames)
    assert speed.min() >= limits.slowest - 1e-9
    assert speed.max() <= limits.fastest + 1e-9
    assert np.abs(np.diff(speed)).max() < 1e-3, "the speed jumps"
    np.testing.assert_allclose(speed[frames[:-1] > wanted], 1.0, atol=1e-9)
    assert warp.length(45) - 45 == wanted - moment


def test_what_would_need_too_much_speed_is_not_warped():
    assert fit_warp(30, 20) is None
    assert fit_warp(20, 30) is None
    assert fit_warp(20, 0) is None
    np.testing.assert_array_equal(Warp().source(np.arange(5.0)), np.arange(5.0))
    with pytest.raises(SettingError, match=r"valid: 0\.1 to 1"):
        WarpSettings(slowest=1.2)


# ---- stitching -------------------------------------------------------------------------------------------------------


def swaying(frames, phase, speed):
    qpos = np.tile(humanoid().standing_qpos.copy(), (frames, 1))
    t = np.arange(frames) / 60
    qpos[:, 7:] += 0.3 * np.sin(speed * t + phase)[:, None]
    qpos[:, 0] += 0.4 * t * np.cos(phase)
    yaws = 0.5 * np.sin(speed * t + phase)
    qpos[:, 3], qpos[:, 6] = np.cos(yaws / 2), np.sin(yaws / 2)
    return qpos


def test_inertialisation_begins_with_pose_speed_and_acceleration_and_ends_as_the_target():
    old, new = swaying(60, 0.3, 4.0), swaying(61, 1.9, 6.0)
    made = inertialise(old[29:32], new[1:], new[0], 18.0)
    np.testing.assert_allclose(made[0], old[30], atol=1e-12)
    np.testing.assert_allclose(made[18:], new[19:], atol=1e-12)
    # a pose that would follow exactly: the error of prediction is of third order
    ahead = np.abs(made[1] - old[31])
    assert ahead.max() < 0.1 * np.abs(new[2] - new[1] - (old[31] - old[30])).max()
    joined = np.concatenate([old[:30], made])
    jerk = np.abs(np.diff(joined[:, 7:], n=3, axis=0)).max(axis=1)
    assert jerk[26:31].max() < 2.5 * jerk[32:46].max(), "a pop at the seam"


def test_what_was_recorded_next_goes_on_unchanged():
    recorded = swaying(60, 0.3, 4.0)
    made = inertialise(recorded[29:32], recorded[30:], recorded[29], 18.0)
    np.testing.assert_allclose(made, recorded[30:], atol=1e-12)


def seam_with(contacts, lift):
    return Seam(np.tile(humanoid().standing_qpos.copy(), (3, 1)), np.array(contacts), np.array(lift))


def test_a_foot_in_the_air_lands_first_and_the_other_waits():
    contacts = np.ones((30, 2), dtype=bool)
    contacts[4:, 1] = False
    settings = StitchSettings()
    planned = plan_contacts(contacts, seam_with([False, True], [0.3, 0.0]), 60.0, settings)
    landing = int(np.ceil((settings.landing_s + 0.3 * settings.drop_s) * 60))
    np.testing.assert_array_equal(planned[:, 0], np.arange(30) >= landing)
    np.testing.assert_array_equal(planned[:, 1], np.arange(30) < landing)
    np.testing.assert_array_equal(plan_contacts(contacts, seam_with([True, True], [0, 0]), 60.0), contacts)


def test_feet_left_behind_step_one_after_the_other():
    contacts = np.ones((62, 2), dtype=bool)
    ankles = np.zeros((62, 2, 2))
    ankles[:, 0, 0] = np.linspace(0, 0.2, 62)
    ankles[:, 1, 0] = np.linspace(0, 0.12, 62)
    steps = plan_steps(contacts, ankles, np.zeros((62, 2)), 60, 60.0, StitchSettings())
    assert (~steps).any(axis=0).all()
    assert steps.any(axis=1).all(), "both feet in the air"
    near = plan_steps(contacts, 0.3 * ankles, np.zeros((62, 2)), 60, 60.0, StitchSettings())
    assert near.all()


# ---- what a chooser is told ------------------------------------------------------------------------------------------


def test_a_recording_performed_again_is_itself_and_choosers_are_told_what_the_model_was_trained_on(
    example, model, examples
):
    actions = model.graph.actions
    followers = (Follower(actions), Follower(actions))
    start = int(examples.guard_frames()[0])
    bout = Bout(examples, followers, np.random.default_rng(0), start, SynthesisSettings(warp=None))
    bout.run(240)
    fight = bout.fight(240)
    for player in (0, 1):
        made, recorded = fight.stream.players[player].qpos, examples.qpos[player, start : start + 240]
        np.testing.assert_allclose(made[:, :2], recorded[:, :2], atol=0.012)
        assert np.abs((made - recorded)[:, 7 + fight.stream.players[player].character.upper_joints]).max() < 1e-6
    features = action_features(pair_tracks(example.stream), actions, model.basis)
    for player, follower in enumerate(followers):
        transitions = actions.transitions(player)
        samples = features.samples(transitions)
        assert len(follower.told) >= 4
        for situation, following in follower.told:
            row = int(np.flatnonzero(transitions.next == following)[0])
            own, opponent, _ = np.split(samples[row], 3)
            assert situation.own_label == actions.label[transitions.current[row]]
            assert situation.opponent_label == actions.label[transitions.opponent[row]]
            # a centimetre and a degree; changes per second are noisier by the inverse of an action's length
            tolerance = np.array([0.012, 0.012, 0.02, 0.02, 0.02, 0.02, 0.06, 0.06, 0.08, 0.1, 0.1, 0.1])
            assert (np.abs(situation.own - own) < tolerance).all()
            assert (np.abs(situation.opponent - opponent) < tolerance).all()
            np.testing.assert_allclose(situation.frame.point(situation.position)[0], own[0], atol=0.5)


def test_a_fight_begins_where_the_bodies_are_not_within_each_other(examples):
    frames = examples.guard_frames()
    entwined = frames[: len(frames) // 2]  # half of the starts, both in one place
    qpos = examples.qpos.copy()
    qpos[1, entwined, :2] = qpos[0, entwined, :2]
    mixed = replace(examples, qpos=qpos)
    drawn = {mixed.start_frame(np.random.default_rng(seed)) for seed in range(30)}
    assert len(drawn) > 1
    assert overlap_of_poses([one[sorted(drawn)] for one in qpos], mixed.bodies).max() <= START_OVERLAP_M
    assert mixed.start_frame(np.random.default_rng(3)) == mixed.start_frame(np.random.default_rng(3))
    qpos[1, frames, :2] = qpos[0, frames, :2]
    assert replace(examples, qpos=qpos).start_frame(np.random.default_rng(0)) in frames  # there is no other


def test_moments_of_attack_and_reaction_coincide_where_they_can_and_nothing_else_is_warped(examples, model):
    actions = model.graph.actions
    start = int(examples.guard_frames()[0])
    bout = Bout(examples, (Follower(actions), Follower(actions)), np.random.default_rng(0), start)
    met = []
    for _ in range(60):
        if min(actions.next[bout.current(player).example] for player in (0, 1)) < 0:
            break
        before = [bout.current(player) for player in (0, 1)]
        begun = bout.step()
        other = before[1 - begun.player]
        attack = examples.attacks[begun.example] or examples.attacks[other.example]
        recorded = int(examples.moments[begun.example] - actions.start[begun.example])
        wanted = other.moment - begun.start
        if attack and wanted > 0 and fit_warp(recorded, wanted) is not None:
            met.append(begun.moment - other.moment)
        else:
            assert begun.end - begun.start == actions.end[begun.example] - actions.start[begun.example]
    assert len(met) >= 2
    assert not any(met)


# ---- bouts -----------------------------------------------------------------------------------------------------------


def test_a_fight_is_whole_and_its_poses_are_possible(fight, examples, model):
    assert len(fight.stream) == round(SECONDS * examples.fps)
    assert fight.seed == 1
    low, high = humanoid().model.jnt_range[1:].T
    for player in (0, 1):
        motion = fight.stream.players[player]
        assert (motion.qpos[:, 7:] >= low - 1e-9).all()
        assert (motion.qpos[:, 7:] <= high + 1e-9).all()
        assert floor_penetration(motion).max() < 0.02
        for one in fight.of(player):
            assert one.label == model.graph.actions.label[one.example]
            assert model.graph.actions.player[one.example] == player
    assert root_distance(fight.stream).min() > 0.35
    assert root_distance(fight.stream).max() < 2.6
    # fighters stand at an angle to each other: the recorded pelvis is 21 degrees off in the median
    assert np.degrees(np.median(np.abs(facing_error(fight.stream)))) < 35


def test_standing_feet_stay_where_they_are(fight):
    drift = np.concatenate([stance_drift(motion) for motion in fight.stream.players])
    assert len(drift) > 20
    assert np.percentile(drift, 95) < 0.005
    assert drift.max() < 0.03
    # nor do they rub to and fro
    path = np.concatenate([foot_slip(motion).stance_travel_m for motion in fight.stream.players])
    assert np.percentile(path, 95) < 0.008
    assert path.max() < 0.03


def test_roots_do_not_jump_at_stitches(fight, examples):
    for player in (0, 1):

        def jolts(qpos, frames):
            jerk = np.linalg.norm(np.diff(qpos[:, :3], n=3, axis=0), axis=1)
            return np.array([jerk[frame - 3 : frame + 1].max() for frame in frames if 3 < frame < len(jerk) - 1])

        seams = [one.start for one in fight.of(player)][1:]
        own = examples.actions.of(player)
        first, after = examples.bounds[0]
        starts = examples.actions.start[own][1:]
        theirs = jolts(examples.qpos[player, first:after], starts[(starts > first + 4) & (starts < after - 4)] - first)
        assert np.median(jolts(fight.stream.players[player].qpos, seams)) < 1.5 * np.median(theirs)


def test_the_same_seed_gives_the_same_fight(fight, examples, choosers):
    again = synthesise(examples, choosers, 4.0, np.random.default_rng(1))
    other = synthesise(examples, choosers, 4.0, np.random.default_rng(2))
    for player in (0, 1):
        np.testing.assert_array_equal(again.stream.players[player].qpos, fight.stream.players[player].qpos[:240])
    assert [one.example for one in other.actions] != [one.example for one in again.actions]


def test_an_action_begins_where_the_last_one_ended_and_ends_half_way_to_its_original_placement(examples, choosers):
    bout = Bout(examples, choosers, np.random.default_rng(7))
    bout.run(120)
    player = bout.due
    situation, seam = bout.situation(player), bout.pose(player, bout.frame)
    begun = bout.step()
    np.testing.assert_array_equal(bout.pose(player, begun.start), seam)
    actions, last = examples.actions, begun.end - 1
    recorded = examples.qpos[player, actions.start[begun.example] : actions.end[begun.example]]
    of = FloorFrame(examples.frames.origin[begun.example], examples.frames.toward[begun.example])
    original = situation.frame.world_point(of.point(recorded[-1, :2]))
    met = seam[:2] + turned(recorded[-1, :2] - recorded[0, :2], float(yaw(seam[3:7]) - yaw(recorded[0, 3:7])))
    np.testing.assert_allclose(bout.pose(player, last)[:2], 0.5 * (original + met), atol=2e-3)


def test_an_interrupted_action_ends_early_and_the_next_is_chosen_there(examples, choosers):
    bout = Bout(examples, choosers, np.random.default_rng(3))
    bout.run(60)
    player = int(np.argmax(bout.ends))
    frame = max(bout.current(0).start, bout.current(1).start) + 8
    with pytest.raises(SettingError, match="cannot be interrupted at frame 0"):
        bout.interrupt(player, 0)
    bout.interrupt(player, frame)
    assert bout.ends[player] == frame
    assert bout.due == player
    assert bout.step().start == frame
    bout.run(180)
    bout.fight(180)


def test_actions_of_another_recording_can_be_performed(example, examples, model, choosers):
    later = example.stream.part(*(int(frame) for frame in example.stream.bounds[1]))
    shift = int(example.stream.bounds[1][0])
    rows = example.truth.table[:, 3] == 1
    player, start, end, clip = example.truth.table[rows].T
    held_out = link_actions(player, start - shift, end - shift, example.truth.codes[rows], clip - 1)
    both = examples.with_recording(later, held_out)
    first = len(examples.actions)
    sequence = [first + row for row in held_out.of(0)[2:8]]
    bout = Bout(both, (Listed(sequence, "recorded"), choosers[1]), np.random.default_rng(0))
    for _ in range(5):
        while bout.due != 0:
            bout.step()
        begun = bout.step()
        assert begun.example == -1
        assert begun.request == "recorded"
        assert begun.label == held_out.label[sequence[0] - first]
        sequence.pop(0)
    assert Label.from_code(begun.label)
    with pytest.raises(MotionError, match="frames per second"):
        examples.with_recording(replace(later, players=tuple(replace(m, fps=30.0) for m in later.players)), held_out)


def test_wrong_use_is_refused(examples, choosers, example):
    with pytest.raises(SettingError, match="valid: above 0"):
        synthesise(examples, choosers, 0.0, np.random.default_rng(0))
    with pytest.raises(MotionError, match="frame 10000000: no actions of both players"):
        Bout(examples, choosers, np.random.default_rng(0), 10_000_000)
    bout = Bout(examples, (Listed([10**6] * 9), Listed([10**6] * 9)), np.random.default_rng(0))
    with pytest.raises(SettingError, match="chose action 1000000; valid: 0 to"):
        bout.step()
    with pytest.raises(SettingError, match="step first"):
        bout.situation(1 - bout.due)
    with pytest.raises(SettingError, match="frames; valid: 2 to"):
        bout.fight(10**6)
    with pytest.raises(SettingError, match="window_s 0"):
        StitchSettings(window_s=0)


def test_a_fight_refuses_actions_that_leave_gaps_or_are_of_nobody(fight):
    whole = fight.actions
    with pytest.raises(MotionError, match=r"actions of player 0 do not cover frames 0 to \d+ one after the other"):
        replace(fight, actions=whole[1:])
    with pytest.raises(MotionError, match=r"actions of player 2; valid: 0 to 1"):
        replace(fight, actions=(*whole, replace(whole[-1], player=2)))
