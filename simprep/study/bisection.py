"""How much of a disturbance is survived: levels tried in order, then halvings between the last survived and the first failed.

Survival need not be monotone: a body may fall at 300 N and stand at 400 N. What is looked for here is the *first* failure:
every level of a fixed scan is tried, and the halvings lie between the first that fails and the one before. So two searches
with the same levels mean the same thing, which a bisection of the whole range does not. Whether anything beyond the first
failure was survived is part of the answer.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from simprep.errors import SettingError


@dataclass(frozen=True)
class DoseLimit:
    """How far a disturbance, the dose, can go.

    Attributes:
        levels: doses of the scan, from the mildest to the hardest.
        completed: of each, whether it was survived.
        survived: the hardest dose before the first failure that was survived; None if the mildest was not.
        failed: the mildest dose found that fails; None if none of the levels does.
    """

    levels: tuple[float, ...]
    completed: tuple[bool, ...]
    survived: float | None
    failed: float | None

    @property
    def monotone(self) -> bool:
        """Whether no level beyond the first failure was survived."""
        return all(self.completed) or not any(self.completed[self.completed.index(False) :])


def narrow(survives: Callable[[float], bool], survived: float, failed: float, halvings: int) -> tuple[float, float]:
    """A survived and a failed dose, brought nearer to each other by bisection.

    Args:
        survives: tries a dose.
        survived: a dose that is survived.
        failed: one that is not; it may be the smaller number.
        halvings: how often the interval is halved.
    """
    for _ in range(halvings):
        middle = (survived + failed) / 2
        survived, failed = (middle, failed) if survives(middle) else (survived, middle)
    return survived, failed


def first_failure(survives: Callable[[float], bool], levels: Sequence[float], halvings: int) -> DoseLimit:
    """Scan all levels, then narrow the interval of the first failure.

    Args:
        survives: tries a dose.
        levels: from the mildest dose to the hardest, rising or falling; the first usually is no disturbance at all. Where that
            fails, nothing else is tried, and all levels count as failed.
        halvings: how often the interval between two levels is halved.

    Raises:
        SettingError: levels that neither rise nor fall throughout, or halvings below 0.
    """
    doses = tuple(float(level) for level in levels)
    if not doses or sorted(set(doses), reverse=doses[0] > doses[-1]) != list(doses):
        raise SettingError(f"levels {', '.join(f'{one:g}' for one in doses) or '(none)'}; valid: rising or falling")
    if halvings < 0:
        raise SettingError(f"{halvings} halvings; valid: 0 or more")
    if not survives(doses[0]):
        return DoseLimit(doses, (False,) * len(doses), None, doses[0])
    completed = (True, *_tried(survives, doses[1:]))
    if all(completed):
        return DoseLimit(doses, completed, doses[-1], None)
    first = completed.index(False)
    return DoseLimit(doses, completed, *narrow(survives, doses[first - 1], doses[first], halvings))


def _tried(survives: Callable[[float], bool], doses: Iterable[float]) -> list[bool]:
    return [bool(survives(dose)) for dose in doses]
