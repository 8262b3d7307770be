"""Reading text and blocks of numbers fast, with the line of the first wrong one."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from simprep.errors import MotionFileError


def read_text(path: Path, what: str) -> str:
    """The file as text.

    Args:
        path: the file.
        what: the kind of file expected, for messages.

    Raises:
        MotionFileError: unreadable, empty or binary.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MotionFileError(path, f"cannot be read ({error.strerror})") from None
    if not content.strip():
        raise MotionFileError(path, f"empty; valid: {what}")
    if b"\0" in content[:4096]:
        raise MotionFileError(path, f"a binary file; valid: {what}")
    return content.decode("utf-8", errors="replace")


def number(path: Path, token: str, what: str, line: int | None) -> float:
    """One finite number.

    Raises:
        MotionFileError: not a number, NaN or infinite.
    """
    try:
        value = float(token)
    except ValueError:
        raise MotionFileError(path, f"{what} is {token[:40]!r}; valid: a number", line) from None
    if not np.isfinite(value):
        raise MotionFileError(path, f"{what} is {token[:40]!r}; valid: a finite number", line)
    return value


def numbers(path: Path, lines: list[str], first_line: int, columns: int) -> NDArray[np.float64]:
    """Rows of numbers.

    Args:
        path: the file, for messages.
        lines: one row each; blank lines are passed over.
        first_line: line number of the first.
        columns: numbers in every row.

    Returns:
        (rows, columns).

    Raises:
        MotionFileError: naming the first line with the wrong count, or with a value that is no finite number.
    """
    rows = [(row, text) for row, text in enumerate(lines) if text.strip()]
    for row, text in rows:
        if len(text.split()) != columns:
            raise MotionFileError(
                path, f"{len(text.split())} values in a frame; valid: {columns}, one for each channel", first_line + row
            )
    tokens = " ".join(text for _, text in rows).split()
    try:
        values = np.array(tokens, dtype=np.float64).reshape(-1, columns)
    except ValueError:
        for row, text in rows:
            for token in text.split():
                number(path, token, "a channel value", first_line + row)
        raise
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(bad):
        raise MotionFileError(path, "NaN or infinity among the channel values", first_line + rows[bad[0]][0])
    return values
