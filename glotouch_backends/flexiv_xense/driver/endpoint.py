"""The driver's socket: one client at a time; others get an error.

By default it is a Unix socket in a directory that only its owner can enter. A network address needs keys (CURVE), and
only clients whose public keys lie in the keys' folder can connect. A message larger than allowed ends its connection
before it is read.
"""

from __future__ import annotations

import select
from pathlib import Path

import zmq
import zmq.auth
from zmq.auth.thread import ThreadAuthenticator

from .messages import MAX_REQUEST_BYTES, Answer, BadMessage, Beat, Failed, Open, Request, decode_request, encode

LINGER_MS = 200
"""Time to deliver pending messages when the socket is closed."""
MAX_WAITING = 100
"""Messages of one peer that wait to be read; further ones stay with their sender."""
HANDSHAKE_MS = 5000
"""A connection that has not proved its key by then is closed."""
HEARTBEAT_SUFFIX = b"+"
"""End of the name of a client's heartbeat socket; the rest is the client's name. Heartbeats have their own thread."""


def load_secret_key(path: Path) -> tuple[bytes, bytes]:
    """Return the public and the secret key of a file.

    Raises:
        ValueError: It has no secret key, or others than its owner may read it.
        OSError: It cannot be read.
    """
    if path.stat().st_mode & 0o077:
        raise ValueError(f"{path}: others can read this secret key; make new keys with `glotouch keys`")
    public, secret = zmq.auth.load_certificate(path)
    if secret is None:
        raise ValueError(f"{path}: has no secret key")
    return public, secret


class DriverSocket:
    """Server socket of the driver.

    Args:
        address: ipc://PATH or tcp://HOST:PORT.
        keys: Folder with driver.key_secret and, in clients/, the clients' public keys; for tcp only.
        max_bytes: Largest message.

    Raises:
        ValueError: tcp without keys, an address of another kind, or a key file that is unusable.
        OSError: The address cannot be opened, or the keys cannot be read.
    """

    def __init__(self, address: str, keys: Path | None = None, *, max_bytes: int = MAX_REQUEST_BYTES) -> None:
        if not address.startswith(("ipc://", "tcp://")):
            raise ValueError(f"address {address!r}: must begin with ipc:// or tcp://")
        if address.startswith("tcp://") and keys is None:
            raise ValueError(f"address {address!r}: a network port is opened only with --keys")
        self._context = zmq.Context()
        self._guard: ThreadAuthenticator | None = None
        self._socket = self._context.socket(zmq.ROUTER)
        for option, value in (
            (zmq.LINGER, LINGER_MS),
            (zmq.MAXMSGSIZE, max_bytes),
            (zmq.RCVHWM, MAX_WAITING),
            (zmq.HANDSHAKE_IVL, HANDSHAKE_MS),
        ):
            self._socket.setsockopt(option, value)
        try:
            if keys is not None:
                self._socket.curve_publickey, self._socket.curve_secretkey = load_secret_key(keys / "driver.key_secret")
                self._socket.curve_server = True
                self._guard = ThreadAuthenticator(self._context)
                self._guard.start()
                self._guard.configure_curve(domain="*", location=str(keys / "clients"))
            self._socket.bind(address)
        except zmq.ZMQError as e:
            self.close()
            raise OSError(f"{address}: {e.strerror}") from e
        except BaseException:
            self.close()
            raise
        self._wakes = int(self._socket.getsockopt(zmq.FD))
        self._client: bytes | None = None

    def receive(self, timeout_s: float) -> Request | None:
        """Return the client's next request, or None after `timeout_s`. The first peer to send `Open` is the client."""
        if not self._socket.poll(max(0, round(timeout_s * 1e3))):
            return None
        frames: list[bytes] = self._socket.recv_multipart()
        sender, body = frames[0], frames[-1]
        try:
            request: Request = decode_request(body)
        except BadMessage as e:
            self._answer(sender, Failed(number=0, kind="link", message=f"a request could not be read: {e}"))
            return None
        if self._client is None and isinstance(request, Open):
            self._client = sender
        if sender == self._client:
            return request
        if isinstance(request, Beat):
            return request if self._client is not None and sender == self._client + HEARTBEAT_SUFFIX else None
        message = "the first request must be Open" if self._client is None else "the driver has another client"
        self._answer(sender, Failed(number=request.number, kind="connect", message=message))
        return None

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
