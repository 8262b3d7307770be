"""The server: it serves its page on loopback, refuses what it must, and stops. In a browser only where one is named."""

import contextlib
import http.client
import os
import threading
import time

import pytest

pytest.importorskip("mjviser")
viser = pytest.importorskip("viser")

from websockets.exceptions import ConnectionClosed, InvalidStatus  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

from simprep.app.app import App  # noqa: E402
from simprep.app.display import Display  # noqa: E402
from simprep.app.stage import stage  # noqa: E402
from simprep.errors import SettingError  # noqa: E402

PROTOCOL = f"viser-v{viser.__version__}"


@pytest.fixture
def app(session):
    made = App(session)
    thread = threading.Thread(target=made.serve)
    thread.start()
    yield made
    made.stop()
    thread.join(10)
    assert not thread.is_alive()
    with pytest.raises(OSError, match="refused"):
        get(made)


def get(app, path="/", **headers):
    port = int(app.address.rpartition(":")[2])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    with contextlib.closing(connection):
        connection.request("GET", path, headers={**headers, "Connection": "close"})
        with connection.getresponse() as answer:
            return answer.status, answer.headers, answer.read()


def drain(connection):
    while True:
        connection.recv(timeout=10)


def test_the_page_is_served_here_and_to_nobody_else(app):
    status, headers, body = get(app)
    assert status == 200
    assert b"<html" in body[:500].lower()
    assert "default-src 'self'" in headers["Content-Security-Policy"]
    assert get(app, "/%2e%2e/%2e%2e/pyproject.toml")[0] == 404
    assert get(app, Host="evil.example")[0] == 403
    assert get(app, Origin="http://evil.example")[0] == 403
    socket = app.address.replace("http", "ws")
    with pytest.raises(InvalidStatus, match="403"):
        connect(socket, origin="http://evil.example", subprotocols=[PROTOCOL])
    with connect(socket, origin=app.address, subprotocols=[PROTOCOL]) as connection:
        assert connection.recv(timeout=10)
        connection.send(b"\x00 no message")
        with pytest.raises(ConnectionClosed):
            drain(connection)
    assert get(app)[0] == 200
    assert app.server.request_share_url() is None


def test_a_port_in_use_is_named(app, session):
    with pytest.raises(SettingError, match="valid: another --port"):
        App(session, port=int(app.address.rpartition(":")[2]))


def test_ghosts_stand_where_the_reference_is(session):
    for _ in range(3):
        session.advance()
    moment = session.newest
    display = Display(session.director.characters, stage("ball"))
    data = display.pose(moment)
    root = display.ghosts[0]
    assert data.xpos[root] == pytest.approx(moment.references[0][:3])
    assert data.xpos[1] == pytest.approx(moment.bodies[0][:3])
    assert (display.model.geom_rgba[display.model.geom_bodyid == root, 3] < 0.5).all()


@pytest.mark.skipif("SIMPREP_BROWSER" not in os.environ, reason="SIMPREP_BROWSER names no Chromium")
def test_in_a_browser(app, session, tmp_path):
    sync_api = pytest.importorskip("playwright.sync_api")
    arguments = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=os.environ["SIMPREP_BROWSER"], args=arguments)
        tabs = [browser.new_page(viewport={"width": 700, "height": 450}) for _ in range(2)]
        errors, requests = [], []
        for tab in tabs:
            tab.on("console", lambda message: errors.append(message.text) if message.type == "error" else None)
            tab.on("request", lambda request: requests.append(request.url))
            tab.goto(app.address)
            tab.get_by_role("button", name="single step").wait_for(timeout=60_000)
        first, second = tabs
        first.get_by_text("live", exact=True).click()  # the first tab looks back
        first.get_by_role("button", name="pause / go on (all tabs)").click()
        deadline = time.time() + 30
        while not session.paused and time.time() < deadline:
            first.wait_for_timeout(200)
        assert session.paused
        first.wait_for_timeout(2000)
        assert "looking back" in first.content()
        assert "looking back" not in second.content()
        first.screenshot(path=os.environ.get("SIMPREP_SCREENSHOTS", str(tmp_path)) + "/page.png", timeout=120_000)
        browser.close()
    assert errors == []
    assert all(url.startswith((app.address, "blob:", "data:")) for url in requests)
