"""Cuts as a text file that a person can edit: one cut a line, with its time and doubts as comments."""

from pathlib import Path

import numpy as np

from simprep.duel.labels.segmentation import Cuts, Segmentation
from simprep.duel.stream.stream import PLAYERS, DuelStream
from simprep.errors import MotionFileError
from simprep.files import atomic_path, find_file

SCHEMA = "simprep.cuts/1"


def save_cuts(segmentation: Segmentation | Cuts, stream: DuelStream, path: str | Path) -> Path:
    """Write cuts as text, atomically, and return the path; comments describe the stream and doubts.

    Raises:
        MotionFileError: it cannot be written.
    """
    path = Path(path)
    cuts = segmentation if isinstance(segmentation, Cuts) else segmentation.cuts
    doubts: dict[tuple[int, int], list[str]] = {}
    for who, frame, reason in () if isinstance(segmentation, Cuts) else segmentation.suspicious:
        doubts.setdefault((who, frame), []).append(reason)
    lines = [
        f"# {SCHEMA}",
        f"# stream {stream.name}: {len(stream)} frames at {stream.fps:g} per second, {len(stream.clips)} clips",
        "# One cut a line: player, frame. Remove or add lines; text after # is ignored; clips begin and end by themselves.",
    ]
    for player, frames in zip(PLAYERS, cuts.frames):
        number = PLAYERS.index(player)
        for frame in frames:
            why = "; ".join(doubts.get((number, int(frame)), []))
            lines.append(f"{player} {frame}  # {frame / stream.fps:.3f} s" + (f", check: {why}" if why else ""))
    try:
        with atomic_path(path) as temporary:
            temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise MotionFileError(path, f"cannot be written ({error.strerror})") from None
    return path


def read_cuts(path: str | Path, stream: DuelStream) -> Cuts:
    """Read cuts of a stream of two that a person may have edited, from the text file or a folder with one.

    Raises:
        MotionFileError: missing, or a line that is no cut of this stream; the message names the line.
        MotionError: more than two people.
    """
    stream.check_pair()
    path = find_file(path, "file of cuts", ".txt")
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        raise MotionFileError(path, "no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise MotionFileError(path, f"not a readable text file ({error})") from None
    frames: tuple[dict[int, int], dict[int, int]] = ({}, {})
    starts = set(stream.bounds[:, 0].tolist())
    for number, line in enumerate(lines, start=1):
        words = line.partition("#")[0].split()
        if not words:
            continue
        if len(words) != 2 or words[0] not in PLAYERS or not words[1].isdecimal():
            raise MotionFileError(path, f"{line.strip()!r} is no cut; valid: A or B, then a frame number", number)
        player, frame = PLAYERS.index(words[0]), int(words[1])
        if not 0 < frame < len(stream) - 1:
            raise MotionFileError(path, f"frame {frame}; valid: 1 to {len(stream) - 2}", number)
        if frame in starts:
            raise MotionFileError(path, f"frame {frame} begins a clip, which is a cut by itself", number)
        if frame in frames[player]:
            raise MotionFileError(
                path, f"player {words[0]} is cut at frame {frame} already in line {frames[player][frame]}", number
            )
        frames[player][frame] = number
    a, b = (np.array(sorted(cut), dtype=np.int64) for cut in frames)
    return Cuts((a, b), stream.bounds.astype(np.int64))
