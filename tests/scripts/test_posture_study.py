"""The study of posture optimisation on made-up records: what is in them is what its report says."""

import json
import re

import numpy as np
import pytest

from posture_optimization.compared import compared, rows_of
from posture_optimization.grid import ARMS, DISTURBANCES, SLOW_ARMS, TARGETS, study_cases
from posture_optimization.report import answer
from study_posture_optimization import write_results

ABOUT = {"command": "python scripts/study_posture_optimization.py", "preset": "live", "seeds": 1, "controllers": ["pd"]}


def records(gain_mm, fewer_falls=0.0, spread_mm=1.0, ends=("done",), seed=0):
    """Cases of two controllers whose margin of stability changes by `gain_mm` with optimisation, and whose falls get fewer."""
    rng = np.random.default_rng(seed)
    made = []
    for controller in ("motion", "pd"):
        for target in TARGETS:
            shift = gain_mm + rng.normal(0, spread_mm)
            for disturbance in DISTURBANCES if controller == "pd" else DISTURBANCES[:1]:
                for height in (1.6, 1.9):
                    level, chance = rng.normal(-50, 10), rng.uniform()
                    for arm in ARMS:
                        margin = level + (shift + rng.normal(0, 0.5) if arm == "optimised" else 0.0)
                        success = chance > (0.5 - fewer_falls if arm == "optimised" else 0.5) if fewer_falls else True
                        case = {"locomotion": "walk", "target": target, "arm": arm, "height_m": height, "seed": 0}
                        case |= {"controller": controller, "disturbance": disturbance}
                        metrics = {"margin_of_stability_mm": margin, "com_cos_mm": 100.0 + rng.normal(0, 0.1)}
                        if controller == "pd":
                            metrics |= {"success": success, "survived_s": 4.0 if success else 2.0}
                        end = "measured" if controller == "motion" else "done" if success else "fell"
                        made.append({
                            "id": f"{len(made):020x}", "end": end, "case": case | ({} if arm == "none" else {"alpha": 1.0}),
                            "metrics": metrics, "cost": {"processor": "made up"},
                        })  # fmt: skip
    return made


@pytest.mark.parametrize(
    ("made", "begins"),
    [
        (records(12.0), "Yes, in part: it helps in 4 of 12 comparisons"),
        (records(-12.0), "No, it is harmful: the motion gets less stable in 4 of 12 comparisons"),
        (records(0.0), "No effect: in all 12 comparisons"),
        (records(2.0, spread_mm=30.0), "No effect can be shown: it helps in none of 12 comparisons"),
        (records(-12.0, fewer_falls=0.5), "Sometimes, and it is harmful elsewhere"),
    ],
)  # fmt: skip
def test_the_answer_says_what_is_in_the_data(made, begins):
    rows, _ = rows_of(made)
    assert answer(compared(rows)).startswith(begins)


def test_the_report_is_written_with_its_figures_and_numbers(tmp_path):
    pytest.importorskip("matplotlib")
    made = records(-12.0)
    content = write_results(made, 2 * len(made), tmp_path, ABOUT)
    assert "it is harmful" in content["answer"]
    assert content["n_cases"] == len(made)
    assert content["n_simulated"] == sum(record["case"]["controller"] == "pd" for record in made)
    text = (tmp_path / "report.md").read_text()
    assert content["answer"] in text
    assert f"{len(made)} of {2 * len(made)} cases" in text
    assert json.loads((tmp_path / "summary.json").read_text())["n_cases"] == len(made)
    files = {path.name for path in tmp_path.iterdir()}
    assert files == {"report.md", "report.html", "summary.json", "effects.png", "worse.png"}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert content["answer"].partition(". ")[0].replace("`", "") in page  # no Markdown there
    assert f"{len(made)} of {2 * len(made)}, {content['n_simulated']} simulated" in page


def test_the_numbers_of_the_text_are_those_of_the_data(tmp_path):
    made = records(12.0)
    rows, ends = rows_of(made)
    assert ends == {"measured": 16 * 2 * len(ARMS), "done": 16 * 8 * len(ARMS)}
    assert {row["alpha"] for row in rows} == {1.0}  # `none` stands for every level
    (one,) = [
        one
        for one in compared(rows)
        if (one.controller, one.disturbance, one.outcome.name) == ("pd", "push", "margin_of_stability_mm")
    ]
    assert (one.effect.n, one.effect.clusters, one.says) == (32, 16, "helps")
    assert one.effect.worse == 0.0
    assert one.effect.estimate == pytest.approx(12.0, abs=1.0)
    said = re.search(
        r"`pd`, push: margin of stability \[mm\] \+([\d.]+) \(\+([\d.]+) to \+([\d.]+)\), p = ", answer(compared(rows))
    )
    assert [float(text) for text in said.groups()] == [
        pytest.approx(value, abs=0.05) for value in (one.effect.estimate, one.effect.low, one.effect.high)
    ]
    assert compared(rows) == compared(
        list(reversed(rows))
    )  # the same numbers from the same seed, in any order of records


def test_cases_that_could_not_be_run_are_counted_and_left_out():
    made = records(0.0)
    made[0] |= {"end": "error", "metrics": {}}
    rows, ends = rows_of(made)
    assert ends["error"] == 1
    assert len(rows) == len(made) - 1


def test_the_study_has_two_thousand_simulated_cases_and_no_case_twice():
    cases = study_cases(["pd", "mpc"], seeds=1, preset="live")
    assert len({case.id for case in cases}) == len(cases)
    assert sum(case.controller != "motion" for case in cases) >= 2000
    assert {case.disturbance.name for case in cases if case.controller == "mpc"} == set(DISTURBANCES)
    assert {case.arm for case in cases if case.controller == "pd"} == set(ARMS)
    assert {case.arm for case in cases if case.controller == "mpc"} == set(SLOW_ARMS)
    without = study_cases(["pd", "mpc"], seeds=1, preset="live", arms=ARMS[:4])
    assert {case.id for case in without} == {case.id for case in cases if case.arm != "dynamic"}
    assert len({case.body.height_m for case in cases}) == 3
    assert len(study_cases(["pd", "mpc"], seeds=1, preset="live", small=True)) < 100
