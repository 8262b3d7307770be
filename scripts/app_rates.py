"""Frames per second that the live page sends, and the rate of its simulation: one character, and two fighters.

Example: SIMPREP_BROWSER=/usr/bin/chromium python scripts/app_rates.py --seconds 20

Wants a machine on which nothing else runs. Without a browser the page's messages are received and thrown away, which leaves
the drawing out; with one that renders in software, drawing takes most of two cores.
"""

import argparse
import contextlib
import os
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from simprep.app.app import App
from simprep.app.session import Session, SessionSettings

SCENES = ("empty", "duel automatic")


@contextlib.contextmanager
def tab(address: str, browser: str) -> Iterator[None]:
    """The page, opened in a browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        made = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox", "--enable-unsafe-swiftshader"])
        made.new_page(viewport={"width": 900, "height": 560}).goto(address)
        yield
        made.close()


@contextlib.contextmanager
def listener(address: str) -> Iterator[None]:
    """A web socket in place of a browser."""
    import viser
    from websockets.exceptions import ConnectionClosed
    from websockets.sync.client import connect

    protocol: Any = f"viser-v{viser.__version__}"
    with connect(address.replace("http", "ws"), origin=address, subprotocols=[protocol], max_size=None) as socket:  # type: ignore[arg-type]

        def drain() -> None:
            with contextlib.suppress(ConnectionClosed):
                for _ in socket:
                    pass

        threading.Thread(target=drain, daemon=True).start()
        yield


def rates(scene: str, seconds: float, preset: str, browser: str | None) -> tuple[float, float]:
    """Frames per second and rate of simulation of a scene; the character walks, the fighters fight."""
    session = Session(SessionSettings(scene, preset=preset, folder=Path("results/app")))
    if not session.is_duel:
        session.set_goal((30.0, 0.0))
    app = App(session)
    serving = threading.Thread(target=app.serve)
    serving.start()
    try:
        with tab(app.address, browser) if browser else listener(app.address):
            time.sleep(5.0)  # until the tab has its scene
            frames, simulated, begun = [], session.time, time.perf_counter()
            while time.perf_counter() - begun < seconds:
                time.sleep(1.0)
                frames.append(max(app.frame_rates, default=0.0))
            rate = (session.time - simulated) / (time.perf_counter() - begun)
    finally:
        app.stop()
        serving.join(10)
    return sum(frames) / len(frames), rate


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, help="of each scene [s]")
    parser.add_argument("--preset", default="live", help="of the tracking controller")
    options = parser.parse_args()
    browser = os.environ.get("SIMPREP_BROWSER")
    print(f"preset {options.preset}, {browser or 'no browser, messages alone'}")
    for scene in SCENES:
        frames, rate = rates(scene, options.seconds, options.preset, browser)
        print(f"{scene:16s} {frames:5.1f} frames/s sent, simulated at {rate:.2f} x real time")
    return 0


if __name__ == "__main__":
    sys.exit(main())
