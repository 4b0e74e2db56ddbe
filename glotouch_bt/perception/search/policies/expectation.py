"""Search policy that maximises the discounted probability of finding hidden objects.

The belief is a weight for every position and size of a hidden object: discs on a grid, of a few radii. Discs that a
swept path would have touched, or that overlap a traced object, are excluded; discs near walls or objects are unlikely.
A path finds the discs within its swath. Beam search over straight legs between lattice nodes maximises the weight
found, discounted by the travel up to it (a surrogate of expected search time; Stone, Theory of Optimal Search, 1975).
Only the first leg is executed before replanning.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from glotouch_bt.perception.search.map import Exclusion, Mask, SearchMap
from glotouch_bt.perception.search.policies.frontier import NearestFrontier
from glotouch_bt.perception.search.policies.policy import Stretch
from glotouch_bt.perception.search.routes import Routes, segment_is_free
from glotouch_bt.perception.touch import signed_distance
from glotouch_bt.robot import Array

Indices = npt.NDArray[np.int64]
SAMPLE_M = 0.008
"""Spacing of the points at which legs are checked against envelopes."""


@dataclass(frozen=True, kw_only=True)
class ExpectationParams:
    """Parameters of `ExpectedFind`.

    Attributes:
        radii_m: Half mean widths of the expected objects, equally likely: objects 4-11 cm long.
        grid_m: Spacing of the positions.
        node_m: Spacing of the lattice nodes.
        leg_m: Maximum length of a lattice leg.
        tip_radius_m: Radius of the ball.
        touch: Fraction of disc radius plus ball radius within which a path excludes a disc.
        gap_m: Usual distance of objects from walls and from each other.
        gap_weight: Weight of a disc at less than the usual distance.
        wall_m: Minimum distance of the tip's centre from the walls.
        discount_m: Travel after which a find is worth 1/e.
        depth, width: Number of legs ahead, and beam width.
        left: Remaining weight below which the frontier search takes over.
    """

    radii_m: tuple[float, ...] = (0.020, 0.028, 0.038)
    grid_m: float = 0.0125
    node_m: float = 0.034
    leg_m: float = 0.13
    tip_radius_m: float = 0.006
    touch: float = 0.85
    gap_m: float = 0.030
    gap_weight: float = 0.05
    wall_m: float = 0.012
    discount_m: float = 0.25
    depth: int = 5
    width: int = 16
    left: float = 0.004


@dataclass(frozen=True)
class _SearchLattice:
    """Discs, nodes, legs and the swath of each leg.

    Attributes:
        centre, radius, prior: (h, 2), (h,), (h,) of every disc.
        nodes: (n, 2) positions, m.
        ends: (l, 2) start and end node of every leg, in both directions.
        length: (l,) lengths of the legs, m.
        swath: (l, h) float32, 1 where the leg touches the disc.
        first: (n + 1,) legs of node i are first[i]..first[i + 1].
        samples, owner: points along all legs (s, 2) and the leg of each (s,).
    """

    centre: Array
    radius: Array
    prior: Array
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
def _lattice(half: tuple[float, float], p: ExpectationParams) -> _SearchLattice:
    inner = np.array(half) + p.wall_m
    axes = [np.linspace(-h, h, max(round(2 * h / p.grid_m) + 1, 2)) for h in inner]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    centre = np.concatenate([grid] * len(p.radii_m))
    radius = np.repeat(np.array(p.radii_m), len(grid))
    gap = (inner - np.abs(centre)).min(axis=1) - radius
    prior = np.where(gap >= p.gap_m, 1.0, p.gap_weight) * (gap >= 0)
    keep = prior > 0
    centre, radius, prior = centre[keep], radius[keep], prior[keep]
    for r in p.radii_m:  # every size equally likely
        prior[radius == r] /= max(prior[radius == r].sum(), 1e-9) * len(p.radii_m)
    node_axes = [np.linspace(-h, h, max(round(2 * h / p.node_m) + 1, 2)) for h in half]
    nodes = np.stack(np.meshgrid(*node_axes, indexing="ij"), axis=-1).reshape(-1, 2)
    distance = np.linalg.norm(nodes[:, None] - nodes[None], axis=2)
    start, end = np.nonzero((distance > 0) & (distance <= p.leg_m))
    swath = np.concatenate([
        touched(centre, p.touch * (radius + p.tip_radius_m), nodes[start[i : i + 256]], nodes[end[i : i + 256]])
        for i in range(0, len(start), 256)
    ]).astype(np.float32)  # fmt: skip
    first = np.searchsorted(start, np.arange(len(nodes) + 1))
    length = distance[start, end]
    count = np.maximum(np.ceil(length / SAMPLE_M).astype(int) + 1, 2)
    owner = np.repeat(np.arange(len(start)), count)
    t = np.concatenate([np.linspace(0, 1, c) for c in count])[:, None]
    samples = (1 - t) * nodes[start][owner] + t * nodes[end][owner]
    ends = np.column_stack([start, end])
    return _SearchLattice(centre, radius, prior, nodes, ends, length, swath, np.asarray(first), samples, owner)


@lru_cache(maxsize=8)
def _free_legs(half: tuple[float, float], p: ExpectationParams, exclusions: tuple[Exclusion, ...]) -> Mask:
    lattice = _lattice(half, p)
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

    def weights(self, belief: SearchMap) -> tuple[Array, Array, Array]:
        """Return centres (h, 2), radii (h,) and weights (h,) of hidden objects; the weights sum to 1 initially."""
        p = self.params
        lattice = _lattice(_half(belief), p)
        weight = lattice.prior.copy()
        weight[belief.path_distance(lattice.centre) < p.touch * (lattice.radius + p.tip_radius_m)] = 0.0
        for e in belief.exclusions:
            gap = signed_distance(e.contour, lattice.centre) - lattice.radius
            weight *= np.where(gap < 0.0, 0.0, np.where(gap < p.gap_m, p.gap_weight, 1.0))
        if len(belief.dropped):
            near = np.linalg.norm(lattice.centre[:, None] - belief.dropped[None], axis=2).min(axis=1)
            weight[near < p.tip_radius_m] = 0.0
        return lattice.centre, lattice.radius, weight

    def next_stretch(self, belief: SearchMap, tip_K_m: Array) -> Stretch | None:
        """See `SearchPolicy`."""
        tip = np.asarray(tip_K_m, dtype=np.float64)[:2]
        _, _, weight = self.weights(belief)
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
        p, half = self.params, _half(belief)
        lattice = _lattice(half, p)
        free = _free_legs(half, p, belief.exclusions)
        reach = p.touch * (lattice.radius + p.tip_radius_m)
        lengths = Routes(belief, tip).lengths(lattice.nodes)
        straight = np.linalg.norm(lattice.nodes - tip, axis=1)
        # The first leg may be longer than a lattice leg, to leave fully explored surroundings.
        near = np.argsort(np.where(np.isfinite(lengths), lengths, 9.0), kind="stable")[: 4 * p.width + 16]
        near = near[
            np.isfinite(lengths[near]) & (straight[near] > 1e-3) & ~belief.inside_exclusion(lattice.nodes[near])
        ]
        if len(near) == 0:
            return None
        swath = touched(lattice.centre, reach, np.broadcast_to(tip, (len(near), 2)), lattice.nodes[near])
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


def _half(belief: SearchMap) -> tuple[float, float]:
    return float(belief.half_extent_m[0]), float(belief.half_extent_m[1])
