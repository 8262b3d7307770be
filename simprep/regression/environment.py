"""In what two sets of numbers differ besides the numbers: versions of packages, processor, seeds."""

from collections.abc import Mapping
from typing import Any

from simprep.regression.measured import Measured
from simprep.report.results import provenance

TITLES = {"mujoco": "MuJoCo", "numpy": "NumPy", "scipy": "SciPy", "python": "Python"}
SHOWN_SEEDS = 8


def here(cases: Mapping[str, Any]) -> Measured:
    """Numbers that were computed in this process, with its versions and its processor."""
    about = provenance(())
    return Measured(cases, about["versions"], about["platform"])


def differences(before: Measured, now: Measured) -> tuple[str, ...]:
    """What differs, a line each: versions, processor and its instruction sets, seeds; also what is not known."""
    lines = []
    if not now.versions or not now.platform:
        lines.append("versions and processor of the new numbers are not known")
    for name in dict.fromkeys((*before.versions, *now.versions)):
        old, new = before.versions.get(name), now.versions.get(name)
        if old != new and before.versions and now.versions:
            lines.append(f"{TITLES.get(name, name)} {new or 'missing'}; the baseline has {old or 'none'}")
    if now.platform and before.platform:
        lines += _processor(before.platform, now.platform)
    if before.seeds != now.seeds:
        lines.append(f"seeds {_seeds(now)}; the baseline has {_seeds(before)}")
    return tuple(lines)


def _processor(before: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    lines = []
    for key, title in (("system", "system"), ("machine", "architecture"), ("cpu", "processor")):
        if before.get(key) != now.get(key):
            lines.append(f"{title} {now.get(key) or 'unknown'}; the baseline has {before.get(key) or 'unknown'}")
    if before.get("avx512") != now.get("avx512"):
        words: dict[Any, str] = {True: "with AVX-512", False: "without AVX-512"}
        known = [words.get(one.get("avx512"), "unknown as to AVX-512") for one in (now, before)]
        lines.append(f"processor {known[0]}, the baseline's {known[1]}: long runs differ by chaos alone")
    elif sets := set(before.get("simd") or ()) ^ set(now.get("simd") or ()):
        lines.append(f"instruction sets differ: {', '.join(sorted(sets))}")
    return lines


def _seeds(measured: Measured) -> str:
    seeds = measured.seeds
    if len(seeds) > 2 and seeds == tuple(range(seeds[0], seeds[-1] + 1)):
        return f"{seeds[0]} to {seeds[-1]}"
    more = f" and {len(seeds) - SHOWN_SEEDS} more" if len(seeds) > SHOWN_SEEDS else ""
    return (", ".join(map(str, seeds[:SHOWN_SEEDS])) or "none") + more
