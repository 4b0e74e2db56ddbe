"""Places where further objects may stand, and the probability that there are any.

A further object is a disc on a grid, of a few radii, each size equally likely and each place where it fits too. A disc
that the swept path would have touched, or that overlaps a traced object, is excluded. The rest is the weight that
remains.

Let h be the share of the weight that remains: the probability that an object which stands beside the traced ones was
missed by the path. With a prior p(N) on the number of objects, and k of them traced, each of the others is hidden with
probability h:

    P(N = k + m | map) ~ p(k + m) C(k + m, m) h^m

For the geometric prior p(N) = (1 - q) q^N, the sum over m is a negative binomial series, and

    P(something is left | map) = 1 - (1 - q h)^(k + 1)

Before any search (h = 1, k = 0) this is q, the prior probability of an object. When nothing remains it is 0. The
geometric prior is the broadest one with a given mean (maximum entropy), so the more objects were found, the more are
expected. Counts thinned by imperfect detection: Royle, Biometrics 60, 2004; the closed form is ours.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from glotouch_bt.robot import Array

DENSITY_PER_M2 = 40.0
"""Mean number of objects of the prior, by floor area: 5 in a box of 0.3 m x 0.4 m. Source: ours."""


@dataclass(frozen=True, kw_only=True)
class DiscPrior:
    """Sizes and places of objects before any search.

    Attributes:
        radii_m: Half mean widths, equally likely.
        grid_m: Spacing of the positions.
        gap_m: Usual distance of objects from walls and from each other.
        gap_weight: Weight of a disc at less than the usual distance.
        wall_m: Minimum distance of the tip's centre from the walls.
        tip_radius_m: Radius of the ball.
        touch: Fraction of disc radius plus ball radius within which a path excludes a disc.
    """

    radii_m: tuple[float, ...] = (0.020, 0.028, 0.038)
    grid_m: float = 0.0125
    gap_m: float = 0.030
    gap_weight: float = 0.05
    wall_m: float = 0.012
    tip_radius_m: float = 0.006
    touch: float = 0.85


USUAL = DiscPrior()
"""Objects 4-11 cm long, 30 mm apart: where the known number of objects is probably found first."""
CROWDED = DiscPrior(gap_m=0.0, gap_weight=1.0)
"""Objects of the same sizes, also close to a wall or to another object."""
ANY = DiscPrior(radii_m=(0.0088, 0.0121, 0.0167, 0.0229, 0.0315), grid_m=0.005, gap_m=0.0, gap_weight=1.0, touch=1.0)
"""Any object of 15 to 74 mm, log-uniform in size, also close to a wall or to another object. Each radius is the middle
of a fifth of the sizes."""


@dataclass(frozen=True)
class Discs:
    """Discs that fit into a container.

    Attributes:
        grid: (g, 2) positions, m.
        place: (h,) position of each disc in the grid.
        radius: (h,) m.
        weight: (h,) prior weights; the sum is 1, and equal for each radius.
        reach: (h,) distance of the tip's centre from the disc's below which a path excludes it, m.
    """

    grid: Array
    place: npt.NDArray[np.int64]
    radius: Array
    weight: Array
    reach: Array

    @property
    def centre(self) -> Array:
        """(h, 2) m."""
        return np.asarray(self.grid[self.place])


@lru_cache(maxsize=8)
def discs(half: tuple[float, float], prior: DiscPrior) -> Discs:
    """Return the discs of a prior for a tip's centre within |x| <= half[0], |y| <= half[1]."""
    p, inner = prior, np.array(half) + prior.wall_m
    axes = [np.linspace(-h, h, max(round(2 * h / p.grid_m) + 1, 2)) for h in inner]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    place = np.tile(np.arange(len(grid)), len(p.radii_m))
    radius = np.repeat(np.array(p.radii_m), len(grid))
    gap = (inner - np.abs(grid)).min(axis=1)[place] - radius
    weight = np.where(gap >= p.gap_m, 1.0, p.gap_weight) * (gap >= 0)
    keep = weight > 0
    place, radius, weight = place[keep], radius[keep], weight[keep]
    for r in p.radii_m:
        weight[radius == r] /= max(weight[radius == r].sum(), 1e-9) * len(p.radii_m)
    return Discs(grid, place, radius, weight, p.touch * (radius + p.tip_radius_m))


@dataclass(frozen=True)
class Remaining:
    """The places and sizes of a prior that a map has not excluded.

    Attributes:
        discs: The discs of the prior.
        beside: (h,) weights beside the traced objects, searched or not.
        weight: (h,) weights of those that the search has not excluded.
    """

    discs: Discs
    beside: Array
    weight: Array

    @property
    def share(self) -> float:
        """Return h: the mean over the sizes of the weight that remains, of that beside the traced objects."""
        sizes = [self.discs.radius == r for r in np.unique(self.discs.radius)]
        shares = [self.weight[s].sum() / self.beside[s].sum() for s in sizes if self.beside[s].any()]
        return float(np.mean(shares)) if shares else 0.0


def remaining(
    half: tuple[float, float],
    prior: DiscPrior,
    gaps: Sequence[Array],
    path_distance: Callable[[Array, float], Array],
    dropped: Array,
) -> Remaining:
    """Return the places and sizes of a prior that a search has not excluded.

    Args:
        half: Limits of the tip's centre, m.
        prior: The prior.
        gaps: Distances (g,) of the positions from the outline of each traced object; nothing overlaps them.
        path_distance: Distances (n,) of points (n, 2) from the swept path; it may be inf above a limit.
        dropped: (m, 2) positions given up.
    """
    every = discs(half, prior)
    beside = every.weight.copy()
    for outside in gaps:
        gap = outside[every.place] - every.radius
        beside *= np.where(gap < 0.0, 0.0, np.where(gap < prior.gap_m, prior.gap_weight, 1.0))
    weight = np.where(path_distance(every.grid, float(every.reach.max()))[every.place] < every.reach, 0.0, beside)
    if len(dropped):
        near = np.linalg.norm(every.grid[:, None] - dropped[None], axis=2).min(axis=1)
        weight[near[every.place] < prior.tip_radius_m] = 0.0
    return Remaining(every, beside, weight)


def chance_left(share: float, found: int, floor_m2: float, density_per_m2: float = DENSITY_PER_M2) -> float:
    """Return the probability that at least one object is left; see the module's text.

    Args:
        share: h, 0..1.
        found: Number of traced objects.
        floor_m2: Area of the floor, which sets the prior mean.
        density_per_m2: Prior mean number of objects on a square metre.
    """
    mean = density_per_m2 * floor_m2
    return float(-np.expm1((found + 1) * np.log1p(-share * mean / (1.0 + mean))))


def left_in_words(chance: float) -> str:
    """Return a `chance_left` as a sentence; nothing if the number of objects is known (nan)."""
    said = f"{100 * chance:.1f} %" if chance >= 0.001 else "below 0.1 %"
    return "" if np.isnan(chance) else f"chance that an object of at least 15 mm is left: {said}"
