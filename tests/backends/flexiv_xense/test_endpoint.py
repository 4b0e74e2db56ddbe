"""The socket: a network port needs keys; no message, key or connection ends the driver."""

from __future__ import annotations

import os
import shutil
import socket as sockets
import threading
import uuid
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import msgspec
import pytest

from glotouch_backends.flexiv_xense.client.backend import FlexivXenseBackend
from glotouch_backends.flexiv_xense.client.link import DriverLink
from glotouch_backends.flexiv_xense.client.options import read_options
from glotouch_backends.flexiv_xense.driver.__main__ import main
from glotouch_backends.flexiv_xense.driver.endpoint import DriverSocket
from glotouch_backends.flexiv_xense.driver.messages import (
    MAX_REQUEST_BYTES,
    Accepted,
    BadMessage,
    HoldRequest,
    Open,
    Opened,
    decode_answer,
    decode_request,
    encode,
)
from glotouch_bt.commissioning import write_keys
from glotouch_bt.robot import BackendError, BadInput


def request(number: int = 7, **settings: object) -> Open:
    options, devices = read_options({"devices": "simulated", **settings})
    return FlexivXenseBackend()._request(options, devices, b"", number, True)


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    write_keys(tmp_path / "keys")
    return tmp_path / "keys"


def answer_one(socket: DriverSocket, stop: threading.Event) -> None:
    while not stop.is_set():
        request = socket.receive(0.05)
        if isinstance(request, (HoldRequest, Open)):
            socket.send(Accepted(number=request.number))


@pytest.fixture
def server(keys: Path) -> Iterator[str]:
    address = "tcp://127.0.0.1:48655"
    stop = threading.Event()
    with DriverSocket(address, keys / "driver") as socket:
        thread = threading.Thread(target=answer_one, args=(socket, stop))
        thread.start()
        yield address
        stop.set()
        thread.join()


def test_a_client_with_a_known_key_is_accepted(server: str, keys: Path) -> None:
    with closing(DriverLink(server, lambda: None, paced=False, keys=keys / "client")) as link:
        assert link.ask(request(7), Accepted, limit_s=10.0).number == 7


@pytest.mark.parametrize("who", ["nobody", "stranger"])
def test_a_client_without_a_known_key_gets_no_answer(server: str, keys: Path, who: str) -> None:
    given: Path | None = None
    if who == "stranger":
        write_keys(keys / "others")
        given = keys / "others" / "client"
        shutil.copy(keys / "client" / "driver.key", given)
    link = DriverLink(server, lambda: None, paced=False, keys=given)
    with pytest.raises(BackendError, match="nothing heard"):
        link.ask(request(7), Accepted, limit_s=0.5)
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
            assert link.ask(request(7), Accepted, limit_s=10.0).number == 7
        finally:
            link.close()
            stop.set()
            thread.join()


def test_secret_keys_are_for_their_owner_alone(keys: Path) -> None:
    before = os.umask(0)
    try:
        write_keys(keys, "laptop")
    finally:
        os.umask(before)
    for path in keys.rglob("*.key_secret"):
        assert path.stat().st_mode & 0o777 == 0o600
    for name in ("driver", "client", "laptop"):
        assert (keys / name).stat().st_mode & 0o777 == 0o700
    (keys / "driver" / "driver.key_secret").chmod(0o640)
    with pytest.raises(ValueError, match="others can read"):
        DriverSocket("tcp://127.0.0.1:48656", keys / "driver")
    (keys / "client" / "client.key_secret").chmod(0o604)
    with pytest.raises(BadInput, match="others can read"):
        DriverLink("tcp://127.0.0.1:48656", lambda: None, paced=False, keys=keys / "client")


def test_keys_are_never_replaced(keys: Path) -> None:
    before = {p: p.read_bytes() for p in keys.rglob("*") if p.is_file()}
    with pytest.raises(BadInput, match="exists already"):
        write_keys(keys)
    write_keys(keys, "laptop")
    assert all(p.read_bytes() == content for p, content in before.items())
    assert sorted(p.name for p in (keys / "driver" / "clients").iterdir()) == ["client.key", "laptop.key"]
    assert (keys / "laptop" / "driver.key").read_text() == (keys / "driver" / "driver.key").read_text()
    for name in ("driver", "../x", "", "a b"):
        with pytest.raises(BadInput, match="must be one word"):
            write_keys(keys, name)


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"\xc1 rubbish",
        b"\x81\xa4type\xa2\xff\xfe",  # text that is no UTF-8
        b"\x82\xa4type\xa4Beat\xa1x" + b"\x91" * 60_000 + b"\xc0",  # nesting
        encode(HoldRequest(number=1)).replace(b"\x01", b"\xcb\x7f\xf8\0\0\0\0\0\0"),
    ],
    ids=["empty", "rubbish", "text", "nesting", "number"],
)
def test_whatever_the_bytes_are_decoding_raises_one_error(body: bytes) -> None:
    for decode in (decode_request, decode_answer):
        with pytest.raises(BadMessage):
            decode(body)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("arm", "force_N"), float("nan")),
        (("arm", "force_N"), float("inf")),
        (("arm", "force_N"), 1e9),
        (("arm", "speed_m_s"), -1.0),
        (("arm", "q_max"), [1.0] * 6),
        (("tool", "pose_E_P"), [0.0] * 8),
        (("hand", "pad_shape"), [0, 20]),
        (("hand", "pad_shape"), [100000, 100000]),
        (("period_s",), 0.0),
        (("devices", "kind"), "cell"),
        (("devices", "settings", "gripper"), "serial:/etc/shadow"),
        (("devices", "settings", "gripper"), "serial:/dev/tty/../sda"),
        (("devices", "world"), "a path"),
    ],
)
def test_a_request_that_limits_nothing_or_names_a_file_is_refused(place: tuple[str, ...], value: object) -> None:
    plain = msgspec.msgpack.decode(encode(request()))
    decode_request(msgspec.msgpack.encode(plain))
    at = plain
    for name in place[:-1]:
        at = at[name]
    at[place[-1]] = value
    with pytest.raises(BadMessage):
        decode_request(msgspec.msgpack.encode(plain))


