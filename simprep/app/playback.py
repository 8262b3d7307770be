"""Which time a tab shows: the simulation comes in bursts, plan by plan, and is shown evenly, a tenth of a second later."""

LAG_S = 0.1
"""How far behind the newest moment a tab stays, by the clock: bursts are seldom longer [s]."""
LOST_S = 0.5
"""A tab that is farther behind than this, simulated, goes to where it should be at once [s]."""
CORRECTION = 0.5
"""The rate that is shown differs from the simulation's by at most this share."""


class Playback:
    """Follows the newest moment at the simulation's rate; never shows what has not been simulated yet."""

    def __init__(self) -> None:
        self._shown, self._now = 0.0, 0.0

    def behind(self, newest: float, rate: float, now: float) -> float:
        """How far behind the newest moment the picture is that is due now, simulated [s].

        Args:
            newest: time of the newest moment [s].
            rate: simulated seconds for each second of the clock; 0: it stands, and the newest moment is shown.
            now: by the clock [s].
        """
        passed, self._now = now - self._now, now
        lag = rate * LAG_S
        late = newest - lag - self._shown
        if rate <= 0 or self._shown > newest or late > LOST_S:
            self._shown = newest - lag
        else:
            speed = rate * (1 + min(max(late / lag, -1.0), 1.0) * CORRECTION)
            self._shown = min(newest, self._shown + passed * speed)
        return newest - self._shown
