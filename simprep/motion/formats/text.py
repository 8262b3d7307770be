"""Text files line by line: encoding, comments, length of lines."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from simprep.errors import MotionFileError

MAX_FILE_BYTES = 100_000_000
MAX_LINE = 100_000
MAX_NAME = 200
"""Most characters of a name; longer ones are damage and would fill the message."""
HEAD_BYTES = 4096
"""Length of the beginning by which a file's encoding and format are recognised."""
_MARKS = (
    # first, because the mark of UTF-32 begins with that of UTF-16
    (b"\xff\xfe\0\0", "utf-32"), (b"\0\0\xfe\xff", "utf-32"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"),
    (b"\xef\xbb\xbf", "utf-8-sig"),
)  # fmt: skip
_COMMENT = re.compile(r"(?:^|(?<=\s))(?:#|//|;).*")


def open_text(path: Path, what: str) -> TextIO:
    """Open a text file for reading: UTF-8, UTF-16 or UTF-32 with a byte order mark, or plainly UTF-16.

    Args:
        path: the file.
        what: the kind of file expected, for messages.

    Raises:
        MotionFileError: unreadable, empty, larger than `MAX_FILE_BYTES`, or binary.
    """
    try:
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES)
        if not head.strip():
            raise MotionFileError(path, f"empty; valid: {what}")
        if path.stat().st_size > MAX_FILE_BYTES:
            raise MotionFileError(path, f"larger than {MAX_FILE_BYTES // 10**6} MB")
        encoding = encoding_of(head)
        if encoding is None:
            raise MotionFileError(path, f"a binary file; valid: {what}")
        return path.open(encoding=encoding, errors="replace")
    except OSError as error:
        raise MotionFileError(path, f"cannot be read ({error.strerror})") from None


def encoding_of(head: bytes) -> str | None:
    """Encoding of a text by its first bytes; None if it is no text."""
    for mark, encoding in _MARKS:
        if head.startswith(mark):
            return encoding
    if b"\0" not in head:
        return "utf-8"
    # numbers and Latin letters in UTF-16: one byte of each pair is zero, the other never
    for encoding, zeros, letters in (("utf-16-le", head[1::2], head[0::2]), ("utf-16-be", head[0::2], head[1::2])):
        if zeros.count(0) >= 0.9 * len(zeros) and letters.count(0) == 0:
            return encoding
    return None


def lines_of(path: Path, stream: TextIO, first: int = 1) -> Iterator[tuple[int, str]]:
    """Line numbers, counted from `first`, and lines, one at a time.

    Raises:
        MotionFileError: a line longer than any of a motion file.
    """
    line = first
    while text := stream.readline(MAX_LINE):
        if len(text) >= MAX_LINE:
            raise MotionFileError(path, f"a line of {MAX_LINE} characters or more", line)
        yield line, text
        line += 1


@dataclass
class Comments:
    """Removes and counts comments: from `#`, `//` or `;` to the end of the line.

    Attributes:
        count: comments removed so far.
    """

    count: int = 0

    def strip(self, text: str) -> str:
        """A line without its comment, which begins the line or follows a space."""
        if "#" not in text and "/" not in text and ";" not in text:
            return text
        bare, found = _COMMENT.subn("", text)
        self.count += found
        return bare

    def strip_whole(self, text: str) -> str:
        """A line, empty if all of it is a comment; for lines in which a name may hold the sign."""
        return self.strip(text) if text.lstrip().startswith(("#", "//", ";")) else text

    def notes(self) -> list[str]:
        """What to report; empty if there were no comments."""
        return [f"comments skipped: {self.count}"] if self.count else []
