"""Where to sweep next: the nearest unexplored frontier (paper III-C)."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from glotouch_bt.robot import Array, ParamError
from glotouch_bt.search.map import SearchMap
from glotouch_bt.search.routes import Routes

DROP_RADIUS_M = 0.012
"""A frontier this near a dropped place is dropped with it."""
MIN_TRAVEL_M = 0.003
"""A frontier nearer than this is no journey; the tip is there."""


class SearchPolicy(Protocol):
    """Chooses the next stretch of a search."""

    def next_path(self, belief: SearchMap, tip_K_m: Array) -> Array | None:
        """Waypoints (k, 2) in K for the tip at tip_K_m (2,), entering no envelope; None: nothing is left to explore."""
        ...


class NearestFrontier:
    """The nearest unexplored place, by the length of the way to it.

    Frontier samples are uniform in the permitted region, drawn once from the seed. One is unexplored if it is farther
    than the coverage radius from all path samples, outside every envelope, and not dropped.

    Args:
        coverage_radius_m: The paper's r_cov. A tip of radius r passing a disc of radius R touches it within R + r: 26
            mm for the smallest object (40 mm) and a 6 mm tip; the default leaves 2 mm for path and registration errors.
        samples: How many frontier samples.
        seed: Of the samples.

    Raises:
        ParamError: A radius or a number of samples that is not positive.
    """

    def __init__(self, coverage_radius_m: float = 0.024, *, samples: int = 600, seed: int = 0) -> None:
        if not (np.isfinite(coverage_radius_m) and coverage_radius_m > 0):
            raise ParamError("coverage_radius_m", coverage_radius_m, "finite and positive")
        if samples < 1:
            raise ParamError("samples", samples, "at least 1")
        self.coverage_radius_m = coverage_radius_m
        self._unit = np.random.default_rng(seed).uniform(-1.0, 1.0, (samples, 2))

    def frontiers(self, belief: SearchMap) -> Array:
        """(n, 2) unexplored samples."""
        return unexplored(belief, self._unit * belief.half_extent_m, self.coverage_radius_m)

    def next_path(self, belief: SearchMap, tip_K_m: Array) -> Array | None:
        """See `SearchPolicy`."""
        goals = self.frontiers(belief)
        routes = Routes(belief, tip_K_m)
        return first_reachable(routes, goals, routes.lengths(goals))


def unexplored(belief: SearchMap, points_K_m: Array, radius_m: float) -> Array:
    """Those of the points (n, 2) that are farther than `radius_m` from the path, outside envelopes, and not dropped."""
    left = points_K_m[belief.path_distance(points_K_m) > radius_m]
    left = left[~belief.inside_exclusion(left)]
    if len(belief.dropped) and len(left):
        gap = np.linalg.norm(left[:, None] - belief.dropped[None], axis=2)
        left = left[np.min(gap, axis=1) > DROP_RADIUS_M]
    return left


def first_reachable(routes: Routes, goals_K_m: Array, cost: Array, tries: int = 40) -> Array | None:
    """Waypoints to the cheapest goal that can be reached; None if there is none."""
    for i in np.argsort(cost, kind="stable")[:tries]:
        if not np.isfinite(cost[i]):
            return None
        way = routes.to(goals_K_m[i])
        if way is not None and float(np.linalg.norm(way[-1] - routes.start_K_m)) > MIN_TRAVEL_M:
            return way
    return None
