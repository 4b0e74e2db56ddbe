"""The web server of the page: viser, bound to this machine's loopback interface and to pages of its own address."""

from __future__ import annotations

import contextlib
import io
import logging
import re
import socket
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from glotouch_bt.robot import BadInput

if TYPE_CHECKING:
    import viser

HOST = "127.0.0.1"
"""Address the page is served on. Nothing outside this machine can reach it."""
PORT = 8765
"""First port to try."""
PORTS = 50
"""Number of ports to try from `PORT` on."""
MIN_VISER = (1, 1)
"""Oldest version that has the panels of the page."""
INSTALL = "pip install 'viser>=1.1'"
"""Command that installs what a view needs."""


class PortTaken(BadInput):
    """Another program took the port between the look and the opening."""


def require_viser() -> None:
    """Require that viser is installed.

    Raises:
        BadInput: It is not, or it is too old; the message says how to install it.
    """
    try:
        found = version("viser")
    except PackageNotFoundError:
        raise BadInput(f"a view needs viser, which is not installed: {INSTALL}") from None
    if tuple(int(n) for n in re.findall(r"\d+", found)[:2]) < MIN_VISER:
        raise BadInput(f"a view needs viser {'.'.join(map(str, MIN_VISER))} or newer, not {found}: {INSTALL}")


def free_port(port: int | None) -> int:
    """Return the port if it is free, or the next free one after `PORT` if none is given.

    Raises:
        BadInput: The port, or every one that was tried, is in use.
    """
    for number in range(PORT, PORT + PORTS) if port is None else (port,):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((HOST, number))
            except OSError:
                continue
        return number
    if port is not None:
        raise BadInput(f"--port {port}: is in use or not allowed; give another port, or leave --port out")
    raise BadInput(f"the ports {PORT} to {PORT + PORTS - 1} are all in use; give a free one with --port")


def address(port: int) -> str:
    """Return the page's address."""
    return f"http://{HOST}:{port}"


def open_server(port: int) -> viser.ViserServer:
    """Serve an empty page on a port of the loopback interface.

    Raises:
        BadInput: viser is not installed.
        PortTaken: Another program took the port meanwhile.
    """
    require_viser()
    import viser

    class LoopbackServer(viser.ViserServer):
        """A server that never opens the public tunnel that viser offers to every page."""

        def request_share_url(self, verbose: bool = True) -> str | None:
            """Refuse."""
            return None

    # websockets logs each connection that is no websocket, for example of a port scan, as an error with a traceback
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    with _own_pages_only(port), contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner
        server = LoopbackServer(host=HOST, port=port, verbose=False)
        taken = server.get_port() != port
        if taken:
            server.stop()
    if taken:
        raise PortTaken(f"port {port} was taken meanwhile; try again")
    return server


@contextlib.contextmanager
def _own_pages_only(port: int) -> Iterator[None]:
    """Let the websocket server that is opened in this block refuse pages of other origins.

    viser accepts the websocket of any page that the browser shows. Without this, a foreign page could read the mission
    and press its buttons. The origin is also that of the address typed, so DNS rebinding does not help it.
    """
    import websockets.asyncio.server as websocket_server
    from websockets.typing import Origin

    serve = websocket_server.serve
    allowed = [Origin(address(port)), Origin(f"http://localhost:{port}")]

    def serve_own(handler: Any, host: Any, number: Any, **options: Any) -> Any:
        return serve(handler, host, number, origins=allowed, **options)

    websocket_server.serve = serve_own  # type: ignore[misc,assignment]
    try:
        yield
    finally:
        websocket_server.serve = serve  # type: ignore[misc]
