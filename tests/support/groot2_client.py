"""A monitor of BehaviorTree.CPP 4, written from groot2_protocol.h, the library's own description of the protocol.

It shares no code with the publisher that it tests: every number stands here again.
"""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
from types import TracebackType
from typing import Any, Self

import msgspec
import zmq

STATUSES = {0: "IDLE", 1: "RUNNING", 2: "SUCCESS", 3: "FAILURE", 4: "SKIPPED"}
PATIENCE_MS = 20_000


class ServerError(Exception):
    """The reply was an error."""


class Groot2Client:
    """Asks like Groot2, one request after the other."""

    def __init__(self, port: int) -> None:
        self._context = zmq.Context()
        self.socket = self._context.socket(zmq.REQ)
        self.socket.setsockopt(zmq.RCVTIMEO, PATIENCE_MS)
        for option in (zmq.REQ_RELAXED, zmq.REQ_CORRELATE):  # ask again although there was no reply
            self.socket.setsockopt(option, 1)
        self.socket.connect(f"tcp://127.0.0.1:{port}")
        self._number = 0
        self.tree_id = b""

    def exchange(self, *parts: bytes) -> list[bytes]:
        """Send a message as it is, return the reply as it is."""
        self.socket.send_multipart(parts)
        return self.socket.recv_multipart()

    def ask(self, kind: str, *rest: bytes, protocol: int = 2) -> list[bytes]:
        """Send a request, check the header of the reply, return its other parts."""
        self._number += 1
        header = bytes([protocol, ord(kind)]) + self._number.to_bytes(4, "little")
        reply = self.exchange(header, *rest)
        if reply[0] == b"error":
            assert len(reply) == 2, reply
            raise ServerError(reply[1].decode())
        assert len(reply[0]) == 22, reply[0]
        assert reply[0][0] == 2
        assert reply[0][1:6] == header[1:]
        if self.tree_id:
            assert self.tree_id == reply[0][6:]
        self.tree_id = reply[0][6:]
        return reply[1:]

    def tree(self) -> ET.Element:
        """Return the XML of the tree."""
        (xml,) = self.ask("T")
        return ET.fromstring(xml)

    def codes(self) -> dict[int, int]:
        """Return the status byte of every node by its number."""
        (content,) = self.ask("S")
        assert len(content) % 3 == 0
        return dict(struct.iter_unpack("<HB", content))

    def statuses(self) -> dict[str, str]:
        """Return the status of every node by its name; that of an idle one is `IDLE was X`."""
        names = {int(e.attrib["_uid"]): e.attrib["name"] for e in self.tree().iter() if "_uid" in e.attrib}
        codes = self.codes()
        assert set(names) == set(codes)
        return {names[u]: STATUSES[c] if c < 10 else f"IDLE was {STATUSES[c - 10]}" for u, c in codes.items()}

    def blackboard(self, names: str) -> Any:
        """Return the dump of blackboards (names separated by `;`)."""
        (content,) = self.ask("B", names.encode())
        return msgspec.msgpack.decode(content)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, e: BaseException | None, trace: TracebackType | None) -> None:
        self._context.destroy(linger=0)
