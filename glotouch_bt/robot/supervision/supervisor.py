"""Wrap a robot so that a guard holds the arm within one control period when something is wrong.

    Supervisor(FaultInjector(backend robot))      injected faults pass the guards, like those of a device

The supervisor checks every command before it is sent and every block before anyone reads it. A fatal finding holds the
arm and raises; every later cycle holds and raises again. A transient finding (a sample that is not finite, a late
block) is dropped or tolerated a limited number of times. Both are recorded.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from glotouch_bt.errors import BackendError, GuardTripped, SafetyStop, StaleReading
from glotouch_bt.robot.command import HOLD, Command, Request, Ticket
from glotouch_bt.robot.interface import Robot, Snapshot
from glotouch_bt.robot.observation import Observation
from glotouch_bt.robot.supervision.command import CommandGuard
from glotouch_bt.robot.supervision.limits import GuardFinding, SupervisionLimits
from glotouch_bt.robot.supervision.readings import ReadingsGuard

MAX_RECORDED = 20
"""Record this many findings of one guard one by one; `Supervisor.counts` counts the rest."""


class Supervisor(Robot):
    """A robot with guards around it.

    Args:
        robot: Any robot.
        guard_limits: Limits of the guards.

    Attributes:
        on_finding: Called with every recorded finding (the first `MAX_RECORDED` of each guard); set by the recorder.
        counts: Number of findings by guard, recorded or not.
    """

    def __init__(self, robot: Robot, guard_limits: SupervisionLimits | None = None) -> None:
        self._robot = robot
        self.description, self.limits, self.period_s = robot.description, robot.limits, robot.period_s
        self.guard_limits = SupervisionLimits() if guard_limits is None else guard_limits
        self.on_finding: Callable[[GuardFinding], None] = lambda _: None
        self.counts: dict[str, int] = {}
        self._lock = threading.RLock()
        self._newest = first = robot.observe()
        self._commands = CommandGuard(robot, self.guard_limits, first)
        self._sensed = ReadingsGuard(robot, self.guard_limits, first)
        self._error: BackendError | None = None

    @property
    def paced(self) -> bool:  # type: ignore[override]
        """See `Robot`."""
        return self._robot.paced

    def observe(self) -> Observation:
        """Return the newest block that passed the guards."""
        return self._newest

    def cycle(self, command: Command) -> Observation:
        """See `Robot`.

        Raises:
            GuardTripped: A guard tripped; the arm is held, and every later cycle only holds and raises again.
            BackendError: As the robot itself raises them.
        """
        with self._lock:
            if self._error is not None:
                self._hold_one_period()
                raise self._error
            if (wrong := self._commands.check(command, self._newest)) is not None:
                raise self._trip(wrong)
            self._sensed.on_command(command)
            try:
                observation = self._robot.cycle(command)
            except BackendError as e:
                self._on_device_error(e)
                raise
            observation, findings = self._sensed.check(observation)
            if findings:
                self._report(findings)
            self._newest = observation
            return observation

    def start(self, request: Request) -> Ticket:
        """See `Robot`."""
        with self._lock:
            return self._robot.start(request)

    def hold(self) -> None:
        """See `Robot`; also from another thread, between two cycles."""
        if self._lock.acquire(timeout=self.period_s):  # else a cycle is under way and notices by itself
            try:
                self._robot.hold()
            finally:
                self._lock.release()

    def close(self) -> None:
        """See `Robot`."""
        self._robot.close()

    def snapshot(self) -> Snapshot | None:
        """Return the snapshot of the supervised robot; the guards keep no state in it."""
        return self._robot.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """See `Robot`."""
        self._robot.restore(snapshot)
        self._error = None
        self._newest = newest = self._robot.observe()
        self._commands.reset(newest)
        self._sensed.reset(newest)

    def trip_by(self, error: GuardTripped) -> None:
        """Hold from now on because a guard above this robot (a skill's own) tripped; record it like the others."""
        with self._lock:
            if error is not self._error:
                self._stop(error, GuardFinding(error.guard, error.what, error.value, error.limit, error.stamp_s))

    def _report(self, findings: list[GuardFinding]) -> None:
        for finding in findings:
            if finding.fatal:
                raise self._trip(finding)
            self._record(finding)

    def _record(self, finding: GuardFinding) -> None:
        count = self.counts[finding.guard] = self.counts.get(finding.guard, 0) + 1
        if count <= MAX_RECORDED or finding.fatal:
            self.on_finding(finding)

    def _trip(self, finding: GuardFinding) -> GuardTripped:
        """Stop because of a finding; return the error to raise from now on."""
        error = GuardTripped(finding.guard, finding.what, finding.value, finding.limit, finding.stamp_s)
        self._stop(error, finding)
        return error

    def _stop(self, error: BackendError, finding: GuardFinding) -> None:
        """Raise `error` from now on, hold, and record the finding, in this order: recording may fail."""
        self._error = error
        self._robot.hold()
        self._record(finding)

    def _on_device_error(self, error: BackendError) -> None:
        """Stop because the robot itself failed."""
        value, limit, stamp_s = 0.0, 0.0, self._newest.now_s
        guard = "device"
        if isinstance(error, SafetyStop):
            guard, value, limit, stamp_s = "wrench", error.value, error.limit, error.stamp_s
        elif isinstance(error, StaleReading):
            value, limit = error.age_s, error.max_age_s
        self._stop(error, GuardFinding(guard, str(error), value, limit, stamp_s))

    def _hold_one_period(self) -> None:
        """Let one more period pass at rest, as far as the robot still can."""
        try:
            self._robot.cycle(HOLD)
        except BackendError:
            self._robot.hold()
