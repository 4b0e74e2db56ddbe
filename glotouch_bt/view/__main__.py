"""The process of the page of `run --live`: a folder comes in on stdin, requests go out on stdout.

Lines in, as JSON objects: the run's `folder`; the `truth` of a simulation; `over` after the run. It ends with stdin.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from glotouch_bt.robot import GlotouchError
from glotouch_bt.untrusted import parse_json
from glotouch_bt.view.live import FAULT, LEFT, PAUSE, READY, RESUME, STOP
from glotouch_bt.view.page import MissionControls
from glotouch_bt.view.serve import page_server
from glotouch_bt.view.watch import RunWatch

NICENESS = 10
"""The control loop goes before the page when both want a core."""
LOOK_S = 0.5
"""Time between two looks for viewers."""
GRACE_S = 10.0
"""Time without a viewer after which a page of a finished run is no longer waited for. Source: ours."""


def main() -> int:
    """Serve until stdin is closed; return the exit code."""
    port, browser, objects = sys.argv[1:4]
    os.nice(NICENESS)
    out = os.dup(1)  # nothing but our lines goes to the run, also not what a browser writes
    os.dup2(2, 1)

    def tell(line: str) -> None:
        with suppress(OSError):  # the run is gone
            os.write(out, f"{line}\n".encode())

    def end_with_run() -> None:
        """Read stdin until it is closed."""
        for line in sys.stdin:
            told.update(parse_json(line.encode(), "the run"))
            (finished if "over" in told else named).set()
        over.set()
        named.set()

    over, named, finished = threading.Event(), threading.Event(), threading.Event()
    told: dict[str, Any] = {}
    try:
        with page_server(int(port) if port else None, bool(browser)) as (server, address):
            threading.Thread(target=end_with_run, daemon=True).start()
            tell(f"{READY} {address}")
            named.wait()
            if over.is_set():
                return 0
            controls = MissionControls(lambda: tell(PAUSE), lambda: tell(RESUME), lambda: tell(STOP))
            watch = RunWatch(server, Path(told["folder"]), controls, Path(objects) if objects else None, told)
            threading.Thread(target=_tell_when_left, args=(watch, finished, over, tell), daemon=True).start()
            watch.run(over)
    except GlotouchError as e:
        tell(f"{FAULT} {e}")
        return 2
    except Exception as e:  # the run goes on without its page
        sys.stderr.write(f"glotouch: the live view ended: {type(e).__name__}: {e}\n")
        return 3
    return 0


def _tell_when_left(
    watch: RunWatch, finished: threading.Event, over: threading.Event, tell: Callable[[str], None]
) -> None:
    """Say when the run is over and nobody has had the page open for `GRACE_S`, or nobody ever had."""
    finished.wait()
    absent_s = 0.0
    while watch.was_viewed and absent_s < GRACE_S and not over.wait(LOOK_S):
        absent_s = 0.0 if watch.viewers else absent_s + LOOK_S
    tell(LEFT)


if __name__ == "__main__":
    sys.exit(main())
