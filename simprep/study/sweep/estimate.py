"""What a sweep will take: measured cost of its kinds of case, times their number, on so many cores."""

import random
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, sqrt
from typing import Any

from simprep.study.sweep.cases import SweepCase
from simprep.study.sweep.store import SweepStore, record_line

CORES = (1, 2, 8, 64, 512)
SAMPLE = 3
"""Cases of each kind that are measured where the store has fewer."""
Kind = tuple[str, str, str]
"""Kind of case (`track`, `prepare`), controller, preset."""


@dataclass(frozen=True)
class KindCost:
    """What one kind of case costs.

    Attributes:
        kind: which.
        cases: of the sweep.
        left: those that are not recorded.
        measured: those that are, and say what they cost.
        mean_s: their mean processor time [s]; NaN without any.
        error_s: standard error of that mean [s]; NaN with fewer than two.
        bytes: mean size of a record.
    """

    kind: Kind
    cases: int
    left: int
    measured: int
    mean_s: float
    error_s: float
    bytes: float


def kind_of(case: SweepCase) -> Kind:
    """Cases of one kind are taken to cost alike."""
    return case.kind, case.controller, case.preset or ""


def sample(cases: Iterable[SweepCase], store: SweepStore) -> list[SweepCase]:
    """Cases to run before an estimate: of each kind at random, until `SAMPLE` of it are recorded."""
    entries = store.index().entries
    kinds: dict[Kind, list[SweepCase]] = defaultdict(list)
    recorded: dict[Kind, int] = defaultdict(int)
    for case in {case.id: case for case in cases}.values():
        if case.id in entries:
            recorded[kind_of(case)] += 1
        else:
            kinds[kind_of(case)].append(case)
    chooser = random.Random(0)
    wanted = {kind: min(len(left), max(0, SAMPLE - recorded[kind])) for kind, left in kinds.items()}
    return [case for kind, left in kinds.items() for case in chooser.sample(left, wanted[kind])]


def costs(cases: Iterable[SweepCase], store: SweepStore) -> list[KindCost]:
    """Cost of each kind of case of a sweep, from what is recorded of it."""
    kinds: dict[Kind, list[str]] = defaultdict(list)
    for case in {case.id: case for case in cases}.values():
        kinds[kind_of(case)].append(case.id)
    ids = {name for names in kinds.values() for name in names}
    known: Mapping[str, Any] = {record["id"]: record for record in store.records(ids.__contains__)}
    found = []
    for kind, names in kinds.items():
        there = [known[name] for name in names if name in known]
        times = [record["cost"]["cpu_s"] for record in there if record["cost"]["cpu_s"] is not None]
        count = len(times)
        mean = sum(times) / count if count else float("nan")
        spread = sqrt(sum((time - mean) ** 2 for time in times) / (count - 1)) if count > 1 else float("nan")
        sizes = [len(record_line(record["id"], record["attempt"], _content(record))) for record in there[:100]]
        found.append(
            KindCost(
                kind,
                len(names),
                len(names) - len(there),
                count,
                mean,
                spread / sqrt(count) if count else float("nan"),
                sum(sizes) / len(sizes) if sizes else float("nan"),
            )
        )
    return found


def _content(record: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in record.items() if key not in ("crc32", "id", "attempt")}


def plan_text(kinds: Sequence[KindCost], clips: int, many: int) -> str:
    """The written plan, in Markdown.

    Args:
        kinds: cost of each kind.
        clips: clips, or pairs of a locomotion and a target, of the sweep.
        many: how many clips to reckon for as well.
    """
    cases, left = sum(one.cases for one in kinds), sum(one.left for one in kinds)
    total = sum(one.cases * one.mean_s for one in kinds)
    error = sqrt(sum((one.cases * one.error_s) ** 2 for one in kinds if one.error_s == one.error_s))
    rest = sum(one.left * one.mean_s for one in kinds)
    size = sum(one.cases * one.bytes for one in kinds)
    share = f" ({200 * error / total:.0f} % either way, two standard errors)" if error and total else ""
    lines = [
        "# Plan of a sweep",
        "",
        f"{cases} cases, {left} of them still to run; {clips} clips or pairs, {cases / clips:.3g} cases of each.",
        "",
        "| kind | controller | preset | cases | to run | measured | processor time of one [s] |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for one in kinds:
        plus = f" ± {one.error_s:.2g}" if one.error_s == one.error_s else ""
        preset = one.kind[2] or "-"
        lines.append(
            f"| {one.kind[0]} | {one.kind[1]} | {preset} | {one.cases} | {one.left} | {one.measured} | {one.mean_s:.3g}{plus} |"
        )
    scale = many / clips
    lines += [
        "",
        f"All of it takes {hours(total)} of one core{share}, and {megabytes(size)} of records. {many} such clips take "
        f"{hours(total * scale)} of one core and {megabytes(size * scale)}.",
        "",
        f"| cores | what is left here | {many} clips |",
        "| --- | --- | --- |",
        *(f"| {cores} | {hours(rest / cores)} | {hours(total * scale / cores)} |" for cores in CORES),
        "",
        "This takes for granted that a case keeps one core busy and that cores do not slow each other, and that further "
        "clips are as long as these. Cases that are not measured are taken to cost the mean of their kind.",
    ]
    return "\n".join(lines) + "\n"


def hours(seconds: float) -> str:
    """A time for people."""
    if seconds != seconds:
        return "an unknown time"
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h" if seconds < 48 * 3600 else f"{ceil(seconds / 86400)} days"


def megabytes(size: float) -> str:
    """A size for people."""
    if size != size:
        return "an unknown number of bytes"
    return f"{size / 1e6:.1f} MB" if size < 1e9 else f"{size / 1e9:.1f} GB"
