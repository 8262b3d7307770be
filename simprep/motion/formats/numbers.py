"""Numbers of text files, one by one or in blocks, with the line of the first wrong one and with decimal commas."""

import re
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import MotionFileError
from simprep.motion.formats.text import Comments

LARGEST = 1e8
"""Numbers beyond this in a motion file are damage, whatever the unit."""
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")


def number(path: Path, token: str, what: str, line: int | None) -> float:
    """One finite number.

    Raises:
        MotionFileError: not a number, NaN, infinite or beyond `LARGEST`.
    """
    try:
        if "_" in token or not token.isascii():  # Python reads them as numbers, files do not mean them so
            raise ValueError
        value = float(token)
    except ValueError:
        raise MotionFileError(path, f"{what} is {token[:40]!r}; valid: a number", line) from None
    if not np.isfinite(value) or abs(value) > LARGEST:
        raise MotionFileError(path, f"{what} is {token[:40]!r}; valid: a finite number up to {LARGEST:g}", line)
    return value


class Decimals:
    """Numbers of one part of a file in which the comma may be the decimal sign, as in `12,5`.

    A comma can also separate values (`1,2`) or thousands (`1,234`). It is a decimal sign where every number with a
    comma has a single one between digits, the part has no decimal point, and not all of them look like thousands.

    Args:
        path: the file, for messages.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.count = 0
        self._comma: tuple[str, int | None] | None = None
        self._point: str | None = None
        self._certain = False

    def number(self, token: str, what: str, line: int | None) -> float:
        """One finite number, with a decimal point or a decimal comma.

        Raises:
            MotionFileError: as for the function `number`.
        """
        if "," in token and _DECIMAL_COMMA.fullmatch(token):
            self.count += 1
            self._comma = self._comma or (token, line)
            self._certain = self._certain or not _THOUSANDS.fullmatch(token)
            return number(self.path, token.replace(",", "."), what, line)
        self.look_for_point((token,))
        return number(self.path, token, what, line)

    def look_for_point(self, tokens: tuple[str, ...] | list[str]) -> None:
        """Notice a decimal point in numbers read elsewhere."""
        if self._point is None:
            self._point = next((token for token in tokens if "." in token), None)

    def check(self) -> int:
        """How many numbers had a decimal comma.

        Raises:
            MotionFileError: commas that may or may not be decimal signs.
        """
        if self._comma is None:
            return 0
        token, line = self._comma
        if self._point is not None:
            raise MotionFileError(
                self.path,
                f"{token!r} beside {self._point[:40]!r}: whether the comma is a decimal sign cannot be told; valid: "
                "decimal points",
                line,
            )
        if not self._certain:
            raise MotionFileError(
                self.path, f"{token!r} can be a decimal comma or a thousand; valid: decimal points", line
            )
        return self.count


def decimal_notes(count: int) -> list[str]:
    """What to report of decimal commas; empty if there were none."""
    return [f"decimal commas, as in 12,5, in {count} numbers: read as decimal points"] if count else []


def numbers(
    path: Path, block: str, first_line: int, columns: int, rows: int, comments: Comments
) -> tuple[FloatArray, int, list[str]]:
    """Numbers of a block (rows, columns), how many had a decimal comma, and notes for the report.

    Args:
        path: the file, for messages.
        block: the text, one row in a line; comments in it are skipped.
        first_line: line number of the first.
        columns: numbers in every row.
        rows: how many rows are declared; the block may have one more or one less.
        comments: counts the comments.

    Raises:
        MotionFileError: another number of rows, or a line with a wrong count or a value that is no finite number.
    """
    notes: list[str] = []
    commas = 0
    values = _parse(block)
    if values is None and re.search(r"[#;/]", block):
        block = "\n".join(comments.strip(text) for text in _each_line(block))
        values = _parse(block)
    if values is None and "," in block:
        commas = _decimal_commas(path, block, first_line, columns)
        block = block.replace(",", ".")
        values = _parse(block)
    if values is None or values.size != rows * columns:
        present = _count_rows(path, block, first_line, columns, values is None)
        if values is None or abs(present - rows) != 1 or not present:
            raise MotionFileError(path, f"{rows} frames declared, {present} present")
        notes.append(f"{rows} frames declared, {present} present: all {present} taken")
    good = np.abs(values) <= LARGEST
    if not good.all():
        bad = int(np.argmin(good))
        line = _line_of_row(block, first_line, bad // columns)
        raise MotionFileError(
            path, f"a channel value is {values[bad]:g}; valid: a finite number up to {LARGEST:g}", line
        )
    return values.reshape(-1, columns), commas, notes


def _parse(block: str) -> FloatArray | None:
    """All numbers of a block; None if anything else is in it."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(block, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


def _decimal_commas(path: Path, block: str, first_line: int, columns: int) -> int:
    """How many numbers of a block have a decimal comma.

    Raises:
        MotionFileError: commas between the values, or commas that may be either.
    """
    decimals = Decimals(path)
    for index, text in enumerate(_each_line(block)):
        tokens = text.split()
        if "," not in text:
            decimals.look_for_point(tokens if "." in text else [])
            continue
        if len(text.replace(",", " ").split()) == columns:
            raise MotionFileError(
                path, f"values parted by commas ({tokens[0][:40]!r}); valid: parted by spaces", first_line + index
            )
        for token in tokens:
            decimals.number(token, "a channel value", first_line + index)
    return decimals.check()


def _count_rows(path: Path, block: str, first_line: int, columns: int, strange: bool) -> int:
    """Number of rows of a block; `strange` if something in it is no number.

    Raises:
        MotionFileError: naming the first line without `columns` numbers.
    """
    if strange and (found := re.search(r"[^0-9eE+\-.\s]", block)):  # fast where the file is large
        start, end = block.rfind("\n", 0, found.start()) + 1, block.find("\n", found.end())
        for token in block[start : end if end >= 0 else None].split():
            number(path, token, "a channel value", first_line + block.count("\n", 0, found.start()))
    present = 0
    for index, text in enumerate(_each_line(block)):
        tokens = text.split()
        if not tokens:
            continue
        if strange or len(tokens) != columns:
            for token in tokens:
                number(path, token, "a channel value", first_line + index)
        if len(tokens) != columns:
            raise MotionFileError(path, f"{len(tokens)} values in a frame; valid: {columns}", first_line + index)
        present += 1
    return present


def _each_line(block: str) -> Iterator[str]:
    """Lines of a block, without a second copy of it."""
    start = 0
    while start < len(block):
        end = block.find("\n", start)
        end = len(block) if end < 0 else end
        yield block[start:end]
        start = end + 1


def _line_of_row(block: str, first_line: int, row: int) -> int:
    """Line number of a row; blank lines are no rows."""
    rows = -1
    for index, text in enumerate(_each_line(block)):
        rows += bool(text.strip())
        if rows == row:
            return first_line + index
    return first_line
