"""simprep's own motion file: one .npz with a schema version and the identity of the model its poses belong to."""

import json
import zipfile
import zlib
from pathlib import Path

import numpy as np

from simprep.errors import MotionFileError, SimprepError
from simprep.files import atomic_path
from simprep.humanoid import HINGES, MODEL_NAME, MODEL_VERSION, Body
from simprep.motion.motion import Motion

SCHEMA = "simprep.motion/1"
MAX_BYTES = 300_000_000
"""Largest motion read: about 14 hours at 30 frames/s."""


def save_motion(motion: Motion, path: str | Path) -> Path:
    """Write a motion to .npz, atomically (a temporary file, then a rename).

    Args:
        motion: what to write.
        path: the file; `.npz` is appended if missing.

    Returns:
        The path written.
    """
    path = Path(path)
    if path.suffix != ".npz":
        path = path.with_name(path.name + ".npz")
    header = {
        "schema": SCHEMA,
        "model": MODEL_NAME,
        "model_version": MODEL_VERSION,
        "hinges": HINGES,
        "fps": motion.fps,
        "events": dict(motion.events),
        "name": motion.name,
        "source": motion.source,
        "loop": motion.loop,
        "height_m": motion.body.height_m,
        "mass_kg": motion.body.mass_kg,
    }
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, header=np.array(json.dumps(header)), qpos=motion.qpos, contacts=motion.contacts)
    return path


def read_motion(path: str | Path) -> Motion:
    """Read a motion written by `save_motion`.

    Args:
        path: the .npz file.

    Raises:
        MotionFileError: missing, not ours, another schema version or another model.
    """
    path = Path(path)
    try:
        with zipfile.ZipFile(path) as parts:
            unpacked = sum(part.file_size for part in parts.infolist())
        if unpacked > MAX_BYTES:
            raise MotionFileError(path, f"{unpacked // 10**6} MB unpacked; valid: up to {MAX_BYTES // 10**6} MB")
        with np.load(path, allow_pickle=False) as archive:
            if "header" not in archive:
                raise MotionFileError(path, f"not a simprep motion (no 'header' entry; schema {SCHEMA} expected)")
            header = json.loads(str(archive["header"]))
            if not isinstance(header, dict) or header.get("schema") != SCHEMA:
                given = header.get("schema") if isinstance(header, dict) else header
                raise MotionFileError(path, f"schema {given!r}; this version reads {SCHEMA!r}")
            model = (header.get("model"), header.get("model_version"))
            if model != (MODEL_NAME, MODEL_VERSION) or tuple(header.get("hinges", ())) != HINGES:
                raise MotionFileError(
                    path,
                    f"poses of model {model[0]!r} version {model[1]!r}; valid: {MODEL_NAME!r} version {MODEL_VERSION}",
                )
            return Motion(
                qpos=archive["qpos"],
                fps=header["fps"],
                contacts=archive["contacts"],
                events={str(key): int(value) for key, value in header["events"].items()},
                name=header["name"],
                source=header["source"],
                loop=bool(header["loop"]),
                body=Body(header["height_m"], header["mass_kg"]),
            )
    except MotionFileError:
        raise
    except FileNotFoundError:
        raise MotionFileError(path, "no such file") from None
    except SimprepError as error:
        raise MotionFileError(path, str(error)) from None
    except (
        OSError,
        ValueError,
        KeyError,
        TypeError,
        AttributeError,
        EOFError,
        MemoryError,
        zipfile.BadZipFile,
        zlib.error,
    ) as error:
        raise MotionFileError(path, f"not a readable .npz motion ({type(error).__name__}: {error})") from None
