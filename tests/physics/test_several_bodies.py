"""Two fighters: momentum, independence, determinism, and the file."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from simprep.physics.pair_contacts import ContactReader, Touch, merge_touches
from simprep.physics.pair_store import read_pair_run, save_pair_run
from simprep.physics.pair_track import PairSettings, track_pair
from simprep.physics.track import track

from simprep.errors import MotionError, MotionFileError, UnknownNameError
from simprep.humanoid import DEFAULT_BODY, HINGES, Body, standing_qpos
from simprep.library import library_motion
from simprep.motion.edit import cut, move
from simprep.motion.kinematics import forward_kinematics
from simprep.motion.motion import Motion
from simprep.physics.controller import PdController
from simprep.physics.falls import FallRule
from simprep.physics.loop import simulate
from simprep.physics.mpc import MpcSettings
from simprep.physics.reference import ReferenceSettings, make_reference
from simprep.physics.run import Run
from simprep.scene import SceneSettings, build_scene

SMALL, LARGE = Body(1.6, 55.0), Body(1.85, 95.0)


def flying(body: Body, start: tuple[float, float, float], speed: float, seed: int, turn: float = 0.0) -> Motion:
    """A body that drifts through the air in a random posture."""
    time = np.arange(49) / 60
    qpos = np.repeat(standing_qpos(body)[None], len(time), axis=0)
    qpos[:, 7:] += np.random.default_rng(seed).uniform(-0.3, 0.3, len(HINGES))
    qpos[:, :3] += start
    qpos[:, 0] += speed * time
    qpos[:, 3:7] = [np.cos(turn / 2), 0, 0, np.sin(turn / 2)]
    return Motion(qpos, 60.0, np.zeros((len(time), 2), dtype=bool), body=body)


def momentum(qpos: np.ndarray, body: Body, timestep: float) -> np.ndarray:
    """(N, 3) of the whole body between states, from positions alone."""
    return np.asarray(body.mass_kg * np.diff(forward_kinematics(qpos, body).com, axis=0) / timestep)


@pytest.mark.parametrize("speed", [1.0, 4.0])
def test_recorded_impulses_are_the_momentum_that_fighters_exchange(speed: float) -> None:
    bodies = (SMALL, LARGE)
    model = build_scene(SceneSettings(bodies))
    model.opt.gravity[:] = 0.0
    dt = model.opt.timestep
    # off the line of centres, so that limbs meet, slide and spin
    motions = [flying(SMALL, (0, 0, 3), speed, 1), flying(LARGE, (0.9, 0.15, 3.1), -speed, 2, np.pi)]
    references = [make_reference(motion, dt, ReferenceSettings(smoothing=0)) for motion in motions]
    steps = len(references[0].qpos) - 1
    reader = ContactReader(model, steps)
    simulated = simulate(model, references, PdController(references, model), FallRule(100, 100), observer=reader)
    assert simulated.end == "done"
    assert reader.unconverged == 0
    contacts = merge_touches(reader.touches, dt)
    recorded = np.sum([one.impulse for one in contacts], axis=0)
    change = []
    for recorder, body in zip(simulated.recorders, bodies):
        path = momentum(recorder.qpos, body, dt)
        change.append(path[-1] - path[0])
        assert not recorder.ground_force.any()
    size = np.linalg.norm(recorded)
    assert size > 20 * speed
    assert np.linalg.norm(change[1] - recorded) < 0.02 * size  # B gains what was recorded ...
    assert np.linalg.norm(change[0] + recorded) < 0.02 * size  # ... and A loses it
    first = contacts[0]
    assert first.closing_speed == pytest.approx(2 * speed, rel=0.3)
    assert max(one.peak_force_n * one.duration_s for one in contacts) > max(one.impulse_ns for one in contacts)


def test_touches_merge_over_short_breaks_only() -> None:
    def touch(step: int, part: int, force: float, speed: float = 0.0) -> Touch:
        return Touch(step, part, 2, np.array([force, 0, 0]), np.array([step, 0, 0], dtype=float), speed, force / 1e4)

    dt = 1 / 480
    touches = [
        touch(10, 7, 100, 3.0),
        touch(11, 7, 300),
        touch(20, 7, 50),
        touch(20, 10, 10),
        touch(30, 7, 40),
        touch(12, 10, 5),
    ]
    first, hand, again = merge_touches(sorted(touches, key=lambda one: one.step), dt)
    assert (first.part_a, first.part_b, hand.part_a) == ("left_hand", "thorax", "right_hand")
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
    pair = track_pair(motions, "pd")
    assert not pair.contacts
    assert not pair.penetration.any()
    assert pair.reference_penetration.max() == 0
    for run, motion in zip(pair.runs, motions):
        alone = track(motion, "pd")
        states = min(len(run.qpos), len(alone.qpos), 240)
        np.testing.assert_allclose(run.qpos[:states], alone.qpos[:states], atol=1e-9)
        np.testing.assert_allclose(run.ground_force[: states - 1], alone.ground_force[: states - 1], atol=1e-3)


def puncher(seconds: float) -> tuple[Motion, Motion]:
    punch = library_motion("jab_left_head")
    frames = round(seconds * punch.fps)
    stands = np.repeat(standing_qpos()[None], frames, axis=0)
    other = Motion(stands, punch.fps, np.ones((frames, 2), dtype=bool), name="stands")
    return cut(punch, 0, frames), move(other, (0.54, 0.0), np.pi)


def test_a_planned_punch_is_bit_identical_and_obeys_newton(tmp_path: Path) -> None:
    motions = puncher(0.75)
    mpc = MpcSettings(samples=16, elites=6, iterations=1)
    runs = [track_pair(motions, seed=2, settings=PairSettings(mpc=replace(mpc, threads=n))) for n in (1, 2)]
    first, second = runs
    for field in fields(Run):
        if isinstance(getattr(first.runs[0], field.name), np.ndarray):
            for one, other in zip(first.runs, second.runs):
                np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))
    assert first.contacts == second.contacts
    hit = max(first.contacts, key=lambda one: one.impulse_ns)
    assert (hit.part_a, hit.impulse[0] > 0) == ("left_hand", True)
    assert first.reference_penetration.max() > 2 * first.penetration.max() > 0
    dt = first.runs[0].timestep
    exchanged = np.sum([one.impulse for one in first.contacts], axis=0)
    weight = DEFAULT_BODY.mass_kg * 9.81
    for run, sign in zip(first.runs, (-1.0, 1.0)):
        path = momentum(run.qpos, DEFAULT_BODY, dt)
        other = path[-1] - path[0] - dt * (run.ground_force[1:] - [0, 0, weight]).sum(axis=0)
        # what neither floor nor gravity explains is the opponent; the rest is the integrator's error
        np.testing.assert_allclose(other, sign * exchanged, atol=0.004 * weight * run.end_s)
        assert run.assist.force_n == run.assist.torque_nm == 0.0
    again = read_pair_run(save_pair_run(first, tmp_path / "run"))
    assert again.contacts == first.contacts
    np.testing.assert_array_equal(again.penetration, first.penetration)
    np.testing.assert_array_equal(again.runs[1].torque, first.runs[1].torque)
    assert again.runs[1].reference.name == "stands"


def test_elites_of_both_can_be_judged_together() -> None:
    motions = puncher(0.1)
    mpc = MpcSettings(samples=10, elites=4, iterations=1, threads=1)
    runs = [track_pair(motions, settings=PairSettings(mpc=mpc, common_elites=common)) for common in (False, True)]
    assert np.abs(runs[0].runs[0].qpos - runs[1].runs[0].qpos).max() > 0


def test_a_fall_of_one_is_reported_as_his() -> None:
    a, b = puncher(0.6)
    qpos = b.qpos.copy()
    qpos[:, 2] += np.linspace(0, 3.0, len(qpos))  # rises as nobody can
    run = track_pair((a, replace(b, qpos=qpos)), "pd")
    assert (run.end, run.fallen) == ("fell", 1)
    assert run.runs[0].fell_at_s is None
    assert run.runs[1].fell_at_s == run.end_s == run.runs[0].end_s


def test_impossible_pairs_are_refused(tmp_path: Path) -> None:
    a, b = puncher(0.5)
    with pytest.raises(MotionError, match="has 30 frames at 60 per second, stands 20 at 60; two fighters need equal"):
        track_pair((a, cut(b, 0, 20)))
    with pytest.raises(UnknownNameError, match="unknown controller 'lqr'; valid: pd, mpc"):
        track_pair((a, b), "lqr")
    path = tmp_path / "no.npz"
    path.write_bytes(b"nothing")
    with pytest.raises(MotionFileError, match="not a readable run of two fighters"):
        read_pair_run(path)
