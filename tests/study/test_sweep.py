"""The grid of a sweep, its configuration, its store, and what a call runs of it."""

import json
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sweep_cases import CHEAP, small, write_cheap

from simprep.cli.main import main
from simprep.errors import MissingExtraError, MotionFileError, SettingError
from simprep.preparation.scenario import ARMS
from simprep.study.plan import ARM_LABELS
from simprep.study.sweep.cases import Body, Clip, Disturbance
from simprep.study.sweep.code import result_sources
from simprep.study.sweep.config import read_sweep, sweep_of
from simprep.study.sweep.engines import OtherCodeError, in_this_process
from simprep.study.sweep.estimate import KindCost, costs, plan_text
from simprep.study.sweep.measure import measure_case
from simprep.study.sweep.page import grouped, sweep_page
from simprep.study.sweep.replays import groups, sweep_replays
from simprep.study.sweep.run import run_sweep
from simprep.study.sweep.store import SweepStore, record_line
from simprep.study.sweep.table import read_table, save_table

CONTENT = {"end": "done", "reason": "", "metrics": {"mpjpe_mm": 1.5}, "cost": {"wall_s": 1.0, "cpu_s": 2.0}}


def fake_engine(stop_at=None, end="done"):
    ran = []

    def engine(cases):
        for case in cases:
            if len(ran) == stop_at:
                raise KeyboardInterrupt
            ran.append(case.id)
            yield case, {**CONTENT, "end": end, "metrics": {"mpjpe_mm": float(case.seed)}}

    return engine, ran


def test_a_grid_runs_every_combination_that_differs_once():
    sweep = small(seeds=3, disturbances=["nominal", "push", "low_friction"], alphas=[0.5, 1.0])
    cases = list(sweep.cases())
    assert len({case.id for case in cases}) == len(cases)
    motions = 2 * (3 * 2 + 1)  # `none` has no level
    assert Counter(case.controller for case in cases) == {"motion": motions, "pd": 3 * motions, "mpc": 9 * motions}
    assert {case.seed for case in cases if case.controller != "mpc"} == {0}
    assert [case.arm for case in cases[:4]] == ["none", "traditional", "blended", "optimised"]
    noisy = small(seeds=3, disturbances=["noisy"], disturbance={"noisy": {"noise": 1.0}}, controllers=["pd"])
    assert {case.seed for case in noisy.cases()} == {0, 1, 2}


def test_a_case_is_named_by_all_that_its_result_depends_on_and_nothing_else():
    case = next(small(controllers=["mpc"]).cases())
    assert case.locomotion
    changes = {
        "code": "0" * 16, "body": Body("humanoid", 1.6, 60.0), "controller": "pd", "arm": "blended", "alpha": 0.25,
        "locomotion": Clip("walk_fast"), "target": Clip("duck"), "preset": "live", "seed": 1,
        "disturbance": Disturbance("nominal", friction=0.5), "profile": replace(case.profile, rise=0.9),
    }  # fmt: skip
    ids = {case.id, *(replace(case, **{key: value}).id for key, value in changes.items())}
    assert len(ids) == 1 + len(changes)
    moved = [replace(case, locomotion=Clip("a.bvh", path, "12")) for path in ("/here/a.bvh", "/there/a.bvh")]
    assert moved[0].id == moved[1].id
    assert json.loads(json.dumps(case.definition)) == case.definition


def test_the_code_that_counts_is_what_measures_and_no_more():
    sources = set(result_sources())
    assert {
        "physics/mpc.py",
        "library/kicks/front.py",
        "preparation/posture_problem.py",
        "metrics/evaluate.py",
        "scene.py",
    } <= sources
    assert not {name for name in sources if name.split("/")[0] in ("cli", "report", "duel", "controller")}
    assert not {"metrics/effects.py", "study/sweep/store.py", "study/sweep/engines.py"} & sources


