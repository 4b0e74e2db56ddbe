"""The small interface behind which search policies are exchanged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.robot import Array


@dataclass(frozen=True)
class Stretch:
    """The next way of the ball.

    Attributes:
        waypoints_K_m: (k, 2) where the ball's centre goes, in order; entering no traced object's envelope.
        raised: True: over the objects to the last waypoint, and down there. False: swept at sensing height.
    """

    waypoints_K_m: Array
    raised: bool = False


class SearchPolicy(Protocol):
    """Chooses the next stretch of a search. Stateless: the answer depends on what it was made with, map and tip."""

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """The way to go on from tip_K_m (2,); None: nothing is left to explore, or nothing can be reached from here."""
        ...
