"""Pickles without their danger: arrays, numbers, text and plain containers are read; everything else is refused.

A pickle is a program. Names that it asks for are looked up in `_MEANINGS` only, whose functions build arrays and
nothing else; arrays of objects, which hold further pickles, are refused. `joblib` puts the bytes of an array behind the
place in the pickle where it is mentioned; it may pack the whole file.
"""

import bz2
import gzip
import io
import lzma
import math
import pickle
import zlib
from collections import OrderedDict
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from simprep.archive import MAX_BYTES, MAX_PACKING, SMALL_BYTES, UNREADABLE
from simprep.errors import MotionFileError

_PACKED: dict[bytes, Callable[[io.BufferedReader], Any]] = {
    b"\x1f\x8b": lambda stream: gzip.GzipFile(fileobj=stream),
    b"BZ": bz2.BZ2File,
    b"\xfd7zXZ": lzma.LZMAFile,
    b"]\x00": lzma.LZMAFile,
}


class _RefusedError(Exception):
    """The pickle asks for something that is not plain data."""


class _ArrayType:
    """Stands for `numpy.ndarray`, which a pickle only mentions."""


class _JoblibArray:
    """What joblib says of an array whose bytes follow."""


def _empty(subtype: object, shape: object, code: object) -> Any:
    if subtype is not _ArrayType or shape != (0,):
        raise _RefusedError("an array that is no plain array")
    return np.empty(0, dtype=np.int8)


def _dtype(code: object, *flags: object) -> Any:
    if not isinstance(code, str | bytes):
        raise _RefusedError(f"an array type {str(code)[:40]!r}")
    return _plain(np.dtype(code.decode("ascii") if isinstance(code, bytes) else code))


def _plain(dtype: Any) -> Any:
    if not isinstance(dtype, np.dtype) or dtype.hasobject or dtype.names:
        raise _RefusedError("an array of objects")
    return dtype


def _scalar(dtype: Any, data: Any) -> Any:
    return np.frombuffer(_bytes(data), dtype=_plain(dtype), count=1)[0]


def _from_buffer(data: Any, dtype: Any, shape: Any, order: Any) -> Any:
    return np.frombuffer(_bytes(data), dtype=_plain(dtype)).reshape(shape, order=order).copy()


def _bytes(data: Any) -> Any:
    return data.encode("latin1") if isinstance(data, str) else data


def _encode(text: Any, encoding: Any = "latin1") -> bytes:
    if not isinstance(text, str) or encoding not in ("latin1", "latin-1"):
        raise _RefusedError(f"text in the encoding {str(encoding)[:40]!r}")
    return text.encode("latin1")


_MEANINGS: dict[tuple[str, str], Any] = {
    **{(f"numpy.{core}.multiarray", "_reconstruct"): _empty for core in ("core", "_core")},
    **{(f"numpy.{core}.multiarray", "scalar"): _scalar for core in ("core", "_core")},
    **{(f"numpy.{core}.numeric", "_frombuffer"): _from_buffer for core in ("core", "_core")},
    ("numpy", "ndarray"): _ArrayType,
    ("numpy", "dtype"): _dtype,
    ("_codecs", "encode"): _encode,
    ("collections", "OrderedDict"): OrderedDict,
    ("joblib.numpy_pickle", "NumpyArrayWrapper"): _JoblibArray,
}


_PythonUnpickler: Any = pickle._Unpickler  # type: ignore[attr-defined]
"""The one in Python, since one in C has no operations to change."""


class _Unpickler(_PythonUnpickler):  # type: ignore[misc]
    """Reads plain data and arrays."""

    dispatch: ClassVar[dict[int, Any]] = dict(_PythonUnpickler.dispatch)

    def __init__(self, stream: Any) -> None:
        super().__init__(stream, encoding="latin1")
        self.stream = stream

    def find_class(self, module: str, name: str) -> Any:
        """The meaning of a name, if it has one here."""
        if (module, name) not in _MEANINGS:
            raise _RefusedError(f"{module[:60]}.{name[:60]}")
        return _MEANINGS[module, name]

    def persistent_load(self, pid: object) -> Any:
        """Nothing outside the file is read."""
        raise _RefusedError("data outside of the file")

    def load_build(self) -> None:
        """Give an object its state: arrays, their types, and what joblib says of an array."""
        state = self.stack.pop()
        target = self.stack[-1]
        if isinstance(target, np.ndarray) and isinstance(state, tuple) and len(state) == 5:
            _plain(state[2])
            target.__setstate__((*state[:4], _bytes(state[4])))
        elif isinstance(target, np.dtype) and isinstance(state, tuple) and state[2:5] == (None, None, None):
            target.__setstate__(state)  # type: ignore[attr-defined]
        elif isinstance(target, _JoblibArray) and isinstance(state, dict):
            self.stack[-1] = self._joblib_array(state)
        else:
            raise _RefusedError(f"the state of a {type(target).__name__}")

    dispatch[pickle.BUILD[0]] = load_build

    def _joblib_array(self, state: dict[str, Any]) -> Any:
        dtype, shape = _plain(state["dtype"]), tuple(int(length) for length in state["shape"])
        if state.get("numpy_array_alignment_bytes") is not None:
            self.stream.read(self.stream.read(1)[0])
        size = math.prod(shape) * dtype.itemsize
        if not 0 <= size <= MAX_BYTES:
            raise ValueError(f"an array of shape {shape}")
        data = self.stream.read(size)
        return np.frombuffer(data, dtype=dtype).reshape(shape, order=state.get("order", "C")).copy()


def read_pickle(path: Path) -> Any:
    """Content of a pickle or joblib file, packed or not.

    Raises:
        MotionFileError: missing, damaged, too large, or anything in it that is not plain data, such as a call that would
            run code.
    """
    try:
        content = _unpacked(path)
        return _Unpickler(io.BytesIO(content)).load()
    except _RefusedError as error:
        raise MotionFileError(
            path,
            f"a pickle that asks for {error}, which could run code: refused; valid: arrays, numbers, text, lists and dicts",
        ) from None
    except FileNotFoundError:
        raise MotionFileError(path, "no such file") from None
    except (*UNREADABLE, pickle.UnpicklingError, AssertionError, RecursionError) as error:
        raise MotionFileError(path, f"not a readable pickle ({type(error).__name__}: {str(error)[:200]})") from None


def _unpacked(path: Path) -> bytes:
    most = min(MAX_BYTES, max(SMALL_BYTES, MAX_PACKING * path.stat().st_size))
    with path.open("rb") as stream:
        head = stream.read(6)
        stream.seek(0)
        opener = next((opener for mark, opener in _PACKED.items() if head.startswith(mark)), None)
        if opener is None and head[:1] == b"x" and int.from_bytes(head[:2]) % 31 == 0:
            content = zlib.decompressobj().decompress(stream.read(most), most + 1)
        else:
            content = (opener(stream) if opener else stream).read(most + 1)
    if len(content) > most:
        raise MotionFileError(path, f"more than {most // 10**6} MB unpacked")
    return content
