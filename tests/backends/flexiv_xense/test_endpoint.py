"""The socket: a network port needs keys."""

from __future__ import annotations

import threading
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest
import zmq.auth

from glotouch_backends.flexiv_xense.client.link import DriverLink
from glotouch_backends.flexiv_xense.driver.endpoint import DriverSocket
from glotouch_backends.flexiv_xense.driver.messages import Accepted, HoldRequest, Quit
from glotouch_bt.robot import BackendError


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    (tmp_path / "clients").mkdir()
    (tmp_path / "strangers").mkdir()
    zmq.auth.create_certificates(tmp_path, "driver")
    public, secret = zmq.auth.create_certificates(tmp_path, "client")
    (tmp_path / "clients" / "client.key").write_text(Path(public).read_text())
    assert Path(secret).name == "client.key_secret"
    return tmp_path


def answer_one(socket: DriverSocket, stop: threading.Event) -> None:
    while not stop.is_set():
        request = socket.receive(0.05)
        if isinstance(request, (HoldRequest, Quit)):
            socket.send(Accepted(number=request.number))


@pytest.fixture
def server(keys: Path) -> Iterator[str]:
    address = "tcp://127.0.0.1:48655"
    stop = threading.Event()
    with DriverSocket(address, keys) as socket:
        thread = threading.Thread(target=answer_one, args=(socket, stop))
        thread.start()
        yield address
        stop.set()
        thread.join()


def test_a_client_with_a_known_key_is_accepted(server: str, keys: Path) -> None:
    link = DriverLink(server, lambda: None, paced=False, keys=keys)
    assert link.ask(HoldRequest(number=7), Accepted, limit_s=10.0).number == 7
    link.close()


@pytest.mark.parametrize("who", ["nobody", "stranger"])
def test_a_client_without_a_known_key_gets_no_answer(server: str, keys: Path, who: str) -> None:
    given: Path | None = None
    if who == "stranger":
        given = keys / "strangers"
        zmq.auth.create_certificates(given, "client")
        (given / "driver.key").write_text((keys / "driver.key").read_text())
    link = DriverLink(server, lambda: None, paced=False, keys=given)
    with pytest.raises(BackendError, match="nothing heard"):
        link.ask(HoldRequest(number=7), Accepted, limit_s=0.5)
    link.close()


@pytest.mark.parametrize(("address", "text"), [("tcp://127.0.0.1:1", "only with --keys"), ("udp://x", "must begin")])
def test_no_port_without_keys(address: str, text: str) -> None:
    with pytest.raises(ValueError, match=text):
        DriverSocket(address)


@pytest.mark.parametrize("number", [int.from_bytes(bytes(15) + b"+"), int.from_bytes(b"\0" + b"+" * 15)])
def test_every_random_client_name_works(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, number: int) -> None:
    monkeypatch.setattr(uuid, "uuid4", lambda: uuid.UUID(int=number))
    address, stop = f"ipc://{tmp_path / 'driver'}", threading.Event()
    with DriverSocket(address) as socket:
        thread = threading.Thread(target=answer_one, args=(socket, stop))
        thread.start()
        link = DriverLink(address, lambda: None, paced=False)
        try:
            assert link.ask(HoldRequest(number=7), Accepted, limit_s=10.0).number == 7
        finally:
            link.close()
            stop.set()
            thread.join()
