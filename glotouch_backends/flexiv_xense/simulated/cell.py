"""A simulated cell: the world with its devices in a process of its own, on wall time.

    python -m glotouch_backends.flexiv_xense.simulated.cell WORLD SOCKET LOG

WORLD is a file with a trial message (`trial_message`), SOCKET the Unix socket to listen at, LOG a file of one JSON line
per event. Like a real arm, the simulated one continues when its client dies. The log then says how fast the tool was,
how long it took to stand still, how far it moved, and the largest contact force. The cell ends on SIGTERM, or ALONE_S
after its last client once its parent process is gone. Exit codes: 0, or 2 if the world cannot be built.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection, Listener
from pathlib import Path
from typing import IO, Any

import numpy as np

from glotouch_backends.flexiv_xense.driver import DEVICES_PRIORITY, Clock, messages, request_realtime
from glotouch_backends.flexiv_xense.simulated.vendor import SimulatedVendor, assemble
from glotouch_backends.flexiv_xense.simulated.wire import MAX_BYTES, NEW, REFEREE, Reference, decode, encode
from glotouch_backends.flexiv_xense.simulated.world import SimulatedWorld
from glotouch_backends.mujoco.model import STEP_S
from glotouch_bt.robot import GlotouchError

ALONE_S = 20.0
"""Time without a client and without the parent process after which the cell ends."""
MAX_BEHIND_S = 0.05
"""A world that is later than this does not catch up. Source: ours."""
STILL_M_S = 1e-3
"""The tool stands still below this speed. Source: ours."""
STILL_STEPS = 20
"""Steps below that speed that count as standstill. Source: ours."""


class CellClock(Clock):
    """World time; sleeping on it releases the world's lock."""

    def __init__(self, world: SimulatedWorld, turn: threading.Condition) -> None:
        self._world, self._turn = world, turn

    def now_s(self) -> float:
        """See `driver.clock.Clock`."""
        return self._world.now_s

    def sleep_until(self, stamp_s: float) -> None:
        """See `driver.clock.Clock`."""
        with self._turn:
            self._turn.wait_for(lambda: self._world.now_s >= stamp_s - 1e-9)


class StandstillMonitor:
    """Monitor of the arm after a client is lost: it logs how the arm comes to rest."""

    def __init__(self, world: SimulatedWorld, write: Callable[..., None]) -> None:
        self._world, self._write = world, write
        self._since: int | None = None
        self._start = np.zeros(3)
        self._peak_N = self._farthest_m = 0.0
        self._still = 0

    def _tool(self) -> tuple[Any, float]:
        w = self._world
        now = np.array(w.data.site_xpos[w.handles.pads_site])
        j = w.arm.kinematics.at(w.arm.sample.row[w.handles.sensors.q])[2]
        return now, float(np.linalg.norm((j @ w.arm.sample.row[w.handles.sensors.dq])[:3]))

    def begin(self, client: int) -> None:
        """Start monitoring: a client is gone."""
        position, speed = self._tool()
        self._since, self._start, self._still = self._world.steps, position, 0
        self._peak_N = self._farthest_m = 0.0
        self._write("client lost", client=client, speed_m_s=speed, force_N=self._world.contact_force_N())

    def check(self) -> None:
        """Check for standstill; call after each step."""
        if self._since is None:
            return
        position, speed = self._tool()
        self._peak_N = max(self._peak_N, self._world.contact_force_N())
        self._farthest_m = max(self._farthest_m, float(np.linalg.norm(position - self._start)))
        self._still = self._still + 1 if speed < STILL_M_S else 0
        if self._still == STILL_STEPS:
            after_s = (self._world.steps - self._since - STILL_STEPS + 1) * STEP_S
            self._write(
                "standstill", after_s=after_s, travel_m=self._farthest_m, peak_force_N=self._peak_N, speed_m_s=speed
            )
            self._since = None


