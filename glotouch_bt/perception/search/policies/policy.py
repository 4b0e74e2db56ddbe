"""Interface of search policies."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.robot import Array


@dataclass(frozen=True)
class Stretch:
    """Next path of the ball.

    Attributes:
        waypoints_K_m: (k, 2) positions of the ball's centre, in order, outside all envelopes; the last one is the goal.
        raised: True: hop above the objects to the goal. False: sweep at sensing height.
        further_K_m: (n, 2) goals of straight sweeps after that, if nothing was felt.
    """

    waypoints_K_m: Array
    raised: bool = False
    further_K_m: Array = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def goals_K_m(self) -> Array:
        """Return the goal (k + n, 2) of the way to each waypoint, then the further goals."""
        return np.concatenate([self.waypoints_K_m[-1:].repeat(len(self.waypoints_K_m), axis=0), self.further_K_m])


class SearchPolicy(Protocol):
    """Rule for the next path of a search. Stateless: the answer depends on its parameters, map and tip."""

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """Return the next path from tip_K_m (2,); None if nothing unexplored is reachable."""
