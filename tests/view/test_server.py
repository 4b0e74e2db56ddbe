"""The page is served to this machine and to its own address only."""

from __future__ import annotations

import asyncio
import socket
import urllib.request
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest

from glotouch_bt.robot import BadInput
from glotouch_bt.view import server as view_server
from glotouch_bt.view.serve import page_server, view_run
from glotouch_bt.view.server import address, free_port, require_viser
from tests.support.made_run import Made

pytest.importorskip("viser")

FORBIDDEN = 403
LISTEN = "0A"
"""State of a listening socket in /proc/net/tcp (Linux, include/net/tcp_states.h)."""


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    number = free_port(None)
    with page_server(number, browser=False):
        yield number


def test_the_page_comes_from_this_machine(port: int) -> None:
    with urllib.request.urlopen(address(port)) as answer:
        page = answer.read()
    assert answer.status == 200
    assert b"<html" in page.lower()


def test_only_the_loopback_interface_listens(port: int) -> None:
    table = Path("/proc/net/tcp")
    if not table.exists():
        pytest.skip("not Linux")
    both = [line.split()[1:4] for name in ("tcp", "tcp6") for line in _lines(Path("/proc/net") / name)]
    listening = [local for local, _, state in both if state == LISTEN and local.endswith(f":{port:04X}")]
    assert listening == [f"0100007F:{port:04X}"]


def _lines(path: Path) -> list[str]:
    return path.read_text().splitlines()[1:] if path.exists() else []


@pytest.mark.parametrize(
    ("origin", "welcome"),
    [
        ("http://127.0.0.1:{port}", True),
        ("http://localhost:{port}", True),
        ("http://evil.example", False),
        (None, False),
    ],
)
def test_a_page_of_another_origin_is_refused(port: int, origin: str | None, welcome: bool) -> None:
    import viser
    from websockets.asyncio.client import connect
    from websockets.exceptions import InvalidStatus
    from websockets.typing import Origin, Subprotocol

    async def knock() -> bool:
        given = None if origin is None else Origin(origin.format(port=port))
        told = [Subprotocol(f"viser-v{viser.__version__}")]
        try:
            async with connect(f"ws://127.0.0.1:{port}", origin=given, subprotocols=told):
                return True
        except InvalidStatus as e:
            return e.response.status_code != FORBIDDEN

    assert asyncio.run(knock()) is welcome


def test_no_page_opens_a_tunnel() -> None:
    with page_server(None, browser=False) as (server, _):
        assert server.request_share_url() is None


def test_the_next_free_port_is_taken_and_a_given_one_must_be_free(port: int) -> None:
    assert free_port(None) != port
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        taken = other.getsockname()[1]
        with pytest.raises(BadInput, match=f"--port {taken}: is in use or not allowed; give another port"):
            free_port(taken)


@pytest.mark.parametrize("found", [None, "0.2.23"])
def test_without_viser_the_message_says_how_to_install_it(monkeypatch: pytest.MonkeyPatch, found: str | None) -> None:
    def version(name: str) -> str:
        if found is None:
            raise PackageNotFoundError(name)
        return found

    monkeypatch.setattr(view_server, "version", version)
    with pytest.raises(BadInput, match=r"pip install 'viser>=1\.1'"):
        require_viser()


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n", b"not a record at all, but some text"])
def test_a_folder_without_a_usable_record_is_one_sentence(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "run.mcap").write_bytes(content)
    with pytest.raises(BadInput, match=r"run\.mcap: is "):
        view_run(tmp_path, browser=False)


def test_a_folder_without_a_record_and_a_file_are_named(tmp_path: Path, whole: Made) -> None:
    with pytest.raises(BadInput, match="no run here"):
        view_run(tmp_path, browser=False)
    with pytest.raises(BadInput, match="give the run's folder"):
        view_run(whole.folder / "run.mcap", browser=False)
