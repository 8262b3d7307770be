"""simprep's files with arrays: one .npz with a JSON header that names its schema. Written whole, checked when read."""

import json
import lzma
import math
import sys
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import IO, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from simprep.errors import MotionFileError, SimprepError
from simprep.files import atomic_path, find_file

MAX_BYTES = 300_000_000
"""Largest content read by default [bytes, unpacked]: a motion of about 14 hours at 30 frames/s."""
SMALL_BYTES = 30_000_000
"""Content of this size is unpacked however small the file is [bytes]."""
MAX_PACKING = 100
"""Larger content is at most this many times the size of its file. Recorded numbers pack by 2, simprep's by up to 20."""
MAX_HEADER_BYTES = 16_000_000
UNREADABLE = (
    OSError, ValueError, LookupError, TypeError, AttributeError, EOFError, MemoryError, ArithmeticError, RuntimeError,
    np.linalg.LinAlgError, zipfile.BadZipFile, zlib.error, lzma.LZMAError, tokenize.TokenError,
)  # fmt: skip


def write_archive(path: str | Path, header: Mapping[str, Any], arrays: Mapping[str, ArrayLike]) -> Path:
    """Write a header and arrays to .npz, atomically; returns the path written.

    Args:
        path: the file; `.npz` is appended if missing.
        header: in JSON's types, with `schema`.
        arrays: by name; not `header`.
    """
    path = Path(path)
    if path.suffix != ".npz":
        path = path.with_name(path.name + ".npz")
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        write_parts(stream, header, arrays)
    return path


def write_parts(stream: IO[bytes], header: Mapping[str, Any], arrays: Mapping[str, ArrayLike]) -> None:
    """Write a header and arrays to a stream; arguments as for `write_archive`."""
    parts: dict[str, Any] = {"header": np.array(json.dumps(header)), **arrays}
    np.savez_compressed(stream, **parts)


@contextmanager
def open_archive(
    path: str | Path,
    what: str,
    schema: str,
    hints: Mapping[str, str] = MappingProxyType({}),
    foreign: Callable[[Collection[str]], str | None] = lambda _: None,
    max_bytes: int = MAX_BYTES,
) -> Iterator[tuple[dict[str, Any], Any]]:
    """Header and arrays (by name) of a file written by `write_archive`. An error inside the block names the file.

    Args:
        path: the file, or a folder with one such file.
        what: what it should be, for the message: `duel model`.
        schema: the schema that is read.
        hints: what to say of files of other kinds, by the beginning of their schema.
        foreign: what to say of a file without a header, by the names of its entries; None for nothing.
        max_bytes: largest content read [bytes, unpacked].

    Raises:
        MotionFileError: as `find_archive` and `open_arrays`; no file of simprep, or another schema version.
    """
    path = find_archive(path, what, schema)
    with open_arrays(path, what, max_bytes) as archive:
        if "header" not in archive:
            kind = foreign(archive.files) or f"not a {what} (no 'header' entry; schema {schema} expected)"
            raise MotionFileError(path, kind)
        header = json.loads("".join(texts(archive["header"])))
        if not isinstance(header, dict) or header.get("schema") != schema:
            given = header.get("schema") if isinstance(header, dict) else header
            hint = next((f": {text}" for kind, text in hints.items() if str(given).startswith(kind)), "")
            raise MotionFileError(path, f"schema {str(given)[:100]!r}{hint}; this version reads {schema!r}")
        yield header, archive


def find_archive(path: str | Path, what: str, schema: str, usual: str = "") -> Path:
    """The file that a path means, which names a file or the folder that it is in.

    Args:
        path: a file, returned as it is, there or not; or a folder with one file of that schema, of any version.
        what: what it should be, for the message: `duel model`.
        schema: the schema that will be read.
        usual: as for `find_file`.

    Raises:
        MotionFileError: as `find_file`.
    """
    kind = schema.partition("/")[0]
    return find_file(path, what, ".npz", lambda file: (schema_of(file) or "").partition("/")[0] == kind, usual)


def schema_of(path: Path) -> str | None:
    """Schema of an .npz file of simprep; None for anything else."""
    try:
        with open_arrays(path, "file of simprep", sys.maxsize) as archive:
            header = json.loads("".join(texts(archive["header"]))) if "header" in archive else None
    except MotionFileError:
        return None
    return str(header.get("schema")) if isinstance(header, dict) else None


@contextmanager
def open_arrays(path: str | Path, what: str, max_bytes: int = MAX_BYTES) -> Iterator[Any]:
    """Arrays (by name) of any .npz, checked before memory is taken. An error inside the block names the file.

    Args:
        path: the file.
        what: what it should be, for the message.
        max_bytes: largest content read [bytes, unpacked].

    Raises:
        MotionFileError: missing, too large, damaged, or entries that declare more than they hold.
    """
    path = Path(path)
    try:
        with zipfile.ZipFile(path) as members:
            _check_members(path, members, max_bytes)
        with np.load(path, allow_pickle=False) as archive:
            yield archive
    except MotionFileError:
        raise
    except FileNotFoundError:
        raise MotionFileError(path, "no such file") from None
    except SimprepError as error:
        raise MotionFileError(path, str(error)) from None
    except UNREADABLE as error:
        raise MotionFileError(path, f"not a readable {what} ({type(error).__name__}: {str(error)[:300]})") from None


def _check_members(path: Path, members: zipfile.ZipFile, max_bytes: int) -> None:
    """Refuse content that takes far more memory than the file: packed zeros, shapes without data."""
    unpacked = sum(member.file_size for member in members.infolist())
    most = min(max_bytes, max(SMALL_BYTES, MAX_PACKING * path.stat().st_size))
    if unpacked > most:
        raise MotionFileError(path, f"{unpacked // 10**6} MB unpacked; valid: up to {most // 10**6} MB for its size")
    for member in members.infolist():
        name = member.filename.removesuffix(".npy")
        if name == "header" and member.file_size > MAX_HEADER_BYTES:
            raise MotionFileError(
                path, f"a header of {member.file_size // 10**6} MB; valid: {MAX_HEADER_BYTES // 10**6}"
            )
        if name != member.filename:
            with members.open(member) as stream:
                shape, itemsize = _declared(stream)
            if min(shape, default=0) < 0 or math.prod(shape) * max(itemsize, 1) > member.file_size:
                raise MotionFileError(
                    path,
                    f"entry {name[:40]!r} declares shape {str(shape)[:60]} and holds {member.file_size} bytes: damaged",
                )


def _declared(stream: IO[bytes]) -> tuple[tuple[int, ...], int]:
    """Shape of the array that a .npy file declares, and bytes of one item."""
    read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    version = np.lib.format.read_magic(stream)
    if version not in read:
        raise ValueError(f"npy format {version}")
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # numpy warns of headers that Python 2 wrote or that are damaged
        try:
            shape, _, dtype = read[version](stream)
        except Warning as warning:
            raise ValueError(str(warning)) from None
    return shape, dtype.itemsize


def texts(array: NDArray[Any]) -> tuple[str, ...]:
    """Strings of an array (N,) or () of a file.

    Raises:
        ValueError: numbers, or invalid characters, on which Python's own string functions fail.
    """
    if array.dtype.kind != "U":
        raise ValueError(f"{array.dtype} where text is expected")
    codes = np.frombuffer(array.astype(array.dtype.newbyteorder("=")).tobytes(), dtype=np.uint32)
    if codes.size and codes.max() > sys.maxunicode:
        raise ValueError("text with characters that do not exist")
    return tuple(str(text) for text in np.atleast_1d(array))
