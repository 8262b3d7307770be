"""The processor that a result was computed on: long simulations differ between kinds of it by chaos alone."""

import platform
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

_LINUX = Path("/proc/cpuinfo")


@lru_cache(maxsize=1)
def processor() -> dict[str, Any]:
    """The processor: `cpu` (its name), `simd` (instruction sets that NumPy found), `avx512` (whether AVX-512 is among them)."""
    found: dict[str, Any] = np.show_config(mode="dicts") or {}  # type: ignore[assignment]
    sets = found.get("SIMD Extensions", {})
    simd = sorted({*sets.get("baseline", ()), *sets.get("found", ())})
    return {"cpu": _name(), "simd": simd, "avx512": has_avx512(simd)}


def has_avx512(simd: Iterable[str]) -> bool:
    """Whether instruction sets, by NumPy's names, include AVX-512; NumPy calls its base X86_V4 since version 2.4."""
    return any(name == "X86_V4" or name.startswith("AVX512") for name in simd)


def _name() -> str:
    try:
        for line in _LINUX.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
