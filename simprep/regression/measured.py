"""Numbers by case and seed, wherever they come from: what a baseline keeps and what is compared with it."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from simprep.errors import SettingError

NO_SEED = 0
"""Seed of numbers that have none."""
LEFT_OUT = (
    "s_per_s",
    "wall_s",
    "cpu_s_per_s",
    "overhead_share",
    "fps_kinematic",
    "yardstick_s",
    "pair_yardsticks",
    "yardsticks",
    "fps",
    "fell_at_s",
    "seed",
)
"""Numbers that are not compared: computing times and speeds, seeds, and `fell_at_s`, as `survived_s` says the same of every run."""

Values = tuple[float | None, ...]


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes:
        seeds: of its random numbers, all different, in rising order.
        metrics: by name, one value for each seed; None where a run has none.
    """

    seeds: tuple[int, ...]
    metrics: Mapping[str, Values]


@dataclass(frozen=True)
class Measured:
    """Numbers of several cases.

    Attributes:
        cases: by name.
        versions: of the packages that made them, by name.
        platform: system, machine and processor (`simprep.report.results.provenance`).
    """

    cases: Mapping[str, Case]
    versions: Mapping[str, str] = field(default_factory=dict)
    platform: Mapping[str, Any] = field(default_factory=dict)

    @property
    def seeds(self) -> tuple[int, ...]:
        """All seeds of all cases, in rising order."""
        return tuple(sorted({seed for case in self.cases.values() for seed in case.seeds}))


def numbers(record: Mapping[str, Any], prefix: str = "") -> dict[str, float | None]:
    """The numbers of a record by name: truth values as 0 and 1, None for NaN and infinity; text is left out.

    Numbers of a mapping inside are called `outer.inner`, those of a list `name[0]`, `name[1]`. Computing times
    and what else is in `LEFT_OUT` are left out.
    """
    found: dict[str, float | None] = {}
    for key, value in record.items():
        name = f"{prefix}{key}"
        value = value.item() if hasattr(value, "item") and getattr(value, "ndim", 1) == 0 else value
        value = value.tolist() if hasattr(value, "tolist") else value
        if key in LEFT_OUT or isinstance(value, str):
            continue
        if value is None:
            found[name] = None
        elif isinstance(value, (bool, int, float)):
            found[name] = float(value) if math.isfinite(value) else None
        elif isinstance(value, Mapping):
            found |= numbers(value, f"{name}.")
        elif isinstance(value, (list, tuple)):
            found |= numbers({f"{name}[{index}]": item for index, item in enumerate(value)})
    return found


def cases_of(records: Iterable[tuple[str, int, Mapping[str, float | None]]]) -> dict[str, Case]:
    """Put records together: those of the same case become one case with several seeds.

    Args:
        records: name of the case, seed, and numbers by name.

    Raises:
        SettingError: the same case and seed twice.
    """
    by_case: dict[str, dict[int, Mapping[str, float | None]]] = {}
    for name, seed, values in records:
        seeds = by_case.setdefault(name, {})
        if seed in seeds:
            raise SettingError(
                f"case {name!r} with seed {seed} is there twice; what tells its records apart is no text, "
                "so name it: --by KEY"
            )
        seeds[seed] = values
    return {name: _case(seeds) for name, seeds in by_case.items()}


def _case(by_seed: Mapping[int, Mapping[str, float | None]]) -> Case:
    seeds = tuple(sorted(by_seed))
    names = dict.fromkeys(name for values in by_seed.values() for name in values)
    return Case(seeds, {name: tuple(by_seed[seed].get(name) for seed in seeds) for name in names})
