"""The process of the page of `run --live`: a folder comes in on stdin, requests go out on stdout.

Lines in, as JSON objects: the run's `folder`; the `truth` of a simulation; `over` after the run. It ends with stdin.
"""

from __future__ import annotations

import sys
import threading
from functools import partial
from pathlib import Path

from glotouch_bt.robot import GlotouchError
from glotouch_bt.view.live import LEFT, PAUSE, RESUME, STOP, UNSEEN
from glotouch_bt.view.page import MissionControls
from glotouch_bt.view.process import FAULT, RunLink
from glotouch_bt.view.serve import page_server
from glotouch_bt.view.watch import RunWatch

LOOK_S = 0.5
"""Time between two looks for viewers."""
GRACE_S = 10.0
"""Time without a viewer after which a page of a finished run is no longer waited for. Source: ours."""


def main() -> int:
    """Serve until stdin is closed; return the exit code."""
    port, browser, objects = sys.argv[1:4]
    link = RunLink()
    try:
        with page_server(int(port) if port else None, bool(browser)) as (server, address):
            folder = link.begin(address)
            if folder is None:
                return 0
            controls = MissionControls(*(partial(link.tell, word) for word in (PAUSE, RESUME, STOP)))
            watch = RunWatch(server, folder, controls, Path(objects) if objects else None, link.told)
            threading.Thread(target=_tell_when_left, args=(watch, link), daemon=True).start()
            watch.run(link.ended)
    except GlotouchError as e:
        link.tell(f"{FAULT} {e}")
        return 2
    except Exception as e:  # the run goes on without its page
        sys.stderr.write(f"glotouch: the live view ended: {type(e).__name__}: {e}\n")
        return 3
    return 0


def _tell_when_left(watch: RunWatch, link: RunLink) -> None:
    """Say when the run is over and nobody has had the page open for `GRACE_S`."""
    link.finished.wait()
    while link.told.get("patient") and not watch.was_viewed and not link.ended.wait(LOOK_S):
        pass
    absent_s = 0.0
    while watch.was_viewed and absent_s < GRACE_S and not link.ended.wait(LOOK_S):
        absent_s = 0.0 if watch.viewers else absent_s + LOOK_S
    link.tell(LEFT if watch.was_viewed else UNSEEN)


if __name__ == "__main__":
    sys.exit(main())
