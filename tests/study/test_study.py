"""The validation study with a stand-in for synthesis and physics: what is run, compared, kept and written."""

import json
import multiprocessing
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from simprep.cli.main import main
from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.library import library_motion
from simprep.motion.motion import Motion
from simprep.physics.run import BodyRun, Run
from simprep.study.plan import ARMS, StudyPlan
from simprep.study.validate import run_study

FRAMES = 31


def still(name):
    return Motion(
        np.repeat(humanoid().standing_qpos.copy()[None], FRAMES, axis=0), 30.0, np.ones((FRAMES, 2), bool), name=name,
        events={"target": 15},
    )  # fmt: skip


def fake_scenario(locomotion, target, profile, arm, *args, **kwargs):
    """Bends backward by an amount that depends on arm and level; no preparation does not depend on the level."""
    alpha = profile.level
    lean = {
        "none": 0.3,
        "traditional": 0.25 * alpha,
        "blended": 0.2 * alpha,
        "optimised": 0.09 * alpha,
        "dynamic": 0.05 * alpha,
    }[arm]
    qpos = locomotion.qpos.copy()
    qpos[:, 7 + humanoid().joint("lumbar_flexion")] = -lean
    name = f"{target.name}_{arm}"
    return replace(locomotion, qpos=qpos, name=name, events={"launch": 15})


class FakeTrack:
    """Perfect tracking, but `pd` falls after half of a strongly bent motion; may be interrupted."""

    def __init__(self, interrupt_at=None):
        self.calls = []
        self.interrupt_at = interrupt_at

    def __call__(self, motion, controller="mpc", seed=0, settings=None, progress=None):
        if len(self.calls) == self.interrupt_at:
            raise KeyboardInterrupt
        self.calls.append((motion.name, controller, seed))
        lean = -motion.qpos[0, 7 + humanoid().joint("lumbar_flexion")]
        fell = controller == "pd" and lean > 0.15
        steps = (FRAMES - 1) // (2 if fell else 1)
        character = motion.character
        zeros, limits = np.zeros((steps, len(character.joints))), np.ones(len(character.joints))
        if progress:
            progress(0.5)
        body = BodyRun(
            reference=motion, qpos=motion.qpos[: steps + 1], qvel=np.zeros((steps + 1, character.nv)),
            reference_qvel=np.zeros((steps + 1, character.nv)), target=zeros, torque=zeros, torque_limit=limits,
            ground_force=np.zeros((steps, 3)), foot_force=np.zeros((steps, 2, 3)),
            centre_of_pressure=np.zeros((steps, 2)), foot_contact=np.ones((steps, 2), bool), penetration=np.zeros(steps),
        )  # fmt: skip
        return Run(
            (body,), controller, seed, 1 / 30, "fell" if fell else "done", "test", 0 if fell else None, wall_s=0.1
        )


@pytest.fixture
def fakes(monkeypatch):
    def install(interrupt_at=None):
        fake = FakeTrack(interrupt_at)
        monkeypatch.setattr("simprep.study.simulated.track", fake)
        monkeypatch.setattr("simprep.study.processes.default_processes", lambda: 1)
        monkeypatch.setattr("simprep.study.validate.make_scenario", fake_scenario)
        monkeypatch.setattr(
            "simprep.cli.resolve.resolve_motion", lambda name, warn, library=None, robot=None: still(name)
        )
        return fake

    return install


def test_a_plan_runs_every_combination_and_deterministic_controllers_once():
    plan = StudyPlan(still("walk"), (still("a"), still("b")), (0.5, 1.0), seeds=(0, 1, 2))
    cases = plan.cases()
    assert len(cases) == len(set(cases)) == 2 * 2 * 4 * (1 + 3)
    assert {case.seed for case in cases if case.controller == "pd"} == {0}
    assert {case.condition.arm for case in cases[:4]} == set(ARMS)  # arms side by side, so a short study compares
    with pytest.raises(UnknownNameError, match="valid: none, traditional"):
        replace(plan, arms=("magic",))
    with pytest.raises(SettingError, match=r"alpha 1\.2"):
        replace(plan, alphas=(1.2,))
    with pytest.raises(MotionError, match="still: the first frame of the target movement is not marked"):
        replace(plan, targets=(replace(still("still"), events={}),))


