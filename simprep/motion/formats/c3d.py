"""C3D files (c3d.org): points over time, binary; through `ezc3d`, which is an extra."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from simprep.errors import MissingExtraError, MotionFileError
from simprep.motion.formats.bvh_write import lost
from simprep.motion.formats.format import Format, Glimpse, ReadMotion, ReadOptions
from simprep.motion.formats.points import PointFile, clip_of_points, points_of_motion
from simprep.motion.formats.skeleton import SourceClip, check_size, tidy_fps
from simprep.motion.motion import Motion

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Metres per unit of the parameter POINT:UNITS."""
KEY = 0x50
"""Second byte of every C3D file."""
MM = 1000.0
LONGEST = 65535
"""Most frames of a file: the header has 16 bits for their number."""


def read_c3d(path: Path) -> PointFile:
    """Read the points of a C3D file. Positions that the file marks as unseen become NaN.

    Raises:
        MissingExtraError: `ezc3d` is not installed.
        MotionFileError: malformed, without points, or in units that are not stated.
    """
    file = _ezc3d().c3d
    try:
        content = file(str(path))
        point = content["parameters"]["POINT"]
        labels = [name for key in ("LABELS", "LABELS2", "LABELS3") if key in point for name in point[key]["value"]]
        fps = float(np.ravel(point["RATE"]["value"])[0])
        unit = str(np.ravel(point.get("UNITS", {"value": ["mm"]})["value"])[0]).strip().lower()
        values = np.asarray(content["data"]["points"], dtype=np.float64)  # (4, J, T)
        residual = np.asarray(content["data"]["meta_points"]["residuals"], dtype=np.float64)  # (1, J, T)
    except MotionFileError:
        raise
    except Exception as error:  # the library raises what its C++ does
        raise MotionFileError(path, f"not a readable C3D file ({str(error)[:200]})") from None
    if values.size == 0:
        raise MotionFileError(path, "a C3D file without points")
    if unit not in UNITS:
        raise MotionFileError(path, f"points in {unit[:40]!r}; valid: {', '.join(UNITS)}")
    check_size(path, values.shape[2], values.shape[1])
    positions = values[:3].transpose(2, 1, 0).copy()
    unseen = residual[0].T < 0
    positions[unseen] = np.nan
    names = [str(name).strip() or f"point {number}" for number, name in enumerate(labels, 1)]
    names = (names + [f"point {number}" for number in range(len(names) + 1, values.shape[1] + 1)])[: values.shape[1]]
    notes = [f"{int(unseen.sum())} positions are marked as not seen"] if unseen.any() else []
    return PointFile(path, "C3D", tuple(names), positions, tidy_fps(fps), UNITS[unit], np.eye(3), tuple(notes))


def write_c3d(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write the points of a motion's segments, z up, in millimetres (single precision); returns what is lost.

    Raises:
        MissingExtraError: `ezc3d` is not installed.
        MotionFileError: more frames than a C3D file holds.
    """
    if len(motion) > LONGEST:
        raise MotionFileError(path, f"{len(motion)} frames; valid: up to {LONGEST} in a C3D file")
    content = _ezc3d().c3d()
    names, positions = points_of_motion(motion)
    point = content["parameters"]["POINT"]
    point["RATE"]["value"] = [motion.fps]
    point["LABELS"]["value"] = list(names)
    point["UNITS"]["value"] = ["mm"]
    content.add_parameter("POINT", "X_SCREEN", ["+X"])
    content.add_parameter("POINT", "Y_SCREEN", ["+Z"])
    homogeneous = np.ones((4, len(names), len(motion)))
    homogeneous[:3] = positions.transpose(2, 1, 0) * MM
    content["data"]["points"] = homogeneous
    with tempfile.TemporaryDirectory() as folder:  # the library adds the extension where it lacks
        file = Path(folder) / "a.c3d"
        content.write(str(file))
        path.write_bytes(file.read_bytes())
    return lost(motion)


def _ezc3d() -> Any:
    try:
        import ezc3d
    except ImportError:
        raise MissingExtraError("reading and writing C3D files", "c3d") from None
    return ezc3d


def _recognise(seen: Glimpse) -> str | None:
    # first byte: the block of the parameters, which follows the header at once or nearly so
    return "C3D, points over time" if len(seen.raw) >= 512 and seen.raw[1] == KEY and seen.raw[0] < 32 else None


def _read(path: Path, options: ReadOptions) -> SourceClip | ReadMotion:
    return clip_of_points(read_c3d(path), options)


FORMAT = Format("c3d", "C3D", (".c3d",), _recognise, _read, write_c3d)