def test_clips_are_names_files_folders_and_globs(tmp_path):
    for name in ("a.bvh", "b.bvh", "sub/c.csv", "sub/notes.md"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    config = tmp_path / "sweep.toml"
    config.write_text('clips = ["walk", "b.bvh", "*.bvh", "sub", {clip = "a.bvh", target_frame = 7}]')
    clips = read_sweep(config).clips
    assert [clip.name for clip in clips] == ["walk", "b.bvh", "a.bvh", "sub/c.csv", "a.bvh"]
    assert [clip.target_frame for clip in clips] == [None, None, None, None, 7]
    assert len({clip.sha256 for clip in clips}) == 4


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("clips = [", "no TOML"),
        ("clip = ['walk']", "unknown key 'clip'; valid: clips"),
        ("clips = 'walk'", "valid: a list"),
        ("clips = ['wlak']", "'wlak' is no built-in motion"),
        ("clips = ['*.bvh']", r"no motion file fits '\*.bvh'"),
        ("seeds = 3", "nothing to run; valid: clips, or locomotions with targets"),
        ("targets = ['jump']", "need each other"),
        ("clips = ['walk']\nseeds = 0", "seeds = 0; valid"),
        ("clips = ['walk']\ncontrollers = ['best']", "unknown controller 'best'; valid: pd, balance, mpc"),
        ("clips = ['walk']\npreset = 'fast'", "unknown preset 'fast'"),
        ("clips = ['walk']\ndisturbances = ['storm']", "unknown disturbance 'storm'; valid: nominal, push"),
        ("clips = ['walk']\n[disturbance.a]\nfriktion = 1", "unknown key of disturbance.a 'friktion'"),
        ("clips = ['walk']\n[disturbance.a]\nstrength = 0", "strength 0; valid: 0.05 to 10"),
        ("clips = ['walk']\ncharacters = [{height_m = 3.0}]", "height 3.0 m is outside"),
        ("clips = ['walk']\ncharacters = [{character = 'primitive_robot', mass_kg = 3.0}]", "has one size"),
        ("clips = ['walk', 'walk']\ncontrollers = ['pd', 'pd']", "controllers pd, pd; valid: all different"),
    ],
)  # fmt: skip
def test_a_wrong_configuration_is_one_clear_error(tmp_path, text, message, capsys):
    config = tmp_path / "wrong.toml"
    config.write_text(text)
    with pytest.raises(MotionFileError, match=message):
        read_sweep(config)
    assert main(["sweep", str(config), "-o", str(tmp_path / "out")]) == 2
    assert "wrong.toml" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_line_cut_anywhere_is_not_read_and_spoils_nothing(tmp_path):
    lines = [record_line(f"{number:020x}", 0, CONTENT) for number in range(3)]
    path = tmp_path / "records-000001.jsonl"
    for length in range(len(lines[2])):
        path.write_bytes(lines[0] + lines[1] + lines[2][:length])
        index = SweepStore(tmp_path).index()
        assert list(index.entries) == [f"{number:020x}" for number in range(2)]
        assert index.damaged == ({path.name: 1} if length else {})
    path.write_bytes(b"".join(lines).replace(b'"mpjpe_mm":1.5', b'"mpjpe_mm":1.6', 1))  # a bit has flipped
    assert list(SweepStore(tmp_path).index().entries) == [f"{number:020x}" for number in (1, 2)]
    with SweepStore(tmp_path).writer() as writer:  # never goes on in a file that may end in the middle of a line
        writer.append(f"{9:020x}", 0, CONTENT)
    assert [file.name for file in SweepStore(tmp_path).segments()] == [path.name, "records-000002.jsonl"]


def test_the_last_attempt_counts_and_copies_count_once(tmp_path):
    store = SweepStore(tmp_path)
    with store.writer() as writer:
        for attempt, end in ((1, "done"), (0, "error"), (1, "done")):
            writer.append("a" * 20, attempt, {**CONTENT, "end": end})
        with pytest.raises(SettingError, match="another sweep is writing"), store.writer():
            pass
    (tmp_path / "records-000002.jsonl").write_bytes((tmp_path / "records-000001.jsonl").read_bytes())  # merged stores
    (record,) = store.records()
    assert (record["attempt"], record["end"]) == (1, "done")


