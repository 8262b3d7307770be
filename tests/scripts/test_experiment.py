from dataclasses import replace

import numpy as np
import pytest

from experiments import cases as module
from experiments.cases import ARMS, LAUNCH_METRICS, CaseKey, Experiment, build_worlds, make_approach, run_cases
from experiments.report import goal_props, summarise
from experiments.setting import Setting
from simprep.controller.influence import Influence
from simprep.controller.runtime.task import Task
from simprep.report.approach_page import place_marks
from simprep.report.results import save_json


def draw(rng, targets):
    assert set(targets) == {"punch_right"}
    goal = (float(rng.uniform(1.2, 1.6)), 0.0)
    return Setting((Task(goal, "punch_right", (Influence(goal, {"punch_right": 1.0}),)),), drawn={"goal": goal})


SMALL = Experiment("small", "a small experiment", ("punch_right",), draw)


def case(seed, arm, peak, success=True):
    row = dict.fromkeys(LAUNCH_METRICS, peak) | {
        "target": "1_punch_right", "alpha": 1.0, "arm": arm, "controller": "mpc", "seed": seed, "success": success,
        "alpha_in_effect": 1.0, "mpjpe_mm": 10.0, "torque_rms_nm": 20.0, "assist_n": 0.0, "assist_nm": 0.0,
        "before_physics": dict.fromkeys(LAUNCH_METRICS, 2 * peak),
    }  # fmt: skip
    approach = {"reached": True, "max_alpha_jump": 0.2, "duration_s": 4.0}
    return {"seed": seed, "arm": arm, "approach": approach, "whole": {"end": "done"}, "rows": [row], "wall_s": 1.0}


def test_arms_share_the_task_and_differ_in_preparation_only():
    worlds = build_worlds(SMALL)
    made = {arm: make_approach(SMALL, 4, worlds[arm]) for arm in ARMS}
    assert all(one.setting.tasks == made["none"].setting.tasks for one in made.values())
    assert make_approach(SMALL, 5, worlds["none"]).setting.drawn != made["none"].setting.drawn
    levels = {arm: one.approach.level[one.approach.launches[0] - 1] for arm, one in made.items()}
    assert levels["none"] == 0
    assert min(levels["blended"], levels["optimised"]) > 0.9
    blended, optimised = (made[arm].approach.motion.qpos for arm in ("blended", "optimised"))
    np.testing.assert_array_equal(blended[:100, :3], optimised[:100, :3])  # the root does not know of it
    assert np.abs(blended[150, 7:] - optimised[150, 7:]).max() > 0.01


def test_pairs_are_matched_by_seed_and_a_fall_is_counted_not_averaged():
    cases = [
        case(seed, arm, peak + seed)
        for seed in range(6)
        for arm, peak in (("none", 100), ("blended", 60), ("optimised", 50))
    ]
    cases += [case(6, "none", 9e9, success=False), case(6, "blended", 60), case(6, "optimised", 50)]
    summary = summarise(cases)
    paired = summary["paired"]["optimised_minus_none"]["peak_torque_nm"]
    assert (paired["median"], paired["low"], paired["high"]) == (-50, -50, -50)
    assert (paired["n"], paired["n_failed_with"], paired["n_failed_without"]) == (6, 0, 1)
    assert summary["paired"]["optimised_minus_blended"]["peak_torque_nm"]["median"] == -10
    assert summary["paired_before_physics"]["blended_minus_none"]["peak_jerk_rad_s3"]["median"] == -80
    assert summary["arms"]["none"]["launches_survived"] == 6
    assert summary["arms"]["none"]["launches"] == 7


def test_finished_cases_are_not_run_again(tmp_path, monkeypatch):
    ran = []

    def run_case(experiment, key, world, folder):
        ran.append(key.slug)
        if len(ran) == 3:
            raise KeyboardInterrupt
        return {
            **case(key.seed, key.arm, 1.0), "schema": module.CASE_SCHEMA, "simprep": module.__version__, "experiment": experiment.name,
        }  # fmt: skip

    monkeypatch.setattr(module, "run_case", run_case)
    monkeypatch.setattr(module, "build_worlds", lambda *_: dict.fromkeys(ARMS))
    with pytest.raises(KeyboardInterrupt):
        run_cases(SMALL, 2, tmp_path)
    assert len(run_cases(SMALL, 2, tmp_path)) == 6
    assert ran == [f"seed000_{arm}" for arm in ARMS] + ["seed000_optimised"] + [f"seed001_{arm}" for arm in ARMS]
    other = replace(SMALL, name="other")  # a result of another experiment is none of this one's
    save_json(tmp_path / "cases" / f"{CaseKey(0, 'none').slug}.json", {"schema": module.CASE_SCHEMA})
    assert len(run_cases(other, 1, tmp_path)) == 3
    assert ran[-3:] == [f"seed000_{arm}" for arm in ARMS]


def test_goals_are_marked_in_strips_where_each_arm_has_them():
    goal, ball = (2.0, 1.0), Influence((2.5, 1.0), {"punch_right": 1.0})
    walker = Influence((4.0, 0.0), {"punch_right": 1.0}, velocity=(-0.5, 0.0))
    tasks = (
        Task(goal, "punch_right", (ball,)),
        Task((5.0, 0.0), None),
        Task(goal, "punch_right", (walker,), meet=True),
    )
    marks = place_marks(*tasks)
    assert [mark.name for mark in marks] == [
        "goal",
        "influence 0",
        "goal of task 2",
    ]  # who moves and is met has no place
    assert [mark.position[:2] for mark in marks] == [goal, (2.5, 1.0), (5.0, 0.0)]
    props = goal_props(tasks)
    assert [prop.shape.name for prop in props] == [mark.name for mark in marks]
    places, _ = props[2].at(np.array([0.0, 3.0]))
    assert places[:, :2].tolist() == [[5.0, 0.0], [5.0, 0.0]]
