"""`invert`, `succeed` and `fail`: decorators that replace the child's result."""

from glotouch_bt.mission.nodes.base import NodeKind
from glotouch_bt.mission.spec import NodeSpec


class InvertKind(NodeKind):
    """Succeed when the child fails, fail when it succeeds."""

    name = "invert"
    description = "success and failure exchanged"
    btcpp, sign = "Inverter", "¬"

    def outcome(self, succeeded: bool) -> bool:
        """Return the other result."""
        return not succeeded


class SucceedKind(NodeKind):
    """Succeed when the child ends."""

    name = "succeed"
    description = "success whatever the child says"
    btcpp, sign = "ForceSuccess", "✓"

    def outcome(self, succeeded: bool) -> bool:
        """Return success."""
        return True

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        """A child that never fails succeeds in any case."""
        return "" if fails else f"{node.children[0].name!r} never fails"


class FailKind(NodeKind):
    """Fail when the child ends."""

    name = "fail"
    description = "failure whatever the child says"
    btcpp, sign = "ForceFailure", "✗"

    def outcome(self, succeeded: bool) -> bool:
        """Return failure."""
        return False

    def no_effect(self, node: NodeSpec, *, fails: bool, succeeds: bool) -> str:
        """A child that never succeeds fails in any case."""
        return "" if succeeds else f"{node.children[0].name!r} never succeeds"

    def catches_failure(self, node: NodeSpec) -> bool:
        """It fails on purpose: the mission counts on it."""
        return True
