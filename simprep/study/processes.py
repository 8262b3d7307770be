"""Processes that work for this one, and end when it does."""

import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from multiprocessing.connection import Connection

MOST = 8
"""So many by themselves at most: each holds some 300 MB."""


def default_processes() -> int:
    """One for each core, `MOST` at most."""
    return min(os.cpu_count() or 1, MOST)


def threads_of(processes: int) -> int:
    """Simulation threads of each of so many processes, which share the cores."""
    return max(1, (os.cpu_count() or 1) // processes)


class Processes:
    """Processes that end when this one does, however that ends, or when they are told to, in the middle of their work.

    Args:
        count: how many.

    Attributes:
        executor: takes functions of modules and what they need; results come back pickled.
    """

    def __init__(self, count: int) -> None:
        context = get_context("spawn")
        self._theirs, self._ours = context.Pipe(duplex=False)
        self.executor = ProcessPoolExecutor(count, context, _begin, (self._theirs,))

    def close(self) -> None:
        """End them."""
        self._ours.close()  # the processes' only sign of life of this one
        self.executor.shutdown(wait=True, cancel_futures=True)
        self._theirs.close()


def _begin(stop: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that people started
    threading.Thread(target=_end_with, args=(stop,), daemon=True).start()


def _end_with(stop: Connection) -> None:
    try:
        stop.recv_bytes()
    except (EOFError, OSError):
        os._exit(1)
