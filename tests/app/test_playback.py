import numpy as np
import pytest

from simprep.app.playback import LAG_S, Playback


@pytest.mark.parametrize("rate", [0.4, 1.0])
def test_bursts_of_the_simulation_are_shown_evenly_and_nothing_before_it_is_there(rate):
    playback, frames = Playback(), 1 / 30
    shown = []
    for number in range(300):
        now = number * frames
        newest = rate * 0.08 * (now // 0.08)  # a burst every 80 ms
        behind = playback.behind(newest, rate, now)
        assert behind >= 0
        shown.append(newest - behind)
    steps = np.diff(shown[60:])
    np.testing.assert_allclose(steps.mean(), rate * frames, rtol=0.02)
    assert steps.min() > 0.4 * rate * frames
    assert steps.max() < 1.6 * rate * frames
    assert rate * 299 * frames - shown[-1] < rate * 2 * LAG_S


def test_what_stands_is_shown_as_it_is_and_another_beginning_at_once():
    playback = Playback()
    for number in range(30):
        playback.behind(number / 30, 1.0, number / 30)
    assert playback.behind(1.0, 0.0, 1.1) == 0  # paused
    assert playback.behind(1.02, 0.0, 1.2) == 0  # a single step
    assert playback.behind(0.05, 1.0, 1.3) == pytest.approx(LAG_S)  # begun anew
    assert playback.behind(9.0, 1.0, 1.4) == pytest.approx(LAG_S)  # far behind
