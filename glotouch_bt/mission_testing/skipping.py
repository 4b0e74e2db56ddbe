"""A FakeRobot whose clock skips waiting: while only a waiting leaf runs, time jumps to its end."""

from __future__ import annotations

from glotouch_bt.mission.nodes import kind_of
from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.robot import Command, FakeRobot, Observation
from glotouch_bt.robot.supervision import SupervisionLimits

PATIENT = SupervisionLimits(late_periods=1e12, tolerated=10**9)
"""Supervision limits that tolerate skipped time."""


def may_skip(root: NodeSpec) -> bool:
    """Return True if only one leaf can run at a time, so nothing but it and its timeouts can act while it waits."""
    return not any(kind_of(node).concurrent for node in root.walk())


class SkippingRobot(FakeRobot):
    """FakeRobot that skips waiting.

    Args:
        end_s: Robot time at which the mission times out; it ends a wait as well.
        period_s: Control period.
    """

    def __init__(self, end_s: float, period_s: float = 0.01) -> None:
        super().__init__(period_s=period_s)
        self._end_s = end_s
        self._wake_s = 0.0

    def wake(self, until_s: float) -> None:
        """Skip to this time in the next cycle."""
        self._wake_s = min(until_s, self._end_s)

    def cycle(self, command: Command) -> Observation:
        """Run one control period that ends at, or just before, the wake time."""
        skipped = int((self._wake_s - self._newest.now_s) / self.period_s + 1e-6) - 1
        self.cycles += max(skipped, 0)
        self._wake_s = 0.0
        return super().cycle(command)
