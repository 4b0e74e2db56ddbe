"""A session of the driver with one client."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from .devices import Served, connect_devices
from .endpoint import DriverSocket
from .faults import DeviceFault, vendor_call
from .loop import Lockstep, Paced
from .messages import PROTOCOL, Failed, Open, Opened, OpenProgress
from .session import DriverSession

MAX_WAIT_FOR_OPEN_S = 60.0
"""Longest wait for a client."""


class Log:
    """Event log: one JSON line an event with the monotonic clock, flushed at once so that a crash loses nothing."""

    def __init__(self, path: Path | None) -> None:
        self._file = None if path is None else path.open("a", encoding="utf-8")

    def __call__(self, event: str, **values: object) -> None:
        """Write one line."""
        if self._file is not None:
            line = {"monotonic_s": time.monotonic(), "pid": os.getpid(), "event": event, **values}
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()

    def close(self) -> None:
        """Close the file. Idempotent."""
        if self._file is not None:
            self._file.close()


def serve(
    socket: DriverSocket, log: Log, stopping: Callable[[], bool], served: Served, *, forever: bool = False
) -> int:
    """Serve one session from its Open to its end; stop and release the devices on every path.

    Args:
        socket: The client's way in.
        log: Receives the events.
        stopping: Returns True to end.
        served: The devices.
        forever: Wait for a client without limit.

    Returns:
        0: ended on request; 1: a device did not come up, or failed outside a cycle; 4: no client came.
    """
    request = _first(socket, stopping, forever=forever)
    if request is None:
        return 4
    if request.protocol != PROTOCOL:
        message = f"client speaks protocol {request.protocol}, this driver {PROTOCOL}: install matching versions"
        socket.send(Failed(number=request.number, kind="connect", message=message))
        return 1
    try:
        devices = connect_devices(request, served, lambda text: socket.send(OpenProgress(text)))
    except DeviceFault as e:
        log("not opened", kind=e.kind, message=e.message)
        socket.send(e.answer(request.number))
        return 1
    try:
        with vendor_call("the session"):  # so that no client can end a driver that stays
            session = DriverSession(devices, request)
            low, high = devices.arm.joint_limits()
            info = devices.arm.describe() | {"devices": served.kind, "python": sys.version.split()[0]}
            socket.send(Opened(number=request.number, info=info, q_min=low, q_max=high))
            log("opened", kind=served.kind)
            loop = (Lockstep if request.lockstep else Paced)(session, socket, log, stopping)
            loop.run(request.period_s)
    except DeviceFault as e:
        log("fault", kind=e.kind, message=e.message)
        socket.send(e.answer(0))
        return 1
    finally:
        if request.move:
            devices.release()
        log("released")
    return 0


def _first(socket: DriverSocket, stopping: Callable[[], bool], *, forever: bool) -> Open | None:
    """Wait for the request that opens a session."""
    began = time.monotonic()
    while not stopping():
        request = socket.receive(1.0)
        if isinstance(request, Open):
            return request
        if not forever and time.monotonic() - began > MAX_WAIT_FOR_OPEN_S:
            return None
    return None
