"""The process of `run --groot2`: a folder and its tree come in on stdin; monitors are answered until stdin ends."""

from __future__ import annotations

import sys
import threading

from glotouch_bt.mission.export import MonitoredTree
from glotouch_bt.robot import GlotouchError
from glotouch_bt.view.groot2.mission_state import MissionState
from glotouch_bt.view.groot2.publisher import Groot2Publisher
from glotouch_bt.view.process import FAULT, RunLink


def main() -> int:
    """Serve until stdin is closed; return the exit code."""
    link = RunLink()
    try:
        with Groot2Publisher(int(sys.argv[1])) as publisher:
            thread = threading.Thread(target=publisher.serve, args=(link.ended,), daemon=True)
            thread.start()
            folder = link.begin(publisher.address)
            if folder is not None:
                publisher.state = MissionState(folder, MonitoredTree(**link.told["tree"]))
            thread.join()
    except GlotouchError as e:
        link.tell(f"{FAULT} {e}")
        return 2
    except Exception as e:  # the run goes on without it
        sys.stderr.write(f"glotouch: the tree for Groot2 ended: {type(e).__name__}: {e}\n")
        return 3
    return 0


if __name__ == "__main__":
    sys.exit(main())
