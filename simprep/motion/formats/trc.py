"""TRC files (Motion Analysis; OpenSim reads them too): points over time as text in columns."""

from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np

from simprep.arrays import FloatArray
from simprep.errors import MotionFileError
from simprep.motion.formats.bvh_write import lost
from simprep.motion.formats.format import Format, Glimpse, ReadMotion, ReadOptions
from simprep.motion.formats.numbers import LARGEST, number
from simprep.motion.formats.points import PointFile, clip_of_points, points_of_motion
from simprep.motion.formats.skeleton import SourceClip, check_size, tidy_fps
from simprep.motion.formats.text import MAX_NAME, lines_of, open_text
from simprep.motion.motion import Motion

UNITS = {"m": 1.0, "meters": 1.0, "cm": 0.01, "mm": 0.001, "inches": 0.0254, "in": 0.0254}
"""Metres per unit of the header's entry `Units`."""
OPENSIM_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""From OpenSim's axes (x forward, y up, z right) to ours."""
MAX_POINTS = 1000
MM = 1000.0


def read_trc(path: Path) -> PointFile:
    """Read the points of a TRC file. The format does not state which axis is up.

    Raises:
        MotionFileError: malformed, with the line.
    """
    with open_text(path, "a TRC file") as stream:
        lines = lines_of(path, stream)
        header = {}
        names: list[str] = []
        line = 0
        for line, text in lines:
            fields = text.rstrip("\r\n").split("\t") if "\t" in text else text.split()
            key = fields[0].strip() if fields else ""
            if line == 1 and not key.startswith("PathFileType"):
                raise MotionFileError(path, f"begins with {key[:40]!r}; valid: PathFileType", line)
            if key == "DataRate":
                line, values = next(lines, (line, ""))
                header = dict(zip([field.strip() for field in fields], values.split()))
            elif key.startswith("Frame#"):
                names = [name.strip() for name in fields[2:] if name.strip()]
                break
        missing = [key for key in ("DataRate", "NumFrames", "NumMarkers", "Units") if key not in header]
        if missing or not names:
            raise MotionFileError(path, f"no {', '.join(missing) or 'line Frame#'}; valid: a TRC file", line or None)
        long = next((name for name in names if len(name) > MAX_NAME), None)
        if long or len(names) > MAX_POINTS or len(set(names)) < len(names):
            double = next((name for name in names if names.count(name) > 1), "")
            raise MotionFileError(
                path,
                f"{len(names)} points{f', two of them called {double[:40]!r}' if double else ''}; valid: up to "
                f"{MAX_POINTS} of different names",
                line,
            )
        fps = number(path, header["DataRate"], "DataRate", None)
        unit = UNITS.get(header["Units"].lower())
        if unit is None:
            raise MotionFileError(path, f"Units {header['Units'][:40]!r}; valid: {', '.join(UNITS)}")
        declared = number(path, header["NumFrames"], "NumFrames", None)
        check_size(path, int(min(max(declared, 0), 1e8)), len(names))
        next(lines, None)  # X1 Y1 Z1 ...
        positions, first = _rows(path, list(lines), len(names))
    notes = [] if len(positions) == declared else [f"{declared:g} frames declared, {len(positions)} present"]
    if abs(first) > 1e-9:
        notes.append(f"the time begins at {first:g} s")
    return PointFile(path, "TRC", tuple(names), positions, tidy_fps(fps), unit, None, tuple(notes))


def _rows(path: Path, lines: list[tuple[int, str]], count: int) -> tuple[FloatArray, float]:
    """Positions (T, count, 3), NaN where a field is empty, and the time of the first frame [s]."""
    width = 2 + 3 * count
    rows = [(line, text) for line, text in lines if text.strip()]
    if rows and rows[0][1].split()[0].upper().startswith("X1"):
        rows = rows[1:]
    out = np.full((len(rows), width), np.nan)
    for row, (line, text) in zip(out, rows):
        fields = text.rstrip("\r\n").split("\t") if "\t" in text else text.split()
        if len(fields) < width:
            fields += [""] * (width - len(fields)) if "\t" in text else []
        if len(fields) < width or any(field.strip() for field in fields[width:]):
            raise MotionFileError(path, f"{len(fields)} values in a frame; valid: {width}", line)
        try:
            row[:] = [float(field) if field.strip() else np.nan for field in fields[:width]]
        except ValueError:
            for field in fields[:width]:
                if field.strip():
                    number(path, field.strip(), "a position", line)
        if (np.abs(row[np.isfinite(row)]) > LARGEST).any() or np.isinf(row).any():
            raise MotionFileError(path, f"a number beyond {LARGEST:g}", line)
    if not len(out):
        raise MotionFileError(path, "no frames")
    first = out[0, 1]
    return out[:, 2:].reshape(len(out), count, 3), 0.0 if np.isnan(first) else float(first)


def write_trc(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write the points of a motion's segments in OpenSim's axes (y up) and millimetres; returns what is lost."""
    names, positions = points_of_motion(motion)
    positions = positions @ OPENSIM_AXES * MM
    count, fps = len(names), motion.fps
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{motion.name}.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{fps:.9g}\t{fps:.9g}\t{len(motion)}\t{count}\tmm\t{fps:.9g}\t1\t{len(motion)}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"X{n}\tY{n}\tZ{n}" for n in range(1, count + 1)),
        "",
    ]
    frames = np.arange(len(motion))
    columns = np.concatenate([frames[:, None] + 1, frames[:, None] / fps, positions.reshape(len(motion), -1)], axis=1)
    text = StringIO()
    np.savetxt(text, columns, fmt=["%d", "%.6f"] + ["%.6f"] * (3 * count), delimiter="\t")
    path.write_text("\n".join(head) + "\n" + text.getvalue(), encoding="utf-8", newline="\n")
    return lost(motion)


def _recognise(seen: Glimpse) -> str | None:
    return "TRC, points over time" if seen.text.startswith("PathFileType") else None


def _read(path: Path, options: ReadOptions) -> SourceClip | ReadMotion:
    # the axes of the points that we write; those of others are found
    return clip_of_points(replace(read_trc(path), axes=OPENSIM_AXES), options)


FORMAT = Format("trc", "TRC", (".trc",), _recognise, _read, write_trc)
