"""Linear algebra on one thread, where it says so, and as before afterwards."""

import pytest
from threadpoolctl import threadpool_info

from simprep.threads import blas_on_one_thread, one_thread


def counts() -> list[int]:
    return [library["num_threads"] for library in threadpool_info()]


def test_blas_has_one_thread_inside_and_as_many_as_before_outside() -> None:
    with blas_on_one_thread():
        before_anything = counts()
    before = counts()
    assert before  # NumPy's and SciPy's libraries are found
    assert set(before_anything) == {1}
    assert set(one_thread(counts)()) == {1}
    with pytest.raises(ZeroDivisionError), blas_on_one_thread():
        raise ZeroDivisionError
    assert counts() == before
