"""A run as a file: one .npz with states, controls, contacts and torques."""

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simprep.files import atomic_path
from simprep.humanoid import HINGES, MODEL_NAME, MODEL_VERSION
from simprep.physics.run import Run

SCHEMA = "simprep.run/1"


def save_run(run: Run, path: str | Path) -> Path:
    """Write a run to .npz, atomically: every array of `Run` under its own name, the rest as JSON in `header`.

    Args:
        run: what to write.
        path: the .npz file; its folder is made.

    Returns:
        The path written.
    """
    header = {"schema": SCHEMA, **run_header(run)}
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **{"header": np.array(json.dumps(header, default=str)), **run_arrays(run)})  # type: ignore[arg-type]
    return Path(path)


def run_arrays(run: Run) -> dict[str, NDArray[Any]]:
    """Every array of a run by its name."""
    values = {field.name: getattr(run, field.name) for field in fields(run)}
    return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}


def run_header(run: Run) -> dict[str, Any]:
    """Everything of a run that is no array, in JSON's types except for what a controller's settings may hold."""
    header: dict[str, Any] = {
        "model": MODEL_NAME,
        "model_version": MODEL_VERSION,
        "hinges": HINGES,
        "motion": run.reference.name,
        "source": run.reference.source,
        "events": dict(run.reference.events),
        "height_m": run.reference.body.height_m,
        "mass_kg": run.reference.body.mass_kg,
        "assist_force_n": run.assist.force_n,
        "assist_torque_nm": run.assist.torque_nm,
        "processing": dict(run.processing),
        "settings": dict(run.settings),
    }
    names = (
        "controller", "seed", "timestep", "end", "end_s", "end_reason", "fell_at_s", "wall_s", "overhead_share",
    )  # fmt: skip
    return header | {name: getattr(run, name) for name in names}
