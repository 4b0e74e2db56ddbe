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

from glotouch_bt.perception.search.map import Exclusion, Mask, SearchMap
from glotouch_bt.perception.search.policies.frontier import NearestFrontier
from glotouch_bt.perception.search.policies.hidden import NearestHidden
from glotouch_bt.perception.search.policies.policy import Stretch
from glotouch_bt.perception.search.remaining import DiscPrior, Discs, discs
from glotouch_bt.perception.search.routes import Routes, segment_is_free
from glotouch_bt.robot import Array

Indices = npt.NDArray[np.int64]
SAMPLE_M = 0.008
"""Spacing of the points at which legs are checked against envelopes."""


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
        swath: (l, h) float32, 1 where the leg touches the disc.
        first: (n + 1,) legs of node i are first[i]..first[i + 1].
        samples, owner: points along all legs (s, 2) and the leg of each (s,).
    """

    discs: Discs
    nodes: Array
    ends: Indices
    length: Array
    swath: npt.NDArray[np.float32]
    first: Indices
    samples: Array
    owner: Indices


def touched(centre: Array, reach: Array, a: Array, b: Array) -> Mask:
    """Return (l, h) True where a segment a-b (l, 2) comes within reach (h,) of a centre (h, 2)."""
    ab = b - a
    along_x, along_y = ab[:, :1], ab[:, 1:]
    x, y = centre.T
    t = (x - a[:, :1]) * along_x + (y - a[:, 1:]) * along_y
    t /= np.maximum((ab * ab).sum(axis=1), 1e-12)[:, None]
    np.clip(t, 0.0, 1.0, out=t)
    away_x, away_y = x - (a[:, :1] + t * along_x), y - (a[:, 1:] + t * along_y)
    return np.asarray(away_x * away_x + away_y * away_y < reach**2)


@lru_cache(maxsize=4)
def _lattice(half: tuple[float, float], prior: DiscPrior, p: ExpectationParams) -> _SearchLattice:
    every = discs(half, prior)
    node_axes = [np.linspace(-h, h, max(round(2 * h / p.node_m) + 1, 2)) for h in half]
    nodes = np.stack(np.meshgrid(*node_axes, indexing="ij"), axis=-1).reshape(-1, 2)
    distance = np.linalg.norm(nodes[:, None] - nodes[None], axis=2)
    start, end = np.nonzero((distance > 0) & (distance <= p.leg_m))
    swath = np.concatenate([
        touched(every.centre, every.reach, nodes[start[i : i + 256]], nodes[end[i : i + 256]])
        for i in range(0, len(start), 256)
    ]).astype(np.float32)  # fmt: skip
    first = np.searchsorted(start, np.arange(len(nodes) + 1))
    length = distance[start, end]
    count = np.maximum(np.ceil(length / SAMPLE_M).astype(int) + 1, 2)
    owner = np.repeat(np.arange(len(start)), count)
    t = np.concatenate([np.linspace(0, 1, c) for c in count])[:, None]
    samples = (1 - t) * nodes[start][owner] + t * nodes[end][owner]
    ends = np.column_stack([start, end])
    return _SearchLattice(every, nodes, ends, length, swath, np.asarray(first), samples, owner)


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
        weight = belief.hidden.weight
        if weight.sum() > self.params.left:
            node = self._first_node(belief, tip, weight.astype(np.float32))
            if node is not None:
                if segment_is_free(belief, tip, node):
                    return Stretch(node[None, :])
                way = Routes(belief, tip).to(node)
                if way is not None:
                    return Stretch(way)
        return self._rest.next_stretch(belief, tip)

    def _first_node(self, belief: SearchMap, tip: Array, weight: npt.NDArray[np.float32]) -> Array | None:
        """Return the end of the best path's first leg, or None if no path finds anything."""
        p = self.params
        lattice = _lattice(belief.half, belief.prior, p)
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
        swath = touched(every.centre, every.reach, np.broadcast_to(tip, (len(near), 2)), lattice.nodes[near])
        left = weight[None] * ~swath
        mass = weight.sum() - left.sum(axis=1)
        length = lengths[near]
        score = mass * np.exp(-0.5 * length / p.discount_m)
        node, root = near.copy(), near.copy()
        best_score, best_root = float(np.max(score)), int(root[int(np.argmax(score))])
        for _ in range(p.depth - 1):
            kept = np.argsort(-score, kind="stable")[: p.width]
            parent, leg = [], []
            for i in kept:
                legs = np.arange(lattice.first[node[i]], lattice.first[node[i] + 1])
                legs = legs[free[legs]]
                parent.append(np.full(len(legs), i))
                leg.append(legs)
            parents, legs = np.concatenate(parent), np.concatenate(leg)
            if len(legs) == 0:
                break
            gained = np.concatenate([lattice.swath[ls] @ left[i] for i, ls in zip(kept, leg, strict=True)])
            middle = length[parents] + 0.5 * lattice.length[legs]
            score = score[parents] + gained * np.exp(-middle / p.discount_m)
            top = np.argsort(-score, kind="stable")[: 3 * p.width]
            parents, legs, score = parents[top], legs[top], score[top]
            left = left[parents] * (1.0 - lattice.swath[legs])
            length = length[parents] + lattice.length[legs]
            root, node = root[parents], lattice.ends[legs, 1]
            if float(score[0]) > best_score:
                best_score, best_root = float(score[0]), int(root[0])
        return lattice.nodes[best_root] if best_score > 1e-6 else None
