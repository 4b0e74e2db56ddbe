"""Shared by the commands that show a mission while it runs: in the browser, in Groot2."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from glotouch_bt.mission import Mission
    from glotouch_bt.mission.execution import Control
    from glotouch_bt.robot.simulation import TrueObject
    from glotouch_bt.runs import RunResult
    from glotouch_bt.view import LiveView
    from glotouch_bt.view.groot2 import LiveTree

INTERRUPTED = 130
"""Exit code of a run that Ctrl-C ended."""


@contextmanager
def live_page(
    wanted: bool, control: Control, port: int | None, no_browser: bool, objects: Path | None
) -> Iterator[LiveView | None]:
    """Serve the page of a run while the block runs, and print its address; yield None if no page is wanted.

    Raises:
        BadInput: An option needs --live, the port is in use, or viser is not installed.
    """
    from glotouch_bt.robot import BadInput

    if not wanted:
        if port is not None or no_browser:
            raise BadInput(f"{'--port' if port is not None else '--no-browser'}: needs --live")
        yield None
        return
    from glotouch_bt.view import LiveView

    with LiveView(control, port=port, browser=not no_browser, objects=objects) as page:
        sys.stderr.write(f"live view: {page.address}\n")
        yield page


@contextmanager
def live_tree(port: int | None) -> Iterator[LiveTree | None]:
    """Publish the tree of a run for Groot2 while the block runs, and print its address; yield None without a port.

    Raises:
        BadInput: The port is in use.
    """
    if port is None:
        yield None
        return
    from glotouch_bt.view.groot2 import LiveTree

    with LiveTree(port) as tree:
        sys.stderr.write(f"for Groot2: {tree.address}\n")
        yield tree


def shown_on(
    page: LiveView | None, tree: LiveTree | None, start: Callable[[Mission, Path], None]
) -> tuple[Callable[[Mission, Path], None], Callable[[list[TrueObject]], None] | None]:
    """Return `on_start` and `on_truth` of a run that is shown on a page and in Groot2; `start` is called first."""

    def begin(mission: Mission, folder: Path) -> None:
        start(mission, folder)
        if page is not None:
            page.show(folder)
        if tree is not None:
            tree.show(mission, folder)

    return begin, None if page is None else page.show_truth


def wait_for_viewers(page: LiveView | None, done: RunResult) -> None:
    """Keep the page of a finished run until nobody has it open, or Ctrl-C; not if Ctrl-C ended the run.

    At a terminal it also waits for the first viewer.
    """
    if page is None or done.exit_code == INTERRUPTED:
        return
    sys.stderr.write(f"the page stays at {page.address} while a browser shows it; Ctrl-C ends it now\n")
    with suppress(KeyboardInterrupt):
        if not page.wait(patient=sys.stderr.isatty()):
            sys.stderr.write(f"nobody had the page open; look at it with: glotouch view {done.folder}\n")
