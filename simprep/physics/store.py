"""A run as a file: one .npz with states, controls, contacts and torques of every body."""

import json
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simprep.archive import find_archive, open_archive, write_archive
from simprep.arrays import BoolArray, FloatArray
from simprep.characters import character_header, character_of_header
from simprep.errors import MotionError
from simprep.motion.motion import Motion
from simprep.physics.contacts import BodyContact
from simprep.physics.run import Assist, BodyRun, Run
from simprep.scene import body_prefix

SCHEMA = "simprep.run/3"
RUN_FILE = "run.npz"
"""Name of a run's file in a folder of results."""
MAX_BYTES = 4_000_000_000
"""Largest run read [bytes, unpacked]: an hour of one body at 480 steps/s."""

_OF_THE_RUN = ("overlap", "reference_overlap", "unconverged")
_PLAIN = (
    "controller", "seed", "timestep", "end", "end_reason", "fallen", "settings", "wall_s", "overhead_share",
)  # fmt: skip


def save_run(run: Run, path: str | Path) -> Path:
    """Write a run to .npz, atomically; returns the path written.

    The arrays of a body have the names of `BodyRun` after its prefix in the scene: `qpos` of a single body, `a_qpos`
    and `b_qpos` of two. Those of its reference are `reference.qpos` and `reference.contacts`. `overlap`,
    `reference_overlap` and `unconverged` are common. The rest is JSON in `header`.

    Args:
        run: what to write.
        path: the file; `.npz` is appended if missing. Its folder is made.
    """
    header, arrays = run_parts(run)
    return write_archive(path, header, arrays)


def read_run(path: str | Path) -> Run:
    """Read what `save_run` wrote, to the bit.

    Args:
        path: the file, or a folder of results with a run in it.

    Raises:
        MotionFileError: missing, damaged, not a run, of another schema version or another model.
    """
    path = find_archive(path, "simprep run", SCHEMA, RUN_FILE)
    with open_archive(path, "simprep run", SCHEMA, max_bytes=MAX_BYTES) as (header, archive):
        return run_of_parts(header, {name: archive[name] for name in archive.files if name != "header"})


def run_parts(run: Run) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Contents of a run's file: header in JSON's types, and arrays by name.

    Raises:
        MotionError: the controller's settings hold something that JSON does not know.
    """
    header: dict[str, Any] = {
        "schema": SCHEMA,
        **{name: getattr(run, name) for name in _PLAIN},
        "assist_force_n": run.assist.force_n,
        "assist_torque_nm": run.assist.torque_nm,
        "assist_kick_mps": run.assist.kick_mps,
        "assist_kick_radps": run.assist.kick_radps,
        "contacts": [asdict(contact) for contact in run.contacts],
        "bodies": [{"processing": one.processing, "reference": _motion_header(one.reference)} for one in run.bodies],
    }
    arrays: dict[str, NDArray[Any]] = {name: getattr(run, name) for name in _OF_THE_RUN}
    for number, one in enumerate(run.bodies):
        prefix = body_prefix(number, len(run.bodies))
        arrays |= {prefix + name: value for name, value in one.arrays().items()}
        arrays[f"{prefix}reference.qpos"] = one.reference.qpos
        arrays[f"{prefix}reference.contacts"] = one.reference.contacts
    try:
        return json.loads(json.dumps(header, default=_plain)), arrays
    except (TypeError, ValueError) as error:
        raise MotionError(f"run of {run.controller!r}: what it records is not JSON ({error})") from None


def run_of_parts(header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Run:
    """The inverse of `run_parts`.

    Raises:
        MotionError: parts that do not belong together.
        LookupError: missing parts.
    """
    names = [one.name for one in fields(BodyRun) if one.name not in ("reference", "processing")]
    bodies = []
    for number, part in enumerate(header["bodies"]):
        prefix = body_prefix(number, len(header["bodies"]))
        reference = _motion(part["reference"], arrays[f"{prefix}reference.qpos"], arrays[f"{prefix}reference.contacts"])
        bodies.append(
            BodyRun(
                reference=reference, processing=part["processing"], **{name: arrays[prefix + name] for name in names}
            )
        )
    contacts: list[dict[str, Any]] = [
        {name: tuple(value) if isinstance(value, list) else value for name, value in one.items()}
        for one in header["contacts"]
    ]
    own: dict[str, Any] = {**{name: header[name] for name in _PLAIN}, **{name: arrays[name] for name in _OF_THE_RUN}}
    return Run(
        bodies=tuple(bodies),
        assist=Assist(
            header["assist_force_n"],
            header["assist_torque_nm"],
            header.get("assist_kick_mps", 0.0),
            header.get("assist_kick_radps", 0.0),
        ),
        contacts=tuple(BodyContact(**one) for one in contacts),
        **own,
    )


def _motion_header(motion: Motion) -> dict[str, Any]:
    return {
        "fps": motion.fps,
        "events": dict(motion.events),
        "name": motion.name,
        "source": motion.source,
        "loop": motion.loop,
        "character": character_header(motion.character),
    }


def _motion(header: Mapping[str, Any], qpos: FloatArray, contacts: BoolArray) -> Motion:
    own = dict(header)
    character = character_of_header(own.pop("character"))
    return Motion(qpos=qpos, contacts=contacts, character=character, **own)


def _plain(value: Any) -> Any:
    """NumPy's numbers and arrays as JSON's."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value).__name__} {value!r}")
