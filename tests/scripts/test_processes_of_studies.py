"""A study whose process is killed does that job again; one that is killed twice ends with a word."""

import os
import signal
from pathlib import Path

import pytest

from measuring.processes import each_result


def doomed_once(job):
    number, folder = job
    killed = Path(folder) / str(number)
    if number == 1 and not killed.exists():
        killed.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 10 * number


def doomed(number):
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_a_killed_job_is_done_again(tmp_path):
    jobs = [(number, str(tmp_path)) for number in range(4)]
    assert dict(each_result(doomed_once, jobs, 2)) == {0: 0, 1: 10, 2: 20, 3: 30}


def test_a_job_that_is_killed_twice_ends_the_study():
    with pytest.raises(RuntimeError, match="job 2 of 3 was killed twice"):
        list(each_result(doomed, [0, 1, 2], 2))
