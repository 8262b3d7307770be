"""Linear algebra on one thread: more threads slow small matrices down, and while they wait for work, simulations too."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
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


@contextmanager
def blas_on_one_thread() -> Iterator[None]:
    """The same for a few lines that run often: costs microseconds, and knows the libraries of NumPy and SciPy only."""
    usual = [(library, threads) for library in _numpy_and_scipy() if (threads := library.get_num_threads()) != 1]
    for library, _ in usual:
        library.set_num_threads(1)
    try:
        yield
    finally:
        for library, threads in usual:
            library.set_num_threads(threads)


@cache
def _numpy_and_scipy() -> list[Any]:
    import numpy.linalg  # noqa: F401
    import scipy.linalg  # noqa: F401

    # not its own limit, which asks every library for its version and threading too: twice as long
    return list(ThreadpoolController().lib_controllers)
