"""`succeed`: success whatever the child returns."""

from glotouch_bt.mission.nodes.base import NodeKind
from glotouch_bt.mission.spec import NodeSpec


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
