"""Values show themselves: in a terminal, in Jupyter, as arrays and as data frames."""

import builtins
import io
from html.parser import HTMLParser

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from simprep import evaluate_run, humanoid, library_motion, track
from simprep.check.motion_check import check_motion
from simprep.controller.best import best_policy
from simprep.controller.graph import build_graph
from simprep.controller.runtime.approach import Approach
from simprep.controller.runtime.task import ActionRecord
from simprep.controller.spaces import Observation
from simprep.display import fact_table, table_html
from simprep.duel.fight.fight import Fight, FightAction
from simprep.duel.labels.labels import Label
from simprep.duel.stream.stream import DuelStream
from simprep.errors import MissingExtraError, MotionError
from simprep.metrics.balance import balance
from simprep.metrics.margins import step_margins
from simprep.motion.edit import move, repeat
from simprep.motion.load import ImportReport
from simprep.regression.compare import Comparison, Row
from simprep.study.bisection import DoseLimit
from simprep.study.push_limits import PushLimits, PushSettings
from simprep.study.stability import MeasureLimits, Stability


@pytest.fixture(scope="module")
def motion():
    return library_motion("stand")[:12]


@pytest.fixture(scope="module")
def run(motion):
    return track(motion, "pd")


class Cells(HTMLParser):
    def __init__(self):
        super().__init__()
        self.rows, self._text = [], None

    def handle_starttag(self, tag, attrs):
        if tag == "tr":
            self.rows.append([])
        self._text = "" if tag in ("td", "th") else self._text

    def handle_data(self, data):
        if self._text is not None:
            self._text += data

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self.rows[-1].append(self._text)
            self._text = None


def cells(html):
    reader = Cells()
    reader.feed(html)
    return reader.rows


def printed(value):
    stream = io.StringIO()
    Console(file=stream, width=150).print(value)
    return stream.getvalue()


def test_the_terminal_and_jupyter_tell_the_same(motion, run):
    stream = DuelStream((motion, move(motion, (1.0, 0.0), np.pi)))
    for value, told in (
        (motion, "12 at"),
        (run, "pd, seed 0"),
        (humanoid(), "joints"),
        (stream, "A: stand"),
        (evaluate_run(run), "mpjpe_mm"),
    ):
        assert told in printed(value)
        rows = cells(value._repr_html_())
        assert told in str(rows)
        assert all(len(row) == 2 and row[1] for row in rows)


def test_a_table_in_html_has_the_cells_of_the_table():
    table = Table(title="[bold]a < b[/bold]")
    table.add_column("x")
    table.add_column("y", justify="right")
    table.add_row("<i>", "1")
    html = table_html(table)
    assert cells(html) == [["x", "y"], ["<i>", "1"]]
    assert "<caption>a &lt; b</caption>" in html
    assert cells(table_html(fact_table("", {"a": None, "b": True, "c": 0.123456})))[0:] == [
        ["a", "–"],
        ["b", "yes"],
        ["c", "0.1235"],
    ]


def test_numpy_sees_the_poses(motion):
    assert np.asarray(motion) is motion.qpos
    assert np.asarray(motion, dtype=np.float32).dtype == np.float32
    assert np.array(motion, copy=True) is not motion.qpos
    np.array(motion, copy=True)[0] = 0  # a copy may be written to, the motion may not
    assert np.allclose(motion, motion[:])
    assert not np.allclose(motion, move(motion, (1.0, 0.0), 0.0))


def test_data_frames_have_units_and_times(motion, run):
    pytest.importorskip("pandas")
    frame = motion.to_dataframe()
    assert frame.index.name == "time_s"
    np.testing.assert_array_equal(frame.index, motion.times)
    np.testing.assert_array_equal(frame.to_numpy()[:, : motion.qpos.shape[1]].astype(float), motion.qpos)
    assert frame["left_contact"].tolist() == motion.contacts[:, 0].tolist()
    states = run.to_dataframe()
    assert len(states) == run.steps + 1
    knee = humanoid().joint("left_knee_flexion")
    np.testing.assert_array_equal(states["left_knee_flexion_nm"][:-1], run.torque[:, knee])
    np.testing.assert_array_equal(states["left_knee_flexion_rad"], run.qpos[:, 7 + knee])
    assert np.isnan(states["ground_force_z_n"].iloc[-1])
    row = evaluate_run(run).to_dataframe()
    assert row["end"].tolist() == ["done"]


