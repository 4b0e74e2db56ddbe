"""Interface of search policies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.robot import Array


@dataclass(frozen=True)
class Stretch:
    """Next path of the ball.

    Attributes:
        waypoints_K_m: (k, 2) positions of the ball's centre, in order, outside all envelopes.
        raised: True: hop above the objects to the last waypoint. False: sweep at sensing height.
    """

    waypoints_K_m: Array
    raised: bool = False


class SearchPolicy(Protocol):
    """Rule for the next path of a search. Stateless: the answer depends on its parameters, map and tip."""

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """Return the next path from tip_K_m (2,); None if nothing unexplored is reachable."""
