"""The client's socket to the driver: numbered requests, answers with bounded waits, heartbeats."""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import zmq
import zmq.auth

from glotouch_backends.flexiv_xense.driver import HEARTBEAT_SUFFIX, load_secret_key, messages
from glotouch_bt.robot import BackendError, BadInput, GlotouchError, ParamError, StaleReading

A = TypeVar("A")
BEAT_S = 0.1
"""Interval between two heartbeats of the client."""
MAX_SILENCE_S = 0.5
"""A paced driver is lost after this time without a message; it sends a heartbeat every 0.05 s. Source: ours."""
SLOW_REQUEST_S = 10.0
"""The same while a slow request is pending: a blocking vendor call may stop the whole driver. Source: ours."""
OPEN_S = 120.0
"""Longest wait for the devices to open. Source: ours."""
LOCKSTEP_S = 30.0
"""Longest wait for an answer in lock-step, where a cycle takes milliseconds. Source: ours."""
POLL_S = 0.2
"""Interval between two checks of the driver's process while waiting."""


class DeviceError(BackendError):
    """A device failed; the message ends with the arm's last event."""


def failure(answer: messages.Failed) -> GlotouchError:
    """Return our error for the driver's, with the arm's event log in its notes."""
    if answer.kind == "input":
        return BadInput(answer.message)
    if answer.kind == "stale":
        error: BackendError = StaleReading(answer.message, answer.age_s, answer.limit_s)
    else:
        text = answer.message if answer.cause in answer.message else f"{answer.message} (from {answer.cause})"
        error = DeviceError(text)
    for e in answer.events:
        error.add_note(f"arm event {e.level} {e.id}: {e.description} {e.advice}".rstrip())
    if answer.events:
        last = answer.events[-1]
        error.args = (f"{error.args[0]}; last arm event: {last.level} {last.id} {last.description}",)
    return error


class DriverLink:
    """Connection to one driver.

    Args:
        address: ipc://PATH or tcp://HOST:PORT.
        alive: Returns why the driver's process has ended, or None while it runs.
        paced: True if the driver sends heartbeats.
        keys: Folder with client.key_secret and driver.key, for tcp.

    Attributes:
        slow_request: True while a slow request is pending; see `SLOW_REQUEST_S`.
    """

    def __init__(self, address: str, alive: Callable[[], str | None], *, paced: bool, keys: Path | None = None) -> None:
        self._alive, self._paced = alive, paced
        self._address, self._keys = address, keys
        self._context = zmq.Context()
        self._name = uuid.uuid4().hex.encode()  # hex: it never ends with HEARTBEAT_SUFFIX or begins with a zero byte
        try:
            self._socket = self._connect(self._name)
        except BaseException:
            self._context.term()
            raise
        self.slow_request = False
        self._number = 0
        self._stop = threading.Event()
        self._heart: threading.Thread | None = None
        self._closed = False
        self._lost: str | None = None

    def _connect(self, name: bytes) -> zmq.Socket[bytes]:
        socket = self._context.socket(zmq.DEALER)
        socket.setsockopt(zmq.LINGER, 200)
        socket.setsockopt(zmq.IDENTITY, name)
        socket.setsockopt(zmq.MAXMSGSIZE, messages.MAX_ANSWER_BYTES)
        try:
            if self._keys is not None:
                socket.curve_publickey, socket.curve_secretkey = load_secret_key(self._keys / "client.key_secret")
                socket.curve_serverkey, _ = zmq.auth.load_certificate(self._keys / "driver.key")
            socket.connect(self._address)
        except (OSError, ValueError, zmq.ZMQError) as e:
            socket.close()
            raise BadInput(f"options driver and keys: no connection to {self._address} can be made ({e})") from e
        return socket

    def number(self) -> int:
        """Return a number for the next request."""
        self._number += 1
        return self._number

    def beat(self) -> None:
        """Start sending heartbeats."""
        self._heart = threading.Thread(target=self._beat_on, daemon=True)
        self._heart.start()

    def _beat_on(self) -> None:
        body = messages.encode(messages.Beat())
        socket = self._connect(self._name + HEARTBEAT_SUFFIX)  # a zmq socket belongs to one thread
        while not self._stop.wait(BEAT_S):
            _send(socket, body)
        socket.close()

    def post(self, request: messages.Request) -> None:
        """Send a request without waiting for its answer."""
        if self._closed:
            raise BackendError("the link to the driver is closed")
        _send(self._socket, messages.encode(request))

    def ask(
        self,
        request: messages.Request,
        answer: type[A],
        *,
        limit_s: float | None = None,
        on_progress: Callable[[str], None] | None = None,
    ) -> A:
        """Send a request and wait for its answer, at most `limit_s` or LOCKSTEP_S.

        Raises:
            BackendError: The driver has ended or is silent, or a device failed. A lost driver is not waited for again.
            BadInput: The driver cannot build the simulated world.
            ParamError: The driver refused a command.
        """
        if self._lost is not None:
            raise BackendError(self._lost)
        self.post(request)
        return self.wait(request.number, answer, limit_s=limit_s, on_progress=on_progress)  # type: ignore[union-attr]

    def wait(
        self,
        number: int,
        kind: type[A],
        *,
        limit_s: float | None = None,
        on_progress: Callable[[str], None] | None = None,
    ) -> A:
        """Wait for the answer to an earlier request; errors as in `ask`."""
        began = heard = time.perf_counter()
        limit_s = quiet_s = LOCKSTEP_S if limit_s is None else limit_s
        if self._paced and on_progress is None:
            quiet_s = SLOW_REQUEST_S if self.slow_request else MAX_SILENCE_S
        while True:
            answer = self._receive(POLL_S)
            now, gone = time.perf_counter(), None
            if answer is None:
                gone = self._alive()
                answer = None if gone is None else self._receive(0.0)  # its last word may have come meanwhile
            if answer is None:
                if gone is not None:
                    raise self._lose(gone)
                if now - heard > quiet_s:
                    raise self._lose(f"nothing heard from the driver for {now - heard:.2f} s (limit {quiet_s:g} s)")
                continue
            heard = now
            if isinstance(answer, messages.OpenProgress) and on_progress is not None:
                on_progress(answer.text)
            if isinstance(answer, messages.Failed) and answer.number in (0, number):
                raise failure(answer)
            if isinstance(answer, messages.Refused) and answer.number in (0, number):
                raise ParamError(answer.name, answer.value, answer.rule)
            if isinstance(answer, kind) and getattr(answer, "number", number) == number:
                return answer
            if now - began > limit_s:
                raise self._lose(f"the driver did not answer within {limit_s:g} s")

    def _lose(self, why: str) -> BackendError:
        self._lost = why
        return BackendError(why)

    def _receive(self, timeout_s: float) -> messages.Answer | None:
        try:
            if not self._socket.poll(round(timeout_s * 1e3)):
                return None
            answer: messages.Answer = messages.decode_answer(self._socket.recv(zmq.NOBLOCK))
        except (messages.BadMessage, zmq.ZMQError) as e:
            raise self._lose(f"the driver's answer cannot be read: {e}") from e
        return answer

    def close(self) -> None:
        """Close the socket and end the heartbeats. Idempotent."""
        if self._closed:
            return
        self._closed = True
        self._stop.set()
        if self._heart is not None:
            self._heart.join()
        self._socket.close()
        self._context.term()


def _send(socket: zmq.Socket[bytes], body: bytes) -> None:
    try:
        socket.send(body, zmq.NOBLOCK)
    except zmq.Again:
        return  # no receiver; waiting for the answer will fail
