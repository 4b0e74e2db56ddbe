"""`glotouch view`: serve the page of a run's folder until Ctrl-C."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from glotouch_bt.report import RECORD_NAME
from glotouch_bt.robot import BadInput
from glotouch_bt.view.server import PortTaken, address, free_port, open_server, require_viser

if TYPE_CHECKING:
    import viser

TRIES = 5
"""Attempts to open a free port. Source: ours; one fails only if another program takes the port in the milliseconds
between finding it and opening it, and the next one starts with a new search."""


def view_run(
    folder: Path,
    *,
    port: int | None = None,
    browser: bool = True,
    objects: Path | None = None,
    groot2: int | None = None,
    on_ready: Callable[[str], None] | None = None,
) -> None:
    """Serve the page of a run, which may be under way, until KeyboardInterrupt.

    Args:
        folder: The run's folder.
        port: Port of the loopback interface; None for the next free one.
        browser: Open the page in the browser, if this machine has a display.
        objects: Folder of STL files for the true objects of a simulation.
        groot2: Port on which Groot2 is served the tree at the time that the page shows; None: none.
        on_ready: Called with the page's address.

    Raises:
        BadInput: There is no run, it cannot be read, the port is in use, or viser is not installed.
    """
    from glotouch_bt.mission import load_mission
    from glotouch_bt.mission.export import as_monitored
    from glotouch_bt.report import RecordReader
    from glotouch_bt.view.groot2 import MissionState, published
    from glotouch_bt.view.watch import RunWatch

    require_viser()
    if folder.is_file():
        raise BadInput(f"{folder}: give the run's folder, not a file in it")
    with RecordReader(folder, growing=True) as reader:  # a broken record is an error here, and a sentence later
        reader.read()
        if not reader.record.run:
            raise BadInput(f"{folder / RECORD_NAME}: is empty or cut off in its first bytes; there is nothing to show")
    tree = None if groot2 is None else as_monitored(load_mission(folder / "mission.yaml"))
    with page_server(port, browser) as (server, shown), ExitStack() as stack:
        watch = RunWatch(server, folder, objects=objects)
        if groot2 is not None and tree is not None:
            stack.enter_context(published(groot2, MissionState(folder, tree, lambda: watch.player.t_s)))
        if on_ready is not None:
            on_ready(shown)
        watch.run(threading.Event())


@contextmanager
def page_server(port: int | None, browser: bool) -> Iterator[tuple[viser.ViserServer, str]]:
    """Serve an empty page while the block runs; yield the server and the page's address.

    Raises:
        BadInput: The port is in use, or viser is not installed.
    """
    require_viser()
    number, server = _open(port)
    try:
        if browser and _has_display():
            threading.Thread(target=webbrowser.open, args=(address(number),), daemon=True).start()
        yield server, address(number)
    finally:
        with contextlib.redirect_stdout(io.StringIO()):  # viser prints a farewell
            server.stop()


def _open(port: int | None) -> tuple[int, viser.ViserServer]:
    """Serve an empty page on the port, or on a free one; another program may take that one meanwhile."""
    for _ in range(TRIES):
        number = free_port(port)
        try:
            return number, open_server(number)
        except PortTaken:
            if port is not None:
                raise
    raise PortTaken(f"{TRIES} ports were taken meanwhile; give one with --port")


def _has_display() -> bool:
    """Return False on a machine without a display: a browser in the terminal would hide the command."""
    return sys.platform == "darwin" or any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
