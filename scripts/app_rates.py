"""Frames per second that the live page sends and a browser draws, and the rate of its simulation: one character, and two fighters.

Example: SIMPREP_BROWSER=/usr/bin/chromium python scripts/app_rates.py --seconds 20

Wants a machine on which nothing else runs. A browser that renders in software takes one of two cores for drawing.
"""

import argparse
import contextlib
import os
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simprep.app.app import App
from simprep.app.session import Session, SessionSettings

SCENES = ("empty", "duel automatic")
RESOLUTIONS = {"as the page opens": "", "every pixel": "/?fixedDpr=1"}
"""Without a graphics card it opens with half the resolution."""


DRAWN = """seconds => new Promise(told => {
  const begun = performance.now(); let frames = 0;
  const count = () => performance.now() - begun < 1000 * seconds ? (frames++, requestAnimationFrame(count)) : told(frames / seconds);
  count();
})"""
"""Counts how often the browser is ready to draw, at most 60 times a second."""


@dataclass(frozen=True)
class Rates:
    """What a tab gets: frames sent to it and frames it can draw [1/s], and simulated time over the clock's."""

    sent: float
    drawn: float
    simulated: float


@contextlib.contextmanager
def tab(address: str, browser: str) -> Iterator[Any]:
    """The page, opened in a browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        made = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox", "--enable-unsafe-swiftshader"])
        page = made.new_page(viewport={"width": 900, "height": 560})
        page.goto(address)
        yield page
        made.close()


def rates(scene: str, seconds: float, preset: str, browser: str, query: str = "") -> Rates:
    """Rates of a scene, the address with a query; the character walks, the fighters fight."""
    session = Session(SessionSettings(scene, preset=preset, folder=Path("results/app")))
    if not session.is_duel:
        session.set_goal((30.0, 0.0))
    app = App(session)
    serving = threading.Thread(target=app.serve)
    serving.start()
    try:
        with tab(app.address + query, browser) as page:
            time.sleep(5.0)  # until the tab has its scene
            simulated, begun = session.time, time.perf_counter()
            drawn, sent = [], []
            while time.perf_counter() - begun < seconds:
                drawn.append(page.evaluate(DRAWN, 1.0))
                sent.append(max(app.frame_rates, default=0.0))
            rate = (session.time - simulated) / (time.perf_counter() - begun)
    finally:
        app.stop()
        serving.join(10)
    return Rates(sum(sent) / len(sent), sum(drawn) / len(drawn), rate)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, help="of each scene [s]")
    parser.add_argument("--preset", default="live", help="of the tracking controller")
    options = parser.parse_args()
    if not (browser := os.environ.get("SIMPREP_BROWSER")):
        print("SIMPREP_BROWSER names no Chromium", file=sys.stderr)
        return 2
    print(f"preset {options.preset}, {browser}")
    for name, query in RESOLUTIONS.items():
        for scene in SCENES:
            one = rates(scene, options.seconds, options.preset, browser, query)
            print(
                f"{scene:16s} {name}: {one.sent:.1f} frames/s sent, {one.drawn:.1f} can be drawn,"
                f" simulated at {one.simulated:.2f} x real time",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
