"""Map of a search: free path, traced objects and dropped positions. Frozen, in the plane of K, metres."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.perception.search.remaining import (
    ANY,
    CROWDED,
    USUAL,
    DiscPrior,
    Remaining,
    chance_left,
    discs,
    remaining,
)
from glotouch_bt.perception.search.tracing import TraceParams
from glotouch_bt.perception.touch import Candidate, Contact, Contour, signed_distance
from glotouch_bt.perception.touch.outline import occupied
from glotouch_bt.robot import Array, ParamError, frozen_array

PATH_STEP_M = 0.002
"""Spacing of the path samples."""
DROPPED_M = 0.004
"""Distance from a dropped position within which a point counts as the same."""
GRID_STEP_M = 0.005
"""Spacing of grids over the permitted region."""
MAX_PROTRUSION_M = 0.010
"""Maximum widening of an envelope by contacts outside the outline. Source: tuned in container_five (gaps of 30 mm)."""
KNOWN_M = 0.005
"""Maximum distance from the envelope of a traced object at which a contact belongs to it."""
MISSED_BELOW = 0.02
"""Chance that one of a known number of objects is missing, below which the search ends. Source: ours."""
WALL_M = 0.003
"""Maximum distance from a wall of a contact with it. Source: ours; no object is as thin."""
WALL_COSINE = 0.9
"""Minimum cosine between the force on the ball and the wall's normal for the contact to be with the wall."""
LEFT_BELOW = 0.03
"""Default chance that something is left below which the search for an unknown number of objects is complete. At 0.05,
the search found everything in 93 % of 300 planar layouts, with a known number in 97 % (`bench search --count unknown
--planar 300 --seed 64000`, 79ab0f05)."""
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Exclusion:
    """A region that the tip's centre avoids: a contour dilated by a margin (tip radius and clearance).

    Compared by identity.

    Attributes:
        contour: The contour.
        margin_m: The margin.
        index: Index of the traced object; None: an obstacle that is no traced object.
    """

    contour: Contour
    margin_m: float
    index: int | None = None

    @classmethod
    def of(cls, contour: Contour, margin_m: float, index: int) -> Exclusion:
        """Return the exclusion of a traced object; contacts outside the outline widen its margin."""
        return cls(contour, margin_m + protrusion_m(contour), index)

    @property
    def given_margin_m(self) -> float:
        """The margin without what contacts outside the outline add."""
        return self.margin_m - protrusion_m(self.contour)

    @property
    def traced(self) -> bool:
        """True for a traced object."""
        return self.index is not None

    def clearance(self, points_K_m: Array) -> Array:
        """Return the distances (n,) of points (n, 2) from the envelope, negative inside."""
        return signed_distance(self.contour, points_K_m) - self.margin_m


