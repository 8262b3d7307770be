"""What a user asks of an avatar (2008 paper, section 5.2), and files of timed requests."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

from simprep.duel.model.structures import REQUESTS
from simprep.errors import MotionFileError, SettingError, SimprepError, UnknownNameError
from simprep.files import find_file

COLUMNS = ("time_s", "action", "x_m", "y_m")
FARTHEST_M = 100.0
"""Largest coordinate of a goal [m]."""


@dataclass(frozen=True)
class Request:
    """One wish.

    Attributes:
        action: kind of attack (`structures.REQUESTS`); empty for any action.
        goal: (x, y) on the floor of the world where the avatar's root should be 0.5 s after its next action begins [m].
        time: from which on it counts, since the beginning of the fight [s].

    Raises:
        UnknownNameError: no such kind of attack.
        SettingError: nothing is asked for, a place or time that is not finite or out of range.
    """

    action: str = ""
    goal: tuple[float, float] | None = None
    time: float = 0.0

    def __post_init__(self) -> None:
        if self.action and self.action not in REQUESTS:
            raise UnknownNameError("requested action", self.action, REQUESTS)
        if not self.action and self.goal is None:
            raise SettingError("a request needs an action, a goal, or both")
        if not (math.isfinite(self.time) and self.time >= 0):
            raise SettingError(f"requested at {self.time} s; valid: 0 or later")
        if self.goal is not None:
            goal = tuple(float(value) for value in self.goal)
            if len(goal) != 2 or not all(abs(value) <= FARTHEST_M for value in goal):
                raise SettingError(f"goal {self.goal}; valid: x and y within {FARTHEST_M:g} m of the world's origin")
            object.__setattr__(self, "goal", goal)

    def __str__(self) -> str:
        place = "" if self.goal is None else f"to ({self.goal[0]:.2f}, {self.goal[1]:.2f})"
        return " ".join(part for part in (self.action, place) if part)


def read_requests(path: str | Path) -> tuple[Request, ...]:
    """Requests by time from a CSV file, or a folder with one.

    Columns `time_s`, `action`, `x_m`, `y_m`; an empty action asks for a place alone, empty x and y for an action alone.
    Lines that begin with # are comments.

    Raises:
        MotionFileError: missing, without the columns, without requests, or a line that asks for nothing valid; the
            message names the line.
    """
    path = find_file(path, "table of requests", ".csv")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise MotionFileError(path, "no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise MotionFileError(path, f"not a readable CSV file ({error})") from None
    rows = [
        (number, [cell.strip() for cell in next(csv.reader([line]))])
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows or tuple(rows[0][1]) != COLUMNS:
        given = ",".join(rows[0][1]) if rows else "nothing"
        raise MotionFileError(path, f"begins with {given!r}; valid: {','.join(COLUMNS)}", rows[0][0] if rows else 1)
    if len(rows) == 1:
        raise MotionFileError(path, "no requests after the names of the columns", rows[0][0])
    return tuple(sorted((_request(path, number, cells) for number, cells in rows[1:]), key=lambda one: one.time))


def _request(path: Path, number: int, cells: list[str]) -> Request:
    if len(cells) != len(COLUMNS):
        raise MotionFileError(path, f"{len(cells)} cells; valid: {len(COLUMNS)} ({', '.join(COLUMNS)})", number)
    time, action, x, y = cells
    if bool(x) != bool(y):
        raise MotionFileError(path, "a goal needs both x_m and y_m, or neither", number)
    values = []
    for name, text in (("time_s", time), *((("x_m", x), ("y_m", y)) if x else ())):
        try:
            values.append(float(text))
        except ValueError:
            raise MotionFileError(path, f"{name} {text!r}; valid: a number", number) from None
    try:
        return Request(action, (values[1], values[2]) if x else None, values[0])
    except SimprepError as error:
        raise MotionFileError(path, str(error), number) from None
