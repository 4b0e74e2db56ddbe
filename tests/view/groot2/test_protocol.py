"""A monitor finds the same protocol at our publisher as at the real BehaviorTree.CPP's."""

from __future__ import annotations

import socket

import pytest

from tests.support.groot2_client import Groot2Client, ServerError
from tests.view.groot2.conftest import Server


def test_the_tree_has_a_number_for_each_node_and_a_model_for_each_kind(server: Server) -> None:
    with Groot2Client(server.port) as client:
        root = client.tree()
    assert (root.tag, root.get("BTCPP_format")) == ("root", "4")
    tree, model = root
    assert (tree.tag, tree.get("ID"), tree.get("_fullpath")) == ("BehaviorTree", "small", "")
    shown = [e for e in tree.iter() if e is not tree]
    assert [e.get("name") for e in shown] == ["sequence", "look", "three", "never mind", "try"]
    assert [e.get("_uid") for e in shown] == ["1", "2", "3", "4", "5"]
    assert model.tag == "TreeNodesModel"
    assert {e.tag for e in shown} <= {e.get("ID") for e in model}
    assert {e.get("ID"): e.tag for e in model}["ScriptCondition"] == "Condition"


def test_each_node_has_a_status(server: Server) -> None:
    with Groot2Client(server.port) as client:
        assert list(client.codes()) == [1, 2, 3, 4, 5]


def test_a_blackboard_is_asked_for_by_the_name_of_the_tree(server: Server) -> None:
    with Groot2Client(server.port) as client:
        for names in ("small", "other;small", "small;small"):
            dump = client.blackboard(names)
            assert list(dump) == ["small"]
            assert dump["small"]["found"] == 3
        for names in ("", "other", ";", "small "):
            assert client.blackboard(names) is None


def test_every_reply_names_the_request_and_the_tree(server: Server) -> None:
    with Groot2Client(server.port) as client:
        client.ask("S")
        first = client.tree_id
        assert len(set(first)) > 1
        client.ask("T")
        with Groot2Client(server.port) as other:
            other.ask("S")
            assert other.tree_id == first


def test_a_request_of_another_protocol_is_answered_with_the_own_one(server: Server) -> None:
    with Groot2Client(server.port) as client:
        for protocol in (0, 1, 3, 255):
            (content,) = client.ask("S", protocol=protocol)  # the client checks that the reply says 2
            assert len(content) == 15


@pytest.mark.parametrize(
    ("parts", "said"),
    [
        ((b"",), "wrong request header"),
        ((b"\x02S\x00\x00\x00",), "wrong request header"),
        ((b"\x02S" + 5 * b"\x00", b"more"), "wrong request header"),
        ((b"\x02?" + 4 * b"\x00",), "Request not recognized"),
        ((b"\x02\x00" + 4 * b"\x00",), "Request not recognized"),
        ((b"\x02B" + 4 * b"\x00",), "must be 2 parts message"),
        ((b"\x02B" + 4 * b"\x00", b"small", b"small"), "must be 2 parts message"),
    ],
)
def test_a_bad_request_gets_an_error_and_the_next_one_an_answer(
    parts: tuple[bytes, ...], said: str, server: Server
) -> None:
    with Groot2Client(server.port) as client:
        assert client.exchange(*parts) == [b"error", said.encode()]
        assert len(client.codes()) == 5


def test_there_are_no_breakpoints(server: Server) -> None:
    with Groot2Client(server.port) as client:
        assert client.ask("A") == []
        assert client.ask("X") == []
        assert client.ask("D") == [b"[]"]
        assert len(client.codes()) == 5


def test_the_next_port_waits_for_monitors(server: Server) -> None:
    with socket.create_connection(("127.0.0.1", server.port + 1), timeout=5.0) as connection:
        assert connection.recv(10)[:1] == b"\xff"  # the greeting of ZeroMQ


@pytest.mark.parametrize("kind", "IRUrt")
def test_nothing_can_be_controlled(kind: str, own_server: Server) -> None:
    with Groot2Client(own_server.port) as client:
        for rest in ((), (b"{}",), (b'{"uid": 2, "position": 0}',), (b"start",)):
            with pytest.raises(ServerError, match="not supported"):
                client.ask(kind, *rest)
        assert len(client.codes()) == 5
