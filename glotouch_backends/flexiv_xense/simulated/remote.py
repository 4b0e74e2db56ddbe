"""The vendors' modules in a client's process while the devices live in a cell: each call goes over a Unix socket."""

from __future__ import annotations

import os
import threading
import time
from dataclasses import dataclass
from multiprocessing.connection import Client, Connection
from types import SimpleNamespace
from typing import Any

from glotouch_backends.flexiv_xense.driver import Vendor, WallClock, messages
from glotouch_backends.flexiv_xense.simulated.vendor_api import flexivrdk, xensesdk
from glotouch_backends.flexiv_xense.simulated.wire import CALL, MAX_BYTES, NEW, REFEREE, Reference, decode, encode

CONNECT_S = 120.0
"""Longest wait for a cell to accept a connection."""
RETRY_S = 0.05
"""Interval between two attempts."""


class CellLink:
    """Calls into a cell; each thread has its own connection.

    Args:
        address: The cell's socket.
    """

    def __init__(self, address: str) -> None:
        self._address = address
        self._mine = threading.local()

    def ask(self, *request: Any) -> Any:
        """Send a request and return its answer; an exception of the cell is raised here.

        Raises:
            RuntimeError: The cell is gone.
        """
        try:
            connection = self._connection()
            connection.send_bytes(encode(request))
            done, answer = decode(connection.recv_bytes(MAX_BYTES))
        except (EOFError, OSError) as e:
            raise RuntimeError(f"the simulated cell does not answer ({str(e) or 'its connection is closed'})") from e
        if not done:
            raise answer
        return answer

    def _connection(self) -> Connection[Any, Any]:
        found: Connection[Any, Any] | None = getattr(self._mine, "connection", None)
        if found is None:
            found = self._connect()
            found.send_bytes(encode(os.getpid()))
            self._mine.connection = found
        return found

    def _connect(self) -> Connection[Any, Any]:
        """Connect; wait for a cell that is still building its world."""
        until, pause = time.monotonic() + CONNECT_S, threading.Event()
        while True:
            try:
                return Client(self._address, family="AF_UNIX")
            except (FileNotFoundError, ConnectionRefusedError):
                if time.monotonic() > until:
                    raise
                pause.wait(RETRY_S)


class RemoteObject:
    """Proxy of an object in the cell: each method is a call."""

    def __init__(self, link: CellLink, reference: Reference) -> None:
        self._link, self._reference = link, reference

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)

        def call(*args: Any, **kwargs: Any) -> Any:
            return self._link.ask(CALL, self._reference.key, name, args, kwargs)

        setattr(self, name, call)
        return call


def _maker(link: CellLink, name: str) -> Any:
    """Return a stand-in for a class: calling it creates the object in the cell."""

    def make(*args: Any, **kwargs: Any) -> RemoteObject:
        plain = [a._reference if isinstance(a, RemoteObject) else a for a in args]
        return RemoteObject(link, link.ask(NEW, name, plain, kwargs))

    return make


@dataclass(frozen=True)
class RemoteVendor(Vendor):
    """The vendors' modules over a cell."""

    link: CellLink

    def referee(self, request: messages.RefereeRequest) -> messages.RefereeAnswer:
        """See `SimulatedVendor.referee`."""
        answer: messages.RefereeAnswer = messages.decode_answer(self.link.ask(REFEREE, messages.encode(request)))
        return answer


def open_remote_vendor(address: str) -> RemoteVendor:
    """Return the vendors' modules over a cell.

    Args:
        address: Its Unix socket.

    Raises:
        OSError: No cell listens there.
    """
    link = CellLink(address)
    arm = {name: getattr(flexivrdk, name) for name in flexivrdk.__all__}
    arm |= {"Robot": _maker(link, "Robot"), "Tool": _maker(link, "Tool")}
    tcp, serial = _maker(link, "XenseTCPGripper"), _maker(link, "XenseSerialGripper")

    def create(mac_addr: str | None = None, **kwargs: Any) -> Any:
        return tcp(mac_addr) if mac_addr is not None else serial(**kwargs)

    gripper = SimpleNamespace(create=create)
    sensor = SimpleNamespace(create=_maker(link, "Sensor"), OutputType=xensesdk.Sensor.OutputType)
    inner = SimpleNamespace(XenseGripper=gripper, XenseTCPGripper=tcp, XenseSerialGripper=serial)
    return RemoteVendor(
        SimpleNamespace(**arm),
        SimpleNamespace(Sensor=sensor),
        SimpleNamespace(XenseGripper=gripper, xense_gripper=inner),
        WallClock(),
        link,
    )
