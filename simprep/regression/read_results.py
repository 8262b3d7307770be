"""Result files as numbers by case and seed: what simprep's commands write, and any table with text, a seed and numbers.

Each record of a JSON list (`cases`, `runs`, `motions`), each line of a JSON-lines or CSV file, or a JSON object as a whole
is one run of a case. Its texts tell the case, with `alpha` and what else is asked for; `seed` tells the seed; its other
numbers are metrics.
"""

import csv
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from simprep.errors import MotionFileError, SettingError
from simprep.regression.baseline import SCHEMA as BASELINE_SCHEMA
from simprep.regression.baseline import read_baseline
from simprep.regression.measured import NO_SEED, Case, Measured, cases_of, numbers

RECORDS = {"cases": "", "runs": "", "motions": " before physics"}
"""Lists of records that result files have, and what is added to the names of their cases."""
CASE_NUMBERS = ("alpha", "direction_deg")
"""Numbers that tell cases apart."""
ABOUT = (
    "schema", "command", "created_utc", "versions", "platform", "settings", "processing", "warnings", "files",
    "timestep_s", "source", "simprep", "mismatch", "record",
)  # fmt: skip
"""What a file says about itself."""
OUTCOMES = ("end", "end_reason", "error", "reason")
"""Texts that are results, so they tell no cases apart; `success` and `survived_s` say the same in numbers."""
SUFFIXES = (".json", ".jsonl", ".csv", ".npz")
METRICS_FILE, RUN_FILE = "metrics.json", "run.npz"

Record = tuple[str, int, Mapping[str, float | None]]


def read_results(paths: Sequence[str | Path], by: Sequence[str] = ()) -> Measured:
    """Read result files and folders as one set of numbers.

    Args:
        paths: `.json`, `.jsonl` and `.csv` files, runs (`.npz`), or folders with `metrics.json` in them or below.
        by: further names of numbers that tell cases apart.

    Raises:
        MotionFileError: a file that is missing, unreadable, unfinished or without numbers.
        SettingError: the same case and seed twice.
    """
    files = [file for path in paths for file in _files(Path(path))]
    records: list[Record] = []
    about: list[Mapping[str, Any]] = []
    whole: dict[str, Case] = {}
    for file in files:
        if _is_baseline(file):
            measured = read_baseline(file).measured
            if taken := set(whole) & set(measured.cases):
                raise SettingError(f"{file}: case {min(taken)!r} is in another file too")
            whole |= measured.cases
            about.append({"versions": measured.versions, "platform": measured.platform})
            continue
        found, header = _read(file, tuple(by))
        if not found:
            raise MotionFileError(file, f"no numbers by case; valid: {_valid()}")
        records += found
        about.append(header)
    made = Measured({**whole, **cases_of(records)})
    stated = [one for one in about if one.get("versions")]
    if not stated:
        return made
    return replace(made, versions=dict(stated[0]["versions"]), platform=dict(stated[0].get("platform") or {}))


def case_name(record: Mapping[str, Any], by: Sequence[str] = ()) -> str:
    """Name of a record's case: its texts, then `name=number` for the numbers that tell cases apart."""
    texts = [value for key, value in record.items() if isinstance(value, str) and key not in (*OUTCOMES, *ABOUT)]
    chosen = [f"{key}={record[key]}" for key in dict.fromkeys((*CASE_NUMBERS, *by)) if _plain(record.get(key))]
    return " ".join((*texts, *chosen)) or "results"


def _plain(value: Any) -> bool:
    return isinstance(value, (bool, int, float))


def _valid() -> str:
    return f"a file of {', '.join(SUFFIXES)}, or a folder with {METRICS_FILE}"


def _files(path: Path) -> list[Path]:
    if not path.is_dir():
        if not path.is_file():
            raise MotionFileError(path, f"no such file; valid: {_valid()}")
        if path.suffix not in SUFFIXES:
            raise MotionFileError(path, f"ends with {path.suffix!r}; valid: {_valid()}")
        return [path]
    for name in (METRICS_FILE, RUN_FILE):
        if (path / name).is_file():
            return [path / name]
    below = sorted(path.rglob(METRICS_FILE))
    for suffix in SUFFIXES[:3]:
        below = below or sorted(path.glob(f"*{suffix}"))
    if not below:
        raise MotionFileError(path, f"a folder without {METRICS_FILE} in it or below, and without other results")
    return below


