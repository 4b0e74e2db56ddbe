"""Supervision below the tree: a robot around any robot that holds it within one period when something is wrong.

    Supervisor(FaultInjector(backend robot))      what is injected passes by the guards, as what a device does would

Every command is looked at before it is sent, every block before anyone else sees it. What is wrong for good holds the
arm and raises; from then on every cycle only holds and raises again. What is transient (a sample that is no number, a
late block) is taken out or let pass a declared number of times. Both go on record.
"""

from __future__ import annotations

import threading
from collections.abc import Callable

from glotouch_bt.robot.command import HOLD, Command, Request, Ticket
from glotouch_bt.robot.errors import BackendError, GuardTripped, SafetyStop, StaleReading
from glotouch_bt.robot.interface import Robot, Snapshot
from glotouch_bt.robot.observation import Observation
from glotouch_bt.robot.supervision.command import CommandWatch
from glotouch_bt.robot.supervision.limits import Finding, SupervisionLimits
from glotouch_bt.robot.supervision.state import SensedWatch

RECORDED = 20
"""So many findings of one guard are put on record one by one; of more, only that there were more (at the end)."""


class Supervisor(Robot):
    """See the module's text.

    Args:
        robot: Any robot.
        rules: What is tolerated.

    Attributes:
        on_finding: Called with every finding (the first `RECORDED` of each guard); set by who keeps the record.
        counts: Findings by guard, all of them.
    """

    def __init__(self, robot: Robot, rules: SupervisionLimits | None = None) -> None:
        self._robot = robot
        self.description, self.limits, self.period_s = robot.description, robot.limits, robot.period_s
        self.rules = SupervisionLimits() if rules is None else rules
        self.on_finding: Callable[[Finding], None] = lambda _: None
        self.counts: dict[str, int] = {}
        self._lock = threading.RLock()
        self._newest = first = robot.observe()
        self._commands = CommandWatch(self.description, self.limits, self.period_s, self.rules, first)
        self._sensed = SensedWatch(self.description, self.limits, self.period_s, self.rules, first)
        self._error: BackendError | None = None

    @property
    def inner(self) -> Robot:
        """What it watches."""
        return self._robot

    @property
    def paced(self) -> bool:  # type: ignore[override]
        """See `Robot`."""
        return self._robot.paced

    def observe(self) -> Observation:
        """The newest block that passed."""
        return self._newest

    def cycle(self, command: Command) -> Observation:
        """See `Robot`.

        Raises:
            GuardTripped: A guard tripped; the arm is held, and every later cycle only holds and raises again.
            BackendError: As the robot itself raises them.
        """
        if self._error is not None:
            self._hold_on()
            raise self._error
        if (wrong := self._commands.look(command, self._newest)) is not None:
            raise self._trip(wrong)
        self._sensed.told(command)
        try:
            with self._lock:
                observation = self._robot.cycle(command)
        except BackendError as e:
            self._lost(e)
            raise
        observation, found = self._sensed.look(observation)
        if found:
            self._report(found)
        self._newest = observation
        return observation

    def start(self, request: Request) -> Ticket:
        """See `Robot`."""
        return self._robot.start(request)

    def hold(self) -> None:
        """See `Robot`; also from another thread, between two cycles."""
        if self._lock.acquire(timeout=self.period_s):  # who cycles will find out by itself
            try:
                self._robot.hold()
            finally:
                self._lock.release()

    def close(self) -> None:
        """See `Robot`."""
        self._robot.close()

    def snapshot(self) -> Snapshot | None:
        """That of what it watches: guards begin anew."""
        return self._robot.snapshot()

    def restore(self, snapshot: Snapshot) -> None:
        """See `Robot`."""
        self._robot.restore(snapshot)
        self._error = None
        self._newest = newest = self._robot.observe()
        self._commands.forget(newest)
        self._sensed.forget(newest)

    def heed(self, error: GuardTripped) -> None:
        """A guard above this one, a skill's own, tripped: hold from now on; it is put on record as our own are."""
        if error is not self._error:
            self._robot.hold()
            self._error = error
            self._note(Finding(error.guard, error.what, error.value, error.limit, error.stamp_s))

    def _report(self, found: list[Finding]) -> None:
        for finding in found:
            if finding.fatal:
                raise self._trip(finding)
            self._note(finding)

    def _note(self, finding: Finding) -> None:
        count = self.counts[finding.guard] = self.counts.get(finding.guard, 0) + 1
        if count <= RECORDED or finding.fatal:
            self.on_finding(finding)

    def _trip(self, finding: Finding) -> GuardTripped:
        """Hold, put on record, and the error to raise from now on."""
        self._robot.hold()
        self._note(finding)
        error = GuardTripped(finding.guard, finding.what, finding.value, finding.limit, finding.stamp_s)
        self._error = error
        return error

    def _lost(self, error: BackendError) -> None:
        """The robot itself gave up: on record, too."""
        value, limit, stamp_s = 0.0, 0.0, self._newest.now_s
        guard = "device"
        if isinstance(error, SafetyStop):
            guard, value, limit, stamp_s = "wrench", error.value, error.limit, error.stamp_s
        elif isinstance(error, StaleReading):
            value, limit = error.age_s, error.max_age_s
        self._robot.hold()
        self._error = error
        self._note(Finding(guard, str(error), value, limit, stamp_s))

    def _hold_on(self) -> None:
        """One more period at rest, as far as the robot still can."""
        try:
            self._robot.cycle(HOLD)
        except BackendError:
            self._robot.hold()
