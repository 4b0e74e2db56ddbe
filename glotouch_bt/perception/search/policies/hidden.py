"""Search policy that covers the floor: to the nearest place where much of what may be hidden would be touched.

It goes on until no place is left where an object of any size from 15 mm on would be touched, gaps between sweeps
included.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import scipy

from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.perception.search.policies.frontier import DROP_RADIUS_M, TURN_M, first_reachable, turning
from glotouch_bt.perception.search.policies.policy import Stretch
from glotouch_bt.perception.search.remaining import ANY, discs
from glotouch_bt.perception.search.routes import CHECK_STEP_M, Routes, cells, grid_count
from glotouch_bt.robot import Array

DISCOUNT_M = 0.05
"""A place that touches e times as much may be farther by this. Source: tuned on 8 random planar layouts."""
ONWARD = 0.5
"""A sweep is prolonged while it touches at least this share of what its end touches. Source: as `DISCOUNT_M`."""
FAR_M = 0.3
"""Longest prolongation of a sweep. Source: ours; most of the box."""
MIN_GAIN = 1e-6
"""Least remaining weight for which the ball travels; all weights before a search sum to 1. Source: ours."""


class NearestHidden:
    """Sweep to the place of a 5 mm grid that touches much remaining weight for the way there, and straight on.

    Stateless; about 15 ms per call, 0.5 s for the first one.
    """

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """See `SearchPolicy`."""
        tip = np.asarray(tip_K_m, dtype=np.float64)[:2]
        places, gain = gains(belief)
        use = (gain > MIN_GAIN) & ~belief.is_dropped(places, DROP_RADIUS_M)
        goals = places[use]
        routes = Routes(belief, tip)
        way_m = routes.lengths(goals) + TURN_M * turning(belief, tip, goals)
        way = first_reachable(routes, goals, way_m - DISCOUNT_M * np.log(gain[use]))
        return None if way is None else Stretch(_onward(belief, tip, way, gain))


def gains(belief: SearchMap) -> tuple[Array, Array]:
    """Return the places (n, 2) of the grid, and the remaining weight (n,) that the ball touches there."""
    places, touches = _touches(belief.half)
    gain = touches @ belief.any_size.weight
    return places, np.where(belief.inside_exclusion(places), 0.0, gain)


def _onward(belief: SearchMap, tip_K_m: Array, way: Array, gain: Array) -> Array:
    """Return the way (k, 2) with its end prolonged straight ahead while that is worthwhile.

    It is not prolonged to a place that was given up: the sweep there was refused.
    """
    end, before = way[-1], way[-2] if len(way) > 1 else tip_K_m
    ahead = end + (end - before) / np.linalg.norm(end - before) * np.arange(0.0, FAR_M, CHECK_STEP_M)[:, None]
    ahead = ahead[np.cumprod(belief.inside_extent(ahead) & ~belief.inside_exclusion(ahead)).astype(bool)]
    worth = gain[cells(belief.half, ahead)]
    fine = np.cumprod(worth >= ONWARD * worth[0]).astype(bool) if len(worth) else np.zeros(0, dtype=bool)
    if not fine.any() or belief.is_dropped(ahead[fine][-1])[0]:
        return way
    return np.vstack([way[:-1], ahead[fine][-1]])


@lru_cache(maxsize=4)
def _touches(half: tuple[float, float]) -> tuple[Array, Any]:
    """Return the places (n, 2) and a sparse matrix (n, h), 1 where the ball at a place touches a disc."""
    every = discs(half, ANY)
    axes = [np.linspace(-h, h, grid_count(h)) for h in half]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    near = scipy.spatial.cKDTree(places).query_ball_point(every.centre, every.reach)
    disc = np.repeat(np.arange(len(near)), [len(n) for n in near])
    place = np.concatenate([np.asarray(n, dtype=np.int64) for n in near])
    return places, scipy.sparse.csr_array((np.ones(len(disc)), (place, disc)), shape=(len(places), len(near)))
