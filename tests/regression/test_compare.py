"""Verdicts, tolerances, what differs besides, and the baseline's file."""

import json
from dataclasses import replace

import pytest

from simprep.errors import MotionFileError, SettingError
from simprep.regression.baseline import Baseline, new_baseline, read_baseline, save_baseline
from simprep.regression.compare import compare
from simprep.regression.environment import here
from simprep.regression.measured import Case, Measured, cases_of, numbers
from simprep.regression.tables import as_text
from simprep.regression.tolerance import Tolerance, better_sign, parse_tolerance, tolerance_of

ALIKE = {"simprep": "1", "mujoco": "4.0.0", "numpy": "2.4.0"}
PLATFORM = {"system": "Linux", "machine": "x86_64", "cpu": "A", "simd": ["AVX2", "X86_V4"], "avx512": True}


def one(**metrics):
    return Measured({"walk": Case((0,), {name: (value,) for name, value in metrics.items()})}, ALIKE, PLATFORM)


def verdicts(before, now, *tolerances):
    rows = compare(one(**now), Baseline(one(**before), tuple(map(parse_tolerance, tolerances)))).rows
    return {row.metric: row.verdict for row in rows}


def test_verdicts_of_single_numbers():
    before = {"mpjpe_mm": 20.0, "com_inside_share": 0.6, "duration_s": 2.0, "assist_n": 0.0, "old": 1.0, "none": None}
    now = {"mpjpe_mm": 21.5, "com_inside_share": 0.7, "duration_s": 2.4, "assist_n": 0.1, "fresh": 1.0, "none": None}
    assert verdicts(before, now) == {
        "mpjpe_mm": "worse", "com_inside_share": "better", "duration_s": "moved", "assist_n": "moved", "old": "gone",
        "fresh": "new",
    }  # fmt: skip
    assert set(verdicts(before, before).values()) == {"same"}


def test_a_better_number_fails_only_a_strict_check():
    baseline = Baseline(one(mpjpe_mm=20.0))
    assert not compare(one(mpjpe_mm=10.0), baseline).failures
    assert [row.verdict for row in compare(one(mpjpe_mm=10.0), baseline, strict=True).failures] == ["better"]


@pytest.mark.parametrize(
    ("wish", "moved"), [("mpjpe_mm=2", False), ("*_mm=8%", False), ("mpjpe_mm=1+2%", True), ("walk/mpjpe_mm=2", False)]
)
def test_tolerances_are_absolute_or_relative_whichever_is_larger(wish, moved):
    assert (verdicts({"mpjpe_mm": 20.0}, {"mpjpe_mm": 21.5}, wish)["mpjpe_mm"] == "worse") == moved


def test_the_first_tolerance_that_fits_holds_and_lists_and_mappings_have_that_of_the_number_in_them():
    own = (Tolerance("run/*", 9.0), Tolerance("*_mm", 3.0))
    assert [tolerance_of(*name, own).absolute for name in (("run", "x_mm"), ("walk", "x_mm"))] == [9.0, 3.0]
    assert tolerance_of("walk", "feet.slip_mm[2]", ()).absolute == tolerance_of("walk", "slip_mm", ()).absolute == 1.0
    assert (better_sign("whole.success"), better_sign("rows[0].mpjpe_mm"), better_sign("steps")) == (1, -1, 0)


@pytest.mark.parametrize("text", ["", "mpjpe_mm", "=2", "mpjpe_mm=", "mpjpe_mm=two", "mpjpe_mm=-1", "a=nan"])
def test_a_bad_tolerance_says_what_is_valid(text):
    with pytest.raises(SettingError, match="valid: "):
        parse_tolerance(text)


def test_a_case_that_only_one_side_has_is_one_row():
    both = Measured({**one(a=1.0, b=2.0).cases, "run": Case((0,), {"a": (1.0,)})})
    (row,) = compare(one(a=1.0, b=2.0), Baseline(both)).failures
    assert (row.case, row.metric, row.verdict) == ("run", "all 1 numbers", "gone")
    (row,) = compare(both, Baseline(one(a=1.0, b=2.0))).changes
    assert (row.case, row.verdict) == ("run", "new")


def test_few_seeds_alarm_only_far_outside_of_the_baseline():
    seeds = tuple(range(10))
    ten = Measured({"walk": Case(seeds, {"mpjpe_mm": tuple(20.0 + 0.2 * seed for seed in seeds)})})
    assert not compare(one(mpjpe_mm=23.0), Baseline(ten)).failures
    found = compare(one(mpjpe_mm=60.0), Baseline(ten))
    assert [row.verdict for row in found.failures] == ["worse"]
    assert "fewer than 5 values" in found.notes[0]


