"""Values show themselves: in a terminal, in Jupyter, as arrays and as data frames."""

import builtins
import io
from html.parser import HTMLParser

import numpy as np
import pytest
from rich.console import Console
from rich.table import Table

from simprep import evaluate_run, humanoid, library_motion, track
from simprep.display import fact_table, table_html
from simprep.duel.stream.stream import DuelStream
from simprep.errors import MissingExtraError
from simprep.motion.edit import move


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