def test_a_sweep_goes_on_where_it_was_stopped_and_then_does_nothing(tmp_path):
    cases, store = list(small().cases()), SweepStore(tmp_path)
    engine, ran = fake_engine(stop_at=5)
    with pytest.raises(KeyboardInterrupt):
        run_sweep(cases, store, engine)
    engine, more = fake_engine()
    told = []
    progress = run_sweep(cases, store, engine, lambda progress: told.append((progress.done, progress.total)))
    assert sorted(ran + more) == sorted(case.id for case in cases)
    assert told == [(done, len(cases)) for done in range(5, len(cases) + 1)]
    assert (progress.recorded, progress.ends) == (5, {"done": len(cases)})
    before = {path: path.read_bytes() for path in store.segments()}
    engine, again = fake_engine()
    run_sweep(cases, store, engine)
    assert not again
    assert {path: path.read_bytes() for path in store.segments()} == before
    larger = [*cases, *small(seeds=[7], controllers=["mpc"]).cases()]
    assert run_sweep(larger, store, engine).others == 0
    assert run_sweep(cases, store, engine).others == len(larger) - len(cases)


def test_failed_cases_are_kept_and_tried_again_only_when_asked(tmp_path):
    cases, store = list(small(controllers=["pd"]).cases()), SweepStore(tmp_path)
    run_sweep(cases[:2], store, fake_engine(end="error")[0])
    run_sweep(cases[2:], store, fake_engine(end="fell")[0])
    engine, ran = fake_engine()
    run_sweep(cases, store, engine)
    assert not ran
    progress = run_sweep(cases, store, engine, retry=True)
    assert ran == [case.id for case in cases[:2]]
    assert progress.ends == {"done": 2, "fell": len(cases) - 2}
    assert Counter(record["attempt"] for record in store.records()) == {0: len(cases) - 2, 1: 2}


def test_what_cannot_be_run_is_a_record_with_its_reason(tmp_path, monkeypatch):
    cases = {(case.clip.name, case.controller): case for case in read_sweep(write_cheap(tmp_path)).cases() if case.clip}
    broken = measure_case(cases["broken.bvh", "pd"])
    assert broken["end"] == "bad_input"
    assert re.search(r"broken\.bvh", broken["reason"])
    late = replace(cases["walk", "pd"], disturbance=Disturbance("late", push_n_per_kg=1.0, push_at=0.3))
    assert "valid: within walk, 0 to 0.4 s" in measure_case(late)["reason"]

    def crash(*args, **kwargs):
        raise ZeroDivisionError("a mistake of ours")

    monkeypatch.setattr("simprep.study.sweep.measure.track", crash)
    found = measure_case(cases["walk", "pd"])
    assert (found["end"], found["metrics"]) == ("error", {})
    assert re.match(r"ZeroDivisionError: a mistake of ours \(test_sweep\.py:\d+\)", found["reason"])
    (tmp_path / "broken.bvh").write_text("other")
    assert "has changed since" in measure_case(cases["broken.bvh", "motion"])["reason"]


def test_other_code_than_planned_is_refused():
    case = replace(next(small().cases()), code="0" * 16)
    with pytest.raises(OtherCodeError, match="the same version of simprep"):
        next(in_this_process([case]))


