"""simprep's motion file: one .npz with a schema version and the identity of the character."""

from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from simprep.archive import open_archive, write_archive, write_parts
from simprep.arrays import FloatArray
from simprep.characters import character_header, character_of_header
from simprep.errors import MotionError
from simprep.motion.formats.foreign import npz_kind
from simprep.motion.formats.numbers import LARGEST
from simprep.motion.formats.skeleton import MAX_VALUES
from simprep.motion.motion import Motion

SCHEMA = "simprep.motion/1"


def save_motion(motion: Motion, path: str | Path) -> Path:
    """Write a motion to .npz, atomically; returns the path written.

    Args:
        motion: what to write.
        path: the file; `.npz` is appended if missing.
    """
    return write_archive(path, _header(motion), {"qpos": motion.qpos, "contacts": motion.contacts})


def write_motion(motion: Motion, stream: IO[bytes]) -> None:
    """Write a motion to a stream, as `save_motion` does to a file."""
    write_parts(stream, _header(motion), {"qpos": motion.qpos, "contacts": motion.contacts})


def _header(motion: Motion) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        **character_header(motion.character),
        "fps": motion.fps,
        "events": dict(motion.events),
        "name": motion.name,
        "source": motion.source,
        "loop": motion.loop,
    }


def read_motion(path: str | Path) -> Motion:
    """Read a motion written by `save_motion`.

    Args:
        path: the .npz file, or a folder with one.

    Raises:
        MotionFileError: missing, damaged, no motion file, another schema version or another model. A known foreign kind
            of file is named.
    """
    with open_archive(path, "simprep motion", SCHEMA, foreign=npz_kind) as (header, archive):
        character = character_of_header(header)
        return Motion(
            qpos=read_poses(archive, "qpos"),
            fps=header["fps"],
            contacts=archive["contacts"],
            events={str(key): int(value) for key, value in header["events"].items()},
            name=str(header["name"]),
            source=str(header["source"]),
            loop=bool(header["loop"]),
            character=character,
        )


def read_poses(archive: Mapping[str, NDArray[Any]], name: str) -> FloatArray:
    """Poses (T, nq) of a file, by the name of their entry, before `Motion` checks them.

    Raises:
        KeyError: no such entry.
        MotionError: no floats, too many, or some beyond `LARGEST`.
    """
    poses = archive[name]
    if poses.dtype.kind != "f" or poses.size > MAX_VALUES:
        raise MotionError(f"{name} holds {poses.size} {poses.dtype}; valid: up to {MAX_VALUES} floats")
    far = np.isfinite(poses) & (np.abs(poses) > LARGEST)
    if far.any():
        raise MotionError(f"{name} holds {poses[far][0]:g}; valid: numbers up to {LARGEST:g}")
    return poses
