"""Several bodies in one world: momentum, independence, determinism, falls."""

from dataclasses import replace

import numpy as np
import pytest

from simprep.character import Character
from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.edit import cut, move
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.physics.contacts import Touch, merge_touches
from simprep.physics.falls import FallRule
from simprep.physics.mpc_settings import MpcSettings
from simprep.physics.reference import ReferenceSettings
from simprep.physics.run import Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import simulate, track
from simprep.physics.tracker import Tracker

SMALL, LARGE = humanoid(1.6, 55.0), humanoid(1.85, 95.0)


def flying(
    character: Character, start: tuple[float, float, float], speed: float, seed: int, turn: float = 0.0
) -> Motion:
    """A body that drifts through the air in a random posture."""
    time = np.arange(49) / 60
    qpos = np.repeat(character.standing_qpos.copy()[None], len(time), axis=0)
    qpos[:, 7:] += np.random.default_rng(seed).uniform(-0.3, 0.3, len(humanoid().joints))
    qpos[:, :3] += start
    qpos[:, 0] += speed * time
    qpos[:, 3:7] = [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
    return Motion(qpos, 60.0, np.zeros((len(time), 2), dtype=bool), character=character)


def momentum(qpos: np.ndarray, character: Character, timestep: float) -> np.ndarray:
    """(N, 3) of the whole body between states, from positions alone."""
    return np.asarray(character.mass_kg * np.diff(forward_kinematics(qpos, character).com, axis=0) / timestep)


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_recorded_impulses_are_the_momentum_that_bodies_exchange(speed: float) -> None:
    bodies = (SMALL, LARGE)
    # off the line of centres, so that limbs meet, slide and spin
    motions = [flying(SMALL, (0, 0, 3), speed, 1), flying(LARGE, (0.9, 0.15, 3.1), -speed, 2, np.pi)]
    settings = SimulationSettings(reference=ReferenceSettings(smoothing=0), fall=FallRule(100, 100))
    tracker = Tracker(bodies, None, controller="pd", settings=settings, stands=False)
    tracker.model.opt.gravity[:] = 0.0
    tracker.extend(*motions)
    while not tracker.end:
        tracker.step()
    simulated = tracker.run()
    assert simulated.end == "done"
    assert not simulated.unconverged.any()
    contacts = simulated.contacts
    recorded = np.sum([one.impulse for one in contacts], axis=0)
    change = []
    for recorder, character in zip(simulated.bodies, bodies):
        path = momentum(recorder.qpos, character, tracker.timestep)
        change.append(path[-1] - path[0])
        assert not recorder.ground_force.any()
    size = np.linalg.norm(recorded)
    assert size > 20 * speed
    assert np.linalg.norm(change[1] - recorded) < 0.005 * size  # B gains what was recorded ...
    assert np.linalg.norm(change[0] + recorded) < 0.005 * size  # ... and A loses it
    assert np.linalg.norm(change[0] + change[1]) < 0.005 * size
    first = contacts[0]
    assert first.closing_speed == pytest.approx(2 * speed, rel=0.3)
    assert max(one.peak_force_n * one.duration_s for one in contacts) > max(one.impulse_ns for one in contacts)


def test_touches_merge_over_short_breaks_only() -> None:
    def touch(step: int, part: str, force: float, speed: float = 0.0, second: int = 1) -> Touch:
        place = np.array([step, 0, 0], dtype=float)
        return Touch(step, (0, second), (part, "thorax"), np.array([force, 0, 0]), place, speed, force / 1e4)

    dt = 1 / 480
    touches = [
        touch(10, "left_hand", 100, 3.0),
        touch(11, "left_hand", 300),
        touch(20, "left_hand", 50),
        touch(20, "right_hand", 10),
        touch(30, "left_hand", 40),
        touch(31, "left_hand", 20, second=2),  # of another body
        touch(12, "right_hand", 5),
    ]
    first, hand, again, other = merge_touches(sorted(touches, key=lambda one: one.step), dt)
    assert (first.parts, hand.parts[0]) == (("left_hand", "thorax"), "right_hand")
    assert (again.bodies, other.bodies, other.impulse_ns) == ((0, 1), (0, 2), pytest.approx(20 * dt))
    assert first.start_s == pytest.approx(10 * dt)
    assert first.duration_s == pytest.approx(11 * dt)
    assert first.impulse_ns == pytest.approx(450 * dt)
    assert (first.peak_force_n, first.closing_speed, first.position[0], first.depth) == (300, 3.0, 11, 0.03)
    assert hand.duration_s == pytest.approx(9 * dt)  # 7 steps between: 1/60 s are 8
    assert again.start_s == pytest.approx(30 * dt)  # 9 steps between


def test_far_apart_each_moves_as_if_alone() -> None:
    motions = (library_motion("jab_left_head"), move(library_motion("kick_front"), (4.0, 0.0), np.pi))
    length = min(len(motion) for motion in motions)
    motions = (cut(motions[0], 0, length), cut(motions[1], 0, length))
    pair = simulate(motions, "pd")
    assert not pair.contacts
    assert not pair.overlap.any()
    assert pair.reference_overlap.max() == 0
    for run, motion in zip(pair.bodies, motions):
        alone = track(motion, "pd")
        states = min(len(run.qpos), len(alone.qpos), 240)
        np.testing.assert_allclose(run.qpos[:states], alone.qpos[:states], atol=1e-9)
        np.testing.assert_allclose(run.ground_force[: states - 1], alone.ground_force[: states - 1], atol=1e-3)


def puncher(seconds: float, apart: float = 0.54) -> tuple[Motion, Motion]:
    punch = library_motion("jab_left_head")
    frames = round(seconds * punch.fps)
    stands = np.repeat(humanoid().standing_qpos.copy()[None], frames, axis=0)
    other = Motion(stands, punch.fps, np.ones((frames, 2), dtype=bool), name="stands")
    return cut(punch, 0, frames), move(other, (apart, 0.0), np.pi)


def test_a_planned_punch_is_bit_identical_and_obeys_newton() -> None:
    motions = puncher(0.75, 0.57)
    mpc = MpcSettings(samples=16, iterations=1, harder=())
    runs = [simulate(motions, seed=2, settings=SimulationSettings(mpc=replace(mpc, threads=n))) for n in (1, 2)]
    run = runs[0]
    assert_same_physics(*runs)
    assert min(one.start_s for one in run.contacts) > run.timestep  # what is exchanged before cannot be told apart
    hit = max(run.contacts, key=lambda one: one.impulse_ns)
    assert (hit.bodies, hit.parts[0], hit.impulse[0] > 0) == ((0, 1), "left_hand", True)
    assert run.reference_overlap.max() > 2 * run.overlap.max() > 0
    exchanged = np.sum([one.impulse for one in run.contacts], axis=0)
    weight = humanoid().mass_kg * 9.81
    for character, sign in zip(run.bodies, (-1.0, 1.0)):
        path = momentum(character.qpos, humanoid(), run.timestep)
        other = path[-1] - path[0] - run.timestep * (character.ground_force[1:] - [0, 0, weight]).sum(axis=0)
        # what neither floor nor gravity explains is the opponent; the rest is the integrator's error
        np.testing.assert_allclose(other, sign * exchanged, atol=0.004 * weight * run.end_s)
    assert run.assist.force_n == run.assist.torque_nm == 0.0


def test_who_is_struck_is_moved_by_the_blow_the_floor_and_gravity_alone() -> None:
    mpc = MpcSettings(samples=16, iterations=1, harder=())
    run = simulate(puncher(1.2, 0.6), seed=2, settings=SimulationSettings(mpc=mpc))
    blow = np.sum([one.impulse for one in run.contacts], axis=0)
    assert min(one.start_s for one in run.contacts) > run.timestep
    assert np.linalg.norm(blow) > 5
    weight = humanoid().mass_kg * 9.81
    for body, sign in zip(run.bodies, (-1.0, 1.0)):
        path = momentum(body.qpos, humanoid(), run.timestep)
        floor = run.timestep * (body.ground_force[1:] - [0, 0, weight]).sum(axis=0)
        rest = path[-1] - path[0] - floor - sign * blow
        assert np.linalg.norm(rest) < 0.02 * np.linalg.norm(blow)


def assert_same_physics(one: Run, other: Run) -> None:
    """All but computing times and the number of threads, to the bit."""
    settings = [{**run.settings, "threads": 0} for run in (one, other)]
    timeless = [replace(run, wall_s=0.0, overhead_share=0.0, settings=s) for run, s in zip((one, other), settings)]
    assert timeless[0] == timeless[1]


def test_errors_of_both_can_count_together() -> None:
    motions = puncher(0.1)
    mpc = MpcSettings(samples=10, iterations=1, threads=1, harder=())
    runs = [
        simulate(motions, settings=SimulationSettings(mpc=replace(mpc, common_search=common)))
        for common in (False, True)
    ]
    assert np.abs(runs[0].bodies[0].qpos - runs[1].bodies[0].qpos).max() > 0
    assert [run.settings["common_search"] for run in runs] == [False, True]


def three(seconds: float) -> tuple[Motion, Motion, Motion]:
    """A puncher between two who stand; the third has another stature and is behind him, within reach of nobody."""
    punch, stands = puncher(seconds)
    frames = len(punch)
    still = np.repeat(SMALL.standing_qpos.copy()[None], frames, axis=0)
    still[:, 0] -= 1.5
    return punch, stands, Motion(still, punch.fps, np.ones((frames, 2), dtype=bool), name="small", character=SMALL)


@pytest.mark.parametrize("controller", ["pd", "mpc"])
def test_three_bodies_in_one_world_are_bit_identical_at_any_thread_count(controller: str) -> None:
    motions = three(0.5 if controller == "pd" else 0.1)
    mpc = MpcSettings(samples=8, keep=2, iterations=1, harder=())
    runs = [
        simulate(motions, controller, 3, SimulationSettings(mpc=replace(mpc, threads=threads))) for threads in (1, 2)
    ]
    assert_same_physics(*runs)
    run = runs[0]
    assert [one.reference.name for one in run.bodies] == [motion.name for motion in motions]
    assert [one.reference.character for one in run.bodies] == [humanoid(), humanoid(), SMALL]
    for one in run.bodies:  # each stands on the floor by itself
        assert one.ground_force[:, 2].max() > 0.5 * one.reference.character.mass_kg * 9.81
    if controller == "pd":
        assert {one.bodies for one in run.contacts} == {(0, 1)}
        # the third moves as if it were alone
        alone = track(motions[2], "pd")
        states = min(run.steps, alone.steps)
        np.testing.assert_allclose(run.bodies[2].qpos[:states], alone.qpos[:states], atol=1e-9)


def test_a_fall_of_one_is_reported_as_his() -> None:
    a, b, c = three(0.6)
    qpos = c.qpos.copy()
    qpos[:, 2] += np.linspace(0, 3.0, len(qpos))  # rises as nobody can
    run = simulate((a, b, replace(c, qpos=qpos)), "pd")
    assert (run.end, run.fallen, run.fell_at_s) == ("fell", 2, run.end_s)
    assert [run.body(number).fell_at_s for number in range(3)] == [None, None, run.end_s]
    assert {run.body(number).end_s for number in range(3)} == {run.end_s}
    assert repr(run) == f"Run(jab_left_head | stands | small, pd, seed 0: fell at {run.end_s:.2f} s)"


def test_what_does_not_fit_together_is_refused() -> None:
    a, b = puncher(0.5)
    with pytest.raises(MotionError, match="has 30 frames at 60 per second, stands 20 at 60; the bodies of a scene"):
        simulate((a, cut(b, 0, 20)))
    with pytest.raises(UnknownNameError, match="unknown controller 'lqr'; valid: pd, balance, mpc"):
        simulate((a, b), "lqr")
    with pytest.raises(SettingError, match="0 bodies in a scene; valid: 1 to 511"):
        simulate(())
    with pytest.raises(MotionError, match="simulate takes a sequence of motions; for jab_left_head alone use track"):
        simulate(a)  # type: ignore[arg-type]
