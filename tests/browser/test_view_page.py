"""`glotouch view` in a browser: a whole run, for two people, on a phone, and without its server."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.browser_page import PHONE, Page, drawn, until
from tests.support.made_run import Made

FAKE_CLI = Path(__file__).parents[1] / "support" / "fake_cli.py"


@contextmanager
def viewed(folder: Path, *options: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Serve the page of a run; give its address and the server's process."""
    words = [sys.executable, str(FAKE_CLI), "view", str(folder), "--no-browser", *options]
    server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        assert server.stdout is not None
        yield server.stdout.readline().split()[0], server
    finally:
        if server.poll() is None:
            server.send_signal(signal.SIGINT)
        server.communicate(timeout=60)


@pytest.fixture(scope="module")
def address(made: Made) -> Iterator[str]:
    with viewed(made.folder) as (at, _):
        yield at


def test_the_page_shows_the_run(browse: Callable[..., Page], address: str) -> None:
    page = browse()
    page.open(address)
    page.says("the mission succeeded")
    page.says("tool_pickup")
    page.says("candidate 4")
    until(lambda: drawn(page.picture()), "the scene drawn")
    assert page.errors() == []


def test_the_buttons_move_the_time_for_both_of_two_people(browse: Callable[..., Page], address: str) -> None:
    one, two = browse(), browse()
    for page in (one, two):
        page.open(address)
        page.says("the mission succeeded")
    end_s = one.clock_s
    one.press("−5 s")
    until(lambda: two.clock_s < end_s, "the other page follows")
    assert two.clock_s == pytest.approx(end_s - 5.0, abs=0.2)
    one.press("end")
    until(lambda: two.clock_s == end_s, "the other page follows back")
    assert one.errors() + two.errors() == []


def test_a_phone_shows_scene_and_panels(browse: Callable[..., Page], address: str) -> None:
    page = browse(PHONE)
    page.open(address)
    page.says("the mission succeeded")
    until(lambda: drawn(page.picture()), "the scene drawn")
    assert page.overflow_px() <= 0
    assert page.errors() == []


def test_a_page_whose_server_is_gone_comes_back_with_it(browse: Callable[..., Page], made: Made) -> None:
    page = browse()
    with viewed(made.folder) as (at, server):
        page.open(at)
        page.says("the mission succeeded")
        server.kill()
        server.wait()
    until(lambda: drawn(page.picture()), "the last picture stays")
    with viewed(made.folder, "--port", at.rsplit(":", 1)[1]):
        page.says("the mission succeeded")
        end_s = page.clock_s

        def moved() -> bool:
            page.press("−5 s")
            return page.clock_s < end_s

        until(moved, "the new server answers")
