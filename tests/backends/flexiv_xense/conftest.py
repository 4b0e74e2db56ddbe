from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from glotouch_backends.flexiv_xense.client.backend import PERIOD_S, FlexivXenseBackend
from glotouch_backends.flexiv_xense.client.link import DriverLink
from glotouch_backends.flexiv_xense.client.options import read_options
from glotouch_backends.flexiv_xense.client.robot import FlexivXenseRobot
from glotouch_backends.flexiv_xense.driver.devices import Served, connect
from glotouch_backends.flexiv_xense.driver.endpoint import DriverSocket
from glotouch_backends.flexiv_xense.driver.messages import Block, Opened
from glotouch_backends.flexiv_xense.driver.serve import Log, serve
from tests.backends.flexiv_xense.scripted import ScriptedVendor

Open = Callable[..., FlexivXenseRobot]


@pytest.fixture
def open_robot(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Open]:
    """Opens a robot over a driver in a thread of this process, with scripted devices."""
    ends: list[Callable[[], None]] = []

    def start(vendor: ScriptedVendor, *, moves: bool = True, **options: object) -> FlexivXenseRobot:
        monkeypatch.setattr(connect, "load_vendor", lambda *_, **__: vendor)
        address = f"ipc://{tmp_path / f'driver{len(ends)}'}"
        socket = DriverSocket(address)
        log = Log(tmp_path / "log.jsonl")
        stop = threading.Event()
        thread = threading.Thread(target=serve, args=(socket, log, stop.is_set, Served("simulated")), daemon=True)
        thread.start()
        options_, settings = read_options({"devices": "simulated", **options})
        backend = FlexivXenseBackend()
        link = DriverLink(address, lambda: None, paced=not options_.lockstep)

        def end() -> None:
            if robot is not None:
                robot.close()
            link.close()
            stop.set()
            thread.join(5.0)
            log.close()
            socket.close()
            assert not thread.is_alive()

        robot: FlexivXenseRobot | None = None
        ends.append(end)
        opened = link.ask(
            backend._request(options_, settings, b"", link.number(), moves), Opened, on_progress=lambda _: None
        )
        link.beat()
        first = link.wait(0, Block)
        robot = FlexivXenseRobot(backend.description, backend._limits, PERIOD_S, link, None, opened.info, first)
        return robot

    yield start
    for end in ends:
        end()