def test_a_metric_that_only_some_seeds_have_is_gone_only_if_chance_does_not_explain_it():
    def of(values):
        return here(cases_of([("walk", seed, {"margin_mm": value}) for seed, value in enumerate(values)]))

    def verdict(before, now):
        (row,) = compare(of(now), new_baseline(of(before), "first")).rows
        return row.verdict

    one_of_eight = [270.0] + [None] * 7
    assert verdict(one_of_eight, [None] * 5) == "same"
    assert verdict(one_of_eight, [None, 300.0, None, None, None]) == "same"
    assert verdict([270.0] * 19 + [None], [None] * 20) == "gone"
    assert verdict([270.0] * 8, [None] * 8) == "gone"
    many = [270.0 + 0.1 * number for number in range(10)] + [None] * 2
    assert verdict(many, [value and value + 100.0 for value in many]) == "moved"


def test_a_failure_says_what_differs_besides():
    baseline = new_baseline(one(mpjpe_mm=20.0), "first")
    told = as_text(compare(one(mpjpe_mm=30.0), baseline), baseline)
    assert "versions, processor and seeds are those of the baseline: the program or its input has changed" in told
    assert "walk │ mpjpe_mm" in told.replace("  ", " ")
    assert "+50.0%" in told
    assert told.endswith(": first")
    other = replace(
        one(mpjpe_mm=30.0),
        versions={**ALIKE, "mujoco": "4.1.0"},
        platform={**PLATFORM, "simd": ["AVX2"], "avx512": False},
    )
    other = replace(other, cases={"walk": Case((3,), {"mpjpe_mm": (30.0,)})})
    assert compare(other, baseline).differences == (
        "MuJoCo 4.1.0; the baseline has 4.0.0",
        "processor without AVX-512, the baseline's with AVX-512: long runs differ by chaos alone",
        "seeds 3; the baseline has 0",
    )
    unknown = compare(Measured(one(mpjpe_mm=20.0).cases), baseline).differences
    assert unknown == ("versions and processor of the new numbers are not known",)


def test_this_process_names_its_versions_and_processor():
    made = here({})
    assert {"simprep", "mujoco", "numpy"} <= set(made.versions)
    assert made.platform["cpu"]
    assert isinstance(made.platform["avx512"], bool)


def test_numbers_of_a_record():
    record = {"a": True, "b": float("nan"), "c": {"d": [1, 2.5]}, "text": "x", "s_per_s": 0.3, "seed": 4, "none": None}
    assert numbers(record) == {"a": 1.0, "b": None, "c.d[0]": 1.0, "c.d[1]": 2.5, "none": None}
    cases = cases_of([("x", 1, {"a": 1.0}), ("x", 0, {"a": 2.0, "b": 3.0})])
    assert cases == {"x": Case((0, 1), {"a": (2.0, 1.0), "b": (3.0, None)})}
    with pytest.raises(SettingError, match="'x' with seed 0 is there twice"):
        cases_of([("x", 0, {}), ("x", 0, {})])


def test_a_baseline_is_read_as_it_was_saved_and_keeps_its_history(tmp_path):
    first = new_baseline(one(mpjpe_mm=20.0, none=None), "first", None, (Tolerance("*_mm", 2.0),), 0.01)
    path = save_baseline(first, tmp_path / "b.json")
    assert read_baseline(path) == first
    second = new_baseline(one(mpjpe_mm=19.0), "better feet", read_baseline(path), (Tolerance("*_mm", 1.0),))
    assert [change.reason for change in second.history] == ["first", "better feet"]
    assert (second.tolerances, second.false_alarm) == ((Tolerance("*_mm", 1.0),), 0.01)
    assert second.history[1].versions == ALIKE
    with pytest.raises(SettingError, match="without a reason"):
        new_baseline(one(a=1.0), "  ")
    with pytest.raises(SettingError, match="no numbers"):
        new_baseline(Measured({}), "first")


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda content: content.update(schema="simprep.track/1"), "a baseline has 'simprep.baseline/1'"),
        (lambda content: content.pop("cases"), "damaged baseline"),
        (lambda content: content["cases"]["walk"].update(seeds=[]), "seeds .*at least one"),
        (lambda content: content["cases"]["walk"]["metrics"].update(a=[1, 2]), "a: 2 values for 1 seeds"),
        (lambda content: content["cases"]["walk"]["metrics"].update(a=["x"]), "damaged baseline"),
        (lambda content: content.update(false_alarm=2), "false alarms 2; valid: above 0"),
        (lambda content: content["tolerances"].append({"pattern": "*", "absolut": 1}), "damaged baseline"),
    ],
)
def test_a_damaged_baseline_is_refused(damage, words, tmp_path):
    path = save_baseline(new_baseline(one(a=1.0), "first"), tmp_path / "b.json")
    content = json.loads(path.read_text())
    damage(content)
    path.write_text(json.dumps(content))
    with pytest.raises(MotionFileError, match=words) as error:
        read_baseline(path)
    assert str(path) in str(error.value)
