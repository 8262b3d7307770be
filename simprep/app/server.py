"""The web server of the page: viser's, kept to this machine. Needs the extra `app`."""

import contextlib
import http
import socket
from collections.abc import Iterator
from typing import Any
from unittest import mock

from simprep.errors import MissingExtraError, SettingError

try:
    import viser
    import websockets.asyncio.server
    from websockets import Headers
    from websockets.http11 import Request, Response

    from simprep.app.entry import entry
except ImportError:
    raise MissingExtraError("the live page", "app") from None

LOOPBACK = "127.0.0.1"
_LOCAL = ("127.0.0.1", "localhost", "[::1]")
POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; connect-src 'self' ws: data: blob:; "
    "worker-src 'self' blob: data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""What browsers let the page do: fetch from this server and nowhere else."""


class PageServer(viser.ViserServer):  # type: ignore[misc]
    """A viser server that answers this machine only.

    Browsers send a page's origin with its web sockets; one of another origin is refused, and so is a request whose host
    is not this server's name (a name of the attacker's that resolves to this machine). viser itself checks neither.

    Args:
        host: address to bind to.
        port: to bind to; 0 for a free one.
        label: over the controls.

    Raises:
        SettingError: the port is in use, or the address not this machine's.
    """

    def __init__(self, host: str = LOOPBACK, port: int = 0, label: str = "simprep") -> None:
        port = _free_port(host, port)
        names = dict.fromkeys([*_LOCAL, host])
        with _guarded(tuple(f"{name}:{port}" for name in names), host in (LOOPBACK, "localhost", "::1")):
            super().__init__(host=host, port=port, label=label, verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Nothing: viser would open a tunnel through a server on the internet, at the wish of any tab."""
        return None


def _free_port(host: str, port: int) -> int:
    if not 0 <= port <= 65535:
        raise SettingError(f"port {port}; valid: 0 (a free one) to 65535")
    try:
        with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as found:
            found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            found.bind((host, port))
            return int(found.getsockname()[1])
    except OSError as error:
        raise SettingError(
            f"cannot listen at {host}:{port} ({error.strerror}); valid: another --port or --host"
        ) from None


@contextlib.contextmanager
def _guarded(hosts: tuple[str, ...], local: bool) -> Iterator[None]:
    """While it lasts, servers of web sockets begin with a check of origin and host, which viser has no option for."""
    serve = websockets.asyncio.server.serve

    def checked(handler: Any, host: Any = None, port: Any = None, **options: Any) -> Any:
        answer = options["process_request"]

        def process(connection: Any, request: Request) -> Response | None:
            named = request.headers.get("Host", "")
            origin = request.headers.get("Origin")
            wrong_host = local and named not in hosts
            # bound to more than loopback, the page's own host is whatever name it was called by
            wrong_origin = origin is not None and origin.removeprefix("http://") not in (
                (*hosts, named) if not local else hosts
            )
            if wrong_host or wrong_origin:
                return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", Headers(), b"refused: another origin or host\n")
            response = entry(request) or answer(connection, request)
            if response is not None:
                response.headers["Content-Security-Policy"] = POLICY
                response.headers["X-Content-Type-Options"] = "nosniff"
            return response  # type: ignore[no-any-return]

        return serve(handler, host, port, **{**options, "process_request": process, "max_size": 2**20})

    with mock.patch.object(websockets.asyncio.server, "serve", checked):
        yield
