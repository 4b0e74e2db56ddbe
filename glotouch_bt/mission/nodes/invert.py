"""`invert`: success and failure exchanged."""

from glotouch_bt.mission.nodes.base import NodeKind


class InvertKind(NodeKind):
    """Succeed when the child fails, fail when it succeeds."""

    name = "invert"
    description = "success and failure exchanged"
    btcpp, sign = "Inverter", "¬"

    def outcome(self, succeeded: bool) -> bool:
        """Return the other result."""
        return not succeeded
