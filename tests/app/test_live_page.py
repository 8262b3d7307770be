"""The server: it serves its page on loopback, refuses what it must, and stops."""

import contextlib
import http.client
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

pytest.importorskip("mjviser")
viser = pytest.importorskip("viser")

from websockets.exceptions import ConnectionClosed, InvalidStatus  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

from simprep.app.app import App  # noqa: E402
from simprep.app.display import GHOST_SIDES, GHOST_SIZE, Display  # noqa: E402
from simprep.app.stage import stage  # noqa: E402
from simprep.errors import SettingError  # noqa: E402
from simprep.report.replay.meshes import segment_hulls  # noqa: E402

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
    for path in ("/", "/?live", "/?fixedDpr=0.5"):
        status, headers, body = get(app, path)
        assert status == 200
        assert b"<html" in body[:500].lower()
        assert (len(body) > 100_000) == (path != "/")  # the bare address only sends on
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
    root = min(display.ghosts)
    assert data.xpos[root] == pytest.approx(moment.references[0][:3])
    assert data.xpos[1] == pytest.approx(moment.bodies[0][:3])
    # mjviser would draw their geoms so that nothing is seen through them
    assert not np.isin(display.model.geom_bodyid, list(display.ghosts)).any()
    (ghost, faces), (body, _) = display.ghosts[root], segment_hulls(session.director.characters[0], GHOST_SIDES)[0]
    assert len(faces)
    assert np.ptp(ghost, axis=0) == pytest.approx(GHOST_SIZE * np.ptp(body, axis=0), rel=1e-4)


def test_ctrl_c_ends_it_cleanly(tmp_path):
    page = ["app", "--scene", "empty", "--controller", "pd", "-o", str(tmp_path)]
    command = [sys.executable, "-m", "simprep.cli.main", *page]
    # what a shell starts in the background ignores SIGINT, and hands that on to what it starts itself
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True) as process:
        signal.signal(signal.SIGINT, before)
        assert process.stderr is not None
        try:
            told = next(line for line in process.stderr if "Ctrl-C ends it" in line)
            process.send_signal(signal.SIGINT)
            _, rest = process.communicate(timeout=60)
            assert process.returncode == 0
        finally:
            process.kill()
    assert "Traceback" not in rest
    port = int(told.split()[2].rpartition(":")[2])
    with pytest.raises(OSError, match="refused"):
        http.client.HTTPConnection("127.0.0.1", port, timeout=5).connect()
    assert list(tmp_path.iterdir()) == []
