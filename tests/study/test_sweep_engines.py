"""Engines give the same results bit for bit, though processes, workers and the sweep itself are killed."""

import multiprocessing
import sys

import numpy as np
import pytest
from sweep_cases import write_cheap

from simprep.study.sweep.config import read_sweep
from simprep.study.sweep.engines import in_processes, in_this_process
from simprep.study.sweep.run import run_sweep
from simprep.study.sweep.store import SweepStore
from sweeping.trials import command, contents, killed


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    return write_cheap(tmp_path_factory.mktemp("sweep"))


@pytest.fixture(scope="module")
def whole(config):
    """What the sweep gives when it is left alone, in one process."""
    out = config.parent / "whole"
    run_sweep(read_sweep(config).cases(), SweepStore(out), in_this_process)
    found = contents(out)
    assert len(found.results) == 12
    assert {record["end"] for record in found.results.values()} == {"done", "measured", "bad_input"}
    return found.results


def check(out, whole):
    found = contents(out)
    assert found.results == whole  # nothing lost, nothing different
    assert set(found.lines.values()) == {1}  # nothing doubled


def test_processes_of_which_one_is_killed(config, whole, tmp_path):
    cases = list(read_sweep(config).cases())

    def engine(some):
        for number, pair in enumerate(in_processes(some, 2)):
            if number == 3:
                multiprocessing.active_children()[0].kill()
            yield pair

    run_sweep(cases, SweepStore(tmp_path), engine)
    check(tmp_path, whole)
    assert not multiprocessing.active_children()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="looks for orphans in /proc")
def test_a_sweep_that_is_killed_and_resumed(config, whole, tmp_path):
    counts = killed(command(config, tmp_path, "--processes", "2"), tmp_path, 2, np.random.default_rng(1), longest_s=0.2)
    assert counts == sorted(counts)
    assert counts[0] < len(whole)
    check(tmp_path, whole)


def test_a_cluster_of_which_a_worker_is_killed(config, whole, tmp_path):
    pytest.importorskip("distributed")
    from sweeping.cluster import swept_with_a_killed_worker

    assert swept_with_a_killed_worker(config, tmp_path, after=3) >= 3
    check(tmp_path, whole)