@dataclass(frozen=True, eq=False)
class SearchMap:
    """State of a search.

    Attributes:
        half_extent_m: (2,) limits of the tip's centre: |x| <= half[0], |y| <= half[1] in K.
        expected: Number of objects to find; None: unknown.
        path_K_m: (n, 2) positions of the tip's centre at sensing height, every 2 mm, oldest first.
        exclusions: Traced objects, one exclusion each, and obstacles.
        dropped: (m, 2) positions given up: unreachable frontiers, contacts without an object.
        hints: Contacts with other objects during a trace; the search visits them first.
        left_below: With an unknown number, the chance that something is left below which the search is complete.
        interior_m: Length and width of the container's interior; None: its walls are unknown.
        doubt: Probability that there are fewer bodies than the known number, although as many objects are traced.
        unprobed: As many objects are traced as are known, but in doubt, and candidates that may be two bodies are still
            to be probed.
        probed: Indices of the candidates that were probed for that; each is probed once.
        first_index: Least index of a new candidate; smaller ones may have been given to candidates that were forgotten.
        to_replace: Candidates that are traced anew, as they were: a new one in the place of one of them gets its index.
    """

    half_extent_m: Array
    expected: int | None
    path_K_m: Array
    exclusions: tuple[Exclusion, ...]
    dropped: Array
    hints: tuple[Contact, ...] = ()
    left_below: float = LEFT_BELOW
    interior_m: tuple[float, float] | None = None
    doubt: float = 0.0
    unprobed: bool = False
    probed: tuple[int, ...] = ()
    first_index: int = 0
    to_replace: tuple[Candidate, ...] = ()

    @classmethod
    def blank(
        cls,
        half_extent_m: npt.ArrayLike,
        expected: int | None,
        left_below: float = LEFT_BELOW,
        interior_m: tuple[float, float] | None = None,
    ) -> SearchMap:
        """Return a map without any exploration.

        Raises:
            ParamError: A half extent that is not positive, no object expected, or a chance outside 0..1.
        """
        half = frozen_array("half_extent_m", half_extent_m, (2,))
        if not (half > 0).all():
            raise ParamError("half_extent_m", half.tolist(), "positive")
        if expected is not None and expected < 1:
            raise ParamError("expected", expected, "at least 1, or None")
        if not 0.0 <= left_below <= 1.0:
            raise ParamError("left_below", left_below, "in [0, 1]")
        none = np.zeros((0, 2))
        none.setflags(write=False)
        return cls(half, expected, none, (), none, left_below=left_below, interior_m=interior_m)

    def forgotten(self, expected: int | None, candidates: Iterable[Candidate]) -> SearchMap:
        """Return a map without any exploration, whose candidates get other indices than the present ones.

        Args:
            expected: Number of objects to find; None: unknown.
            candidates: The candidates that are forgotten.
        """
        indices = (*(c.index for c in candidates), *(e.index for e in self.exclusions if e.index is not None))
        blank = SearchMap.blank(self.half_extent_m, expected, self.left_below, self.interior_m)
        return replace(blank, first_index=max(indices, default=self.first_index - 1) + 1)

    def with_path(self, points_K_m: npt.ArrayLike) -> SearchMap:
        """Add an executed, connected path (n, 2 or 3), resampled to 2 mm."""
        p = np.asarray(points_K_m, dtype=np.float64)
        if p.ndim != 2 or p.shape[1] < 2 or not np.isfinite(p).all():
            raise ParamError("points_K_m", p.shape, "(n, 2) finite positions")
        if len(p) == 0:
            return self
        p = p[:, :2]
        length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
        at = np.arange(0.0, length[-1] + 1e-12, PATH_STEP_M)
        new = np.column_stack([np.interp(at, length, p[:, 0]), np.interp(at, length, p[:, 1])])
        if len(self.path_K_m):
            far = np.linalg.norm(new - self.path_K_m[-1], axis=1) >= PATH_STEP_M - 1e-9
            new = new[int(np.argmax(far)) :] if far.any() else new[:0]
        return replace(self, path_K_m=_frozen(np.concatenate([self.path_K_m, new])))

    def with_exclusion(self, contour: Contour, margin_m: float, index: int | None = None) -> SearchMap:
        """Add a traced object, or replace the exclusion of a known one: where it no longer is may be searched again.

        Args:
            contour: Where certainly nothing else stands, such as its envelope. Contacts outside the outline widen the
                margin, by 10 mm at most.
            margin_m: Distance that the tip's centre keeps from the envelope.
            index: Index of the object; None: a new one.
        """
        if not (np.isfinite(margin_m) and margin_m >= 0):
            raise ParamError("margin_m", margin_m, "finite and not negative")
        if index is None:
            index = max([self.first_index, *(e.index + 1 for e in self.exclusions if e.index is not None)])
        others = self.without_exclusion(index).exclusions
        return replace(self, exclusions=(*others, Exclusion.of(contour, margin_m, index)))

    def without_exclusion(self, index: int) -> SearchMap:
        """Remove a traced object: it is a part of another one."""
        return replace(self, exclusions=tuple(e for e in self.exclusions if e.index != index))

    def only_with(self, candidates: Iterable[Candidate]) -> SearchMap:
        """Keep the traced objects that are candidates, with the outlines that these have now, and remove the others:
        they turned out to be parts of others, or are gone. Where an object no longer is may be searched again.
        """
        now = {c.index: c for c in candidates}
        gone = [e.index for e in self.exclusions if e.index is not None and e.index not in now]
        kept = [e for e in self.exclusions if e.index is None or e.index in now]
        updated = tuple(
            e if e.index is None else Exclusion.of(occupied(now[e.index]), e.given_margin_m, e.index) for e in kept
        )
        return replace(self, exclusions=updated, first_index=max([self.first_index, *(i + 1 for i in gone)]))

    def unsearched(self, outline: Contour, within_m: float) -> SearchMap:
        """Forget the path and the dropped positions within a distance of an outline: something may stand there now."""
        near_path, near_dropped = (
            signed_distance(outline, points) < within_m for points in (self.path_K_m, self.dropped)
        )
        return replace(self, path_K_m=_frozen(self.path_K_m[~near_path]), dropped=_frozen(self.dropped[~near_dropped]))

    def with_dropped(self, point_K_m: npt.ArrayLike) -> SearchMap:
        """Add a position (2,) that the search must not try again."""
        point = np.asarray(point_K_m, dtype=np.float64).ravel()[None, :2]
        return replace(self, dropped=_frozen(np.concatenate([self.dropped, point])))

    def is_dropped(self, points_K_m: Array, within_m: float = DROPPED_M) -> Mask:
        """Return (n,) True for points (n, 2) within a distance of a dropped position."""
        points = np.asarray(points_K_m, dtype=np.float64).reshape(-1, 2)
        if len(self.dropped) == 0:
            return np.zeros(len(points), dtype=np.bool_)
        return np.asarray(np.linalg.norm(points[:, None] - self.dropped[None], axis=2).min(axis=1) < within_m)

    def with_obstacle(self, point_K_m: npt.ArrayLike, radius_m: float) -> SearchMap:
        """Add a disc that the tip's centre must not enter; it does not count as an object."""
        if not (np.isfinite(radius_m) and radius_m > 0):
            raise ParamError("radius_m", radius_m, "finite and positive")
        point = np.asarray(point_K_m, dtype=np.float64).ravel()[:2]
        disc = Contour("round", point, (2 * radius_m, 2 * radius_m), 0.0, 0.0, np.zeros(0))
        return replace(self, exclusions=(*self.exclusions, Exclusion(disc, 0.0)))

    def with_doubt(self, doubt: float) -> SearchMap:
        """Set the probability that there are fewer bodies than traced objects."""
        return replace(self, doubt=doubt, unprobed=doubt >= MISSED_BELOW and self.found == self.expected)

    def with_probed(self, index: int | None) -> SearchMap:
        """Add a candidate that is probed because it may be two bodies; None: no further one is worth a probe."""
        return replace(self, unprobed=False) if index is None else replace(self, probed=(*self.probed, index))

    def with_hints(self, contacts: tuple[Contact, ...]) -> SearchMap:
        """Replace the hints."""
        return replace(self, hints=contacts)

    def clearance(self, points_K_m: Array) -> Array:
        """Return the distances (n,) of points (n, 2) from the nearest envelope, negative inside, inf without one."""
        points = np.asarray(points_K_m, dtype=np.float64).reshape(-1, 2)
        nearest = np.full(len(points), np.inf)
        for e in self.exclusions:
            nearest = np.minimum(nearest, e.clearance(points))
        return nearest

    def inside_exclusion(self, points_K_m: Array) -> Mask:
        """Return (n,) True for points (n, 2) inside any envelope."""
        return np.asarray(self.clearance(points_K_m) < 0.0)

    def knows(self, contact: Contact) -> bool:
        """Return True if a contact belongs to a traced object: near its envelope, on an outward-facing surface."""
        tip, least = contact.tip_K_m[:2], TraceParams().facing
        for e in self.exclusions:
            out = tip - e.contour.centre_K_m
            facing = float(contact.reaction_K[:2] @ out) < least * float(np.hypot(out[0], out[1]))
            if e.traced and not facing and float(e.clearance(tip[None])[0]) < KNOWN_M:
                return True
        return False

    def at_wall(self, contact: Contact) -> bool:
        """Return True if a contact is with a wall of the container: near it, and pushed back by it."""
        if self.interior_m is None:
            return False
        beyond = np.abs(contact.point_K_m) > 0.5 * np.array(self.interior_m) - WALL_M
        inwards = -np.sign(contact.point_K_m) * contact.reaction_K[:2]
        return bool(np.any(beyond & (inwards > WALL_COSINE)))

    def inside_extent(self, points_K_m: Array) -> Mask:
        """Return (n,) True for points (n, 2) that the tip's centre may visit."""
        return np.asarray(np.all(np.abs(points_K_m) <= self.half_extent_m + 1e-9, axis=1))

    def path_distance(self, points_K_m: Array, within_m: float = np.inf) -> Array:
        """Return the distances (n,) of points (n, 2) from the nearest path sample; inf beyond `within_m`."""
        points = np.asarray(points_K_m, dtype=np.float64).reshape(-1, 2)
        if len(self.path_K_m) == 0:
            return np.full(len(points), np.inf)
        return np.asarray(self._tree.query(points, distance_upper_bound=within_m)[0], dtype=np.float64)

    def reaches_beyond(self, before: SearchMap) -> bool:
        """Return True if the path leads to positions that it had not visited in an earlier state of this map."""
        new = self.path_K_m[len(before.path_K_m) :]
        return bool((before.path_distance(new) >= PATH_STEP_M).any())

    @property
    def found(self) -> int:
        """Number of traced objects."""
        return sum(e.traced for e in self.exclusions)

    @property
    def half(self) -> tuple[float, float]:
        """Return the limits of the tip's centre, m."""
        return float(self.half_extent_m[0]), float(self.half_extent_m[1])

    @property
    def prior(self) -> DiscPrior:
        """Return the sizes and places of what is looked for: any object if the number is unknown."""
        return ANY if self.expected is None else USUAL

    @cached_property
    def hidden(self) -> Remaining:
        """Places where objects may still be."""
        return self.any_size if self.expected is None else self._remaining(self.prior)

    @cached_property
    def anywhere(self) -> Remaining:
        """Places where objects of the usual sizes may still be, without a gap to walls and traced objects."""
        return self._remaining(CROWDED)

    @cached_property
    def any_size(self) -> Remaining:
        """Places where objects of any size from 15 mm on may still be, without such a gap."""
        return self._remaining(ANY)

    def _remaining(self, prior: DiscPrior) -> Remaining:
        """Return where objects may still be: an obstacle hides none, because it is only a place of a contact."""
        gaps = [_gap(e, self.half, prior) for e in self.exclusions if e.traced]
        return remaining(self.half, prior, gaps, self.path_distance, self.dropped)

    @cached_property
    def chance_left(self) -> float:
        """Probability that at least one object of the prior is left; nan with a known number."""
        if self.expected is not None:
            return float("nan")
        floor_m2 = float(np.prod(2.0 * (self.half_extent_m + self.prior.wall_m)))
        return chance_left(self.hidden.share, self.found, floor_m2)

    @cached_property
    def chance_missed(self) -> float:
        """Probability that one of a known number of objects is missing although as many are traced.

        By Bayes' rule from the doubt d, and the share h of places where the missing one would not have been met yet:
        d h / (d h + 1 - d).
        """
        missed = self.doubt * self.anywhere.share if self.doubt > 0.0 else 0.0
        return missed / (missed + 1.0 - self.doubt) if missed > 0.0 else 0.0

    def is_searched(self, share: float) -> bool:
        """Return True if objects of a known number are missing, and less than a share of the places is left."""
        short = self.expected is not None and self.found < self.expected
        return short and share > 0.0 and self.anywhere.share < share

    @property
    def complete(self) -> bool:
        """True if all expected objects are traced; for an unknown number, if hardly anything can be left.

        Of a doubtful number (`MISSED_BELOW`), the object that is missing may be at a hint that is not followed yet, or
        a part of a candidate that is probed first.
        """
        if self.expected is None:
            return not self.hints and self.chance_left < self.left_below
        if self.found < self.expected:
            return False
        return self.doubt < MISSED_BELOW or (not self.hints and not self.unprobed and self.chance_missed < MISSED_BELOW)

    @cached_property
    def _tree(self) -> scipy.spatial.cKDTree:
        return scipy.spatial.cKDTree(self.path_K_m)


@lru_cache(maxsize=128)
def _gap(exclusion: Exclusion, half: tuple[float, float], prior: DiscPrior) -> Array:
    """Return the distances (g,) of a prior's positions from the outline of a traced object."""
    return signed_distance(exclusion.contour, discs(half, prior).grid)


def protrusion_m(contour: Contour) -> float:
    """Return how far contacts outside an outline widen its envelope."""
    return float(np.clip(np.max(contour.residuals_m, initial=0.0), 0.0, MAX_PROTRUSION_M))


def _frozen(a: Array) -> Array:
    a.setflags(write=False)
    return a
