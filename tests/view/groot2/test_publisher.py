"""Our publisher: only this machine reaches it, and nothing that is sent to it ends it."""

from __future__ import annotations

import random
import socket
import threading
from pathlib import Path

import pytest
import zmq

from glotouch_bt.robot import BadInput
from glotouch_bt.view.groot2 import Groot2Publisher
from tests.support.groot2_client import Groot2Client, ServerError
from tests.view.groot2.conftest import Server, record_small, state_of, two_ports


def test_the_status_of_each_node_at_each_time(small: Path) -> None:
    """0 idle, 1 running, 2 success, 3 failure; 10 more: idle after that."""
    clock = [0.0]
    state = state_of(small, lambda: clock[0])
    assert state.statuses() == b"\x01\0\0\x02\0\0\x03\0\0\x04\0\0\x05\0\0"  # no record yet
    assert state.blackboard(["small"]) == {"small": {}}
    state.update()
    seen = {}
    for clock[0] in (-1.0, 0.5, 1.5, 2.5, 3.5):
        content = state.statuses()
        assert content[0::3] + content[1::3] == bytes([1, 2, 3, 4, 5, 0, 0, 0, 0, 0])
        seen[clock[0]] = list(content[2::3])
    state.close()
    assert seen == {
        -1.0: [0, 0, 0, 0, 0],
        0.5: [1, 1, 0, 0, 0],
        1.5: [1, 2, 2, 1, 1],
        2.5: [2, 2, 2, 2, 3],
        3.5: [11, 12, 0, 2, 13],
    }


def test_the_blackboard_at_each_time(small: Path) -> None:
    clock = [0.5]
    state = state_of(small, lambda: clock[0])
    state.update()
    assert state.blackboard(["small"]) == {"small": {}}
    clock[0] = 1.5
    plan = {"poses": [1.5, None], "name": "é"}
    assert state.blackboard(["other", "small"]) == {"small": {"found": 3, "part_1__plan": plan}}
    state.close()


def test_a_record_that_a_resumed_run_replaces_is_followed(small: Path) -> None:
    state = state_of(small)
    state.update()
    assert state.statuses()[2::3] == bytes([2, 2, 2, 2, 3])
    (small / "run.mcap").rename(small / "old.mcap")
    record_small(small)
    state.update()
    assert state.statuses()[2::3] == bytes([2, 2, 2, 2, 3])
    state.close()


def test_a_monitor_that_comes_before_the_mission_is_told(small: Path) -> None:
    port, over = two_ports(), threading.Event()
    with Groot2Publisher(port) as publisher:
        assert publisher.address == f"127.0.0.1:{port}"
        thread = threading.Thread(target=publisher.serve, args=(over,), daemon=True)
        thread.start()
        with Groot2Client(port) as client:
            for kind, rest in (("T", ()), ("S", ()), ("B", (b"small",))):
                with pytest.raises(ServerError, match="the mission has not begun"):
                    client.ask(kind, *rest)
            publisher.state = state_of(small)
            assert len(client.codes()) == 5
        over.set()
        thread.join()
        publisher.state.close()


def test_only_this_machine_reaches_it(own_server: Server) -> None:
    for port in (own_server.port, own_server.port + 1):
        for host in ("127.0.0.2", "::1", socket.gethostbyname(socket.gethostname())):
            if host == "127.0.0.1":
                continue
            with pytest.raises(OSError), socket.create_connection((host, port), timeout=5.0):  # noqa: PT011
                pass


def test_nothing_that_is_sent_ends_it(own_server: Server) -> None:
    rng = random.Random(0)
    with Groot2Client(own_server.port) as client:
        for _ in range(500):
            parts = [rng.randbytes(rng.choice([0, 1, 5, 6, 6, 6, 7, 100])) for _ in range(rng.randint(1, 3))]
            if rng.random() < 0.5:
                parts[0] = bytes([2, rng.choice(b"TSBIRNUDAXrt\x00\xff")]) + rng.randbytes(4)
            reply = client.exchange(*parts)
            assert len(reply[0]) == 22 or (reply[0] == b"error" and len(reply) == 2), parts
        assert len(client.codes()) == 5


def test_a_request_that_is_too_large_ends_its_connection_only(own_server: Server) -> None:
    with Groot2Client(own_server.port) as greedy, Groot2Client(own_server.port) as client:
        greedy.socket.setsockopt(zmq.RCVTIMEO, 500)
        with pytest.raises(zmq.Again):
            greedy.exchange(bytes(10_000_000))
        assert len(client.codes()) == 5


def test_bytes_that_are_no_zeromq_are_dropped(own_server: Server) -> None:
    with socket.create_connection(("127.0.0.1", own_server.port), timeout=5.0) as browser:
        browser.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n" * 100)
        with Groot2Client(own_server.port) as client:
            assert len(client.codes()) == 5


def test_monitors_that_leave_in_the_middle_do_no_harm(own_server: Server) -> None:
    for _ in range(20):
        with Groot2Client(own_server.port) as leaver:
            leaver.socket.send_multipart([b"\x02T\0\0\0\0"])
    with Groot2Client(own_server.port) as client:
        assert len(client.codes()) == 5


def test_a_value_that_msgpack_cannot_hold_is_an_error(small: Path) -> None:
    port, over = two_ports(), threading.Event()
    with Groot2Publisher(port) as publisher:
        publisher.state = state_of(small)
        publisher.state.blackboard = lambda names: {"small": {"found": 10**30}}  # type: ignore[method-assign]
        thread = threading.Thread(target=publisher.serve, args=(over,), daemon=True)
        thread.start()
        with Groot2Client(port) as client:
            with pytest.raises(ServerError, match="OverflowError"):
                client.blackboard("small")
            assert len(client.codes()) == 5
        over.set()
        thread.join()
        publisher.state.close()


@pytest.mark.parametrize("taken", [0, 1])
def test_a_port_in_use_is_one_sentence(taken: int) -> None:
    port = two_ports()
    with socket.socket() as other:
        other.bind(("127.0.0.1", port + taken))
        other.listen()
        needs = f"; Groot2 needs the ports {port} and {port + 1}" if taken else ""
        with pytest.raises(BadInput) as caught:
            Groot2Publisher(port)
    says = f"--groot2 {port}: port {port + taken} is in use or not allowed{needs}; give another one: --groot2 PORT"
    assert str(caught.value) == says
    with Groot2Publisher(port):
        pass
