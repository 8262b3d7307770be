"""The live page as a whole: a session, its clock, and a server whose tabs show it. Needs the extra `app`."""

import contextlib
import io
import threading
import time
import warnings

import numpy as np
import viser

from simprep.app.loop import SessionLoop
from simprep.app.page import Page
from simprep.app.server import LOOPBACK, PageServer
from simprep.app.session import Session

SHOWN_FPS = 32.0
"""Frames that a tab is sent [1/s]: 30, and two that are lost to the simulation in the same process."""


class App:
    """Serves a session until it is stopped.

    Args:
        session: what is shown.
        host: address to listen at.
        port: of it; 0 for a free one.

    Raises:
        SettingError: the port is in use.
    """

    def __init__(self, session: Session, host: str = LOOPBACK, port: int = 0) -> None:
        self.session, self._loop = session, SessionLoop(session)
        self._pages: dict[int, Page] = {}
        self._stop = threading.Event()
        # a tab may close while it is drawn
        warnings.filterwarnings("ignore", message="Queued a .* closed connection", category=UserWarning)
        with contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner of its own
            self.server = PageServer(host, port)
        self.address = f"http://{host}:{self.server.get_port()}"
        self.server.on_client_connect(self._opened)
        self.server.on_client_disconnect(self._closed)
        self._loop.start()

    def serve(self, seconds: float | None = None) -> None:
        """Draw until `stop`, Ctrl-C, or so many seconds are over."""
        due = time.perf_counter()
        end = np.inf if seconds is None else due + seconds
        while not self._stop.is_set() and (now := time.perf_counter()) < end:
            for page in list(self._pages.values()):
                page.update()
            due = max(due, now - 1 / SHOWN_FPS) + 1 / SHOWN_FPS  # a wait that was too long shortens the next one
            self._stop.wait(max(due - time.perf_counter(), 0.002))

    @property
    def frame_rates(self) -> tuple[float, ...]:
        """Frames that each tab was sent lately [1/s]."""
        return tuple(page.frame_rate for page in list(self._pages.values()))

    def stop(self) -> None:
        """End the simulation and the server."""
        self._stop.set()
        self._loop.stop()
        with contextlib.redirect_stdout(io.StringIO()):
            self.server.stop()

    def _opened(self, client: viser.ClientHandle) -> None:
        self._pages[client.client_id] = Page(client, self.session)

    def _closed(self, client: viser.ClientHandle) -> None:
        self._pages.pop(client.client_id, None)
