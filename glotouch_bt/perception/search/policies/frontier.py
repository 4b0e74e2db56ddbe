"""Search policy of the paper: sweep to the nearest unexplored frontier (III-C)."""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.perception.search.policies.policy import Stretch
from glotouch_bt.perception.search.routes import Routes
from glotouch_bt.robot import Array, ParamError

DROP_RADIUS_M = 0.012
"""Distance from a dropped position within which other goals are dropped, too: where one sweep was refused, the next one
probably is. Source: ours."""
MIN_TRAVEL_M = 0.003
"""Minimum distance of a frontier from the tip."""

PAPER_PASSES = ((1.0, 0.0),)
"""The paper's single pass."""
PASSES = ((1.6, 0.03), (1.0, 0.03), (1.0, 0.0), (0.6, 0.0))
"""Passes from coarse to fine. Source: tuned on random layouts of five objects of 4-11 cm."""
TURN_M = 0.02
"""Cost of a full turn back, as travel. Source: tuned with PASSES."""


class NearestFrontier:
    """Sweep to the nearest unexplored frontier by route length, from coarse to fine.

    Frontier samples are uniform in the permitted region, drawn once from the seed. A sample is unexplored if it is
    farther than the coverage radius from the path, outside all envelopes, and not dropped. Two extensions of the paper:

    - Passes: a first pass with a larger radius and away from the border finds large objects on a short path. The rest
      is searched at the coverage radius. `passes=PAPER_PASSES` is the paper's single pass.
    - Turning has a cost, so of two equally near frontiers the one ahead is chosen.

    Stateless: the answer depends on map and tip alone.

    Args:
        coverage_radius_m: The paper's r_cov. A tip of radius r touches a disc of radius R within R + r: 26 mm for the
            smallest object (40 mm) and a 6 mm tip; the default leaves 2 mm for path and registration errors.
        samples: Number of frontier samples.
        seed: Seed of the samples.
        turn_m: Cost of turning back, as travel; 0 in the paper.
        passes: (radius factor, width of the border to skip, m) of each pass, in order.

    Raises:
        ParamError: A radius, a number of samples or a pass that is not positive.
    """

    def __init__(
        self,
        coverage_radius_m: float = 0.024,
        *,
        samples: int = 600,
        seed: int = 0,
        turn_m: float = TURN_M,
        passes: tuple[tuple[float, float], ...] = PASSES,
    ) -> None:
        if not (np.isfinite(coverage_radius_m) and coverage_radius_m > 0):
            raise ParamError("coverage_radius_m", coverage_radius_m, "finite and positive")
        if samples < 1:
            raise ParamError("samples", samples, "at least 1")
        if not passes or min(p for p, _ in passes) <= 0 or min(b for _, b in passes) < 0:
            raise ParamError("passes", passes, "at least one (positive radius factor, border >= 0)")
        self.coverage_radius_m, self._turn_m, self._passes = coverage_radius_m, turn_m, passes
        self._unit = np.random.default_rng(seed).uniform(-1.0, 1.0, (samples, 2))

    def frontiers(self, belief: SearchMap, step: int = -1) -> Array:
        """Return the unexplored samples (n, 2) of the given pass (the last by default)."""
        factor, border = self._passes[step]
        samples = self._unit * belief.half_extent_m
        inner = np.all(np.abs(samples) <= np.maximum(belief.half_extent_m - border, 0.0), axis=1)
        return unexplored(belief, samples[inner], factor * self.coverage_radius_m)

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """See `SearchPolicy`: the way to the nearest unexplored sample."""
        tip = np.asarray(tip_K_m, dtype=np.float64)[:2]
        routes = Routes(belief, tip)
        for step in range(len(self._passes)):
            goals = self.frontiers(belief, step)
            way = first_reachable(routes, goals, routes.lengths(goals) + self._turn_m * turning(belief, tip, goals))
            if way is not None:
                return Stretch(way)
        return None


def turning(belief: SearchMap, tip_K_m: Array, goals_K_m: Array) -> Array:
    """Return (n,) 0 for a goal ahead of the path's end .. 1 for one behind; 0 if the tip is not at the path's end."""
    path = belief.path_K_m
    if len(path) < 4 or len(goals_K_m) == 0 or np.linalg.norm(path[-1] - tip_K_m) > 0.005:
        return np.zeros(len(goals_K_m))
    heading = path[-1] - path[-4]
    way = goals_K_m - tip_K_m
    scale = np.linalg.norm(heading) * np.linalg.norm(way, axis=1)
    return np.asarray(0.5 * (1.0 - (way @ heading) / np.maximum(scale, 1e-12)))


def unexplored(belief: SearchMap, points_K_m: Array, radius_m: float) -> Array:
    """Return the points of (n, 2) farther than `radius_m` from the path, outside envelopes and not dropped."""
    left = points_K_m[belief.path_distance(points_K_m) > radius_m]
    left = left[~belief.inside_exclusion(left)]
    if len(belief.dropped) and len(left):
        gap = np.linalg.norm(left[:, None] - belief.dropped[None], axis=2)
        left = left[np.min(gap, axis=1) > DROP_RADIUS_M]
    return left


def first_reachable(routes: Routes, goals_K_m: Array, cost: Array, tries: int = 40) -> Array | None:
    """Return waypoints to the cheapest reachable goal; None without one."""
    for i in np.argsort(cost, kind="stable")[:tries]:
        if not np.isfinite(cost[i]):
            return None
        way = routes.to(goals_K_m[i])
        if way is not None and float(np.linalg.norm(way[-1] - routes.start_K_m)) > MIN_TRAVEL_M:
            return way
    return None
