"""`fail`: failure whatever the child returns."""

from glotouch_bt.mission.nodes.base import NodeKind
from glotouch_bt.mission.spec import NodeSpec


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