def test_the_referee_answers_a_fixed_list_of_questions() -> None:
    for method in ("_robot", "__class__", "places_B_m", "shove"):
        with pytest.raises(BadMessage):
            decode_request(msgspec.msgpack.encode({"type": "RefereeRequest", "number": 1, "method": method}))


def test_the_first_peer_that_opens_is_the_client(server: str, keys: Path) -> None:
    """One that sends rubbish, or another request, before it does not become the client."""
    links = [DriverLink(server, lambda: None, paced=False, keys=keys / "client") for _ in range(2)]
    try:
        links[0]._socket.send(b"rubbish")
        with pytest.raises(BackendError, match="could not be read"):
            links[0].ask(HoldRequest(number=1), Accepted, limit_s=10.0)
        with pytest.raises(BackendError, match="first request must be Open"):
            links[0].wait(1, Accepted, limit_s=10.0)
        assert links[1].ask(request(2), Accepted, limit_s=10.0).number == 2
        with pytest.raises(BackendError, match="another client"):
            links[0].ask(request(3), Accepted, limit_s=10.0)
    finally:
        for link in links:
            link.close()


def test_a_message_that_is_too_large_ends_only_its_connection(server: str, keys: Path) -> None:
    with closing(DriverLink(server, lambda: None, paced=False, keys=keys / "client")) as flood:
        flood._socket.send(bytes(MAX_REQUEST_BYTES + 1))
        with pytest.raises(BackendError, match="nothing heard"):
            flood.wait(0, Accepted, limit_s=0.5)
    with closing(DriverLink(server, lambda: None, paced=False, keys=keys / "client")) as link:
        assert link.ask(request(2), Accepted, limit_s=10.0).number == 2


def test_a_flood_of_connections_does_not_lock_a_client_out(server: str, keys: Path) -> None:
    host, port = server.removeprefix("tcp://").split(":")
    flood = [sockets.create_connection((host, int(port))) for _ in range(200)]
    try:
        for one in flood:
            one.sendall(b"\xff" + bytes(8) + b"\x7f\x03" + os.urandom(60))
        with closing(DriverLink(server, lambda: None, paced=False, keys=keys / "client")) as link:
            assert link.ask(request(2), Accepted, limit_s=20.0).number == 2
    finally:
        for one in flood:
            one.close()


def test_a_lost_driver_is_not_waited_for_again(tmp_path: Path) -> None:
    with closing(DriverLink(f"ipc://{tmp_path / 'nobody'}", lambda: None, paced=False)) as link:
        with pytest.raises(BackendError, match="nothing heard"):
            link.ask(request(1), Opened, limit_s=0.3)
        with pytest.raises(BackendError, match="nothing heard"):
            link.ask(request(2), Opened, limit_s=1e6)


def test_simulated_devices_are_not_served_on_the_network(keys: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words in (["--simulated"], ["--cell", "x"]):
        with pytest.raises(SystemExit):
            main(["--address", "tcp://127.0.0.1:48657", "--keys", str(keys / "driver"), *words])
        assert "ipc:// only" in capsys.readouterr().err


def test_unusable_addresses_and_keys_are_named(keys: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for address in ("nonsense", "tcp://", "udp://x:1"):
        with pytest.raises(BadInput, match="no connection to"):
            DriverLink(address, lambda: None, paced=False)
    for name in ("client/driver.key", "client/client.key_secret", "driver/driver.key_secret"):
        (keys / name).write_text('metadata\ncurve\n    public-key = "short"\n    secret-key = "short"\n')
    with pytest.raises(BadInput, match="no connection to"):
        DriverLink("tcp://127.0.0.1:48656", lambda: None, paced=False, keys=keys / "client")
    assert main(["--address", "tcp://127.0.0.1:48656", "--keys", str(keys / "driver")]) == 2
    assert main(["--address", "ipc://" + "x" * 200]) == 2
    assert "Traceback" not in capsys.readouterr().err


def test_a_driver_needs_usable_keys(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--address", "tcp://127.0.0.1:48657", "--keys", str(tmp_path)]) == 2
    assert "driver.key_secret" in capsys.readouterr().err
