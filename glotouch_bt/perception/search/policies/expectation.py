"""Search policy that maximises the discounted probability of finding hidden objects.

The belief is a weight for every position and size of a hidden object; see `remaining`. A path finds the discs within
its swath. Beam search over straight legs between lattice nodes maximises the weight found, discounted by the travel up
to it (a surrogate of expected search time; Stone, Theory of Optimal Search, 1975). Only the first leg is executed
before replanning.

With an unknown number of objects the whole floor must be searched, for small objects too. The order hardly matters
then, and `NearestHidden` covers it on a shorter way.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.perception.search.map import Exclusion, Mask, SearchMap
from glotouch_bt.perception.search.policies.frontier import NearestFrontier
from glotouch_bt.perception.search.policies.hidden import NearestHidden
from glotouch_bt.perception.search.policies.policy import Stretch
from glotouch_bt.perception.search.remaining import CROWDED, DiscPrior, Discs, discs
from glotouch_bt.perception.search.routes import Routes, segment_is_free
from glotouch_bt.robot import Array

Indices = npt.NDArray[np.int64]
SAMPLE_M = 0.008
"""Spacing of the points at which legs are checked against envelopes."""
LEGS_AT_ONCE = 2048
"""Number of legs whose swaths are found at once, for memory."""


@dataclass(frozen=True, kw_only=True)
class ExpectationParams:
    """Parameters of `ExpectedFind`.

    Attributes:
        node_m: Spacing of the lattice nodes.
        leg_m: Maximum length of a lattice leg.
        discount_m: Travel after which a find is worth 1/e.
        depth, width: Number of legs ahead, and beam width.
        left: Remaining weight below which the frontier search takes over.
    """

    node_m: float = 0.034
    leg_m: float = 0.13
    discount_m: float = 0.25
    depth: int = 5
    width: int = 16
    left: float = 0.004


@dataclass(frozen=True, eq=False)
class _SearchLattice:
    """Discs, nodes, legs and the swath of each leg.

    Attributes:
        discs: The h discs.
        nodes: (n, 2) positions, m.
        ends: (l, 2) start and end node of every leg, in both directions.
        length: (l,) lengths of the legs, m.
        swath, begin: leg i touches the discs swath[begin[i]:begin[i + 1]].
        first: (n + 1,) legs of node i are first[i]..first[i + 1].
        samples, owner: points along all legs (s, 2) and the leg of each (s,).
    """

    discs: Discs
    nodes: Array
    ends: Indices
    length: Array
    swath: Indices
    begin: Indices
    first: Indices
    samples: Array
    owner: Indices

    def gains(self, node: int, left: Array) -> Array:
        """Return the weight found on each leg of a node, of the weights (h,) that are left."""
        begin = self.begin[self.first[node] : self.first[node + 1] + 1]
        found = np.concatenate([[0.0], np.cumsum(left[self.swath[begin[0] : begin[-1]]])])
        return np.asarray(np.diff(found[begin - begin[0]]))


def touched(centre: Array, reach: Array, a: Array, b: Array) -> Mask:
    """Return True where a segment a-b comes within reach of a centre.

    Args:
        centre, a, b: Points (..., 2), broadcast against each other.
        reach: Distances (...).
    """
    along, from_a = b - a, centre - a
    t = (from_a * along).sum(axis=-1) / np.maximum((along * along).sum(axis=-1), 1e-12)
    away = from_a - np.clip(t, 0.0, 1.0)[..., None] * along
    return np.asarray((away * away).sum(axis=-1) < reach**2)


def _swaths(every: Discs, start: Array, end: Array) -> tuple[Indices, Indices]:
    """Return the discs that the segments start-end (l, 2) touch, one after another, and where each begins (l + 1,)."""
    middle, half_m = 0.5 * (start + end), 0.5 * np.linalg.norm(end - start, axis=1)
    tree, count, found = scipy.spatial.cKDTree(every.centre), np.zeros(len(start), dtype=np.int64), []
    for i in range(0, len(start), LEGS_AT_ONCE):
        part = slice(i, i + LEGS_AT_ONCE)
        near = tree.query_ball_point(middle[part], half_m[part] + every.reach.max(), return_sorted=True)
        disc = np.concatenate([np.asarray(n, dtype=np.int64) for n in near])
        leg = i + np.repeat(np.arange(len(near)), [len(n) for n in near])
        hit = touched(every.centre[disc], every.reach[disc], start[leg], end[leg])
        found.append(disc[hit])
        count += np.bincount(leg[hit], minlength=len(start))
    return np.concatenate(found), np.concatenate([[0], np.cumsum(count)])


def _repeated(values: Indices, begin: Indices, rows: Indices) -> tuple[Indices, Indices]:
    """Return the chosen rows of a ragged table, one after another, and where each begins."""
    lengths = np.diff(begin)[rows]
    begins = np.concatenate([[0], np.cumsum(lengths)])
    return values[np.arange(begins[-1]) + np.repeat(begin[rows] - begins[:-1], lengths)], begins


@lru_cache(maxsize=4)
def _lattice(half: tuple[float, float], prior: DiscPrior, p: ExpectationParams) -> _SearchLattice:
    every = discs(half, prior)
    node_axes = [np.linspace(-h, h, max(round(2 * h / p.node_m) + 1, 2)) for h in half]
    nodes = np.stack(np.meshgrid(*node_axes, indexing="ij"), axis=-1).reshape(-1, 2)
    distance = np.linalg.norm(nodes[:, None] - nodes[None], axis=2)
    start, end = np.nonzero((distance > 0) & (distance <= p.leg_m))
    one_way = start < end  # a leg and its reverse touch the same discs
    swath, begin = _swaths(every, nodes[start[one_way]], nodes[end[one_way]])
    key = len(nodes) * np.minimum(start, end) + np.maximum(start, end)
    swath, begin = _repeated(swath, begin, np.searchsorted(key[one_way], key))
    first = np.searchsorted(start, np.arange(len(nodes) + 1))
    length = distance[start, end]
    count = np.maximum(np.ceil(length / SAMPLE_M).astype(int) + 1, 2)
    owner = np.repeat(np.arange(len(start)), count)
    t = ((np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)) / (count - 1)[owner])[:, None]
    samples = (1 - t) * nodes[start][owner] + t * nodes[end][owner]
    ends = np.column_stack([start, end])
    return _SearchLattice(every, nodes, ends, length, swath, begin, np.asarray(first), samples, owner)


@lru_cache(maxsize=8)
def _free_legs(lattice: _SearchLattice, exclusions: tuple[Exclusion, ...]) -> Mask:
    free = np.ones(len(lattice.ends), dtype=np.bool_)
    for e in exclusions:
        free[lattice.owner[e.clearance(lattice.samples) < 0.0]] = False
    return free


class ExpectedFind:
    """Policy of this module. Stateless; about 20 ms per call, 0.15 s for the first one.

    Args:
        params: See `ExpectationParams`.
    """

    def __init__(self, params: ExpectationParams | None = None) -> None:
        self.params = params or ExpectationParams()
        self._rest = NearestFrontier(passes=((1.0, 0.0), (0.6, 0.0)))
        self._everywhere = NearestHidden()

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """See `SearchPolicy`."""
        tip = np.asarray(tip_K_m, dtype=np.float64)[:2]
        if belief.expected is None:
            return self._everywhere.next_stretch(belief, tip)
        for prior in (belief.prior, CROWDED):
            weight = (belief.anywhere if prior is CROWDED else belief.hidden).weight
            if weight.sum() <= self.params.left:
                continue
            node = self._first_node(belief, tip, weight, prior)
            if node is not None:
                if segment_is_free(belief, tip, node):
                    return Stretch(node[None, :])
                way = Routes(belief, tip).to(node)
                if way is not None:
                    return Stretch(way)
        return self._rest.next_stretch(belief, tip)

    def _first_node(self, belief: SearchMap, tip: Array, weight: Array, prior: DiscPrior) -> Array | None:
        """Return the end of the best path's first leg, or None if no path finds anything."""
        p = self.params
        lattice = _lattice(belief.half, prior, p)
        free = _free_legs(lattice, belief.exclusions)
        lengths = Routes(belief, tip).lengths(lattice.nodes)
        straight = np.linalg.norm(lattice.nodes - tip, axis=1)
        # The first leg may be longer than a lattice leg, to leave fully explored surroundings.
        near = np.argsort(np.where(np.isfinite(lengths), lengths, 9.0), kind="stable")[: 4 * p.width + 16]
        near = near[
            np.isfinite(lengths[near]) & (straight[near] > 1e-3) & ~belief.inside_exclusion(lattice.nodes[near])
        ]
        if len(near) == 0:
            return None
        every = lattice.discs
        swath = touched(every.centre[None], every.reach[None], tip, lattice.nodes[near][:, None])
        left = weight[None] * ~swath
        mass = weight.sum() - left.sum(axis=1)
        length = lengths[near]
        score = mass * np.exp(-0.5 * length / p.discount_m)
        node, root = near.copy(), near.copy()
        best_score, best_root = float(np.max(score)), int(root[int(np.argmax(score))])
        for _ in range(p.depth - 1):
            kept = np.argsort(-score, kind="stable")[: p.width]
            leg = [np.arange(lattice.first[node[i]], lattice.first[node[i] + 1]) for i in kept]
            legs, parents = np.concatenate(leg), np.repeat(kept, [len(ls) for ls in leg])
            gained = np.concatenate([lattice.gains(node[i], left[i]) for i in kept])[free[legs]]
            legs, parents = legs[free[legs]], parents[free[legs]]
            if len(legs) == 0:
                break
            middle = length[parents] + 0.5 * lattice.length[legs]
            score = score[parents] + gained * np.exp(-middle / p.discount_m)
            top = np.argsort(-score, kind="stable")[: 3 * p.width]
            parents, legs, score = parents[top], legs[top], score[top]
            left = left[parents]
            for weights, begin, end in zip(left, lattice.begin[legs], lattice.begin[legs + 1], strict=True):
                weights[lattice.swath[begin:end]] = 0.0
            length = length[parents] + lattice.length[legs]
            root, node = root[parents], lattice.ends[legs, 1]
            if float(score[0]) > best_score:
                best_score, best_root = float(score[0]), int(root[0])
        return lattice.nodes[best_root] if best_score > 1e-6 else None
