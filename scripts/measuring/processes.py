"""Jobs of a study, shared among processes. One that is killed, for its memory, say, holds up nobody: its job is done again."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Generic, TypeVar

from simprep.study.processes import Died, each_in_processes

J = TypeVar("J")
R = TypeVar("R")


@dataclass(frozen=True)
class _Numbered(Generic[J, R]):
    """Calls a function with a job, whose number it leaves alone."""

    function: Callable[[J], R]

    def __call__(self, numbered: tuple[int, J]) -> R:
        return self.function(numbered[1])


def each_result(function: Callable[[J], R], jobs: Sequence[J], processes: int) -> Iterator[tuple[int, R]]:
    """Number and result of each job, as they finish.

    Args:
        function: of a module; it, the jobs and the results are pickled.
        jobs: what to do.
        processes: how many at a time.

    Raises:
        RuntimeError: a job's process died twice.
    """
    again: list[tuple[int, J]] = []
    with closing(each_in_processes(_Numbered(function), list(enumerate(jobs)), processes)) as finished:
        for (number, job), result in finished:
            if isinstance(result, Died):
                again.append((number, job))
            else:
                yield number, result
    for (number, _), result in each_in_processes(_Numbered(function), again, 1):
        if isinstance(result, Died):
            raise RuntimeError(f"the process of job {number + 1} of {len(jobs)} was killed twice")
        yield number, result
