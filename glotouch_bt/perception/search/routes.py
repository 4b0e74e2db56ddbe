"""Collision-free routes of the tip around envelopes: straight, or by Dijkstra on a 5 mm grid with shortcutting."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.perception.search.map import GRID_STEP_M, Exclusion, Mask, SearchMap
from glotouch_bt.robot import Array

CHECK_STEP_M = 0.001
"""Spacing of the points at which a segment is checked."""
NODE_CLEARANCE_M = 0.0005
"""Extra clearance of grid nodes, so that the chord between two nodes stays outside a round envelope."""


def segment_is_free(belief: SearchMap, start_K_m: Array, end_K_m: Array) -> bool:
    """Return True if the segment between two points (2,) enters no envelope (checked every millimetre)."""
    if not belief.exclusions:
        return True
    n = int(np.ceil(np.linalg.norm(np.subtract(end_K_m, start_K_m)) / CHECK_STEP_M)) + 1
    t = np.linspace(0.0, 1.0, max(n, 2))[:, None]
    return not bool(belief.inside_exclusion((1 - t) * start_K_m + t * end_K_m).any())


Half = tuple[float, float]


class _RouteLattice:
    """Nodes of the 5 mm grid over a permitted region, and all edges between neighbours."""

    def __init__(self, half_m: Half) -> None:
        axes = [np.linspace(-h, h, grid_count(h)) for h in half_m]
        nx, ny = len(axes[0]), len(axes[1])
        self.nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        index = np.arange(nx * ny, dtype=np.int32).reshape(nx, ny)
        pairs = [
            (index[:-1, :], index[1:, :]),
            (index[:, :-1], index[:, 1:]),
            (index[:-1, :-1], index[1:, 1:]),
            (index[:-1, 1:], index[1:, :-1]),
        ]
        self.a = np.concatenate([p.ravel() for p, _ in pairs])
        self.b = np.concatenate([q.ravel() for _, q in pairs])
        self.length = np.linalg.norm(self.nodes[self.a] - self.nodes[self.b], axis=1)


class _Grid:
    """The grid without the nodes inside exclusions."""

    def __init__(self, half_m: Half, exclusions: tuple[Exclusion, ...]) -> None:
        lattice = _lattice(half_m)
        self.nodes = lattice.nodes
        self.free = np.ones(len(self.nodes), dtype=np.bool_)
        for e in exclusions:
            self.free &= _free_of(half_m, e)
        keep = self.free[lattice.a] & self.free[lattice.b]
        n = len(self.nodes)
        self.graph: Any = scipy.sparse.csr_array(
            (lattice.length[keep], (lattice.a[keep], lattice.b[keep])), shape=(n, n)
        )

    def nearest_free(self, point: Array) -> int:
        """Return the index of the free node nearest to a point (2,); -1 without one."""
        if not self.free.any():
            return -1
        distance = np.where(self.free, np.sum((self.nodes - point) ** 2, axis=1), np.inf)
        return int(np.argmin(distance))


def grid_count(half_m: float) -> int:
    """Return the number of nodes along one side of the grid."""
    return max(round(2 * half_m / GRID_STEP_M) + 1, 2)


def cells(half_m: Half, points_K_m: Array) -> npt.NDArray[np.int64]:
    """Return the node (n,) of the grid that is nearest to each point (n, 2)."""
    half, shape = np.array(half_m), np.array([grid_count(h) for h in half_m])
    cell = np.clip(np.rint((points_K_m + half) / (2 * half) * (shape - 1)), 0, shape - 1).astype(np.int64)
    return np.asarray(cell[:, 0] * shape[1] + cell[:, 1])


@lru_cache(maxsize=2)
def _lattice(half_m: Half) -> _RouteLattice:
    return _RouteLattice(half_m)


@lru_cache(maxsize=32)
def _free_of(half_m: Half, exclusion: Exclusion) -> Mask:
    return np.asarray(exclusion.clearance(_lattice(half_m).nodes) >= NODE_CLEARANCE_M)


@lru_cache(maxsize=4)
def _grid(half_m: Half, exclusions: tuple[Exclusion, ...]) -> _Grid:
    return _Grid(half_m, exclusions)


class Routes:
    """Routes from one start.

    Args:
        belief: The map.
        start_K_m: (2,) position of the tip. Inside an envelope, the first leg leads to the nearest free node.
    """

    def __init__(self, belief: SearchMap, start_K_m: Array) -> None:
        self._belief = belief
        self.start_K_m = np.asarray(start_K_m, dtype=np.float64)
        self._tables: dict[float, tuple[_Grid, Array, np.typing.NDArray[np.int32]]] = {}

    def lengths(self, goals_K_m: Array, within_m: float = np.inf) -> Array:
        """Return the route lengths (n,) to goals (n, 2), to a grid step; inf if unreachable or beyond `within_m`."""
        goals = np.asarray(goals_K_m, dtype=np.float64).reshape(-1, 2)
        straight = np.asarray(np.linalg.norm(goals - self.start_K_m, axis=1))
        if not self._belief.exclusions or len(goals) == 0:
            return straight
        _, distance, _ = self._solve(within_m)
        by_grid = distance[cells(self._belief.half, goals)]
        # Grid routes are up to 8 % longer than straight ones.
        return np.asarray(np.where(np.isfinite(by_grid), np.maximum(by_grid / 1.04, straight), np.inf))

    def to(self, goal_K_m: Array) -> Array | None:
        """Return waypoints (k, 2) from the start (excluded) to the goal, outside all envelopes; None if unreachable."""
        goal = np.asarray(goal_K_m, dtype=np.float64)
        if segment_is_free(self._belief, self.start_K_m, goal):
            return goal[None, :]
        if bool(self._belief.inside_exclusion(goal[None, :])[0]):
            return None
        grid, distance, before = self._solve()
        node = grid.nearest_free(goal)
        if node < 0 or not np.isfinite(distance[node]):
            return None
        chain = [node]
        while before[chain[-1]] >= 0:
            chain.append(int(before[chain[-1]]))
        points = np.vstack([grid.nodes[chain[::-1]], goal])
        return self._pull_tight(points)

    def _solve(self, within_m: float = np.inf) -> tuple[_Grid, Array, np.typing.NDArray[np.int32]]:
        if within_m not in self._tables:
            half = self._belief.half_extent_m
            grid = _grid((float(half[0]), float(half[1])), self._belief.exclusions)
            node = grid.nearest_free(self.start_K_m)
            if node < 0:
                n = len(grid.nodes)
                self._tables[within_m] = grid, np.full(n, np.inf), np.full(n, -1, dtype=np.int32)
            else:
                # The type stubs do not allow a single start index.
                solve: Any = scipy.sparse.csgraph.dijkstra
                distance, before = solve(
                    grid.graph, directed=False, indices=node, return_predecessors=True, limit=within_m
                )
                distance = distance + np.linalg.norm(grid.nodes[node] - self.start_K_m)
                self._tables[within_m] = grid, distance, before
        return self._tables[within_m]

    def _pull_tight(self, points: Array) -> Array | None:
        """Shortcut each waypoint to the farthest visible later one. The first leg may leave an envelope."""
        out: list[Array] = []
        here = self.start_K_m
        if bool(self._belief.inside_exclusion(here[None, :])[0]):
            here = points[0]
            out.append(here)
        i = 0
        while i < len(points):
            j = len(points) - 1
            while j > i and not segment_is_free(self._belief, here, points[j]):
                j = i + (j - i) // 2
            if j == i and not segment_is_free(self._belief, here, points[i]) and out:
                return None
            here = points[j]
            if not out or np.linalg.norm(here - out[-1]) > 1e-6:
                out.append(here)
            i = j + 1
        return np.array(out)
