"""Where cases run: in this process, in several, or on a Dask cluster. What comes out does not depend on it.

An engine gives each case with what `measure_case` returns of it, in the order in which they finish.
"""

import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from simprep.errors import MissingExtraError, SettingError, SimprepError
from simprep.study.processes import Processes, threads_of
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

    If a process dies (killed for memory, say), the cases that were running are run again one at a time; the one that
    kills its process again is an `error`.

    Args:
        cases: what to run.
        processes: how many.
        threads: simulation threads of `mpc` in each; None: the cores are shared among the processes.
    """
    threads = threads or threads_of(processes)
    waiting, running, pool = iter(cases), dict[Future[Content], SweepCase](), Processes(processes)
    try:
        while True:
            while len(running) < processes and (case := next(waiting, None)):
                running[_submit(pool, case, threads)] = case
            if not running:
                return
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            suspects = []
            for future in finished:
                case = running.pop(future)
                if isinstance(future.exception(), BrokenProcessPool):
                    suspects.append(case)
                else:
                    yield case, future.result()
            if suspects:
                suspects += running.values()
                running.clear()
                pool.close()
                for case in suspects:
                    yield case, _alone(case, threads)
                pool = Processes(processes)
    finally:
        pool.close()


def _submit(pool: Processes, case: SweepCase, threads: int) -> "Future[Content]":
    try:
        return pool.executor.submit(run_job, case, threads)
    except BrokenProcessPool as error:  # one died while none of its cases was looked at
        future: Future[Content] = Future()
        future.set_exception(error)
        return future


def _alone(case: SweepCase, threads: int) -> Content:
    pool = Processes(1)
    try:
        return pool.executor.submit(run_job, case, threads).result()
    except BrokenProcessPool:
        return died("the process that ran it died, twice: killed, or out of memory")
    finally:
        pool.close()


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
