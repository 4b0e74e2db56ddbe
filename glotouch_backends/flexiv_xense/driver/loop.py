"""The driver's two loops: in lock-step with the client (simulated devices), or paced by the clock (real ones).

The paced loop reads the arm every millisecond and sends a block on a fixed grid of control periods. It never replaces a
late command:

    no command for HOLD_AFTER_S            the arm brakes to rest along its path
    a device failed                        the same, repeated until the arm accepts it
    no message for CLIENT_LOST_S           Stop(), IDLE, devices released, the process ends
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext, suppress

from . import messages
from .endpoint import DriverSocket
from .faults import CommandRefused, DeviceFault, vendor_call
from .session import MAX_STANDSTILL_M_S, DriverSession

SAMPLE_S = 0.001
"""Interval between two readings of the arm."""
HOLD_AFTER_S = 0.03
"""Hold the arm after this time without a command. Source: ours, three control periods."""
CLIENT_LOST_S = 0.5
"""The client is lost after this time without a message; it sends a heartbeat every 0.1 s. Source: ours."""
BEAT_S = 0.05
"""Interval between two heartbeats of the driver."""
LOCKSTEP_CLIENT_LOST_S = 10.0
"""The same in lock-step, where the client may compute for long. Source: ours."""
MAX_BEHIND_S = 0.02
"""A loop that is later than this skips samples instead of catching up; the stamps show the gap. Source: ours."""

Log = Callable[..., None]


class _DriverLoop:
    """Answers that both loops give."""

    def __init__(self, session: DriverSession, socket: DriverSocket, log: Log, stopping: Callable[[], bool]) -> None:
        self._session, self._socket, self._log, self._stopping = session, socket, log, stopping

    def _refuse(self, number: int, error: CommandRefused) -> None:
        self._socket.send(messages.Refused(number=number, name=error.name, value=repr(error.value), rule=error.rule))

    def _fail(self, number: int, error: DeviceFault) -> None:
        session = self._session
        if session.failed is None:
            session.failed = error
            self._log("fault", kind=error.kind, message=error.message)
            with suppress(DeviceFault):  # the arm may be the device that failed
                session.hold()
        self._socket.send(error.answer(number))

    def _note_lost_client(self, silent_s: float) -> None:
        self._log("client lost", silent_s=silent_s, speed_m_s=self._session.speed_m_s,
                  peak_force_N=self._session.peak_force_N)  # fmt: skip
        sys.stderr.write(
            f"no word from the client for {silent_s:.1f} s: it hung, or was stopped; the arm was stopped\n"
        )

    def _answer(self, request: messages.Request) -> bool:
        """Answer a request other than a cycle; return False to end the loop."""
        session = self._session
        if isinstance(request, (messages.TareRequest, messages.PayloadRequest)):
            session.start(request)
            self._socket.send(messages.Accepted(number=request.number))
        elif isinstance(request, messages.HoldRequest):
            try:
                session.hold()
            except DeviceFault as e:
                self._fail(request.number, e)
            else:
                self._socket.send(messages.Accepted(number=request.number))
        elif isinstance(request, messages.RefereeRequest):
            ask = getattr(session.devices.vendor, "referee", None)
            if ask is None:
                fault = DeviceFault("vendor", "there is no referee: the devices are real")
                self._socket.send(fault.answer(request.number))
                return True
            try:
                with vendor_call("asking the referee", "world"):
                    answer = ask(request)
            except DeviceFault as e:
                self._socket.send(e.answer(request.number))
            else:
                self._socket.send(answer)
        elif isinstance(request, messages.Quit):
            self._log("quit", peak_force_N=session.peak_force_N)
            return False
        return True


class Lockstep(_DriverLoop):
    """Loop of simulated devices: one cycle advances the world by exactly one period."""

    def run(self, period_s: float) -> None:
        """Run until the client quits or is lost."""
        session, socket = self._session, self._socket
        clock, steps = session.clock, round(period_s / SAMPLE_S)
        conducting = getattr(clock, "conducting", nullcontext)
        begin, cycles = clock.now_s(), 0
        heard = time.monotonic()
        with conducting():
            socket.send(session.block(0, tactile=False))
            while not self._stopping():
                request = socket.receive(1.0)
                now = time.monotonic()
                if request is None:
                    if now - heard > LOCKSTEP_CLIENT_LOST_S:
                        self._note_lost_client(now - heard)
                        return
                    continue
                heard = now
                if not isinstance(request, messages.Cycle):
                    if not self._answer(request):
                        return
                    continue
                try:
                    session.command(request)
                    for k in range(1, steps + 1):
                        clock.sleep_until(begin + cycles * period_s + k * SAMPLE_S)
                        session.sample()
                    cycles += 1
                    session.poll()
                    block = session.block(request.number, tactile=request.tactile)
                except CommandRefused as e:
                    self._refuse(request.number, e)
                except DeviceFault as e:
                    self._fail(request.number, e)
                else:
                    socket.send(block)
                    if session.failed is not None:
                        self._log("fault", kind=session.failed.kind, message=session.failed.message)


class _Stop:
    """Hold the arm once no command has arrived for a while or a device has failed, until the arm accepts it."""

    def __init__(self, session: DriverSession, log: Log) -> None:
        self._session, self._log = session, log
        self._silent = self._still = self._held = False

    def check(self, silent_s: float) -> None:
        """Check before each sample; `silent_s` is the time since the last command.

        Raises:
            DeviceFault: The arm did not accept the hold, and no device had failed before. The next call tries again.
        """
        session = self._session
        silent = silent_s > HOLD_AFTER_S
        if silent and not self._silent:
            self._still = False
            session.recent_peak_N = 0.0
            self._log("no command", silent_s=silent_s, speed_m_s=session.speed_m_s)
        self._silent = silent
        if not silent and session.failed is None:
            self._held = False
        elif not self._held:
            try:
                session.hold()
            except DeviceFault:
                if session.failed is None:
                    raise
            else:
                self._held = True
        if silent and not self._still and session.speed_m_s < MAX_STANDSTILL_M_S:
            self._still = True
            self._log("standstill", silent_s=silent_s, peak_force_N=session.recent_peak_N)


class Paced(_DriverLoop):
    """Loop of real devices: wall time."""

    def run(self, period_s: float) -> None:
        """Run until the client quits or is lost."""
        session, socket, clock = self._session, self._socket, self._session.clock
        steps = round(period_s / SAMPLE_S)
        socket.send(session.block(0, tactile=False))
        waiting: messages.Cycle | None = None
        gc.collect()
        gc.freeze()  # a full garbage collection takes longer than a sample may be late
        begin = due = clock.now_s()
        heard = commanded = beaten = begin
        late = tick = 0
        stop = _Stop(session, self._log)
        while not self._stopping():
            due += SAMPLE_S
            now = clock.now_s()
            if now - due > MAX_BEHIND_S:
                self._log("late", by_s=now - due)
                due = now
            tick += 1
            try:
                while True:
                    while (request := socket.receive(0.0)) is not None:
                        heard = clock.now_s()
                        if isinstance(request, messages.Cycle):
                            waiting, commanded = request, heard
                            session.command(request)
                        elif not self._answer(request):
                            return
                    left = due - clock.now_s()
                    if left <= 0.0:
                        break
                    socket.wait(left)
                stop.check(clock.now_s() - commanded)
                session.sample()
                now = clock.now_s()
                if tick % steps == 0:
                    session.poll()
                    if waiting is None:
                        late += 1
                    elif session.ready:
                        socket.send(session.block(waiting.number, tactile=waiting.tactile, late=late))
                        waiting, late = None, 0
            except CommandRefused as e:
                self._refuse(0 if waiting is None else waiting.number, e)
                waiting = None
            except DeviceFault as e:
                if session.failed is None or waiting is not None:
                    self._fail(0 if waiting is None else waiting.number, e)
                waiting = None
            if now - beaten > BEAT_S:
                beaten = now
                socket.send(messages.Beat())
            if now - heard > CLIENT_LOST_S:
                self._note_lost_client(now - heard)
                return
