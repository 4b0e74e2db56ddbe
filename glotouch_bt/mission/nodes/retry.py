"""`retry`: the child again after a failure."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from pydantic import Field

from glotouch_bt.mission.nodes.base import BtcppForm, BuildContext, CountedLoop, LoopKind
from glotouch_bt.mission.spec import NodeSpec, Settings


class RetrySettings(Settings):
    """Try again after a failure."""

    attempts: int = Field(description="how often in all", ge=1, le=10_000)


class Retry(CountedLoop):
    """Run the child until it succeeds. FAILURE when all attempts have failed."""

    def update(self) -> Status:
        """Count a failed attempt."""
        if self.decorated.status is not Status.FAILURE:
            return self.decorated.status
        self._passes += 1
        if self._passes < self._limit:
            return Status.RUNNING
        tried = f"{self._limit} attempt{'s' if self._limit > 1 else ''}"
        return self.fail("retries_ran_out", f"failed {self._passes} of {tried}")


class RetryKind(LoopKind):
    """Run the child again after a failure, up to a number of attempts."""

    name = "retry"
    description = "try the child again when it fails"
    Settings = RetrySettings
    btcpp, sign = "RetryUntilSuccessful", "↻"
    repeat_on = False

    def max_passes(self, node: NodeSpec) -> int:
        """Return its `attempts`."""
        return node.settings.attempts if isinstance(node.settings, RetrySettings) else 1

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        """One attempt, or a child that never fails."""
        if node.settings is not None and self.max_passes(node) == 1:
            return "one attempt is none again"
        return "" if fails else f"{node.children[0].name!r} never fails"

    def build(self, node: NodeSpec, children: list[Behaviour], made: BuildContext) -> Behaviour:
        """Return the loop."""
        return Retry(node.name, children[0], self.max_passes(node))

    def btcpp_form(self, node: NodeSpec) -> BtcppForm:
        """Return it with its attempts."""
        return BtcppForm(self.btcpp, {"num_attempts": str(self.max_passes(node))})