def test_without_pandas_the_extra_is_named(motion, monkeypatch):
    real = builtins.__import__

    def without(name, *rest):
        if name == "pandas":
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingExtraError, match=r"simprep\[pandas\]"):
        motion.to_dataframe()


def results():
    """A result of each kind that has no simulation in it, what its table tells, and the rows of its data frame."""
    settings = PushSettings(0.5, (0.0, 90.0), seeds=(0, 1))
    limit = DoseLimit((1.0, 0.5), (True, False), 0.75, 0.5)
    row = Row("walk", "mpjpe_mm", 20.0, 23.0, 18.0, 22.0, "worse", (1, 1))
    walk = repeat(library_motion("walk"), 2)
    graph = build_graph([library_motion("walk"), library_motion("stand")], [library_motion("punch_right")])
    margins = step_margins(walk, balance(walk))
    return [
        (PushLimits(settings, ((100.0, 120.0), (80.0, 90.0)), (False, False), 2.0, 130.0), "110 (100 to 120)", 2),
        (Stability((MeasureLimits("friction", (0, 1), ((limit, limit),)),), runs=5), "dose_friction", 2),
        (Comparison((row,)), "failed", 1),
        (margins, "step_margin_ml_left_mm", len(margins.steps)),
        (fight(), "A: 1, B: 2", 3),
        (check_motion(walk), "verdict", len(check_motion(walk).findings)),
        (graph, "transitions, core", len(graph.transitions)),
        (approached(walk), "until the goal [s]", 1),
    ]


def fight():
    """Two who stand; B steps half-way."""
    motion = library_motion("stand")[:12]
    stand, step = Label(move="L-L").code, Label(left_punch="fwd", move="L-R").code
    actions = (FightAction(0, 0, 12, stand), FightAction(1, 0, 6, stand), FightAction(1, 6, 12, step, moment=9))
    return Fight(DuelStream((motion, move(motion, (1.0, 0.0), np.pi))), actions, seed=3)


def approached(motion):
    action = ActionRecord(0, "walk", 0.2, False, 0.2, 1.5, Observation(0.0, 0, 1.5, 0.0, 1.5, 0.0), (1.0,))
    return Approach(motion, True, 1.2, np.zeros(len(motion)), (action,), (20,), 0.95, 0.2, len(motion), 0.1, 0.1)


def test_results_of_studies_show_themselves_and_are_data_frames():
    pytest.importorskip("pandas")
    for value, told, rows in results():
        assert told in printed(value)
        assert told in value._repr_html_()
        assert len(value.to_dataframe()) == rows
    limits, stable, compared, *_ = (value for value, _, _ in results())
    assert limits.to_dataframe()["max_force_n"].tolist() == [110.0, 85.0]
    assert stable.to_dataframe()["survived"].tolist() == [0.75, 0.75]
    assert compared.to_dataframe()["now"].tolist() == [23.0]


def test_a_stream_is_sliced_as_a_motion(motion):
    stream = DuelStream((motion, move(motion, (1.0, 0.0), np.pi)), seams=(6,), clips=("one", "two"))
    part = stream[4:-2]
    assert (len(part), part.seams, part.clips) == (6, (2,), ("one", "two"))
    assert stream[:6].clips == ("one",)
    with pytest.raises(MotionError, match="valid: frames a:b"):
        stream[::2]
    fought = next(value for value, _, _ in results() if isinstance(value, Fight)).to_dataframe()
    assert fought["player"].tolist() == ["A", "B", "B"]
    assert fought["moment_s"].tolist()[2] == pytest.approx(9 / library_motion("stand").fps)


def test_policies_models_and_imports_tell_what_they_are():
    policy = best_policy()
    report = ImportReport(30, 60.0, 0.5, None, "z", 0.01, ("a word",), "BVH file x.bvh")
    for value, told in (
        (policy, "core nodes"),
        (policy, "value iteration"),
        (report, "BVH file x.bvh"),
        (report, "30 at 60/s"),
    ):
        assert told in printed(value)
        assert told in value._repr_html_()
