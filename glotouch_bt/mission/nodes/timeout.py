"""`timeout`: a limit of the child's time on the robot's clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from glotouch_bt.mission.nodes.base import BtcppForm, BuildContext, MissionDecorator, NodeKind
from glotouch_bt.mission.spec import NodeSpec, Settings
from glotouch_bt.skill import param


class TimeoutSettings(Settings):
    """Fail a child that takes too long on the robot's clock."""

    seconds: float = param("longest time, robot clock", unit="s", gt=0.0, le=86_400.0)


class ClockTimeout(MissionDecorator):
    """FAILURE when the child runs longer than `seconds` on the robot's clock; the child is then preempted."""

    def __init__(self, name: str, child: Behaviour, seconds: float, clock: Callable[[], float]) -> None:
        super().__init__(name, child)
        self._seconds, self._clock = seconds, clock
        self._start_s = 0.0

    @property
    def progress(self) -> dict[str, Any]:
        """The time that has passed, as two times of the robot's clock (s)."""
        return {"clock_s": self._clock(), "start_s": self._start_s}

    @progress.setter
    def progress(self, kept: dict[str, Any]) -> None:
        """Let as much time have passed; the clock may be another one now."""
        self._start_s = kept["start_s"] + (self._clock() - kept["clock_s"])

    @property
    def deadline_s(self) -> float:
        """End of the child's time, on the robot's clock (s); valid while it runs."""
        return self._start_s + self._seconds

    def initialise(self) -> None:
        """Start the clock."""
        super().initialise()
        self._start_s = self._clock()

    def update(self) -> Status:
        """Return the child's status, unless its time is up."""
        if self.decorated.status is Status.RUNNING and self._clock() - self._start_s >= self._seconds:
            return self.fail(
                "timed_out",
                f"{self.decorated.name!r} took longer than {self._seconds:g} s",
                "allow more time, or see in the record what it waited for",
                limit_s=self._seconds,
                took_s=round(self._clock() - self._start_s, 3),
            )
        return self.decorated.status


class TimeoutKind(NodeKind):
    """Fail if the child takes too long."""

    name = "timeout"
    description = "fail if the child takes longer, robot clock"
    Settings = TimeoutSettings
    btcpp, sign = "Timeout", "⏱"
    interrupts = True

    def time_limit_s(self, node: NodeSpec) -> float | None:
        """Return its `seconds`."""
        return node.settings.seconds if isinstance(node.settings, TimeoutSettings) else None

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        """Only skills take time."""
        idle = not any(n.skill_type is not None or n.is_unread for n in node.children[0].walk())
        return "nothing below it takes time" if idle else ""

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return a timeout on the mission's clock."""
        assert isinstance(node.settings, TimeoutSettings)
        context = made.context
        return ClockTimeout(node.name, children[0], node.settings.seconds, lambda: context.mission_s)

    def btcpp_form(self, node: NodeSpec) -> BtcppForm:
        """Return it with its time in ms."""
        assert isinstance(node.settings, TimeoutSettings)
        return BtcppForm(self.btcpp, {"msec": str(round(1000 * node.settings.seconds))})
