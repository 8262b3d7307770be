"""The store of a sweep: records that are only ever added, one line each, in files that are never written again.

A record is a line of JSON with a checksum of its own. A file of its own for each record would be simpler, but a hundred
thousand files take minutes to read and list; a database would need its own recovery, and locks that shared folders lack. A
process that writes begins a new file, hands each record to the system in one call, and asks that it be on disk twice a
second. So a killed process loses nothing that it has written, and a cut of power half a second; what is left of a line is known by its
checksum, is not read, and its case is run again. Stores are merged by copying their files into one folder under other
numbers.
"""

import json
import os
import re
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from time import monotonic
from typing import IO, Any, NamedTuple

from simprep.errors import SettingError
from simprep.report.results import jsonable

SEGMENT = "records-{:06d}.jsonl"
SEGMENT_BYTES = 64_000_000
"""A file that has grown so large is followed by another [bytes]."""
SYNC_S = 0.5
"""Longest time after which records are on disk, not only with the system [s]."""
_LINE = re.compile(
    rb'\{"crc32":"([0-9a-f]{8})",("id":"([0-9a-f]{20})","attempt":(\d{1,9}),"end":"(\w+)",.*\})', re.DOTALL
)


class Entry(NamedTuple):
    """What is known of a record without reading it.

    Attributes:
        attempt: its number, from 0.
        end: how the case ended.
        file: where the record is, and from which byte to which.
    """

    attempt: int
    end: str
    file: Path
    first: int
    after: int


@dataclass
class Index:
    """What a store holds.

    Attributes:
        entries: by the case's name, the last attempt.
        damaged: lines that are not whole, by file; their cases count as not run.
    """

    entries: dict[str, Entry] = field(default_factory=dict)
    damaged: dict[str, int] = field(default_factory=dict)


def record_line(case_id: str, attempt: int, content: Mapping[str, Any]) -> bytes:
    """A record as a line of its store.

    Args:
        case_id: name of the case.
        attempt: number of the attempt, from 0.
        content: `end` and all else, in JSON's types.
    """
    head = {"id": case_id, "attempt": attempt, "end": content["end"]}
    body = json.dumps({**head, **jsonable(content)}, allow_nan=False, separators=(",", ":")).encode()[1:]
    return b'{"crc32":"%08x",%b\n' % (zlib.crc32(body), body)


class SweepStore:
    """Records in a folder.

    Args:
        folder: made when something is written.
    """

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)

    def segments(self) -> list[Path]:
        """Files with records, in the order of their making."""
        return sorted(self.folder.glob(SEGMENT.format(0).replace("000000", "*")))

    def entries(self, damaged: Callable[[Path], None] = lambda path: None) -> Iterator[tuple[str, Entry]]:
        """Every whole record, in the order of writing: name of its case, and entry.

        Args:
            damaged: told the file of every line that is not whole.
        """
        for path in self.segments():
            after = 0
            for line in path.read_bytes().splitlines(keepends=True):
                first, after = after, after + len(line)
                match = _LINE.fullmatch(line, 0, len(line) - 1) if line.endswith(b"\n") else None
                if match is None or zlib.crc32(match[2]) != int(match[1], 16):
                    damaged(path)
                    continue
                yield match[3].decode(), Entry(int(match[4]), match[5].decode(), path, first, after)

    def index(self) -> Index:
        """What is recorded: of several attempts the last, and of copies of that the first."""
        index = Index()

        def damaged(path: Path) -> None:
            index.damaged[path.name] = index.damaged.get(path.name, 0) + 1

        for name, entry in self.entries(damaged):
            known = index.entries.get(name)
            if known is None or entry.attempt > known.attempt:
                index.entries[name] = entry
        return index

    def last_lines(self, wanted: Callable[[str], bool] = lambda name: True) -> Iterator[bytes]:
        """Records in JSON, one of each case (see `index`), in the order of writing.

        Args:
            wanted: whether the case of a name is.
        """
        entries = [entry for name, entry in self.index().entries.items() if wanted(name)]
        entries.sort(key=lambda entry: (entry.file, entry.first))
        for path, of_file in groupby(entries, key=lambda entry: entry.file):
            content = path.read_bytes()
            for entry in of_file:
                yield content[entry.first : entry.after]

    def records(self, wanted: Callable[[str], bool] = lambda name: True) -> Iterator[dict[str, Any]]:
        """As `last_lines`, as mappings."""
        for line in self.last_lines(wanted):
            yield json.loads(line)

    @contextmanager
    def writer(self) -> Iterator["RecordWriter"]:
        """Add records; the only writer of the store meanwhile.

        Raises:
            SettingError: another process is writing.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / "lock").open("ab") as lock:
            _lock(lock, self.folder)
            writer = RecordWriter(self)
            try:
                yield writer
            finally:
                writer.close()


class RecordWriter:
    """Adds records to a store; made by `SweepStore.writer`."""

    def __init__(self, store: SweepStore) -> None:
        self._store = store
        self._file: int | None = None
        self._size, self._synced = 0, monotonic()

    def append(self, case_id: str, attempt: int, content: Mapping[str, Any]) -> None:
        """Add a record, whole; arguments as of `record_line`."""
        line = record_line(case_id, attempt, content)
        if self._file is None or self._size > SEGMENT_BYTES:
            self.close()
            self._file = self._new_file()
        while line:  # one call writes all of it, unless the disk is full
            written = os.write(self._file, line)
            line, self._size = line[written:], self._size + written
        if monotonic() - self._synced > SYNC_S:
            self.sync()

    def sync(self) -> None:
        """Return when all records are on disk."""
        if self._file is not None:
            os.fsync(self._file)
        self._synced = monotonic()

    def close(self) -> None:
        """End the file."""
        if self._file is not None:
            self.sync()
            os.close(self._file)
            self._file, self._size = None, 0

    def _new_file(self) -> int:
        there = self._store.segments()
        number = 1 + (int(there[-1].stem.rpartition("-")[2]) if there else 0)
        path = self._store.folder / SEGMENT.format(number)
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        if hasattr(os, "O_DIRECTORY"):  # the file's name, too, has to be on disk
            folder = os.open(self._store.folder, os.O_DIRECTORY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
        return file


def _lock(stream: IO[bytes], folder: Path) -> None:
    """Take the lock of a folder, which the system gives back when the process ends, however it ends."""
    try:
        import fcntl
    except ImportError:  # not on this system: two sweeps at once would only run cases twice
        return
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise SettingError(f"another sweep is writing to {folder}; valid: wait for it, or another folder") from None
    except OSError:  # a shared folder without locks
        return
