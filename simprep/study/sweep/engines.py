"""Where cases run: in this process, in several, or on a Dask cluster. What comes out does not depend on it.

An engine gives each case with what `measure_case` returns of it, in the order in which they finish.
"""

import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import closing
from functools import partial
from typing import Any

from simprep.errors import MissingExtraError, SettingError, SimprepError
from simprep.study.processes import Died, each_in_processes, threads_of
from simprep.study.sweep.cases import SweepCase
from simprep.study.sweep.code import results_code
from simprep.study.sweep.measure import ERROR, measure_case, processor

Content = dict[str, Any]
Engine = Callable[[Iterable[SweepCase]], Iterator[tuple[SweepCase, Content]]]
CONNECT_S = 20.0
AHEAD = 2
"""Cases that are given to a cluster for each of its threads, so that none waits for the next."""

_one_at_a_time = threading.Lock()  # a worker with several threads: MuJoCo's warnings and BLAS are per process


class OtherCodeError(SimprepError):
    """A process that is to run cases has other code, or other packages, than the one that planned them."""


def run_job(case: SweepCase, threads: int) -> Content:
    """`measure_case`, on a worker.

    Raises:
        OtherCodeError: the worker would compute something else.
    """
    if (own := results_code()) != case.code:
        raise OtherCodeError(
            f"a worker runs other code or packages ({own}) than the sweep was planned with ({case.code}); "
            "valid: the same version of simprep and its packages everywhere, not edited while a sweep runs"
        )
    with _one_at_a_time:
        return measure_case(case, threads)


def died(how: str) -> Content:
    """What is recorded of a case whose process died."""
    return {
        "end": ERROR,
        "reason": how,
        "metrics": {},
        "cost": {"wall_s": None, "cpu_s": None, "processor": processor()},
    }


def in_this_process(cases: Iterable[SweepCase], threads: int = 0) -> Iterator[tuple[SweepCase, Content]]:
    """Run cases one after the other.

    Args:
        cases: what to run.
        threads: simulation threads of `mpc`; 0 for all cores.
    """
    for case in cases:
        yield case, run_job(case, threads)


def in_processes(
    cases: Iterable[SweepCase], processes: int, threads: int | None = None
) -> Iterator[tuple[SweepCase, Content]]:
    """Run cases in processes of this machine.

    If a process dies (killed for memory, say), its case is run once more when the others are finished, alone; if that
    kills its process again, the case is an `error`.

    Args:
        cases: what to run.
        processes: how many.
        threads: simulation threads of `mpc` in each; None: the cores are shared among the processes.
    """
    run = partial(run_job, threads=threads or threads_of(processes))
    again = []
    with closing(each_in_processes(run, cases, processes)) as finished:
        for case, content in finished:
            if isinstance(content, Died):
                again.append(case)
            else:
                yield case, content
    for case, content in each_in_processes(run, again, 1):
        twice = "the process that ran it died, twice: killed, or out of memory"
        yield case, died(twice) if isinstance(content, Died) else content


def on_dask(cases: Iterable[SweepCase], address: str) -> Iterator[tuple[SweepCase, Content]]:
    """Run cases on a Dask cluster. Files of clips must lie at the same paths there.

    The cluster runs a case again if its worker is lost; after several, it is an `error`.

    Args:
        cases: what to run.
        address: of the scheduler, `tcp://HOST:PORT`.

    Raises:
        MissingExtraError: Dask is not installed.
        SettingError: no scheduler there, or it is lost.
    """
    try:
        from distributed import Client, KilledWorker, as_completed
    except ImportError:
        raise MissingExtraError("--scheduler", "dask") from None
    try:
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SettingError(f"no Dask scheduler at {address!r} ({error}); valid: such as tcp://HOST:8786") from None
    waiting, running = iter(cases), dict[Any, SweepCase]()
    finished = as_completed(loop=client.loop)
    try:

        def fill() -> None:
            room = max(1, AHEAD * sum(client.nthreads().values()))
            while len(running) < room and (case := next(waiting, None)):
                future = client.submit(run_job, case, 1, pure=False)
                running[future] = case
                finished.add(future)

        fill()
        for future in finished:
            case = running.pop(future)
            try:
                content = future.result()
            except KilledWorker as error:
                content = died(f"every worker that ran it died: {' '.join(str(error).split())}")
            except CancelledError:
                raise SettingError(f"the Dask scheduler at {address} is lost; the same command goes on") from None
            future.release()
            yield case, content
            fill()
    finally:
        client.cancel(list(running))
        client.close(timeout=5)