def test_equal_motions_are_simulated_once_and_reported_for_each(fakes):
    fake = fakes()
    study = run_study(StudyPlan(still("walk"), (still("a"),), (0.5, 1.0), controllers=("mpc",)))
    assert study.complete
    assert len(study.results) == 8
    assert len(fake.calls) == 7  # no preparation is the same at both levels


def test_validate_writes_and_prints_the_whole_study(fakes, tmp_path, capsys):
    fakes()
    out = tmp_path / "study"
    assert main(["validate", "--target", "a", "b", "--seeds", "2", "-o", str(out), "--json", "--no-pictures"]) == 0
    content = json.loads(capsys.readouterr().out)
    written = json.loads((out / "metrics.json").read_text())
    assert content["complete"] is written["complete"] is True
    assert content["cases"] == written["cases"]
    assert written["schema"] == "simprep.validate/1"
    assert written["assist"] == {"force_n": 0.0, "torque_nm": 0.0}
    assert {"command", "versions", "platform", "seeds", "created_utc"} <= set(written)
    assert len(content["cases"]) == 2 * 2 * 4 * (1 + 2)
    assert {"target", "alpha", "arm", "controller", "seed", "success", "fell_at_s", "mpjpe_mm"} <= set(
        content["cases"][0]
    )
    assert {case["arm"] for case in content["cases"]} == set(ARMS)
    assert content["wall_s"] > 0
    names = {path.name for path in (out / "motions").iterdir()}
    assert {"a_a050_optimised.npz", "a_a050_optimised_mpc.npz"} <= names
    assert len(written["files"]) == len(names)
    leaning_less = content["paired"]["mpc"]["com_cos_mm"]
    assert leaning_less["n"] == 8
    assert leaning_less["low"] <= leaning_less["median"] <= leaning_less["high"] < 0
    falls = content["paired"]["pd"]["success"]  # blended falls at level 1, optimised never
    assert falls["n"] == 4
    assert falls["median"] == 0.5


def test_ctrl_c_keeps_finished_cases_and_says_so(fakes, tmp_path, capsys):
    fakes(interrupt_at=3)
    out = tmp_path / "study"
    arguments = ["validate", "--target", "a", "--alpha", "0.5", "1", "-o", str(out), "--json", "--no-pictures"]
    assert main(arguments) == 130
    printed = capsys.readouterr()
    assert "4 finished cases are kept" in printed.err  # three were simulated; one of them is two cases
    content = json.loads(printed.out)
    written = json.loads((out / "metrics.json").read_text())
    assert content["complete"] is written["complete"] is False
    assert len(content["cases"]) == len(written["cases"]) == 4


def test_several_processes_find_the_same_bits_and_end_at_ctrl_c():
    walk = library_motion("walk")
    plan = StudyPlan(walk, (library_motion("punch_right"),), (1.0,), ("none", "blended"), controllers=("pd", "balance"))
    told, costs = [], {"s_per_s": 0, "cpu_s_per_s": 0}
    alone, shared = run_study(plan), run_study(plan, lambda what, done: told.append(done), processes=2)
    assert shared.complete
    assert [one.case for one in shared.results] == [one.case for one in alone.results] == plan.cases()
    for one, other in zip(shared.results, alone.results):
        assert {**one.metrics, **costs} == {**other.metrics, **costs}
        np.testing.assert_array_equal(one.simulated.qpos, other.simulated.qpos)
    assert told[-1] == len(plan.cases())

    def interrupted(what, done):
        if done == 1:
            raise KeyboardInterrupt

    begun = multiprocessing.active_children()
    cut = run_study(plan, interrupted, processes=2)
    assert not cut.complete
    assert len(cut.results) < len(plan.cases())
    assert set(multiprocessing.active_children()) <= set(begun)


