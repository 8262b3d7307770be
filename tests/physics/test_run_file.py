"""Runs as values and as files: what is read back is what was written, to the bit."""

import copy
import json
import pickle
from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from simprep.character import Character
from simprep.errors import MotionError, MotionFileError
from simprep.humanoid_model import humanoid
from simprep.metrics.evaluate import evaluate_run
from simprep.motion.motion import Motion
from simprep.motion.store import save_motion
from simprep.physics.mpc_settings import MpcSettings
from simprep.physics.run import Assist, Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import simulate
from simprep.physics.store import read_run, save_run

PEOPLE = (humanoid(), humanoid(1.6, 55.0), humanoid(1.85, 90.0))


def standing(character: Character, x: float, name: str) -> Motion:
    qpos = np.repeat(character.standing_qpos.copy()[None], 19, axis=0)
    qpos[:, 0] += x
    events = {"launch": 6, "late": 18}
    return Motion(qpos, 60.0, np.ones((19, 2), bool), events, name, "made by a test", character=character)


@pytest.fixture(scope="module", params=[1, 2, 3])
def run(request: pytest.FixtureRequest) -> Run:
    """One body, two within each other (contacts), three."""
    motions = [standing(character, 0.15 * n, f"motion {n}") for n, character in enumerate(PEOPLE[: request.param])]
    mpc = MpcSettings(samples=8, keep=2, iterations=1, harder=())
    done = simulate(motions, "mpc", 5, SimulationSettings(mpc=mpc))
    return replace(done, assist=Assist(3.5, 0.25))


def test_what_is_read_is_what_was_written(run: Run, tmp_path: Path) -> None:
    path = run.save(tmp_path / "results" / "run")
    assert path == tmp_path / "results" / "run.npz"
    again = read_run(path)
    assert again == run
    for one, other in zip(again.bodies, run.bodies, strict=True):
        for name, array in other.arrays().items():
            read = one.arrays()[name]
            assert (read.dtype, read.tobytes()) == (array.dtype, np.ascontiguousarray(array).tobytes()), name
        for name in ("fps", "events", "name", "source", "loop", "character"):
            assert getattr(one.reference, name) == getattr(other.reference, name)
        assert one.reference.qpos.tobytes() == other.reference.qpos.tobytes()
        assert one.processing == other.processing
    assert again.contacts == run.contacts
    assert bool(run.contacts) == (len(run.bodies) > 1)
    for name in ("end", "end_s", "end_reason", "fallen", "fell_at_s", "assist", "wall_s", "overhead_share", "seed"):
        assert getattr(again, name) == getattr(run, name)
    # a folder that we wrote will do
    assert read_run(path.parent) == run


def test_the_only_body_keeps_plain_names_and_several_have_their_prefix(run: Run, tmp_path: Path) -> None:
    with np.load(save_run(run, tmp_path / "run")) as archive:
        names = set(archive.files)
    prefixes = [""] if len(run.bodies) == 1 else ["a_", "b_", "c_"][: len(run.bodies)]
    assert {f"{prefix}qpos" for prefix in prefixes} <= names
    assert ("qpos" in names) == (len(run.bodies) == 1)


def test_runs_are_values(run: Run) -> None:
    assert pickle.loads(pickle.dumps(run)) == run
    assert copy.deepcopy(run) == run
    torque = run.bodies[-1].torque.copy()
    torque[0, 0] = np.nextafter(torque[0, 0], np.inf)
    nudged = replace(run, bodies=(*run.bodies[:-1], replace(run.bodies[-1], torque=torque)))
    assert nudged != run
    assert replace(run, seed=6) != run
    assert run != "run"
    assert len(repr(run)) < 120


def test_one_body_answers_itself_and_of_several_one_is_asked_for(run: Run) -> None:
    if len(run.bodies) == 1:
        for name, array in run.bodies[0].arrays().items():
            assert getattr(run, name) is array
        assert run.body(0) == run
        return
    with pytest.raises(
        AttributeError, match=rf"{len(run.bodies)} bodies has no qpos of its own; use run.body\(0\).qpos"
    ):
        _ = run.qpos
    for number, one in enumerate(run.bodies):
        alone = run.body(number)
        assert alone.qpos is one.qpos
        assert (alone.contacts, alone.overlap.any(), alone.end_s) == ((), False, run.end_s)
        assert evaluate_run(alone)["survived_s"] == run.end_s
    with pytest.raises(MotionError, match=f"body 3 of a run of {len(run.bodies)}"):
        run.body(3)