def test_a_store_is_one_table(tmp_path):
    arrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    assert read_table(tmp_path / "empty").num_rows == 0
    cases, store = list(small(seeds=[0, 3], characters=["humanoid", {"height_m": 1.6}]).cases()), SweepStore(tmp_path)
    run_sweep(cases, store, fake_engine()[0])
    table = read_table(tmp_path)
    assert table.column("id").to_pylist() == [case.id for case in cases]
    assert table.column("mpjpe_mm").to_pylist() == [float(case.seed) for case in cases]
    assert table.column("alpha").to_pylist() == [case.alpha for case in cases]
    assert table.column("height_m").to_pylist() == [case.body.height_m for case in cases]
    assert table.schema.field("mpjpe_mm").type == table.schema.field("cpu_s").type == arrow.float64()
    assert table.schema.field("success").type == arrow.bool_()
    assert table.schema == read_table(tmp_path / "empty").schema
    few = {case.id for case in cases[:3]}
    assert parquet.read_table(save_table(tmp_path, tmp_path / "few.parquet", few.__contains__)).num_rows == 3


def test_the_plan_multiplies_what_was_measured(tmp_path):
    cases, store = list(small(controllers=["pd"]).cases()), SweepStore(tmp_path)
    run_sweep(cases[:4], store, fake_engine()[0])
    (one,) = costs(cases, store)
    assert (one.kind, one.cases, one.left, one.measured) == (("prepare", "pd", ""), 14, 10, 4)
    assert (one.mean_s, one.error_s) == (2.0, 0.0)
    text = plan_text([replace(one, bytes=1000.0)], clips=2, many=1_000_000)
    assert "14 cases, 10 of them still to run; 2 clips or pairs, 7 cases of each" in text
    assert "takes 28 s of one core, and 0.0 MB of records" in text
    assert "| 2 | 10 s | 41 days | 1000000" not in text
    assert "| 8 | 2 s | 21 days |" in text  # 14 million seconds
    unknown = plan_text([KindCost(("track", "mpc", "live"), 5, 5, 0, float("nan"), float("nan"), float("nan"))], 5, 10)
    assert "an unknown time" in unknown


