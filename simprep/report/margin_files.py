"""Margins of stability as files for statistics elsewhere: a row for each step, and time-normalised curves."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.files import atomic_path
from simprep.metrics.margins import NODES, StepMargin
from simprep.motion.formats.opensim import opensim_table


def save_steps(steps: Sequence[StepMargin], path: Path) -> Path:
    """Write a CSV with a row for each step; an empty cell where a number does not exist."""
    names = [one.name for one in fields(StepMargin)]
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        writer.writerows([_cell(value) for value in asdict(step).values()] for step in steps)
    return path


def save_curves_csv(curves: Mapping[str, FloatArray], path: Path) -> Path:
    """Write curves (101,) by name as a CSV with a column for each, after `percent`; an empty cell for NaN."""
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["percent", *curves])
        table = np.stack([_percent(), *curves.values()], axis=1)
        writer.writerows([_cell(value) for value in row] for row in table.tolist())
    return path


def save_curves_mot(curves: Mapping[str, FloatArray], path: Path, about: Mapping[str, str]) -> Path:
    """Write curves (101,) by name under OpenSim's header, which wants the column `time`: it holds 0 to 100 %.

    Args:
        curves: by name.
        path: the file.
        about: definitions by name, lines of the header.
    """
    lines = [
        "time is in per cent of the step or cycle; margins in metres",
        *(f"{k}: {v.replace('=', 'is')}" for k, v in about.items()),
    ]
    text = opensim_table(path.stem, {"time": _percent(), **curves}, "".join(f"{line}\n" for line in lines))
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return path


def _percent() -> FloatArray:
    return np.linspace(0.0, 100.0, NODES)


def _cell(value: object) -> object:
    if not isinstance(value, float):
        return value
    return f"{value:.9g}" if np.isfinite(value) else ""