def test_parts_of_a_run(run: Run) -> None:
    assert run[:] == run
    part = run[40:100]
    assert (part.steps, part.end, part.completed_share) == (60, "done", 1.0)
    assert part.time[-1] == part.end_s == 60 * run.timestep
    for one, whole in zip(part.bodies, run.bodies):
        np.testing.assert_array_equal(one.qpos, whole.qpos[40:101])
        np.testing.assert_array_equal(one.torque, whole.torque[40:100])
        np.testing.assert_array_equal(one.reference_qpos, whole.reference_qpos[40:101])
        assert one.reference.events == {"launch": 48 - 40}  # 0.1 s are step 48
    begun = [one for one in run.contacts if 40 <= round(one.start_s / run.timestep) < 100]
    assert [one.impulse for one in part.contacts] == [one.impulse for one in begun]
    assert run.seconds(40 * run.timestep, 100 * run.timestep) == part
    again = run[40:][:60]
    assert replace(again, end_reason=part.end_reason, wall_s=part.wall_s) == part
    assert run.seconds(0.1).end_reason == run.end_reason
    for bad in (slice(5, 5), slice(None, None, 2)):
        with pytest.raises(MotionError, match="of a run"):
            _ = run[bad]


def test_a_part_of_a_fallen_run_fell_only_if_it_holds_the_fall(run: Run) -> None:
    fallen = replace(run, end="fell", fallen=0, end_reason="the pelvis is low")
    assert fallen[10:].fell_at_s == (run.steps - 10) * run.timestep
    assert (fallen[:10].end, fallen[:10].fallen) == ("done", None)


def test_arrays_that_do_not_belong_together_are_no_run(run: Run) -> None:
    character = run.bodies[0]
    with pytest.raises(MotionError, match=r"run of motion 0: qpos \(5, 44\); valid: \(\d+, 44\)"):
        replace(character, qpos=character.qpos[:5])
    with pytest.raises(MotionError, match="valid: done, fell, diverged"):
        replace(run, end="won")
    with pytest.raises(MotionError, match="valid: all the same"):
        replace(run, overlap=np.zeros(3))


def test_bad_files_give_one_clear_error(run: Run, tmp_path: Path) -> None:
    path = save_run(run, tmp_path / "run")
    with np.load(path) as archive:
        parts = dict(archive)
    header = json.loads(str(parts["header"]))

    def written(name: str, header: dict[str, object], **changes: np.ndarray | None) -> Path:
        arrays = {**parts, "header": np.array(json.dumps(header)), **changes}
        np.savez(tmp_path / name, **{key: value for key, value in arrays.items() if value is not None})
        return tmp_path / f"{name}.npz"

    other = deepcopy(header)
    other["bodies"][0]["reference"]["character"]["model"] = "robot"
    name = "qpos" if len(run.bodies) == 1 else "a_qpos"
    (tmp_path / "text.npz").write_text("no archive")
    (tmp_path / "empty").mkdir()
    whole = path.read_bytes()
    (tmp_path / "half.npz").write_bytes(whole[: len(whole) // 2])
    cases = {
        tmp_path / "nowhere.npz": "nowhere.npz: no such file",
        tmp_path / "empty": r"empty: a directory without a simprep run; in it: no \.npz",
        tmp_path / "text.npz": "not a readable simprep run",
        tmp_path / "half.npz": "not a readable simprep run",
        save_motion(run.bodies[0].reference, tmp_path / "motion"): "schema 'simprep.motion/1'.*reads 'simprep.run/3'",
        written("old", {**header, "schema": "simprep.run/1"}): "schema 'simprep.run/1'",
        written("other", other): "poses of model 'robot'; valid: simprep_humanoid, ",
        written("bare", {"schema": "simprep.run/3"}): "not a readable simprep run",
        written("lacking", header, **{name: None}): "not a readable simprep run",
        written("short", header, **{name: parts[name][:4]}): r"short\.npz: run of motion 0: qpos \(4, 44\)",
        written("nan", {**header, "end": "won"}): "a run that ended 'won'; valid: done, fell, diverged",
    }
    for bad, said in cases.items():
        with pytest.raises(MotionFileError, match=said):
            read_run(bad)
