"""Search policy that maximises the discounted probability of finding hidden objects.

The belief is a weight for every position and size of a hidden object; see `remaining`. A path finds the discs within
its swath. Beam search over straight legs between lattice nodes maximises the weight found, discounted by the travel up
to it (a surrogate of expected search time; Stone, Theory of Optimal Search, 1975). Only the first two legs are executed
before replanning.

With an unknown number of objects, or once objects of the usual sizes can be nowhere, the whole floor must be searched,
for small objects too. The order hardly matters then, and `NearestHidden` covers it on a shorter way.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from glotouch_bt.compiled import compiled
from glotouch_bt.perception.search.map import Exclusion, Mask, SearchMap
from glotouch_bt.perception.search.policies.hidden import NearestHidden
from glotouch_bt.perception.search.policies.policy import Stretch
from glotouch_bt.perception.search.remaining import Discs, Remaining
from glotouch_bt.perception.search.routes import Routes, segment_is_free
from glotouch_bt.robot import Array

Indices = npt.NDArray[np.int64]
SLACK_M = 0.002
"""Tolerance for the distance between planned and executed path. A leg counts only the discs that a path this far beside
it would also reach. Source: ours; the map samples the executed path at this spacing."""
SAMPLE_M = 0.008
"""Spacing of the points at which legs are checked against envelopes."""
FIRST_M = 0.3
"""Maximum length of the routes to the ends of the first leg; all routes are computed if too few nodes are that near.
Source: ours."""
COLUMN_M = 0.010
"""Width of the columns in which the discs are sorted. Source: ours."""
EXECUTED_LEGS = 2
"""Number of legs of a plan that are executed before the next plan. Source: with one leg, planning time grew faster than
the floor; with three, searches took longer (planar, seeds 63100-63139 and 63200-63209)."""


@dataclass(frozen=True, kw_only=True)
class ExpectationParams:
    """Parameters of `ExpectedFind`.

    Attributes:
        node_m: Spacing of the lattice nodes.
        leg_m: Maximum length of a lattice leg.
        discount_m: Travel after which a find is worth 1/e.
        depth, width: Number of legs ahead, and beam width.
        left: Remaining weight below which the whole floor is searched for small objects, too.
    """

    node_m: float = 0.034
    leg_m: float = 0.13
    discount_m: float = 0.25
    depth: int = 5
    width: int = 16
    left: float = 0.004


@dataclass(frozen=True, eq=False)
class _SearchLattice:
    """Nodes and the legs between them.

    Attributes:
        nodes: (n, 2) positions, m.
        ends: (l, 2) start and end node of every leg, in both directions, by start.
        length: (l,) lengths of the legs, m.
        first: (n + 1,) legs of node i are first[i]..first[i + 1].
        track: (l,) number of the track of each leg, the same in both directions.
        samples, owner: points along all tracks (s, 2) and the track of each (s,).
    """

    nodes: Array
    ends: Indices
    length: Array
    first: Indices
    track: Indices
    samples: Array
    owner: Indices


@dataclass(frozen=True)
class _Hidden:
    """Discs that may hide something, by column of `COLUMN_M` along x, and by y inside one.

    Attributes:
        centre, reach, weight: Of each disc (h, 2), (h,), (h,); see `Discs`. The reach is smaller by `SLACK_M`.
        first: (c + 1,) discs of column i are first[i]..first[i + 1].
        west_m: x of the first column's edge.
    """

    centre: Array
    reach: Array
    weight: Array
    first: Indices
    west_m: float

    @classmethod
    def of(cls, every: Discs, weight: Array, low: Array, high: Array) -> _Hidden:
        """Return the discs with a weight (h,) that a path between two corners (2,) of a region may touch."""
        centre, reach = every.centre, every.reach[:, None] - SLACK_M
        chosen = np.flatnonzero((weight > 0.0) & ((centre > low - reach) & (centre < high + reach)).all(axis=1))
        return cls.sorted(centre[chosen], every.reach[chosen] - SLACK_M, weight[chosen])

    @classmethod
    def sorted(cls, centre: Array, reach: Array, weight: Array) -> _Hidden:
        """Return discs by column, and by y inside one."""
        west_m = float(centre[:, 0].min()) if len(centre) else 0.0
        column = ((centre[:, 0] - west_m) / COLUMN_M).astype(np.int64)
        order = np.lexsort((centre[:, 1], column))
        first = np.searchsorted(column[order], np.arange(column.max(initial=-1) + 2))
        return cls(centre[order], reach[order], weight[order], np.asarray(first), west_m)


@compiled("f8[:, ::1]", "f8[::1]", "i8[::1]", "f8", "f8[:, ::1]", "i8[::1]", "f8[:, ::1]", "f8[:, ::1]", "b1")
def _find(
    centre: Array,
    reach: Array,
    first: Indices,
    west: float,
    left: Array,
    rows: Indices,
    start: Array,
    end: Array,
    take: bool,
) -> Array:
    """Return the weight found on each leg (l,): that of the discs which the leg touches.

    Args:
        centre, reach, first, west: See `_Hidden`.
        left: (r, h) weights that are left; with `take`, those found on a leg are set to zero.
        rows: (l,) row of `left` for each leg.
        start, end: (l, 2) ends of the legs, m.
        take: See `left`.
    """
    found = np.zeros(len(rows))
    farthest = reach.max() if len(reach) else 0.0
    columns = len(first) - 1
    for leg in range(len(rows)):
        row, x, y = rows[leg], start[leg, 0], start[leg, 1]
        along_x, along_y = end[leg, 0] - x, end[leg, 1] - y
        length_2 = max(along_x * along_x + along_y * along_y, 1e-12)
        low, high = min(y, end[leg, 1]) - farthest, max(y, end[leg, 1]) + farthest
        left_edge, right_edge = min(x, end[leg, 0]) - farthest, max(x, end[leg, 0]) + farthest
        for column in range(
            max(int((left_edge - west) / COLUMN_M), 0), min(int((right_edge - west) / COLUMN_M) + 1, columns)
        ):
            i, beyond = first[column], first[column + 1]
            i += np.searchsorted(centre[i:beyond, 1], low)
            while i < beyond and centre[i, 1] <= high:
                if left[row, i] > 0.0:
                    from_x, from_y = centre[i, 0] - x, centre[i, 1] - y
                    t = min(max((from_x * along_x + from_y * along_y) / length_2, 0.0), 1.0)
                    away_x, away_y = from_x - t * along_x, from_y - t * along_y
                    if away_x * away_x + away_y * away_y < reach[i] * reach[i]:
                        found[leg] += left[row, i]
                        if take:
                            left[row, i] = 0.0
                i += 1
    return found


@lru_cache(maxsize=4)
def _lattice(half: tuple[float, float], p: ExpectationParams) -> _SearchLattice:
    node_axes = [np.linspace(-h, h, max(round(2 * h / p.node_m) + 1, 2)) for h in half]
    nodes = np.stack(np.meshgrid(*node_axes, indexing="ij"), axis=-1).reshape(-1, 2)
    distance = np.linalg.norm(nodes[:, None] - nodes[None], axis=2)
    start, end = np.nonzero((distance > 0) & (distance <= p.leg_m))
    key = len(nodes) * np.minimum(start, end) + np.maximum(start, end)
    _, once, track = np.unique(key, return_index=True, return_inverse=True)
    length = distance[start, end]
    count = np.maximum(np.ceil(length[once] / SAMPLE_M).astype(int) + 1, 2)
    owner = np.repeat(np.arange(len(once)), count)
    t = ((np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)) / (count - 1)[owner])[:, None]
    samples = (1 - t) * nodes[start[once]][owner] + t * nodes[end[once]][owner]
    first = np.searchsorted(start, np.arange(len(nodes) + 1))
    return _SearchLattice(nodes, np.column_stack([start, end]), length, np.asarray(first), track, samples, owner)


def _free_legs(lattice: _SearchLattice, exclusions: tuple[Exclusion, ...]) -> Mask:
    """Return (l,) True for the legs that keep clear of all envelopes."""
    free = np.ones(len(lattice.ends), dtype=np.bool_)
    for e in exclusions:
        free &= ~_blocked(lattice, e)[lattice.track]
    return free


@lru_cache(maxsize=128)
def _blocked(lattice: _SearchLattice, exclusion: Exclusion) -> Mask:
    """Return True for the tracks that enter an envelope."""
    blocked = np.zeros(int(lattice.owner[-1]) + 1, dtype=np.bool_)
    contour = exclusion.contour
    corners = contour.boundary_K_m if contour.family == "free" else contour.centre_K_m
    reach = exclusion.margin_m + (0.0 if contour.family == "free" else 0.5 * float(np.linalg.norm(contour.size_m)))
    low, high = np.min(np.atleast_2d(corners), axis=0) - reach, np.max(np.atleast_2d(corners), axis=0) + reach
    near = np.flatnonzero(((lattice.samples > low) & (lattice.samples < high)).all(axis=1))
    blocked[lattice.owner[near[exclusion.clearance(lattice.samples[near]) < 0.0]]] = True
    return blocked


class ExpectedFind:
    """Policy of this module. Stateless.

    Args:
        params: See `ExpectationParams`.
    """

    def __init__(self, params: ExpectationParams | None = None) -> None:
        self.params = params or ExpectationParams()
        self._everywhere = NearestHidden()

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """See `SearchPolicy`."""
        tip = np.asarray(tip_K_m, dtype=np.float64)[:2]
        usual = () if belief.expected is None else (belief.hidden, belief.anywhere)
        for hidden in usual:
            if hidden.weight.sum() <= self.params.left:
                continue
            legs = self._first_legs(belief, tip, hidden)
            if len(legs):
                way = legs[:1] if segment_is_free(belief, tip, legs[0]) else Routes(belief, tip).to(legs[0])
                if way is not None:
                    return Stretch(way, further_K_m=legs[1:])
        return self._everywhere.next_stretch(belief, tip)

    def _first_legs(self, belief: SearchMap, tip: Array, hidden: Remaining) -> Array:
        """Return the ends (k, 2) of the best path's first `EXECUTED_LEGS` legs; none if no path finds anything."""
        p = self.params
        lattice = _lattice(belief.half, p)
        dropped = belief.is_dropped(lattice.nodes)
        free = _free_legs(lattice, belief.exclusions) & ~dropped[lattice.ends[:, 1]]
        # The first leg may be longer than a lattice leg, to leave fully explored surroundings.
        count, routes = 4 * p.width + 16, Routes(belief, tip)
        lengths = routes.lengths(lattice.nodes, FIRST_M)
        if np.isfinite(lengths).sum() < count:
            lengths = routes.lengths(lattice.nodes)
        straight = np.linalg.norm(lattice.nodes - tip, axis=1)
        near = np.argsort(lengths, kind="stable")[:count]
        near = near[
            np.isfinite(lengths[near]) & (straight[near] > 1e-3) & ~belief.inside_exclusion(lattice.nodes[near])
        ]
        near = near[~dropped[near]]
        if len(near) == 0:
            return np.zeros((0, 2))
        goals, ahead_m = lattice.nodes[near], (p.depth - 1) * p.leg_m
        corners = np.concatenate([tip[None], goals - ahead_m, goals + ahead_m])
        discs = _Hidden.of(hidden.discs, hidden.weight, corners.min(axis=0), corners.max(axis=0))
        left = np.repeat(discs.weight[None], len(near), axis=0)

        def find(rows: Indices, start: Array, end: Array, *, take: bool = False) -> Array:
            return _find(
                discs.centre, discs.reach, discs.first, discs.west_m, left, rows, start, end, take
            )  # fmt: skip

        mass = find(np.arange(len(near)), np.repeat(tip[None], len(near), axis=0), goals, take=True)
        length = lengths[near]
        score = mass * np.exp(-0.5 * length / p.discount_m)
        path = near[:, None]
        best_score, best = float(np.max(score)), path[int(np.argmax(score))]
        for _ in range(p.depth - 1):
            kept = np.argsort(-score, kind="stable")[: p.width]
            leg = [np.arange(lattice.first[path[i, -1]], lattice.first[path[i, -1] + 1]) for i in kept]
            legs, parents = np.concatenate(leg), np.repeat(kept, [len(ls) for ls in leg])
            legs, parents = legs[free[legs]], parents[free[legs]]
            if len(legs) == 0:
                break
            start, end = (lattice.nodes[lattice.ends[legs, i]] for i in range(2))
            middle = length[parents] + 0.5 * lattice.length[legs]
            score = score[parents] + find(parents, start, end) * np.exp(-middle / p.discount_m)
            top = np.argsort(-score, kind="stable")[: 3 * p.width]
            parents, legs, score = parents[top], legs[top], score[top]
            left = left[parents]
            find(np.arange(len(top)), start[top], end[top], take=True)
            length = length[parents] + lattice.length[legs]
            path = np.column_stack([path[parents], lattice.ends[legs, 1]])
            if float(score[0]) > best_score:
                best_score, best = float(score[0]), path[0]
        return lattice.nodes[best[:EXECUTED_LEGS]] if best_score > 1e-6 else np.zeros((0, 2))
