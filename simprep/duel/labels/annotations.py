"""Labels of single actions as a CSV that a person fills in.

Columns: segment (A0, A1, ..., B0, ...), clip, player, start, end (frames), then one per aspect. Player, start and end
tell the action; the segment number is checked against them, since it shifts when cuts are edited.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simprep.arrays import IntArray
from simprep.duel.labels.labels import ASPECTS, LEARNED_ASPECTS, QUALIFIERS, check_qualifier
from simprep.duel.stream.stream import PLAYERS
from simprep.errors import MotionFileError, SimprepError
from simprep.files import atomic_path, find_file

PLACE_COLUMNS = ("segment", "clip", "player", "start", "end")


@dataclass(frozen=True)
class Annotations:
    """Which actions a person has labelled, and how.

    Attributes:
        rows: (N,) rows of the action table (`Cuts.table`), rising.
        qualifiers: (N, 5) index of the qualifier of every learned aspect.
    """

    rows: IntArray
    qualifiers: IntArray


def segment_names(table: IntArray) -> list[str]:
    """Names of actions (S, 4) as from `Cuts.table`: player and number within the player's actions."""
    counts = [0, 0]
    names = []
    for player in table[:, 0]:
        names.append(f"{PLAYERS[player]}{counts[player]}")
        counts[player] += 1
    return names


def save_annotations(
    path: str | Path,
    table: IntArray,
    rows: IntArray,
    qualifiers: IntArray | None,
    aspects: Sequence[str] = LEARNED_ASPECTS,
) -> Path:
    """Write actions as CSV, atomically, and return the path.

    Args:
        path: the CSV file.
        table: (S, 4) all actions.
        rows: (N,) which of them, in the order to be written.
        qualifiers: (N, aspects) indices, or None for empty cells that a person fills in.
        aspects: the columns.

    Raises:
        MotionFileError: it cannot be written.
    """
    path, names = Path(path), segment_names(table)
    try:
        with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow([*PLACE_COLUMNS, *aspects])
            for number, row in enumerate(rows):
                player, start, end, clip = table[row]
                chosen = [""] * len(aspects)
                if qualifiers is not None:
                    chosen = [QUALIFIERS[aspect][index] for aspect, index in zip(aspects, qualifiers[number])]
                writer.writerow([names[row], clip, PLAYERS[player], start, end, *chosen])
    except OSError as error:
        raise MotionFileError(path, f"cannot be written ({error.strerror})") from None
    return path


def read_annotations(path: str | Path, table: IntArray) -> Annotations:
    """Read a person's labels.

    Args:
        path: the CSV file, or a folder with one. Columns `react` and `move` are not read, since they follow from rules.
        table: (S, 4) all actions of the stream.

    Raises:
        MotionFileError: missing file or column, an action that is not in the stream or comes twice, an unknown or empty
            qualifier; the message names the line.
    """
    path = find_file(path, "table of annotations", ".csv")
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream)
            header = tuple(reader.fieldnames or ())
            lines = [(reader.line_num, row) for row in reader]
    except FileNotFoundError:
        raise MotionFileError(path, "no such file") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise MotionFileError(path, f"not a readable CSV file ({error})") from None
    missing = [name for name in ("player", "start", "end", *LEARNED_ASPECTS) if name not in header]
    if missing:
        raise MotionFileError(path, f"no column {', '.join(missing)}; valid: {', '.join(PLACE_COLUMNS + ASPECTS)}", 1)
    unknown = [name for name in header if name not in PLACE_COLUMNS + ASPECTS]
    if unknown:
        raise MotionFileError(path, f"unknown column {unknown[0]!r}; valid: {', '.join(PLACE_COLUMNS + ASPECTS)}", 1)
    places = {(PLAYERS[player], int(start), int(end)): row for row, (player, start, end, _) in enumerate(table)}
    names = segment_names(table)
    found: dict[int, list[int]] = {}
    for line, cells in lines:
        row = _row(path, line, cells, places, names, table)
        if row in found:
            raise MotionFileError(path, f"action {names[row]} is annotated twice", line)
        found[row] = [_qualifier(path, line, cells, aspect) for aspect in LEARNED_ASPECTS]
    rows = np.array(sorted(found), dtype=np.int64)
    return Annotations(rows, np.array([found[row] for row in rows], dtype=np.int64).reshape(-1, len(LEARNED_ASPECTS)))


def _row(
    path: Path,
    line: int,
    cells: dict[str, str],
    places: dict[tuple[str, int, int], int],
    names: list[str],
    table: IntArray,
) -> int:
    try:
        place = (cells["player"].strip(), int(cells["start"]), int(cells["end"]))
    except (TypeError, ValueError, AttributeError):
        raise MotionFileError(path, "player, start or end is missing or no number", line) from None
    if place[0] not in PLAYERS:
        raise MotionFileError(path, f"unknown player {place[0]!r}; valid: {', '.join(PLAYERS)}", line)
    row = places.get(place)
    if row is None:
        own = table[table[:, 0] == PLAYERS.index(place[0])]
        nearest = own[int(np.argmin(np.abs(own[:, 1] - place[1]) + np.abs(own[:, 2] - place[2])))]
        raise MotionFileError(
            path,
            f"player {place[0]} has no action from frame {place[1]} to {place[2]}; the nearest is "
            f"{nearest[1]} to {nearest[2]} (were the cuts edited since?)",
            line,
        )
    given = (cells.get("segment") or "").strip()
    if given and given != names[row]:
        raise MotionFileError(
            path, f"the action from frame {place[1]} to {place[2]} is {names[row]}, not {given}", line
        )
    return row


def _qualifier(path: Path, line: int, cells: dict[str, str], aspect: str) -> int:
    text = (cells[aspect] or "").strip()
    try:
        check_qualifier(aspect, text)
    except SimprepError as error:
        raise MotionFileError(path, str(error), line) from None
    return QUALIFIERS[aspect].index(text)