def test_an_old_result_is_not_left_looking_complete(fakes, tmp_path, monkeypatch):
    fakes()
    out = tmp_path / "study"
    assert main(["validate", "--target", "a", "-o", str(out), "--no-pictures"]) == 0

    def crash(*args, **kwargs):
        raise RuntimeError("power cut")

    monkeypatch.setattr("simprep.study.validate.run_study", crash)
    with pytest.raises(RuntimeError, match="power cut"):
        main(["validate", "--target", "a", "-o", str(out), "--no-pictures"])
    left = json.loads((out / "metrics.json").read_text())
    assert left["complete"] is False
    assert left["cases"] == []


def test_pictures_of_a_study_are_drawn_for_every_target(fakes, tmp_path, capsys):
    fakes()
    out = tmp_path / "study"
    assert main(["validate", "--target", "a", "--alpha", "1", "-o", str(out)]) == 0
    names = {path.name for path in out.iterdir()}
    assert {"blending_curves.png", "margin_a.png", "com_a.png", "metrics.json"} <= names
    printed = capsys.readouterr()
    assert {"strip_a.png", "strip_a_pd.png", "strip_a_mpc.png"} <= names or "no film strips: " in printed.err
    table = printed.out
    assert "MPJPE [mm]" in table
    assert "preparation + optimisation" in table
    assert str(out) in table


def test_the_other_optimiser_is_an_arm_that_is_compared_too(fakes, tmp_path, capsys):
    fakes()
    command = ["validate", "--target", "a", "--arms", "blended", "optimised", "dynamic", "-o", str(tmp_path)]
    assert main([*command, "--json", "--no-pictures", "--controllers", "mpc"]) == 0
    captured = capsys.readouterr()
    content = json.loads(captured.out)
    assert {case["arm"] for case in content["cases"]} == {"blended", "optimised", "dynamic"}
    change = [content[name]["mpc"]["com_cos_mm"]["median"] for name in ("paired", "paired_dynamic")]
    assert change[0] != change[1]
    assert content["paired_dynamic_before_physics"]["com_cos_mm"]["n"] == 2
    assert "preparation + dynamic optimisation minus preparation" in captured.err
    assert main(["validate", "--target", "a", "--arms", "magic", "-o", str(tmp_path)]) == 2


def test_doses_are_measured_and_compared_in_pairs_falls_included(fakes, monkeypatch, tmp_path, capsys):
    fakes()
    wishes = []

    def fake_stability(motion, wish, controller, settings, on_progress):
        wishes.append((controller, wish))
        lean = -float(motion.qpos[0, 7 + humanoid().joint("lumbar_flexion")])
        on_progress("friction, seed 0", 0, 1)
        return SimpleNamespace(
            doses=lambda: {"dose_friction": 0.2 + lean}, falls_undisturbed=controller == "pd", assist_n=0.0
        )

    monkeypatch.setattr("simprep.study.simulated.stability", fake_stability)
    arguments = ["validate", "--target", "a", "b", "--controllers", "pd", "balance", "--dose", "friction", "horizon"]
    assert main([*arguments, "-o", str(tmp_path), "--json", "--no-pictures"]) == 0
    printed = capsys.readouterr()
    content = json.loads(printed.out)
    written = json.loads((tmp_path / "metrics.json").read_text())
    assert written["dose"]["measures"] == ["friction", "horizon"]
    assert {(controller, wish.measures, wish.seeds) for controller, wish in wishes} == {
        ("pd", ("friction",), (0,)),
        ("balance", ("friction",), (0,)),
    }
    for controller in ("pd", "balance"):  # optimised leans less by 0.055 and 0.11, at levels 0.5 and 1
        found = content["paired"][controller]["dose_friction"]
        assert found["n"] == 4
        assert found["median"] == pytest.approx(-0.0825)
    assert "lowest friction" in printed.err
    assert "horizon" not in str(content["cases"][0])
