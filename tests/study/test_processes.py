"""Processes are killed in whatever they do, and nobody waits for what they leave half said."""

import multiprocessing
import os
import signal
import time

import pytest

from simprep.study.processes import Died, each_in_processes

LARGE = 50_000_000  # far more than a pipe holds: whoever writes it is in the middle of that for some time


def large(number):
    if number < 0:
        raise ValueError(f"no such job: {number}")
    return bytes(LARGE)


def doomed(number):
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_each_job_comes_back_and_one_whose_process_is_killed_says_so():
    came = dict(each_in_processes(doomed, iter(range(5)), 2))
    assert came == {0: 0, 1: Died(), 2: 2, 3: 3, 4: 4}
    assert dict(each_in_processes(doomed, [], 2)) == {}


def test_what_a_job_raises_is_raised_and_says_where():
    with pytest.raises(ValueError, match="no such job: -1") as raised:
        list(each_in_processes(large, [-1], 1))
    assert "in large" in raised.value.__notes__[0]
    assert not multiprocessing.active_children()


@pytest.mark.parametrize("how", ["closed", "killed"])
def test_ends_while_a_result_is_half_written(how):
    begun = set(multiprocessing.active_children())
    results = each_in_processes(large, [0, 1, 2], 2)
    next(results)
    time.sleep(1.0)  # the others fill their pipes and wait
    if how == "killed":
        for process in set(multiprocessing.active_children()) - begun:
            process.kill()
        assert [one for _, one in results] == [Died(), Died()]
    results.close()
    assert set(multiprocessing.active_children()) <= begun
