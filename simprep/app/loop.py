"""Keeps a session going by the clock, in a thread of its own."""

import os
import sys
import threading
import time

from simprep.app.moments import FPS
from simprep.app.session import Session
from simprep.errors import SimprepError

LATE_S = 0.1
"""A simulation that is later than this does not try to catch up: it goes on from now, at the rate that is shown [s]."""


NICE = 10
"""The simulation gives way to the page and to a browser that draws without a graphics card: what is slow is shown fluently."""


class SessionLoop:
    """Advances a session no faster than the clock, until it is stopped.

    Args:
        session: what is advanced; its other methods may be called meanwhile.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="simulation", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """Stop, and wait for the present moment to be done."""
        self._stop.set()
        self._thread.join(timeout=30.0)

    def _run(self) -> None:
        if sys.platform == "linux":  # elsewhere a thread has no niceness of its own
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICE)
        due = time.perf_counter()
        while not self._stop.is_set():
            try:
                went = self.session.advance()
            except SimprepError as error:
                self.session.told = str(error)
                self.session.pause()
                went = False
            now = time.perf_counter()
            due = now + 1 / FPS if not went else max(due + 1 / FPS, now - LATE_S)
            # also where it is late: commands wait for the session's lock
            self._stop.wait(max(due - now, 0.001))
