"""Serve a mission's state in the protocol of Groot2, as BehaviorTree.CPP's `Groot2Publisher` does.

Source of the protocol: BehaviorTree.CPP 4.10, groot2_protocol.h and groot2_publisher.cpp. A request is a header of six
bytes (protocol, type, number of the request), with a second part for some types. The reply repeats the header, adds 16
bytes that name the tree, and has the content as its second part. An error is the two parts "error" and a sentence.
"""

from __future__ import annotations

import struct
import threading
import uuid
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from types import TracebackType
from typing import Self

import msgspec
import zmq

from glotouch_bt.robot import BadInput, GlotouchError
from glotouch_bt.view.groot2.mission_state import MissionState
from glotouch_bt.view.server import HOST

PROTOCOL = 2
"""Version of the protocol. Source: `kProtocolID`."""
_REQUEST = struct.Struct("<BBI")
"""Header of a request: protocol, type, number of the request. Source: `SerializeHeader`."""
_POLL_MS = 50
"""Time between two looks at the record; a request is answered at once."""
_SEND_MS = 1000
"""Time after which a reply that nobody takes is dropped. Source: Groot2Publisher."""
_MAX_REQUEST_BYTES = 65_536
"""Size above which a request ends its connection. Source: ours; Groot2 sends names and hooks of a few hundred bytes."""
_CONTROL = frozenset("IRU")
"""Requests that set breakpoints or replace the result of a node. Source: `RequestType`."""
_RECORDING = frozenset("rt")
"""Requests of a recording of the status changes, which the run's record already is. Source: as above."""
_NO_HOOKS = {"A": [], "X": [], "D": [b"[]"]}
"""Requests about the existing breakpoints, of which there are none. Source: as above."""


class RefusedRequest(Exception):
    """A request that is answered with an error."""


class Groot2Publisher:
    """A server on the loopback interface. Use it in a `with` block.

    Args:
        port: Port of the requests. The next one is opened too: monitors wait there for notices of breakpoints.

    Attributes:
        address: The address that a monitor connects to.
        state: The mission; None: it has not begun.

    Raises:
        BadInput: A port is in use.
    """

    def __init__(self, port: int) -> None:
        self.address = f"{HOST}:{port}"
        self.state: MissionState | None = None
        self._tree_id = uuid.uuid4().bytes
        self._context = zmq.Context()
        self._server, self._notices = self._context.socket(zmq.REP), self._context.socket(zmq.PUB)
        self._server.setsockopt(zmq.MAXMSGSIZE, _MAX_REQUEST_BYTES)
        self._server.setsockopt(zmq.SNDTIMEO, _SEND_MS)
        for socket, number in ((self._server, port), (self._notices, port + 1)):
            try:
                socket.bind(f"tcp://{HOST}:{number}")
            except zmq.ZMQError as e:
                self.close()
                second = "" if number == port else f"; Groot2 needs the ports {port} and {number}"
                what = f"port {number} is in use or not allowed{second}; give another one: --groot2 PORT"
                raise BadInput(f"--groot2 {port}: {what}") from e

    def serve(self, over: threading.Event) -> None:
        """Answer requests until `over` is set. Call it in one thread; no request ends it."""
        while not (over.is_set() or self._server.closed):
            if self.state is not None:
                with suppress(GlotouchError):  # a broken record: its last state stays
                    self.state.update()
            with suppress(zmq.ZMQError):  # the monitor is gone, maybe since the poll: never wait for its request
                if self._server.poll(_POLL_MS):
                    self._server.send_multipart(self._reply(self._server.recv_multipart(zmq.NOBLOCK)))

    def close(self) -> None:
        """Close the ports; idempotent."""
        self._context.destroy(linger=0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def _reply(self, parts: list[bytes]) -> list[bytes]:
        try:
            if len(parts[0]) != _REQUEST.size:
                raise RefusedRequest("wrong request header")
            _, kind, number = _REQUEST.unpack(parts[0])
            return [_REQUEST.pack(PROTOCOL, kind, number) + self._tree_id, *self._content(chr(kind), parts[1:])]
        except RefusedRequest as e:
            return [b"error", str(e).encode()]
        except Exception as e:  # a fault of ours must not end the server
            return [b"error", f"{type(e).__name__}: {e}".encode()]

    def _content(self, kind: str, rest: list[bytes]) -> list[bytes]:
        if kind in _NO_HOOKS:
            return _NO_HOOKS[kind]
        if kind in _CONTROL:
            raise RefusedRequest("not supported: this mission can be watched, not controlled")
        if kind in _RECORDING:
            raise RefusedRequest("not supported: the run's folder has a record of every status change (run.mcap)")
        if kind not in "TSB":
            raise RefusedRequest("Request not recognized")
        if kind == "B" and len(rest) != 1:
            raise RefusedRequest("must be 2 parts message")
        if self.state is None:
            raise RefusedRequest("the mission has not begun")
        if kind == "T":
            return [self.state.tree.xml.encode()]
        if kind == "S":
            return [self.state.statuses()]
        return [msgspec.msgpack.encode(self.state.blackboard(rest[0].decode(errors="replace").split(";")))]


@contextmanager
def published(port: int, state: MissionState) -> Iterator[str]:
    """Serve a mission's state in a thread while the block runs; yield the address.

    Raises:
        BadInput: A port is in use.
    """
    over = threading.Event()
    with Groot2Publisher(port) as publisher, closing(state):
        publisher.state = state
        thread = threading.Thread(target=publisher.serve, args=(over,), daemon=True)
        thread.start()
        try:
            yield publisher.address
        finally:
            over.set()
            thread.join()
