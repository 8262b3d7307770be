"""The file of a two-person stream: one .npz with a schema version and the identity of the model its poses belong to."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from simprep.archive import MAX_BYTES, UNREADABLE
from simprep.duel.stream import PLAYERS, DuelStream
from simprep.errors import MotionFileError, SimprepError
from simprep.files import atomic_path
from simprep.humanoid import HINGES, MODEL_NAME, MODEL_VERSION, Body
from simprep.motion.motion import Motion

SCHEMA = "simprep.duel-stream/1"


def save_stream(stream: DuelStream, path: str | Path) -> Path:
    """Write a stream to .npz, atomically.

    Args:
        stream: what to write.
        path: the file; `.npz` is appended if missing.

    Returns:
        The path written.

    Raises:
        MotionFileError: it cannot be written.
    """
    path = Path(path)
    if path.suffix != ".npz":
        path = path.with_name(path.name + ".npz")
    header = {
        "schema": SCHEMA,
        "model": MODEL_NAME,
        "model_version": MODEL_VERSION,
        "hinges": HINGES,
        "name": stream.name,
        "fps": stream.fps,
        "seams": stream.seams,
        "clips": stream.clips,
        "players": [
            {
                "name": motion.name,
                "source": motion.source,
                "events": dict(motion.events),
                "height_m": motion.body.height_m,
                "mass_kg": motion.body.mass_kg,
            }
            for motion in stream.players
        ],
    }
    arrays: dict[str, Any] = {f"qpos_{player}": motion.qpos for player, motion in zip(PLAYERS, stream.players)}
    arrays |= {f"contacts_{player}": motion.contacts for player, motion in zip(PLAYERS, stream.players)}
    try:
        with atomic_path(path) as temporary, temporary.open("wb") as target:
            np.savez_compressed(target, header=np.array(json.dumps(header)), **arrays)
    except OSError as error:
        raise MotionFileError(path, f"cannot be written ({error.strerror})") from None
    return path


def read_stream(path: str | Path) -> DuelStream:
    """Read a stream written by `save_stream`.

    Args:
        path: the .npz file.

    Raises:
        MotionFileError: missing, not a two-person stream, another schema version or another model.
    """
    path = Path(path)
    if not path.is_file():
        raise MotionFileError(path, "no such file")
    try:
        with zipfile.ZipFile(path) as parts:
            unpacked = sum(part.file_size for part in parts.infolist())
        if unpacked > MAX_BYTES:
            raise MotionFileError(path, f"{unpacked // 10**6} MB unpacked; valid: up to {MAX_BYTES // 10**6} MB")
        with np.load(path, allow_pickle=False) as archive:
            header = _header(path, archive)
            first, second = (_player(header, archive, number) for number in range(2))
        return DuelStream((first, second), tuple(header["seams"]), tuple(header["clips"]), header["name"])
    except MotionFileError:
        raise
    except SimprepError as error:
        raise MotionFileError(path, str(error)) from None
    except UNREADABLE as error:
        raise MotionFileError(path, f"not a readable two-person stream ({type(error).__name__}: {error})") from None


def _header(path: Path, archive: Any) -> dict[str, Any]:
    header = json.loads(str(archive["header"])) if "header" in archive else None
    schema = header.get("schema") if isinstance(header, dict) else None
    if not isinstance(header, dict) or schema != SCHEMA:
        hint = ": one person; `simprep duel import A B` joins two" if str(schema).startswith("simprep.motion/") else ""
        raise MotionFileError(path, f"schema {schema!r}{hint}; a two-person stream has {SCHEMA!r}")
    model = (header["model"], header["model_version"])
    if model != (MODEL_NAME, MODEL_VERSION) or tuple(header["hinges"]) != HINGES:
        raise MotionFileError(
            path, f"poses of model {model[0]!r} version {model[1]!r}; valid: {MODEL_NAME!r} version {MODEL_VERSION}"
        )
    return header


def _player(header: dict[str, Any], archive: Any, number: int) -> Motion:
    about = header["players"][number]
    return Motion(
        qpos=archive[f"qpos_{PLAYERS[number]}"],
        fps=header["fps"],
        contacts=archive[f"contacts_{PLAYERS[number]}"],
        events={str(key): int(value) for key, value in about["events"].items()},
        name=about["name"],
        source=about["source"],
        body=Body(about["height_m"], about["mass_kg"]),
    )
