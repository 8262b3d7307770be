"""Result files: plain JSON, written whole or not at all, with what is needed to repeat the run."""

import contextlib
import json
import os
import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from simprep.files import atomic_path
from simprep.report.machine import processor

PACKAGES = ("simprep", "mujoco", "numpy", "scipy", "daqp")


def jsonable(value: Any) -> Any:
    """The same content in JSON's types: arrays become lists, NaN and infinity become None.

    Args:
        value: mappings, sequences, numpy arrays and numbers, paths, text, None; anything else raises TypeError.
    """
    if value is None or isinstance(value, (bool, str, int)):
        return value
    if isinstance(value, (np.bool_, np.integer)):
        return value.item()
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): jsonable(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return jsonable(value.tolist())
    if isinstance(value, (list, tuple)):
        return [jsonable(item) for item in value]
    raise TypeError(f"{type(value).__name__} has no JSON form")


def save_json(path: str | Path, content: Mapping[str, Any]) -> Path:
    """Write a JSON file (`jsonable`) atomically."""
    text = json.dumps(jsonable(content), indent=1, allow_nan=False)
    with atomic_path(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return Path(path)


def provenance(arguments: Sequence[str]) -> dict[str, Any]:
    """What repeats a result: `command`, `created_utc`, `versions`, `platform`.

    Args:
        arguments: the command line after `simprep`, or a script's whole `sys.argv`.
    """
    program = "python" if arguments and arguments[0].endswith(".py") else "simprep"
    versions = {"python": platform.python_version()}
    for package in PACKAGES:
        with contextlib.suppress(metadata.PackageNotFoundError):
            versions[package] = metadata.version(package)
    return {
        "command": " ".join([program, *arguments]),
        "created_utc": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "versions": versions,
        "platform": {"system": platform.system(), "machine": platform.machine(), "cpus": os.cpu_count(), **processor()},
    }
