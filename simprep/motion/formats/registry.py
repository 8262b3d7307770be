"""The table of motion file formats. Everything that asks which formats there are asks here.

A format is a `Format` value beside its reader or writer; it is listed in `FORMATS`. Files are recognised by content;
the extension decides only between formats that both recognise a file, and whose message a file gets that none does.
"""

import zipfile
from collections.abc import Iterable
from pathlib import Path

from simprep.archive import open_arrays
from simprep.errors import MotionFileError, UnknownNameError
from simprep.motion.formats import (
    acclaim,
    bvh,
    c3d,
    csv_angles,
    deepmimic,
    interhuman,
    opensim,
    own,
    points_npz,
    robot,
    smpl,
    trc,
)
from simprep.motion.formats.foreign import npz_kind
from simprep.motion.formats.format import Format, Glimpse
from simprep.motion.formats.text import HEAD_BYTES, encoding_of

FORMATS: tuple[Format, ...] = (
    *(
        module.FORMAT
        for module in (own, bvh, acclaim, deepmimic, smpl, interhuman, trc, c3d, opensim, csv_angles, points_npz)
    ),
    *robot.FORMATS,
)
"""All formats. Of several that recognise a file, and share its extension or its lack, the first one wins."""


def glimpse(path: Path) -> Glimpse:
    """Look at the beginning of a file, and at the names of the arrays if it is an .npz.

    Raises:
        MotionFileError: missing or unreadable.
    """
    try:
        with path.open("rb") as stream:
            raw = stream.read(HEAD_BYTES)
    except FileNotFoundError:
        raise MotionFileError(path, "no such file") from None
    except OSError as error:
        raise MotionFileError(path, f"cannot be read ({error.strerror})") from None
    encoding = encoding_of(raw)
    text = raw.decode(encoding, errors="replace") if encoding else ""
    return Glimpse(path, raw, text.lstrip("\ufeff"), _entries(path) if raw.startswith(b"PK") else frozenset())


def _entries(path: Path) -> frozenset[str]:
    try:
        with zipfile.ZipFile(path) as members:
            return frozenset(name.removesuffix(".npy") for name in members.namelist())
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile):
        return frozenset()


def recognise(path: Path) -> tuple[Format, str]:
    """The format of a file that can be read, and what was recognised, in words for the report.

    Raises:
        MotionFileError: missing, or of no format that is read. A known kind that is not read is named.
    """
    seen = glimpse(path)
    found = [(form, what) for form in FORMATS if form.read is not None and (what := form.recognise(seen))]
    if found:
        form, what = next(((form, what) for form, what in found if seen.suffix in form.suffixes), found[0])
        named = (
            "" if seen.suffix in form.suffixes else f" (by its content, though it is called {seen.suffix or path.name})"
        )
        return form, what + named
    if seen.entries and (kind := npz_kind(seen.entries)):
        with open_arrays(path, "motion file"):  # which refuses a damaged one
            raise MotionFileError(path, kind)
    # not what its extension says: the reader of that format says what is wrong
    for form in FORMATS:
        if form.read is not None and seen.suffix in form.suffixes:
            return form, form.title
    raise MotionFileError(path, f"unknown extension {path.suffix!r}, and unknown content; valid: {readable()}")


def format_to_write(path: Path, name: str | None = None) -> Format:
    """The format to write a file in.

    Args:
        path: the file to be written.
        name: name of the format; None for the first that its extension stands for.

    Raises:
        UnknownNameError: no such format, or none with that extension, that is written.
    """
    written = [form for form in FORMATS if form.write is not None]
    if name is not None:
        for form in written:
            if form.name == name:
                return form
        raise UnknownNameError("format to write", name, [form.name for form in written])
    for form in written:
        if path.suffix.lower() in form.suffixes:
            return form
    choices = [f"{form.suffixes[0]} ({form.title})" for form in written]
    raise UnknownNameError("extension of a file to write", path.suffix or path.name, choices)


def read_suffixes() -> tuple[str, ...]:
    """Extensions of all formats that are read, each once, in the order of `FORMATS`."""
    return tuple(dict.fromkeys(suffix for form in FORMATS if form.read is not None for suffix in form.suffixes))


def readable() -> str:
    """The formats that are read with their extensions, for messages."""
    return _listed(form for form in FORMATS if form.read is not None)


def _listed(forms: Iterable[Format]) -> str:
    return ", ".join(f"{' or '.join(form.suffixes)} ({form.title})" for form in forms)
