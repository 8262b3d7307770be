"""Reading text line by line and blocks of numbers fast, with the line of the first wrong one."""

import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from simprep.errors import MotionFileError

MAX_LINE = 100_000
LARGEST = 1e8
"""Numbers beyond this in a motion file are damage, whatever the unit."""


def open_text(path: Path, what: str) -> TextIO:
    """Open a text file for reading.

    Args:
        path: the file.
        what: the kind of file expected, for messages.

    Raises:
        MotionFileError: unreadable, empty or binary.
    """
    try:
        with path.open("rb") as stream:
            head = stream.read(4096)
        if not head.strip():
            raise MotionFileError(path, f"empty; valid: {what}")
        if b"\0" in head:
            raise MotionFileError(path, f"a binary file; valid: {what}")
        return path.open(encoding="utf-8", errors="replace")
    except OSError as error:
        raise MotionFileError(path, f"cannot be read ({error.strerror})") from None


def lines_of(path: Path, stream: TextIO, first: int = 1) -> Iterator[tuple[int, str]]:
    """Line numbers, counted from `first`, and lines; nothing is kept in memory.

    Raises:
        MotionFileError: a line longer than any of a motion file.
    """
    line = first
    while text := stream.readline(MAX_LINE):
        if len(text) >= MAX_LINE:
            raise MotionFileError(path, f"a line of {MAX_LINE} characters or more", line)
        yield line, text
        line += 1


def number(path: Path, token: str, what: str, line: int | None) -> float:
    """One finite number.

    Raises:
        MotionFileError: not a number, NaN, infinite or beyond `LARGEST`.
    """
    try:
        value = float(token)
    except ValueError:
        raise MotionFileError(path, f"{what} is {token[:40]!r}; valid: a number", line) from None
    if not np.isfinite(value) or abs(value) > LARGEST:
        raise MotionFileError(path, f"{what} is {token[:40]!r}; valid: a finite number up to {LARGEST:g}", line)
    return value


def numbers(path: Path, block: str, first_line: int, columns: int, rows: int) -> NDArray[np.float64]:
    """A block of rows of numbers.

    Args:
        path: the file, for messages.
        block: the text, one row in a line.
        first_line: line number of the first.
        columns: numbers in every row.
        rows: how many rows there should be.

    Returns:
        (rows, columns).

    Raises:
        MotionFileError: another number of rows; or naming the first line with the wrong count, or with a value that is
            no number (or NaN, infinite, beyond `LARGEST`).
    """
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(block, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):  # something that is no number
            values = np.empty(0)
    if values.size == rows * columns:
        good = np.abs(values) <= LARGEST
        if good.all():
            return values.reshape(rows, columns)
        bad = int(np.argmin(good))
        line = _line_of_row(block, first_line, bad // columns)
        raise MotionFileError(
            path, f"a channel value is {values[bad]:g}; valid: a finite number up to {LARGEST:g}", line
        )
    strange = re.search(r"[^0-9eE+\-.\s]", block)  # fast where the file is large
    if strange:
        start, end = block.rfind("\n", 0, strange.start()) + 1, block.find("\n", strange.end())
        for token in block[start : end if end >= 0 else None].split():
            number(path, token, "a channel value", first_line + block.count("\n", 0, strange.start()))
    present = 0
    for index, text in enumerate(_each_line(block)):
        tokens = text.split()
        if not tokens:
            continue
        if not values.size or len(tokens) != columns:
            for token in tokens:
                number(path, token, "a channel value", first_line + index)
        if len(tokens) != columns:
            raise MotionFileError(path, f"{len(tokens)} values in a frame; valid: {columns}", first_line + index)
        present += 1
    raise MotionFileError(path, f"{rows} frames declared, {present} present")


def _each_line(block: str) -> Iterator[str]:
    """Lines of a block one by one, without a second copy of it."""
    start = 0
    while start < len(block):
        end = block.find("\n", start)
        end = len(block) if end < 0 else end
        yield block[start:end]
        start = end + 1


def _line_of_row(block: str, first_line: int, row: int) -> int:
    """Line number of a row, blank lines not being rows."""
    rows = -1
    for index, text in enumerate(_each_line(block)):
        rows += bool(text.strip())
        if rows == row:
            return first_line + index
    return first_line