class Cell:
    """A world, its pace and its clients.

    Args:
        world: The world.
        log: File for events.
    """

    def __init__(self, world: SimulatedWorld, log: IO[str]) -> None:
        self.world, self._log = world, log
        self.turn = threading.Condition(threading.RLock())
        self.vendor: SimulatedVendor = assemble(world, CellClock(world, self.turn))
        sdk, grippers = self.vendor.flexivrdk, self.vendor.xensegripper.xense_gripper
        self._makers: dict[str, Any] = {
            "Robot": sdk.Robot,
            "Tool": sdk.Tool,
            "XenseTCPGripper": grippers.XenseTCPGripper,
            "XenseSerialGripper": grippers.XenseSerialGripper,
            "Sensor": self.vendor.xensesdk.Sensor.create,
        }
        self._made: dict[int, tuple[int, Any]] = {}
        self._links: dict[int, int] = {}  # client: open connections
        self._monitor = StandstillMonitor(world, self.write)
        self._parent = os.getppid()
        self._last_client_s = time.monotonic()
        self.ended = False

    def write(self, event: str, **values: object) -> None:
        """Write one line of the log."""
        self._log.write(json.dumps({"t": round(self.world.now_s, 4), "event": event, **values}) + "\n")
        self._log.flush()

    # --- time -------------------------------------------------------------------------------------------------------

    def live(self) -> None:
        """Step the world at wall time until the end."""
        gc.collect()
        gc.freeze()  # a full garbage collection takes longer than a step may
        begin, slept = time.monotonic() - self.world.now_s, threading.Event()
        while not self.ended:
            with self.turn:
                self.world.advance(self.world.now_s + STEP_S)
                self._monitor.check()
                self.turn.notify_all()
                alone = not self._links
            now = time.monotonic()
            if not alone or os.getppid() == self._parent:
                self._last_client_s = now
            elif now - self._last_client_s > ALONE_S:
                self.ended = True
            left = begin + self.world.now_s - now
            if left > 0.0:
                slept.wait(left)
            elif left < -MAX_BEHIND_S:
                self.write("late", by_s=-left)
                begin = now - self.world.now_s

    # --- clients ----------------------------------------------------------------------------------------------------

    def serve(self, listener: Listener) -> None:
        """Accept connections, and serve each in its own thread."""
        while not self.ended:
            try:
                connection = listener.accept()
            except OSError:
                return
            threading.Thread(target=self._talk, args=(connection,), daemon=True).start()

    def _talk(self, connection: Connection[Any, Any]) -> None:
        """Serve one connection: requests in, results or exceptions out."""
        client = -1
        try:
            client = int(decode(connection.recv_bytes(MAX_BYTES)))
            with self.turn:
                self._links[client] = self._links.get(client, 0) + 1
            while True:
                request = decode(connection.recv_bytes(MAX_BYTES))
                try:
                    with self.turn:
                        made = self._do(client, *request)
                    answer = encode((True, made))
                except Exception as e:  # errors of the stand-ins go to their caller
                    answer = encode((False, e))
                connection.send_bytes(answer)
        except (EOFError, OSError, TypeError, ValueError):  # it has gone, or does not speak our language
            pass
        finally:
            connection.close()
            self._leave(client)

    def _leave(self, client: int) -> None:
        with self.turn:
            left = self._links.get(client, 1) - 1
            if left > 0:
                self._links[client] = left
                return
            self._links.pop(client, None)
            owned = [key for key, (owner, _) in self._made.items() if owner == client]
            robots = [key for key in owned if isinstance(self._made[key][1], self._makers["Robot"])]
            for key in owned:
                del self._made[key]
            if robots:
                self._monitor.begin(client)
                self.vendor.box.leave()

    def _do(self, client: int, what: str, *arguments: Any) -> Any:
        if what == REFEREE:
            return messages.encode(self.vendor.referee(messages.decode_request(arguments[0])))
        if what == NEW:
            name, args, kwargs = arguments
            args = [self._made[a.key][1] if isinstance(a, Reference) else a for a in args]
            made = self._makers[name](*args, **kwargs)
            key = len(self._made) + 1
            while key in self._made:
                key += 1
            self._made[key] = client, made
            return Reference(key)
        key, method, args, kwargs = arguments
        made = self._made[key][1]
        if method.startswith("_") or not callable(getattr(type(made), method, None)):
            raise AttributeError(method)
        return getattr(made, method)(*args, **kwargs)


def main(argv: list[str]) -> int:
    """Run the cell; see the module's text."""
    world_file, address, log_file = argv
    try:
        world = SimulatedWorld.of_message(Path(world_file).read_bytes())
    except GlotouchError as e:
        sys.stderr.write(f"{e}\n")
        return 2
    granted = request_realtime(DEVICES_PRIORITY)
    with Path(log_file).open("a") as log, Listener(address, family="AF_UNIX") as listener:
        cell = Cell(world, log)

        def end(number: int, frame: object) -> None:
            cell.ended = True

        signal.signal(signal.SIGTERM, end)
        signal.signal(signal.SIGINT, end)
        threading.Thread(target=cell.serve, args=(listener,), daemon=True).start()
        cell.write("ready", urgent=granted)
        cell.live()
        cell.write("end", peak_force_N=world.true_force.peak_N)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
