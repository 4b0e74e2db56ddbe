"""`python -m glotouch_driver --address ipc://PATH`: wait for one client, serve it, stop the arm, end."""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import sys
from pathlib import Path

from .devices import Served
from .endpoint import DriverSocket
from .messages import MAX_REQUEST_BYTES, MAX_WORLD_BYTES
from .priority import DRIVER_PRIORITY, request_realtime
from .serve import Log, serve


def main(argv: list[str] | None = None) -> int:
    """Run the driver. Exit codes: 0 ended on request, 1 a device did not come up, 2 bad arguments, 4 no client came."""
    parser = argparse.ArgumentParser(prog="glotouch-driver", description=__doc__)
    parser.add_argument("--address", required=True, help="ipc://PATH, or tcp://HOST:PORT with --keys")
    parser.add_argument("--keys", type=Path, help="folder with driver.key_secret and clients/*.key (CURVE)")
    parser.add_argument(
        "--simulated", action="store_true", help="serve simulated devices, whose world the client sends"
    )
    parser.add_argument("--cell", metavar="SOCKET", help="serve the simulated devices of the cell at this Unix socket")
    parser.add_argument("--log", type=Path, help="append one JSON line per event here")
    parser.add_argument("--private", type=Path, help="remove this folder at the end if the parent process was killed")
    parser.add_argument("--urgent", action="store_true", help="request real-time priority; continue if refused")
    parser.add_argument("--stay", action="store_true", help="wait for the next client after one has gone")
    options = parser.parse_args(argv)
    served = Served("cell", options.cell) if options.cell else Served("simulated" if options.simulated else "real")
    if served.kind != "real" and not options.address.startswith("ipc://"):
        parser.error("simulated devices are served on ipc:// only")
    max_bytes = MAX_REQUEST_BYTES + (MAX_WORLD_BYTES if served.kind == "simulated" else 0)
    starter = os.getppid()
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    signal.signal(signal.SIGINT, lambda number, _: stopped.append(number))
    log = Log(options.log)
    if options.urgent:  # before any thread starts: threads inherit the priority
        log("priority", granted=request_realtime(DRIVER_PRIORITY))
    while True:
        try:
            socket = DriverSocket(options.address, options.keys, max_bytes=max_bytes)
        except (ValueError, OSError) as e:
            sys.stderr.write(f"glotouch-driver: {e}\n")
            return 2
        with socket:
            code = serve(socket, log, lambda: bool(stopped), served, forever=options.stay)
        if not options.stay or stopped:
            if options.private and os.getppid() != starter:  # the parent can no longer remove it
                shutil.rmtree(options.private, ignore_errors=True)
            return code


if __name__ == "__main__":
    sys.exit(main())
