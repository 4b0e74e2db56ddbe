"""`python -m glotouch_driver --address ipc://PATH`: waits for one client, serves it, stops the arm, ends."""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import sys
from pathlib import Path

from .endpoint import DriverSocket
from .priority import DRIVER_PRIORITY, request_realtime
from .serve import Log, serve


def main(argv: list[str] | None = None) -> int:
    """The process. 0: ended as asked; 1: a device did not come up; 2: bad arguments; 4: nobody came."""
    parser = argparse.ArgumentParser(prog="glotouch-driver", description=__doc__)
    parser.add_argument("--address", required=True, help="ipc://PATH, or tcp://HOST:PORT with --keys")
    parser.add_argument("--keys", type=Path, help="folder with driver.key_secret and clients/*.key (CURVE)")
    parser.add_argument("--log", type=Path, help="append one JSON line per event here")
    parser.add_argument("--private", type=Path, help="remove this folder at the end if who started us was killed")
    parser.add_argument("--urgent", action="store_true", help="ask for real-time priority; go on without if refused")
    parser.add_argument("--stay", action="store_true", help="wait for the next client when one has gone")
    options = parser.parse_args(argv)
    starter = os.getppid()
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    signal.signal(signal.SIGINT, lambda number, _: stopped.append(number))
    log = Log(options.log)
    if options.urgent:  # before any thread is started: they inherit it
        log("priority", granted=request_realtime(DRIVER_PRIORITY))
    while True:
        try:
            socket = DriverSocket(options.address, options.keys)
        except (ValueError, OSError) as e:
            sys.stderr.write(f"glotouch-driver: {e}\n")
            return 2
        with socket:
            code = serve(socket, log, lambda: bool(stopped), forever=options.stay)
        if not options.stay or stopped:
            if options.private and os.getppid() != starter:  # it can no longer do so itself
                shutil.rmtree(options.private, ignore_errors=True)
            return code


if __name__ == "__main__":
    sys.exit(main())
