"""How a node may leave the configurations it was entered in."""

from __future__ import annotations

from dataclasses import dataclass

from glotouch_bt.mission.check.state_sets import EMPTY, Configurations


@dataclass(frozen=True)
class After:
    """Sets of configurations after a node.

    Attributes:
        success, failure: How it may have ended.
        running: Where it may be broken off.
    """

    success: int = EMPTY
    failure: int = EMPTY
    running: int = EMPTY

    def joined(self, other: After, sets: Configurations) -> After:
        """What either of two may be."""
        return After(
            sets.union(self.success, other.success),
            sets.union(self.failure, other.failure),
            sets.union(self.running, other.running),
        )
