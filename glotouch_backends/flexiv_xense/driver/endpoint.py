"""The driver's socket: one client at a time; others get an error.

By default it is a Unix socket in a directory that only its owner can enter. A network address needs keys (CURVE), and
only clients whose public keys lie in the keys' folder can connect.
"""

from __future__ import annotations

import select
from pathlib import Path

import msgspec
import zmq
import zmq.auth
from zmq.auth.thread import ThreadAuthenticator

from .messages import Answer, Beat, Failed, Request, decode_request, encode

LINGER_MS = 200
"""Time to deliver pending messages when the socket is closed."""
HEARTBEAT_SUFFIX = b"+"
"""End of the name of a client's heartbeat socket; the rest is the client's name. Heartbeats have their own thread."""


class DriverSocket:
    """Server socket of the driver.

    Args:
        address: ipc://PATH or tcp://HOST:PORT.
        keys: Folder with driver.key_secret and, in clients/, the clients' public keys; for tcp only.

    Raises:
        ValueError: tcp without keys, or an address of another kind.
    """

    def __init__(self, address: str, keys: Path | None = None) -> None:
        if not address.startswith(("ipc://", "tcp://")):
            raise ValueError(f"address {address!r}: must begin with ipc:// or tcp://")
        if address.startswith("tcp://") and keys is None:
            raise ValueError(f"address {address!r}: a network port is opened only with --keys")
        self._context = zmq.Context()
        self._guard: ThreadAuthenticator | None = None
        self._socket = self._context.socket(zmq.ROUTER)
        self._socket.setsockopt(zmq.LINGER, LINGER_MS)
        if keys is not None:
            self._guard = ThreadAuthenticator(self._context)
            self._guard.start()
            self._guard.configure_curve(domain="*", location=str(keys / "clients"))
            public, secret = zmq.auth.load_certificate(keys / "driver.key_secret")
            if secret is None:
                raise ValueError(f"{keys}/driver.key_secret has no secret key")
            self._socket.curve_publickey, self._socket.curve_secretkey = public, secret
            self._socket.curve_server = True
        self._socket.bind(address)
        self._wakes = int(self._socket.getsockopt(zmq.FD))
        self._client: bytes | None = None

    def receive(self, timeout_s: float) -> Request | None:
        """Return the client's next request, or None after `timeout_s`."""
        if not self._socket.poll(max(0, round(timeout_s * 1e3))):
            return None
        frames: list[bytes] = self._socket.recv_multipart()
        sender, body = frames[0], frames[-1]
        if self._client is None:
            self._client = sender.removesuffix(HEARTBEAT_SUFFIX)
        try:
            request: Request = decode_request(body)
        except msgspec.MsgspecError as e:
            self._answer(sender, Failed(number=0, kind="link", message=f"a request could not be read: {e}"))
            return None
        if sender == self._client + HEARTBEAT_SUFFIX:
            return request if isinstance(request, Beat) else None
        if sender != self._client:
            number = getattr(request, "number", 0)
            self._answer(sender, Failed(number=number, kind="connect", message="the driver has another client"))
            return None
        return request

    def wait(self, timeout_s: float) -> bool:
        """Wait at most `timeout_s` for a message, exactly. All earlier messages must have been received."""
        ready, _, _ = select.select([self._wakes], [], [], timeout_s)
        return bool(ready)

    def send(self, answer: Answer) -> None:
        """Send an answer to the client; drop it if the client is gone."""
        if self._client is not None:
            self._answer(self._client, answer)

    def _answer(self, to: bytes, answer: Answer) -> None:
        try:
            self._socket.send_multipart((to, encode(answer)), zmq.NOBLOCK)
        except zmq.Again:
            return

    def close(self) -> None:
        """Close the socket. Idempotent."""
        if self._guard is not None:
            self._guard.stop()
            self._guard = None
        self._socket.close()
        self._context.term()

    def __enter__(self) -> DriverSocket:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