def _is_baseline(file: Path) -> bool:
    if file.suffix != ".json":
        return False
    content = _parsed(file, json.loads)
    return isinstance(content, dict) and content.get("schema") == BASELINE_SCHEMA


def _parsed(file: Path, parse: Callable[[str], Any]) -> Any:
    try:
        return parse(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise MotionFileError(file, f"not readable ({str(error)[:200]})") from None


def _read(file: Path, by: tuple[str, ...]) -> tuple[list[Record], Mapping[str, Any]]:
    if file.suffix == ".npz":
        return _of_run(file), {}
    if file.suffix == ".csv":
        return [_record(row, by) for row in _parsed(file, _rows)], {}
    if file.suffix == ".jsonl":
        rows = _parsed(file, lambda text: [json.loads(line) for line in text.splitlines() if line.strip()])
        return [_record(row, by) for row in rows if isinstance(row, dict)], {}
    content = _parsed(file, json.loads)
    if isinstance(content, list):
        return [_record(row, by) for row in content if isinstance(row, dict)], {}
    if not isinstance(content, dict):
        return [], {}
    if content.get("complete") is False:
        raise MotionFileError(file, "a study that was cut short; run it again to its end")
    try:
        return list(_of_object(content, by)), content
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        raise MotionFileError(file, f"damaged results ({type(error).__name__}: {str(error)[:200]})") from None


def _of_object(content: Mapping[str, Any], by: tuple[str, ...]) -> Iterator[Record]:
    if str(content.get("schema", "")).startswith("simprep.push/"):
        yield from _of_pushes(content)
        return
    lists = {key: more for key, more in RECORDS.items() if isinstance(content.get(key), list) and content[key]}
    for key, more in lists.items():
        for row in content[key]:
            if isinstance(row, dict):
                name, seed, values = _record(row, by)
                yield name + more, seed, values
    if not lists:
        record = _record(content, by)
        if record[2]:
            yield record


def _record(row: Mapping[str, Any], by: tuple[str, ...]) -> Record:
    seed = row.get("seed", NO_SEED)
    if not isinstance(seed, (int, float)) or int(seed) != seed:
        raise SettingError(f"seed {seed!r}; valid: a whole number")
    told = {*ABOUT, *CASE_NUMBERS, *by, "seed"}
    return case_name(row, by), int(seed), numbers({key: value for key, value in row.items() if key not in told})


def _of_pushes(content: Mapping[str, Any]) -> Iterator[Record]:
    """`simprep push`: a case for each direction, the largest force survived by seed."""
    name = " ".join(str(content[key]) for key in ("motion", "segment", "preset") if content.get(key))
    for direction, forces in zip(content["directions_deg"], content["force_n"], strict=True):
        for seed, force in zip(content["seeds"], forces, strict=True):
            yield f"{name} direction_deg={direction:g}", int(seed), {"max_force_n": float(force)}


def _of_run(file: Path) -> list[Record]:
    from simprep.metrics.evaluate import evaluate_run
    from simprep.physics.store import read_run

    run = read_run(file)
    if len(run.bodies) != 1:
        raise MotionFileError(file, f"a run of {len(run.bodies)} bodies; valid: a run of one")
    return [(f"{run.reference.name} {run.controller}", run.seed, numbers(evaluate_run(run)))]


def _rows(text: str) -> list[dict[str, Any]]:
    rows = list(csv.DictReader(text.splitlines()))
    for number, row in enumerate(rows, 2):
        if None in row or None in row.values():
            raise ValueError(f"line {number} has another number of columns than the first")
    columns = {name: [row[name].strip() for row in rows] for name in (rows[0] if rows else ())}
    typed: dict[str, list[Any]] = {name: _column(cells) for name, cells in columns.items()}
    return [{name: cells[index] for name, cells in typed.items()} for index in range(len(rows))]


def _column(cells: list[str]) -> list[Any]:
    """A column as numbers (empty cells None), if each of its cells is one, else as text."""
    words = {"": None, "true": 1.0, "false": 0.0}
    try:
        values = [words[cell.lower()] if cell.lower() in words else float(cell) for cell in cells]
    except ValueError:
        return cells
    return [int(value) if value is not None and value.is_integer() else value for value in values]
