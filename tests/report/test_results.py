"""Result files."""

import json

import numpy as np
import pytest

from simprep import __version__
from simprep.files import atomic_path
from simprep.report.results import jsonable, provenance, save_json


def test_everything_in_a_result_has_a_json_form():
    content = {
        "a": np.float64(1.5),
        "b": np.array([[1, 2]]),
        "c": float("nan"),
        "d": np.inf,
        "e": np.bool_(True),
        3: (1,),
    }
    assert jsonable(content) == {"a": 1.5, "b": [[1, 2]], "c": None, "d": None, "e": True, "3": [1]}
    with pytest.raises(TypeError, match="set has no JSON form"):
        jsonable({"x": {1, 2}})


def _write_half(path):
    with atomic_path(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError("half way")


def test_a_file_is_whole_or_not_there(tmp_path):
    path = save_json(tmp_path / "sub" / "r.json", {"x": 1})
    assert json.loads(path.read_text()) == {"x": 1}
    with pytest.raises(RuntimeError, match="half way"):
        _write_half(path)
    assert json.loads(path.read_text()) == {"x": 1}
    assert [file.name for file in path.parent.iterdir()] == ["r.json"]
    with pytest.raises(TypeError):
        save_json(path, {"x": object()})
    assert json.loads(path.read_text()) == {"x": 1}


def test_a_result_says_how_to_repeat_it():
    record = provenance(["track", "walk"])
    assert record["command"] == "simprep track walk"
    assert record["versions"]["simprep"] == __version__
    assert {"python", "mujoco", "numpy"} <= set(record["versions"])
    assert record["created_utc"].endswith("Z")
