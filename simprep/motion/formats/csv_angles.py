"""CSV of joint angles with a header: `time_s`, `root_x_m` ..., `root_qw` ..., and joints as `left_knee_flexion_rad`.

A joint's unit is part of its name: `_rad` or `_deg`, or `[rad]`, `(deg)` after it. A file without it is refused.
"""

import re
from io import StringIO
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import MotionFileError
from simprep.motion.formats.angles import (
    character_of_columns,
    motion_of_angles,
    rate_of_times,
    sized_character,
    unusual_size,
)
from simprep.motion.formats.bvh_write import lost
from simprep.motion.formats.format import Format, Glimpse, ReadMotion, ReadOptions
from simprep.motion.formats.numbers import Decimals, decimal_notes, number
from simprep.motion.formats.skeleton import MAX_VALUES
from simprep.motion.formats.text import MAX_LINE, Comments, lines_of, open_text
from simprep.motion.motion import Motion

ROOT = ("root_x_m", "root_y_m", "root_z_m", "root_qw", "root_qx", "root_qy", "root_qz")
"""Columns of the root: position, z up, and quaternion."""
UNITS = {"rad": 1.0, "deg": np.pi / 180, "degrees": np.pi / 180, "radians": 1.0}
_UNIT = re.compile(r"^(?P<name>.+?)(?:_|\s*[\[(]\s*|\s+)(?P<unit>rad|deg|degrees|radians)\s*[\])]?$", re.IGNORECASE)
_DELIMITERS = (",", ";", "\t")


def read_csv_angles(path: Path, options: ReadOptions) -> ReadMotion:
    """Read a CSV of joint angles.

    Raises:
        MotionFileError: malformed, with the line; no joint, or a joint without a unit.
    """
    header, table, notes = _table(path)
    names = {column: match["name"].strip() for column in header if (match := _UNIT.match(column))}
    character = character_of_columns(path, [names.get(column, column) for column in header], options.character)
    bare = [column for column in header if column in character.joints]
    if bare:
        raise MotionFileError(
            path, f"column {bare[0]!r} does not state its unit; valid: {bare[0]}_rad or {bare[0]}_deg", 1
        )
    columns = dict(zip(header, table.T))
    angles = {
        name: columns[column] * UNITS[_UNIT.match(column)["unit"].lower()]  # type: ignore[index]
        for column, name in names.items()
        if name in character.joints
    }
    given = [name for name in ROOT if name in columns]
    if given and len(given) < len(ROOT):
        missing = [name for name in ROOT if name not in columns]
        raise MotionFileError(path, f"the root lacks {', '.join(missing)}; valid: all of {', '.join(ROOT)}", 1)
    times = next((columns[name] for name in ("time_s", "time", "t") if name in columns), None)
    size = [float(columns[name][0]) if name in columns else None for name in ("height_m", "mass_kg")]
    known = {
        *ROOT,
        "time_s",
        "time",
        "t",
        "height_m",
        "mass_kg",
        *(column for column, name in names.items() if name in angles),
    }
    unused = [column for column in header if column not in known]
    if unused:
        notes.append(f"{len(unused)} columns are not used: {', '.join(unused[:8])}")
    return motion_of_angles(
        path, "CSV", rate_of_times(path, times, options), np.stack([columns[name] for name in ROOT], axis=1) if given else None,
        angles, sized_character(path, character, *size), notes,
    )  # fmt: skip


def _table(path: Path) -> tuple[list[str], FloatArray, list[str]]:
    """Names of the columns, values (T, C), and notes."""
    comments = Comments()
    with open_text(path, "a CSV of joint angles") as stream:
        header: list[str] = []
        delimiter = ","
        line = 0
        for at, text in lines_of(path, stream):
            line = at
            if bare := comments.strip_whole(text).strip():
                delimiter = max(_DELIMITERS, key=bare.count)
                header = [field.strip().strip('"') for field in bare.split(delimiter)]
                break
        double = next((name for name in header if header.count(name) > 1), None)
        if double is not None:
            raise MotionFileError(path, f"two columns called {double[:40]!r}", line)
        rest = stream.read()
    if not rest.strip():
        raise MotionFileError(path, "no frames", line)
    try:
        table = np.loadtxt(StringIO(rest), delimiter=delimiter, ndmin=2, dtype=np.float64, comments="#")
    except ValueError:
        table = None
    notes = comments.notes()
    if table is None or table.shape[1] != len(header) or not np.isfinite(table).all():
        table, commas = _slowly(path, rest, line, len(header), delimiter)
        notes += decimal_notes(commas)
    if not len(table):
        raise MotionFileError(path, "no frames", line)
    if table.size > MAX_VALUES:
        raise MotionFileError(path, f"{table.size} numbers; valid: up to {MAX_VALUES}")
    return header, table, notes


def _slowly(path: Path, text: str, first: int, width: int, delimiter: str) -> tuple[FloatArray, int]:
    """Values line by line, for the error's sake and for decimal commas; also how many of these there were."""
    decimals = Decimals(path)
    rows = []
    for line, whole in enumerate(text.split("\n"), first + 1):
        bare = whole.strip()
        if not bare or bare.startswith("#"):
            continue
        fields = [field.strip() for field in whole.strip("\r\n")[:MAX_LINE].split(delimiter)]
        if len(fields) != width:
            raise MotionFileError(path, f"{len(fields)} values in a frame; valid: {width}", line)
        read = decimals.number if delimiter != "," else lambda token, what, line: number(path, token, what, line)
        rows.append([read(field, "a value", line) for field in fields])
    return np.array(rows).reshape(-1, width), decimals.check()


def write_csv_angles(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write time, root and joint angles [rad] under a header; returns what is lost."""
    size = unusual_size(motion.character)
    header = ["time_s", *ROOT, *(f"{joint}_rad" for joint in motion.character.joints), *size]
    constant = np.tile(list(size.values()), (len(motion), 1))
    columns = np.concatenate([motion.times[:, None], motion.qpos, constant], axis=1)
    text = StringIO()
    np.savetxt(text, columns, fmt="%.9f", delimiter=",")
    path.write_text(",".join(header) + "\n" + text.getvalue(), encoding="utf-8", newline="\n")
    return lost(motion)


def _recognise(seen: Glimpse) -> str | None:
    first = next((line for text in seen.text.splitlines() if (line := Comments().strip_whole(text).strip())), "")
    if not seen.text or first.startswith(("{", ":", "<")):
        return None
    fields = [field.strip().strip('"') for field in first.split(max(_DELIMITERS, key=first.count))]
    stated = [match["unit"].lower() for field in fields if (match := _UNIT.match(field))]
    if len(stated) < 3 and not {"root_x_m", "root_qw"} <= set(fields):
        return None
    units = " and ".join(sorted({"radians" if UNITS[unit] == 1.0 else "degrees" for unit in stated}))
    return f"CSV of {len(stated)} joint angles in {units}"


FORMAT = Format("csv", "CSV of joint angles", (".csv",), _recognise, read_csv_angles, write_csv_angles)
