"""A sweep on a local Dask cluster, one of whose workers is killed midway."""

import logging
import os
import signal
from pathlib import Path

from distributed import Client, LocalCluster

from simprep.study.sweep.config import read_sweep
from simprep.study.sweep.engines import on_dask
from simprep.study.sweep.run import Progress, run_sweep
from simprep.study.sweep.store import SweepStore


def swept_with_a_killed_worker(config: Path, out: Path, after: int) -> int:
    """Run a sweep on two workers, and kill one of them; the cluster starts another.

    Returns:
        Number of records at that moment.

    Args:
        config: TOML file of the sweep.
        out: folder of its store.
        after: kill when so many cases are recorded.
    """
    killed_at = 0
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL
        ) as cluster,
        Client(cluster) as client,
    ):
        pids = list(client.run(os.getpid).values())

        def tell(progress: Progress) -> None:
            nonlocal killed_at
            if not killed_at and progress.done >= after:
                os.kill(pids[0], signal.SIGKILL)
                killed_at = progress.done

        run_sweep(
            read_sweep(config).cases(), SweepStore(out), lambda cases: on_dask(cases, cluster.scheduler_address), tell
        )
    return killed_at
