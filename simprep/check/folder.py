"""Check a folder of motion files, one record per file: a check that is stopped goes on where it was."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from simprep.check.finding import FAIL
from simprep.errors import MotionFileError, SimprepError
from simprep.motion.formats.registry import read_suffixes
from simprep.report.results import save_json

SCHEMA = "simprep.check/1"
KEEP, DROP = "keep", "drop"
RECORDS = "check-motion"
"""Usual name of the folder of records."""


def motion_files(folder: Path) -> tuple[Path, ...]:
    """Motion files of a folder and the folders in it, by name; an .asf only belongs to one.

    Raises:
        MotionFileError: there is none.
    """
    suffixes = {suffix for suffix in read_suffixes() if suffix != ".asf"}
    found = sorted(
        path
        for path in folder.rglob("*")
        if path.suffix.lower() in suffixes and path.is_file() and RECORDS not in path.relative_to(folder).parts
    )
    if not found:
        raise MotionFileError(folder, f"a directory without a motion file; valid: {', '.join(sorted(suffixes))}")
    return tuple(found)


def check_folder(
    folder: Path, records: Path, settings: Mapping[str, Any], check: Callable[[Path], dict[str, Any]]
) -> Iterator[tuple[Path, dict[str, Any], bool]]:
    """Check every motion file; gives its path, its record, and whether the record was there already.

    A record is used again if file and settings are the same. It is written whole or not at all. A file that cannot be
    read is dropped, with the reason.

    Args:
        folder: of the motions.
        records: folder of the records.
        settings: all that the result depends on besides the file, in JSON's types.
        check: gives the content of a record, with `verdict`.
    """
    for path in motion_files(folder):
        relative = path.relative_to(folder)
        record_path = records / relative.with_name(relative.name + ".json")
        identity = {"schema": SCHEMA, "file": relative.as_posix(), "sha256": _digest(path), "settings": dict(settings)}
        known = _read(record_path)
        if known is not None and {key: known.get(key) for key in identity} == json.loads(json.dumps(identity)):
            yield path, known, True
            continue
        try:
            content = check(path)
        except SimprepError as error:
            content = {"verdict": FAIL, "raised": ["unreadable"], "error": str(error)}
        record = {**identity, **content, "decision": DROP if content["verdict"] == FAIL else KEEP}
        save_json(record_path, record)
        yield path, record, False


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _read(path: Path) -> dict[str, Any] | None:
    """A record; None if there is none, or it is damaged."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) else None
