"""What moved between two result files: numbers at the same place, beyond a tolerance."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any, TypeGuard

TIMES = (
    "wall_s",
    "s_per_s",
    "cpu_s",
    "cpu_ms",
    "yardstick",
    "overhead",
    "speedup",
    "one_s",
    "two_s",
    "threads_s",
    "seconds_s",
    "per_min_wall",
)
"""Keys with one of these in them are times of computing; they move with the machine."""
ABOUT = (
    "command",
    "created_utc",
    "versions",
    "platform",
    "processors",
    "files",
    "records_after_each",
    "killed_at_record",
)
"""Keys that say how a result was made, not what it is."""


@dataclass(frozen=True)
class Change:
    """A value that is not as it was.

    Attributes:
        place: keys down to it.
        kept, now: values; None where there is none.
        share: relative change of a number; infinite where it is no number or is missing.
    """

    place: tuple[str, ...]
    kept: Any
    now: Any
    share: float

    @property
    def key(self) -> str:
        """The last key that is no index: the metric, mostly."""
        return next((part for part in reversed(self.place) if not part.isdigit()), "")


@dataclass(frozen=True)
class Comparison:
    """Two files compared: how many values there are, and which moved."""

    values: int
    moved: tuple[Change, ...]


def leaves(content: Any, place: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], Any]]:
    """Every value of a JSON file with its place, but for times and what says how it was made."""
    if isinstance(content, Mapping):
        for key, value in content.items():
            if key not in ABOUT and not any(part in str(key) for part in TIMES):
                yield from leaves(value, (*place, str(key)))
    elif isinstance(content, Sequence) and not isinstance(content, str):
        for index, value in enumerate(content):
            yield from leaves(value, (*place, str(index)))
    else:
        yield place, content


def compare(kept: Any, now: Any, relative: float = 1e-3, absolute: float = 1e-6) -> Comparison:
    """Values of two results.

    Args:
        kept: the one in `results/`, as JSON gives it.
        now: the one made anew.
        relative: a number that moved by a smaller share has not moved.
        absolute: nor has one that moved by less than this.
    """
    before, after = dict(leaves(kept)), dict(leaves(now))
    moved = []
    for place in dict.fromkeys((*before, *after)):
        a: Any = before.get(place)
        b: Any = after.get(place)
        if place in before and place in after and _same(a, b, relative, absolute):
            continue
        share = abs(b - a) / max(abs(a), 1e-12) if _number(a) and _number(b) else float("inf")
        moved.append(Change(place, a, b, share))
    return Comparison(len(before), tuple(moved))


def moved_text(comparison: Comparison, longest: int = 12) -> Iterator[str]:
    """What moved, in lines: metric by metric, those first that moved most."""
    groups: dict[str, list[Change]] = {}
    for change in comparison.moved:
        groups.setdefault(change.key, []).append(change)
    ordered = sorted(groups.items(), key=lambda item: -median(change.share for change in item[1]))
    for key, changes in ordered[:longest]:
        worst = max(changes, key=lambda change: change.share)
        middle = median(change.share for change in changes)
        size = "other or missing" if middle == float("inf") else f"by {100 * middle:.3g} % in the middle"
        yield f"{key}: {len(changes)} moved, {size}; {'.'.join(worst.place)}: {_shown(worst.kept)} -> {_shown(worst.now)}"
    if len(ordered) > longest:
        yield f"and {len(ordered) - longest} more metrics"


def _same(a: Any, b: Any, relative: float, absolute: float) -> bool:
    if _number(a) and _number(b):
        return abs(a - b) <= max(absolute, relative * abs(a))
    return bool(a == b)


def _number(value: Any) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _shown(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:60]
