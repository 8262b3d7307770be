"""The first failure of a dose: scan, halvings, and what is said where survival is not monotone."""

import pytest

from simprep.errors import SettingError
from simprep.study.bisection import first_failure, narrow

RISING = (0.0, 50.0, 100.0, 200.0, 400.0)
FALLING = (1.0, 0.7, 0.5, 0.3, 0.1)


@pytest.mark.parametrize("limit", [0.0, 49.0, 50.0, 73.2, 199.9, 399.0])
@pytest.mark.parametrize("halvings", [0, 1, 5])
def test_a_monotone_limit_is_bracketed(limit, halvings):
    tried = {}
    found = first_failure(lambda dose: tried.setdefault(dose, dose <= limit), RISING, halvings)
    above = next(level for level in RISING if level > limit)
    gap = (above - max(level for level in RISING if level <= limit)) / 2**halvings
    assert found.survived <= limit < found.failed
    assert found.failed - found.survived == pytest.approx(gap)
    assert tried[found.survived]
    assert not tried[found.failed]
    assert found.monotone
    assert len(tried) == len(RISING) + halvings
    assert found.completed == tuple(level <= limit for level in RISING)


@pytest.mark.parametrize("limit", [0.11, 0.42, 0.93])
def test_a_dose_may_be_the_harder_the_smaller(limit):
    found = first_failure(lambda dose: dose >= limit, FALLING, 4)
    assert found.failed < limit <= found.survived
    assert found.survived - found.failed <= 0.3 / 16 + 1e-12


def test_of_several_limits_the_first_is_found_and_the_others_are_told():
    def survives(dose):
        return dose < 60 or 180 < dose < 300

    found = first_failure(survives, RISING, 3)
    assert (found.survived, found.failed) == (56.25, 62.5)
    assert found.completed == (True, True, False, True, False)
    assert not found.monotone
    # a bisection of the whole range finds another one
    low, high = narrow(survives, 0.0, 400.0, 6)
    assert low < 300 <= high


def test_ends_are_said_to_be_ends():
    never = first_failure(lambda dose: True, RISING, 3)
    assert (never.survived, never.failed, never.monotone) == (400.0, None, True)
    tried = []
    always = first_failure(lambda dose: bool(tried.append(dose)), RISING, 3)
    assert (always.survived, always.failed, always.monotone) == (None, 0.0, True)
    assert tried == [0.0]  # what is not completed undisturbed is not tried further


@pytest.mark.parametrize("levels", [(), (0.0, 2.0, 1.0), (1.0, 1.0)])
def test_levels_out_of_order_are_refused(levels):
    with pytest.raises(SettingError, match="valid: rising or falling"):
        first_failure(lambda dose: True, levels, 3)
