"""The page in a real browser, where `SIMPREP_BROWSER` names a Chromium.

Pictures go to the folder `SIMPREP_SCREENSHOTS`. `SIMPREP_DUEL_S` is how long each duel lasts [s]; 2 without it.
"""

import contextlib
import os
import re
import threading
import time
from pathlib import Path

import numpy as np
import pytest

if "SIMPREP_BROWSER" not in os.environ:
    pytest.skip("SIMPREP_BROWSER names no Chromium", allow_module_level=True)
pytest.importorskip("mjviser")
sync_api = pytest.importorskip("playwright.sync_api")

from simprep.app.app import App  # noqa: E402
from simprep.app.page import HOTKEYS  # noqa: E402
from simprep.app.session import Session, SessionSettings  # noqa: E402
from simprep.app.stage import LAUNCHES  # noqa: E402
from simprep.motion.store import read_motion  # noqa: E402

ARGUMENTS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
VISER_SAYS = "Unable to preventDefault inside passive event listener invocation."
"""Chromium's word on a listener of viser's own page while a body is dragged, at times; the drag works. Nowhere else is it let pass."""
LONGEST_S = 240.0
"""A page that is drawn without a graphics card takes its time."""
RENDERER = """() => {
  const gl = document.createElement("canvas").getContext("webgl2");
  return gl.getParameter(gl.getExtension("WEBGL_debug_renderer_info").UNMASKED_RENDERER_WEBGL);
}"""
FLOOR = (400, 380)  # some 2 m before the character, left of the controls
"""Pixel on the floor, left of the controls, from where the camera begins."""


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as playwright:
        made = playwright.chromium.launch(executable_path=os.environ["SIMPREP_BROWSER"], args=ARGUMENTS)
        yield made
        made.close()


class Tabs:
    """Tabs of one page, and all that they complained about or asked for."""

    def __init__(self, browser, session, address):
        self.browser, self.session, self.address = browser, session, address
        self.errors, self.requests = [], []

    def open(self):
        tab = self.browser.new_page(viewport={"width": 900, "height": 560})
        tab.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)
        tab.on("request", lambda request: self.requests.append(request.url))
        tab.goto(self.address)
        tab.get_by_role("button", name="single step").wait_for(timeout=60_000)
        software = bool(re.search("SwiftShader|llvmpipe", tab.evaluate(RENDERER)))
        assert tab.url == self.address + ("/?fixedDpr=0.5" if software else "/?live")
        return tab

    def until(self, tab, happened):
        end = time.time() + LONGEST_S
        while not happened():
            assert time.time() < end, self.session.told
            tab.wait_for_timeout(200)

    def picture(self, tab, name):
        tab.wait_for_timeout(1000)
        folder = os.environ.get("SIMPREP_SCREENSHOTS")
        if folder:
            Path(folder).mkdir(parents=True, exist_ok=True)
            tab.screenshot(path=f"{folder}/{name}.png", timeout=120_000)


@contextlib.contextmanager
def shown(browser, session):
    app = App(session)
    thread = threading.Thread(target=app.serve)
    thread.start()
    tabs = Tabs(browser, session, app.address)
    try:
        yield tabs
    finally:
        for context in browser.contexts:
            context.close()
        app.stop()
        thread.join(10)
    assert tabs.errors == []
    assert all(url.startswith((app.address, "blob:", "data:")) for url in tabs.requests)


def settings(scene, tmp_path, **more):
    return SessionSettings(scene, folder=tmp_path, **more)


def test_a_click_sets_a_goal_and_the_character_gets_there(browser, tmp_path):
    session = Session(settings("empty", tmp_path))
    with shown(browser, session) as tabs:
        tab = tabs.open()
        tab.get_by_label("a click sets").click()
        tab.get_by_role("option", name="goal only").click()
        tab.get_by_label("arm", exact=True).click()
        tab.get_by_role("option", name="blended").click()
        tabs.until(tab, lambda: session.settings.arm == "blended")
        tab.mouse.click(*FLOOR)
        tabs.until(tab, lambda: session.told.startswith("goal"))
        goal = [float(value) for value in session.told.removeprefix("goal ").split(",")]
        tabs.until(tab, lambda: session.newest.caption.goal is not None)
        tabs.until(tab, lambda: np.linalg.norm(session.newest.bodies[0][:2] - goal) < 0.6)
        assert session.newest.fallen == ()
        tabs.picture(tab, "goal")