def test_the_command_runs_writes_and_says_what_it_did(tmp_path, capsys, monkeypatch):
    config = write_cheap(tmp_path)
    config.write_text(CHEAP.replace('["motion", "pd"]', '["motion"]'))
    arguments = ["sweep", str(config), "-o", str(tmp_path / "out"), "--processes", "1"]
    assert main([*arguments, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["ends"] == {"measured": 4, "bad_input": 2}
    written = json.loads((tmp_path / "out" / "sweep.json").read_text())
    assert written["complete"] is True
    assert written["schema"] == "simprep.sweep/1"
    assert {path.name for path in (tmp_path / "out").iterdir()} >= {
        "records-000001.jsonl",
        "table.parquet",
        "report.html",
    }
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "6 cases: 4 measured, 2 bad input." in page
    assert (
        page.count('type="text/plain" id="recording-') == 3
    )  # of the two clips on one body and the first on the other
    made = (tmp_path / "out" / "report.html").stat().st_mtime_ns

    def missing():
        raise MissingExtraError("the table of a sweep", "table")

    monkeypatch.setattr("simprep.study.sweep.table._arrow", missing)
    assert main(arguments) == 0
    printed = capsys.readouterr()
    assert "6 cases, 0 of them run now: 2 bad_input, 4 measured" in printed.out
    assert (tmp_path / "out" / "report.html").stat().st_mtime_ns == made  # nothing was run, so nothing is drawn
    assert "pip install 'simprep[table]'" in printed.err
    assert main([*arguments, "--scheduler", "tcp://nowhere:1"]) == 2
    assert "valid: one of them" in capsys.readouterr().err


def recorded(case, cpu_s=1.0, **changes):
    metrics = {"success": True, "survived_s": 2.0, "mpjpe_mm": 20.0}
    content = {"end": "done", "metrics": metrics, "cost": {"cpu_s": cpu_s}} | changes
    return {"id": case.id, "case": case.definition, **content}


def test_what_belongs_together_stands_side_by_side():
    cases = list(small(clips=["walk"], disturbances=["nominal", "push"]).cases())
    made = groups(cases)
    assert all(len({(case.clip, case.target, case.disturbance.name) for case in group}) == 1 for group in made)
    arms = next(group for group in made if group[0].target is not None)
    assert [case.arm for case in arms] == list(ARMS)
    assert {case.alpha for case in arms} == {None, 1.0}  # the highest level; `none` has none
    controllers = next(group for group in made if group[0].clip is not None)
    assert [case.controller for case in controllers] == ["pd", "mpc"]
    assert made[-1][0].controller == "motion"  # what is not simulated comes last


def test_a_replay_simulates_again_what_is_cheap_enough(tmp_path):
    content = {"clips": ["stand", "walk"], "seconds": 0.2, "controllers": ["pd"]}
    cases = list(sweep_of(content).cases())
    records = [recorded(case) for case in cases]
    shown = sweep_replays(cases, records)
    assert [replay.title for replay in shown] == ["stand, nominal", "walk, nominal"]
    assert shown[0].actors[0].reference is not None  # a simulation
    assert [replay.title for replay in sweep_replays(cases, records, budget_s=1.5)] == ["stand, nominal"]
    assert not sweep_replays(cases, [recorded(case, end="bad_input", metrics={}) for case in cases])


def test_a_page_counts_ends_and_successes():
    cases = list(small(controllers=["motion", "mpc"]).cases())
    fell = {"success": False, "survived_s": 1.0, "mpjpe_mm": 90.0}
    records = [
        recorded(case, end="measured", metrics={})
        if case.controller == "motion"
        else recorded(case, end="fell", metrics=fell)
        if case.arm == "none"
        else recorded(case)
        for case in cases
    ]
    page = sweep_page("kicks", records, [], {})
    assert page.headline == "28 cases: 14 measured, 12 done, 2 fell. Simulated cases that succeed: 12 of 14 with mpc."
    (none,) = [one for one in grouped(records) if (one.controller, one.what) == ("mpc", ARM_LABELS["none"])]
    assert (none.cases, none.success_share, none.survived_s) == (2, 0.0, 1.0)
    assert np.isnan(none.mpjpe_mm)
    assert "for a replay would take too long" in page.details["replay"]


def test_ctrl_c_keeps_what_is_recorded_and_says_so(tmp_path, capsys, monkeypatch):
    config = write_cheap(tmp_path)
    monkeypatch.setattr("simprep.study.sweep.engines.in_this_process", fake_engine(stop_at=3)[0])
    out = tmp_path / "out"
    assert main(["sweep", str(config), "-o", str(out), "--processes", "1"]) == 130
    assert f"3 of 12 cases are recorded in {out}; the same command goes on" in capsys.readouterr().err
    assert len(SweepStore(out).index().entries) == 3
    assert json.loads((out / "sweep.json").read_text())["complete"] is False


def test_paths_do_not_reach_results(tmp_path):
    """A record from one machine is that from another, where the files lie elsewhere."""
    records = []
    for folder in (tmp_path / "one", tmp_path / "two"):
        folder.mkdir()
        case = next(case for case in read_sweep(write_cheap(folder)).cases() if case.clip and case.clip.path)
        assert Path(case.clip.path).parent == folder
        records.append(case.definition)
    assert records[0] == records[1]


def test_a_robot_takes_the_place_of_the_characters(tmp_path, capsys):
    config = tmp_path / "walk.toml"
    config.write_text(
        'clips = ["walk"]\nseconds = 0.3\ncontrollers = ["motion"]\ncharacters = ["humanoid", {height_m = 1.6}]'
    )
    (tmp_path / "legless.xml").write_text('<mujoco><worldbody><body><geom size="1"/></body></worldbody></mujoco>')
    wanted = ["sweep", str(config), "--processes", "1", "-o", str(tmp_path / "out"), "--quiet", "--robot"]
    assert main([*wanted, "primitive_robot"]) == 0
    assert [one["case"]["character"] for one in SweepStore(tmp_path / "out").records()] == ["primitive_robot"]
    assert main([*wanted, str(tmp_path / "legless.xml")]) == 2
    assert "legless.xml: no free joint" in capsys.readouterr().err
