"""Processes that work for this one, and end when it does."""

import os
import signal
import threading
import traceback
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import TypeVar, cast

J = TypeVar("J")
R = TypeVar("R")

MOST = 8
"""So many by themselves at most: each holds some 300 MB."""


@dataclass(frozen=True)
class Died:
    """What comes of a job whose process died: killed, or out of memory."""


def default_processes() -> int:
    """One for each core, `MOST` at most."""
    return min(os.cpu_count() or 1, MOST)


def threads_of(processes: int) -> int:
    """Simulation threads of each of so many processes, which share the cores."""
    return max(1, (os.cpu_count() or 1) // processes)


def each_in_processes(
    function: Callable[[J], R], jobs: Iterable[J], processes: int
) -> Generator[tuple[J, R | Died], None, None]:
    """Call a function for each job, in processes that are killed when this generator is closed or this process ends.

    Each process has a pipe of its own and shares no lock, so one that is killed, in whatever it does, holds up nobody;
    pools of the standard library wait for ever for a result that is cut off.

    Args:
        function: of a module; it, the jobs and the results are pickled.
        jobs: taken one by one as processes become free.
        processes: how many at most.

    Returns:
        Each job with what came of it, as they finish.

    Raises:
        Exception: what the function raised, with the other process's traceback as a note.
    """
    waiting = iter(jobs)
    at_work: dict[Connection, tuple[SpawnProcess, J]] = {}
    try:
        while True:
            for job in islice(waiting, processes - len(at_work)):
                at_work.update([_started(function, job)])
            if not at_work:
                return
            for ours in cast(list[Connection], wait(list(at_work))):
                process, job = at_work[ours]
                try:
                    message = ours.recv()
                    if message == _READY:
                        ours.send(job)
                        continue
                except (EOFError, OSError):
                    _end(at_work, ours)
                    yield job, Died()
                    continue
                succeeded, result = message
                if not succeeded:
                    raise result
                yield job, result
                following = list(islice(waiting, 1))
                if not following:
                    _end(at_work, ours)
                    continue
                at_work[ours] = process, following[0]
                with suppress(OSError):  # it died meanwhile: reading from it will tell
                    ours.send(following[0])
    finally:
        for ours in list(at_work):
            _end(at_work, ours)


_READY = "ready"


def _started(function: Callable[[J], R], job: J) -> tuple[Connection, tuple[SpawnProcess, J]]:
    context = get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(function, theirs), daemon=True)
    process.start()
    theirs.close()  # so that reading ends when the process does
    return ours, (process, job)


def _end(at_work: dict[Connection, tuple[SpawnProcess, J]], ours: Connection) -> None:
    process, _ = at_work.pop(ours)
    process.kill()
    process.join()
    ours.close()


def _work(function: Callable[[J], R], theirs: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that people started
    threading.Thread(target=_end_with_parent, daemon=True).start()
    theirs.send(_READY)
    while True:
        job: J = theirs.recv()
        try:
            message = True, function(job)
        except Exception as error:
            error.add_note(traceback.format_exc())
            theirs.send((False, error))
        else:
            theirs.send(message)


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)
