"""MuJoCo's timers of the parts of a step, off where hundreds of thousands of steps are simulated and nobody reads them.

The Python package sets the clock `mjcb_time`, and every step reads it a dozen times: a twentieth of the time of a small
model's step. What is simulated is the same. Python can neither read nor restore that clock; the C library's variable can.
"""

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import mujoco


@contextmanager
def without_step_timers() -> Iterator[None]:
    """Simulate without reading the clock; `mjData.timer` of these steps stays empty. Nothing where the clock is not found."""
    clock = _clock()
    if clock is None:
        yield
        return
    variable, usual = clock
    variable.value = None
    try:
        yield
    finally:
        variable.value = usual


@cache
def _clock() -> tuple[ctypes.c_void_p, int | None] | None:
    """The variable `mjcb_time` of the loaded library, and what it held."""
    folder = Path(mujoco.__file__).parent
    for pattern in ("libmujoco*.so*", "libmujoco*.dylib", "mujoco.dll"):
        for library in sorted(folder.glob(pattern)):
            try:
                variable = ctypes.c_void_p.in_dll(ctypes.CDLL(str(library)), "mjcb_time")
            except (OSError, ValueError):
                continue
            return variable, variable.value
    return None
