"""Files of ours with arrays: one .npz with a JSON header that names its schema, written whole, checked when read."""

import json
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from simprep.errors import MotionFileError, SimprepError
from simprep.files import atomic_path

MAX_BYTES = 300_000_000
"""Largest content read where nothing else is said [bytes, unpacked]: a motion of about 14 hours at 30 frames/s."""
UNREADABLE = (
    OSError, ValueError, LookupError, TypeError, AttributeError, EOFError, MemoryError, np.linalg.LinAlgError,
    zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def write_archive(path: str | Path, header: Mapping[str, Any], arrays: Mapping[str, ArrayLike]) -> Path:
    """Write a header and arrays to .npz, atomically.

    Args:
        path: the file; `.npz` is appended if missing.
        header: in JSON's types, with `schema`.
        arrays: by name; not `header`.

    Returns:
        The path written.
    """
    path = Path(path)
    if path.suffix != ".npz":
        path = path.with_name(path.name + ".npz")
    parts: dict[str, Any] = {"header": np.array(json.dumps(header)), **arrays}
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **parts)
    return path


@contextmanager
def open_archive(
    path: str | Path,
    what: str,
    schema: str,
    hints: Mapping[str, str] = MappingProxyType({}),
    max_bytes: int = MAX_BYTES,
) -> Iterator[tuple[dict[str, Any], Any]]:
    """Header and arrays of a file written by `write_archive`; whatever goes wrong inside the block names the file.

    Args:
        path: the file.
        what: what it should be, for the message: `duel model`.
        schema: the schema that is read.
        hints: what to say of files of other kinds, by the beginning of their schema.
        max_bytes: largest content read [bytes, unpacked].

    Yields:
        the header, and the archive (a mapping of names to arrays).

    Raises:
        MotionFileError: missing, too large, not a file of ours, another schema version, damaged, or refused in the block.
    """
    path = Path(path)
    try:
        with zipfile.ZipFile(path) as members:
            unpacked = sum(member.file_size for member in members.infolist())
        if unpacked > max_bytes:
            raise MotionFileError(path, f"{unpacked // 10**6} MB unpacked; valid: up to {max_bytes // 10**6} MB")
        with np.load(path, allow_pickle=False) as archive:
            if "header" not in archive:
                raise MotionFileError(path, f"not a {what} (no 'header' entry; schema {schema} expected)")
            header = json.loads(str(archive["header"]))
            if not isinstance(header, dict) or header.get("schema") != schema:
                given = header.get("schema") if isinstance(header, dict) else header
                hint = next((f": {text}" for kind, text in hints.items() if str(given).startswith(kind)), "")
                raise MotionFileError(path, f"schema {given!r}{hint}; this version reads {schema!r}")
            yield header, archive
    except MotionFileError:
        raise
    except FileNotFoundError:
        raise MotionFileError(path, "no such file") from None
    except SimprepError as error:
        raise MotionFileError(path, str(error)) from None
    except UNREADABLE as error:
        raise MotionFileError(path, f"not a readable {what} ({type(error).__name__}: {error})") from None
