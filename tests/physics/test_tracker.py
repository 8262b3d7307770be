"""The tracker: the same bits as a run made at once, references that grow, standing, mismatch and kicks."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import simprep
from simprep import Kick, Mismatch, MpcSettings, Push, SimulationSettings, Tracker
from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.library import library_motion
from simprep.motion.edit import cut, move, repeat
from simprep.motion.kinematics import forward_kinematics
from simprep.physics.bodies import scene_bodies
from simprep.physics.controller import ControlTask, PdController
from simprep.physics.mismatch import Observer
from simprep.physics.pushes import KICK_EVERY_S, KICK_MPS, KICK_RADPS, random_kicks
from simprep.physics.standing import BRAKE_S, standing_tail

CHEAP = MpcSettings(samples=12, refined=6, iterations=1, replan=0.05, harder=())


@pytest.fixture(scope="module")
def walk() -> simprep.Motion:
    return repeat(library_motion("walk"), 2)


def steps(tracker: Tracker, seconds: float) -> None:
    for _ in range(round(seconds / tracker.timestep)):
        tracker.step()


@pytest.mark.parametrize("controller", ["pd", "balance", "mpc"])
def test_pieces_given_while_it_goes_on_are_the_whole_motion(walk: simprep.Motion, controller: str) -> None:
    settings = SimulationSettings(mpc=CHEAP)
    whole = simprep.track(walk, controller, 3, settings)
    pieces = [cut(walk, first, min(first + 41, len(walk))) for first in range(0, len(walk) - 1, 40)]
    assert len(pieces) > 2
    tracker = Tracker(walk.character, None, 3, controller, settings)
    tracker.extend(pieces.pop(0))
    end = 0.0
    while pieces or tracker.ahead_s > 0:
        tracker.step()
        end = tracker.state.time
        if pieces and tracker.ahead_s < 0.3:
            tracker.extend(pieces.pop(0))
    assert end == pytest.approx((len(walk) - 1) / walk.fps, abs=2 * tracker.timestep)
    grown = tracker.run()
    assert grown.steps == pytest.approx(whole.steps if controller != "pd" else grown.steps, abs=1)
    states = min(len(grown.qpos), len(whole.reference.qpos))
    # away from the ends of what was known, where smoothing looks on, the reference is the same
    error = np.abs(grown.reference_qpos[:states] - whole.reference.qpos[:states])
    assert np.median(error.max(axis=1)) < 1e-6
    assert error.max() < 0.01
    np.testing.assert_array_equal(grown.reference.contacts[:states], whole.reference.contacts[:states])


def test_one_extension_and_a_loop_are_track(walk: simprep.Motion) -> None:
    settings = SimulationSettings(mpc=CHEAP)
    whole = simprep.track(walk, "mpc", 3, settings)
    tracker = Tracker(walk.character, None, 3, "mpc", settings, stands=False)
    tracker.extend(walk)
    while not tracker.end:
        tracker.step()
    again = tracker.run()
    assert again == whole.__class__(
        **{**whole.__dict__, "wall_s": again.wall_s, "overhead_share": again.overhead_share}
    )
    with pytest.raises(SettingError, match="the simulation has ended: done"):
        tracker.step()


def test_it_stands_where_the_reference_ends_and_goes_on_from_there(walk: simprep.Motion) -> None:
    tracker = Tracker(seed=1)
    tracker.extend(cut(walk, 0, len(walk) // 2))
    steps(tracker, walk.duration / 2 + 2.5)
    state = tracker.state
    assert state.ahead_s == (0.0,)
    assert not state.fallen
    assert state.qpos[2] > 0.9
    assert np.linalg.norm(state.qvel[:3]) < 0.15
    here = move(library_motion("punch_right"), tuple(state.reference_qpos[0][:2]))
    tracker.extend(here)
    assert tracker.ahead_s == pytest.approx(here.duration, abs=tracker.timestep)
    steps(tracker, here.duration)
    assert not tracker.state.fallen
    run = tracker.run()
    assert run.end == "done"
    assert run.reference.events["target"] > walk.duration / 2 / tracker.timestep
    jumps = np.abs(np.diff(run.reference_qpos[:, 7:], axis=0)).max() / tracker.timestep
    assert jumps < 25  # rad/s: a punch, not a jump from pose to pose


def test_a_function_gives_the_next_motion_when_it_is_needed(walk: simprep.Motion) -> None:
    asked = []
    pieces = [cut(walk, 0, 31), cut(walk, 30, 91)]

    def source(state: simprep.TrackerState | None) -> simprep.Motion | None:
        asked.append(None if state is None else state.time)
        return pieces.pop(0) if pieces else None

    tracker = Tracker(controller="pd")
    tracker.extend(source)
    steps(tracker, 0.2)
    assert asked[0] is None
    assert not pieces
    assert tracker.ahead_s == pytest.approx(90 / walk.fps - 0.2, abs=2 * tracker.timestep)


def test_what_a_tracker_refuses(walk: simprep.Motion) -> None:
    with pytest.raises(UnknownNameError, match="unknown preset 'quick'; valid: live, default, bake"):
        Tracker(preset="quick")
    tracker = Tracker(controller="pd")
    with pytest.raises(SettingError, match="no motion to track yet"):
        tracker.step()
    with pytest.raises(SettingError, match="nothing was simulated yet"):
        tracker.run()
    with pytest.raises(SettingError, match="2 motions; valid: 1, one for each body"):
        tracker.extend(walk, walk)
    tracker.extend(walk)
    with pytest.raises(MotionError, match=r"walk begins \d\.\d\d m from where the reference is; valid: up to 0.5 m"):
        tracker.extend(move(walk, (-2.0, 0.0)))
    with pytest.raises(MotionError, match="belongs to"):
        tracker.extend(replace(walk, character=simprep.humanoid(1.6, 55.0)))
    for since in (-1.0, np.nan, np.inf):
        with pytest.raises(SettingError, match=f"motions since {since:g} s; valid: now, 0 s, or later"):
            tracker.extend(walk, since_s=since)
    with pytest.raises(SettingError, match="a function gives motions when they are needed"):
        tracker.extend(lambda state: None, since_s=1.0)
    with pytest.raises(SettingError, match=r"5 is no push; valid: a simprep\.Push"):
        tracker.push(5)  # type: ignore[arg-type]
    asking = Tracker(controller="pd")
    asking.extend(lambda state: 5)  # type: ignore[arg-type,return-value]
    with pytest.raises(SettingError, match="5 is no motion"):
        asking.step()


@pytest.mark.parametrize("seed", [-1, 1.5, None, True, "0"])
def test_a_seed_is_a_whole_number(seed: object) -> None:
    with pytest.raises(SettingError, match=r"seed .*; valid: a whole number, 0 or more"):
        Tracker(seed=seed)  # type: ignore[arg-type]
    with pytest.raises(SettingError, match=r"seed .*; valid: a whole number, 0 or more"):
        random_kicks(seed, 10.0)  # type: ignore[arg-type]


def test_only_a_character_is_a_body(walk: simprep.Motion) -> None:
    for wrong in ("humanoid", walk, [walk]):
        with pytest.raises(SettingError, match="is no body; valid: a Character"):
            Tracker(wrong)  # type: ignore[arg-type]


def test_pushes_and_kicks_are_numbers() -> None:
    with pytest.raises(SettingError, match=r"push: force \(1, 0\); valid: three numbers"):
        Push("pelvis", 0.0, 0.2, (1, 0))  # type: ignore[arg-type]
    with pytest.raises(SettingError, match=r"push at nan s for 0\.2 s; valid"):
        Push("pelvis", np.nan, 0.2, (1, 0, 0))
    with pytest.raises(SettingError, match=r"push at 0\.0 s for -1\.0 s; valid"):
        Push("pelvis", 0.0, -1.0, (1, 0, 0))
    with pytest.raises(SettingError, match=r"kick: spin .*nan.*; valid: three numbers"):
        Kick(0.0, (0, 0, 0), (0, 0, np.nan))
    with pytest.raises(SettingError, match="kick at inf s; valid: a number"):
        Kick(np.inf, (0, 0, 0))
    with pytest.raises(SettingError, match="kicks for nan s"):
        random_kicks(0, np.nan)


def test_a_controller_without_follow_cannot_track_a_growing_reference(walk: simprep.Motion) -> None:
    class Plain:
        name = "plain"

        def __init__(self, task: ControlTask) -> None:
            self._pd = PdController(task)
            self.target, self.settings = self._pd.target, self._pd.settings

    tracker = Tracker(controller=Plain)
    tracker.extend(cut(walk, 0, 31))
    steps(tracker, 0.1)
    tracker.extend(cut(walk, 30, 61))
    with pytest.raises(SettingError, match="controller 'plain' cannot track a growing reference"):
        tracker.step()


def test_standing_tail_begins_with_the_motion_and_ends_at_rest(walk: simprep.Motion) -> None:
    fps, character = 240.0, walk.character
    fast = simprep.Motion(walk.qpos, walk.fps, walk.contacts)
    tail = standing_tail(fast.qpos[:20], walk.fps, character, round(3 * BRAKE_S * walk.fps))
    whole = np.concatenate([fast.qpos[:20], tail])
    speed = np.diff(whole[:, :3], axis=0) * walk.fps
    assert np.abs(speed[19] - speed[18]).max() < 0.1
    assert np.abs(speed[-10:]).max() < 1e-9
    assert tail[-1, 0] - fast.qpos[19, 0] == pytest.approx(speed[18, 0] / np.sqrt(9.81 / tail[-1, 2]), rel=0.02)
    still = standing_tail(np.repeat(character.standing_qpos[None], 2, axis=0), fps, character, 10)
    np.testing.assert_allclose(still, np.repeat(character.standing_qpos[None], 10, axis=0), atol=1e-12)


def test_a_heavier_body_on_ice_with_weak_motors_is_simulated_while_the_controller_does_not_know(
    walk: simprep.Motion,
) -> None:
    mismatch = Mismatch(mass_scale=1.2, friction=0.3, strength=0.5)
    tracker = Tracker(controller="pd", settings=SimulationSettings(mismatch=mismatch))
    plain = Tracker(controller="pd")
    assert tracker.model.body_mass.sum() == pytest.approx(1.2 * plain.model.body_mass.sum())
    assert tracker.model.body_subtreemass[1] == pytest.approx(1.2 * plain.model.body_subtreemass[1])
    np.testing.assert_allclose(tracker.model.actuator_forcerange, 0.5 * plain.model.actuator_forcerange)
    assert tracker.model.geom("floor").friction[0] == 0.3
    tracker.extend(walk)
    steps(tracker, 0.2)
    run = tracker.run()
    assert np.abs(run.torque).max() <= run.torque_limit.max()
    assert run.settings["mismatch"] == {
        "mass_scale": 1.2, "friction": 0.3, "strength": 0.5, "delay_s": 0.0, "noise": 0.0,
    }  # fmt: skip
    with pytest.raises(SettingError, match=r"mismatch: strength 0; valid: 0\.05 to 10"):
        Mismatch(strength=0)


def test_a_delayed_state_is_predicted_forward_to_the_present(walk: simprep.Motion) -> None:
    """Without noise and with the right model, the prediction is the present state, so the delay changes nothing."""
    short = cut(walk, 0, 8)  # three plans; small differences grow later
    told = simprep.track(short, "mpc", 0, SimulationSettings(mpc=CHEAP))
    late = simprep.track(short, "mpc", 0, SimulationSettings(mpc=CHEAP, mismatch=Mismatch(delay_s=0.01)))
    # the first plan is made in the same state; later ones differ by the solver's warm start only
    assert np.abs(told.qpos - late.qpos).max() < 1e-3


def test_observer_is_late_and_noisy_as_told() -> None:
    tracker = Tracker(controller="pd")
    model, bodies = tracker.model, scene_bodies(tracker.model, [simprep.humanoid()])
    data = mujoco.MjData(model)
    late = Observer(model, bodies, Mismatch(delay_s=5 * tracker.timestep), np.random.default_rng(0))
    seen = []
    for number in range(9):
        data.qpos[0] = number
        seen.append(float(late.observe(data).qpos[0]))
    assert seen == [0, 0, 0, 0, 0, 0, 1, 2, 3]
    noisy = Observer(model, bodies, Mismatch(noise=2.0), np.random.default_rng(0))
    told = np.array([(lambda d: [*d.qpos[:3], *d.qpos[7:], *d.qvel])(noisy.observe(data)) for _ in range(400)])
    spread = told.std(axis=0)
    hinges = len(data.qpos) - 7
    assert spread[:3].mean() == pytest.approx(0.02, rel=0.1)
    assert spread[3 : 3 + hinges].mean() == pytest.approx(0.02, rel=0.1)
    assert spread[3 + hinges : 6 + hinges].mean() == pytest.approx(0.2, rel=0.1)
    assert spread[-hinges:].mean() == pytest.approx(1.0, rel=0.1)


def test_a_kick_changes_the_momentum_of_the_whole_body_by_what_it_says() -> None:
    settings = SimulationSettings(kicks=(Kick(0.1, (0.4, -0.2, 0.1)), Kick(0.3, (0, 0, 0), (0, 0, 0.5))))
    still = repeat(library_motion("stand"), 1)
    run = simprep.track(cut(still, 0, 30), "pd", settings=settings)
    com = np.array([np.gradient(axis, run.timestep) for axis in forward_kinematics(run.qpos).com.T]).T
    at = round(0.1 / run.timestep)
    np.testing.assert_allclose(com[at + 2] - com[at - 2], [0.4, -0.2, 0.1], atol=0.06)
    assert run.assist.kick_mps == pytest.approx(np.linalg.norm([0.4, -0.2, 0.1]))
    assert run.assist.kick_radps == 0.5  # a kick that only turns is not hidden either
    assert run.assist.force_n == 0
    with pytest.raises(SettingError, match="kick of body 1; valid: 0 to 0"):
        simprep.track(still, "pd", settings=SimulationSettings(kicks=(Kick(0.1, (1, 0, 0), body=1),)))


def test_random_kicks_are_within_their_bounds_and_repeatable() -> None:
    kicks = random_kicks(4, 300.0)
    assert kicks == random_kicks(4, 300.0)
    assert kicks != random_kicks(5, 300.0)
    gaps = np.diff([0.0, *(kick.time for kick in kicks)])
    assert gaps.min() >= KICK_EVERY_S[0]
    assert gaps.max() <= KICK_EVERY_S[1]
    velocity, spin = (np.abs([getattr(kick, name) for kick in kicks]).max(axis=0) for name in ("velocity", "spin"))
    assert (velocity <= KICK_MPS).all()
    assert (spin <= KICK_RADPS).all()
    assert (velocity > 0.9 * np.array(KICK_MPS)).all()


def test_two_bodies_get_motions_each_in_its_own_time_and_keep_standing(walk: simprep.Motion) -> None:
    tracker = Tracker([walk.character, walk.character], "live", seed=2)
    near, far = cut(walk, 0, 31), move(cut(walk, 0, 61), (0.0, 3.0))
    tracker.extend(near, far)
    steps(tracker, 0.5)
    assert tracker.state.ahead_s == pytest.approx((0.0, 0.5), abs=2 * tracker.timestep)
    place = tracker.state.reference_qpos[0]
    tracker.extend(move(library_motion("stand"), (float(place[0]), float(place[1]))), None)
    steps(tracker, 1.5)
    state = tracker.state
    assert state.fallen == ()
    assert state.ahead_s[0] > 0
    assert state.ahead_s[1] == 0
    run = tracker.run()
    assert [len(body.qpos) for body in run.bodies] == [run.steps + 1] * 2
    assert run.bodies[1].qpos[-1, 1] == pytest.approx(3.0, abs=0.2)


def test_a_long_motion_is_worked_out_piece_by_piece_and_nothing_is_kept_unless_asked(walk: simprep.Motion) -> None:
    stand = library_motion("stand")
    long = repeat(stand, int(np.ceil(8 / stand.duration)))
    tracker = Tracker(controller="pd", records=False)
    tracker.extend(long)
    steps(tracker, 0.1)
    assert len(tracker._references[0].qpos) == pytest.approx(5 / tracker.timestep, abs=2)
    with pytest.raises(SettingError, match="keeps no record"):
        tracker.run()
    recorded = Tracker(controller="pd")
    recorded.extend(long)
    steps(recorded, 0.1)
    np.testing.assert_array_equal(recorded.state.qpos, tracker.state.qpos)


def test_a_lying_body_gets_up_and_stands() -> None:
    get_up = library_motion("get_up_prone")
    tracker = Tracker(seed=0)
    tracker.extend(get_up)
    assert tracker.state.qpos[2] < 0.2
    steps(tracker, get_up.duration + 0.5)
    state = tracker.state
    assert state.fallen == ()
    assert state.qpos[2] > 0.85
    run = tracker.run()
    assert run.end == "done"
    assert run.assist == simprep.physics.run.Assist()
