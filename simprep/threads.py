"""Linear algebra on one thread: more threads slow small matrices down, and while they wait for work, simulations too."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

P = ParamSpec("P")
R = TypeVar("R")


def one_thread(function: Callable[P, R]) -> Callable[P, R]:
    """Run a function with BLAS and OpenMP on one thread: faster for small matrices, the same bits at any core count."""

    @wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with ThreadpoolController().limit(limits=1):  # of all libraries that are loaded by now
            return function(*args, **kwargs)

    return limited


def blas_on_one_thread() -> AbstractContextManager[Any]:
    """The same for a few lines that run often: costs microseconds, and knows the libraries of NumPy and SciPy only."""
    limited: AbstractContextManager[Any] = _numpy_and_scipy().limit(limits=1)
    return limited


@cache
def _numpy_and_scipy() -> ThreadpoolController:
    import numpy.linalg  # noqa: F401
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()
