"""A FakeRobot whose clock skips what nobody looks at: while all that runs is a leaf that waits, time passes at once."""

from __future__ import annotations

from glotouch_bt.mission.nodes import kind_of
from glotouch_bt.mission.spec import NodeSpec
from glotouch_bt.robot import Command, FakeRobot, Observation
from glotouch_bt.robot.supervision import SupervisionLimits

PATIENT = SupervisionLimits(late_periods=1e12, tolerated=10**9)
"""A supervisor that lets skipped time pass."""


def may_skip(root: NodeSpec) -> bool:
    """Only one leaf runs at a time, so that nothing but it and the timeouts above it can change while it waits."""
    return not any(kind_of(node).concurrent for node in root.walk())


class SkippingRobot(FakeRobot):
    """See the module's text. A mission's own longest time must be told, for it ends a wait as well.

    Args:
        end_s: Robot time at which the mission is over whatever happens.
        period_s: Control period.
    """

    def __init__(self, end_s: float, period_s: float = 0.01) -> None:
        super().__init__(period_s=period_s)
        self._end_s = end_s
        self._wake_s = 0.0

    def wake(self, until_s: float) -> None:
        """Until then nobody needs a tick; holds for the next cycle only."""
        self._wake_s = min(until_s, self._end_s)

    def cycle(self, command: Command) -> Observation:
        """One control period that ends at, or just before, the time somebody asked to be woken."""
        skipped = int((self._wake_s - self._newest.now_s) / self.period_s + 1e-6) - 1
        self.cycles += max(skipped, 0)
        self._wake_s = 0.0
        return super().cycle(command)
