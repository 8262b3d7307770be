"""A run as a file: one .npz with states, controls, contacts and torques."""

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

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
    values = {field.name: getattr(run, field.name) for field in fields(run)}
    arrays = {name: value for name, value in values.items() if isinstance(value, np.ndarray)}
    header: dict[str, Any] = {
        "schema": SCHEMA,
        "model": MODEL_NAME,
        "model_version": MODEL_VERSION,
        "hinges": HINGES,
        "motion": run.reference.name,
        "source": run.reference.source,
        "height_m": run.reference.body.height_m,
        "mass_kg": run.reference.body.mass_kg,
        "assist_force_n": run.assist.force_n,
        "assist_torque_nm": run.assist.torque_nm,
        "processing": dict(run.processing),
        "settings": dict(run.settings),
    }
    for name in ("controller", "seed", "timestep", "end", "end_s", "end_reason", "fell_at_s", "wall_s"):
        header[name] = values[name]
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **{"header": np.array(json.dumps(header, default=str)), **arrays})  # type: ignore[arg-type]
    return Path(path)