def test_each_hotkey_launches_its_motion(browser, tmp_path):
    session = Session(settings("empty", tmp_path))
    with shown(browser, session) as tabs:
        tab = tabs.open()
        for name, key in HOTKEYS.items():
            session.restart()
            tabs.until(tab, lambda: session.time > 0.1)
            tab.keyboard.press(key.lower())
            tabs.until(tab, lambda: session.newest.caption.doing == (LAUNCHES[name],))  # noqa: B023
            assert session.newest.fallen == ()
            tabs.picture(tab, f"key_{name}")


def test_a_kicked_ball_moves(browser, tmp_path):
    session = Session(settings("ball", tmp_path))
    with shown(browser, session) as tabs:
        tab = tabs.open()
        before = session.newest.things[0, :2]
        tabs.picture(tab, "ball_before")
        tab.get_by_role("button", name="do the scene's tasks").click()
        tabs.until(tab, lambda: np.linalg.norm(session.newest.things[0, :2] - before) > 0.3)
        assert any("ball" in parts for moment in session.history.all() for parts, _, _ in moment.hits)
        tabs.picture(tab, "ball_kicked")


@pytest.mark.parametrize("mode", ["automatic", "interactive", "passive"])
def test_a_duel_runs(browser, tmp_path, mode):
    seconds = float(os.environ.get("SIMPREP_DUEL_S", "2"))
    session = Session(settings(f"duel {mode}", tmp_path, seed=1))
    with shown(browser, session) as tabs:
        tab = tabs.open()
        if mode == "interactive":
            tab.keyboard.press("e")
            tabs.until(tab, lambda: session.told == "right punch")
            tab.mouse.click(*FLOOR)
            tabs.until(tab, lambda: session.newest.caption.goal is not None)
        tabs.until(tab, lambda: session.time > seconds)
        assert session.tracker.end == ""
        assert session.newest.caption.chances
        assert len(session.newest.bodies) == 2
        tabs.picture(tab, f"duel_{mode}")


def test_time_belongs_to_all_and_the_view_to_each_tab(browser, session, tmp_path):
    with shown(browser, session) as tabs:
        first, second = tabs.open(), tabs.open()
        tabs.until(first, lambda: session.time > 1.0)
        first.get_by_text("live", exact=True).click()  # the first tab looks back
        first.get_by_role("button", name="pause / go on (all tabs)").click()
        tabs.until(first, lambda: session.paused)
        first.get_by_role("slider").last.press("ArrowRight")
        now = session.time
        first.get_by_role("button", name="single step").click()
        tabs.until(first, lambda: session.time > now)
        assert session.time == pytest.approx(now + 1 / 60)
        first.get_by_role("button", name="save this as a motion").click()
        tabs.until(first, lambda: session.told.startswith("saved"))
        assert len(read_motion(tmp_path / "saved" / "motion.npz")) == len(session.history)
        first.wait_for_timeout(1500)
        assert "looking back" in first.content()
        assert "looking back" not in second.content()
        tabs.picture(first, "looking_back")


def test_a_body_that_is_dragged_is_pushed(browser, session):
    session.advance()
    session.pause()  # it stays where it can be found
    with shown(browser, session) as tabs:
        tab = tabs.open()
        tab.wait_for_timeout(3000)
        x, y = pixel(session.newest.bodies[0][:3])
        tabs.picture(tab, "before_drag")
        tab.mouse.move(x, y)
        tab.mouse.down()
        tab.mouse.move(x + 40, y, steps=5)
        tab.mouse.move(x + 80, y, steps=5)
        tab.mouse.up()
        tabs.until(tab, lambda: session.told.startswith("push"))
        tabs.errors = [one for one in tabs.errors if one != VISER_SAYS]


def pixel(point, fov_deg=75.0):
    """Where a point of the world is on the page, from where the camera begins (`Page`)."""
    camera, look_at = np.array([2.2, -4.4, 1.9]), np.array([2.2, 0.0, 0.75])
    ahead = (look_at - camera) / np.linalg.norm(look_at - camera)
    right = np.array([1.0, 0.0, 0.0])
    way = np.asarray(point) - camera
    scale = 280 / (np.tan(np.radians(fov_deg / 2)) * (way @ ahead))
    return 450 + scale * (way @ right), 280 - scale * (way @ np.cross(right, ahead))
