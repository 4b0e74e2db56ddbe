"""What the search knows: where the tip has been, what is traced, what is given up. A frozen value in K's plane,
metres."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import scipy

from glotouch_bt.perception.touch import Contact, Contour, signed_distance
from glotouch_bt.robot import Array, ParamError, frozen_array

PATH_STEP_M = 0.002
GRID_STEP_M = 0.005
LIMB_M = 0.010
"""Most that contacts outside the fitted outline may widen its envelope: gaps between objects are 30 mm."""
KNOWN_M = 0.005
"""A contact this near to the envelope of a traced object is one with that object: the next stands farther off."""
FACING = -0.4
"""Cosine between the force on the ball and the direction from an object's middle below which it is not the object's."""
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Exclusion:
    """A traced object and how far the tip's centre keeps from its outline (tip radius and clearance).

    Compared by identity: two exclusions are the same if they are one. `traced=False`: a place to keep out of, no
    object.
    """

    contour: Contour
    margin_m: float
    traced: bool = True

    def clearance(self, points_K_m: Array) -> Array:
        """(n,) distance of points (n, 2) from the envelope; negative inside."""
        return signed_distance(self.contour, points_K_m) - self.margin_m


@dataclass(frozen=True, eq=False)
class SearchMap:
    """The state of a search.

    Attributes:
        half_extent_m: (2,) the tip's centre may be at |x| <= half[0], |y| <= half[1] in K.
        expected: How many objects there are.
        found: How many are traced.
        path_K_m: (n, 2) where the tip's centre has been at sensing height, every 2 mm, oldest first.
        exclusions: Traced objects.
        dropped: (m, 2) places given up: frontiers that cannot be reached, contacts that gave no object.
        hints: Contacts with something that was not what was being traced: where to look first.
    """

    half_extent_m: Array
    expected: int
    found: int
    path_K_m: Array
    exclusions: tuple[Exclusion, ...]
    dropped: Array
    hints: tuple[Contact, ...] = ()

    @classmethod
    def blank(cls, half_extent_m: npt.ArrayLike, expected: int) -> SearchMap:
        """Nothing explored yet.

        Raises:
            ParamError: A half extent that is not positive, or no object expected.
        """
        half = frozen_array("half_extent_m", half_extent_m, (2,))
        if not (half > 0).all():
            raise ParamError("half_extent_m", half.tolist(), "positive")
        if expected < 1:
            raise ParamError("expected", expected, "at least 1")
        none = np.zeros((0, 2))
        none.setflags(write=False)
        return cls(half, expected, 0, none, (), none)

    def with_path(self, points_K_m: npt.ArrayLike) -> SearchMap:
        """With an executed, connected stretch of path (n, 2 or 3), resampled to one point every 2 mm of its length."""
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

    def with_exclusion(self, contour: Contour, margin_m: float, *, new: bool = True) -> SearchMap:
        """With one more object traced; the tip's centre keeps `margin_m` from its outline.

        `new=False`: more of an object that was counted before.

        Contacts that stick out of the outline (limbs of a figure) widen the margin, by 10 mm at most.
        """
        if not (np.isfinite(margin_m) and margin_m >= 0):
            raise ParamError("margin_m", margin_m, "finite and not negative")
        out = float(np.clip(np.max(contour.residuals_m, initial=0.0), 0.0, LIMB_M))
        return replace(self, found=self.found + new, exclusions=(*self.exclusions, Exclusion(contour, margin_m + out)))

    def with_dropped(self, point_K_m: npt.ArrayLike) -> SearchMap:
        """With a place (2,) that the search shall not try again."""
        point = np.asarray(point_K_m, dtype=np.float64).ravel()[None, :2]
        return replace(self, dropped=_frozen(np.concatenate([self.dropped, point])))

    def with_obstacle(self, point_K_m: npt.ArrayLike, radius_m: float) -> SearchMap:
        """With a disc about a place (2,) that the tip's centre shall not enter; it counts as no object."""
        if not (np.isfinite(radius_m) and radius_m > 0):
            raise ParamError("radius_m", radius_m, "finite and positive")
        point = np.asarray(point_K_m, dtype=np.float64).ravel()[:2]
        disc = Contour("round", point, (2 * radius_m, 2 * radius_m), 0.0, 0.0, np.zeros(0))
        return replace(self, exclusions=(*self.exclusions, Exclusion(disc, 0.0, traced=False)))

    def with_hints(self, contacts: tuple[Contact, ...]) -> SearchMap:
        """With these hints, and no others."""
        return replace(self, hints=contacts)

    def clearance(self, points_K_m: Array) -> Array:
        """(n,) distance of points (n, 2) from the nearest envelope; negative inside one, infinite if there is none."""
        points = np.asarray(points_K_m, dtype=np.float64).reshape(-1, 2)
        nearest = np.full(len(points), np.inf)
        for e in self.exclusions:
            nearest = np.minimum(nearest, e.clearance(points))
        return nearest

    def inside_exclusion(self, points_K_m: Array) -> Mask:
        """(n,) True for points (n, 2) inside any traced object's envelope."""
        return np.asarray(self.clearance(points_K_m) < 0.0)

    def knows(self, contact: Contact) -> bool:
        """True if a contact belongs to a traced object: in its envelope or hardly outside, on a surface that does not
        face the object's middle."""
        tip = contact.tip_K_m[:2]
        for e in self.exclusions:
            out = tip - e.contour.centre_K_m
            facing = float(contact.reaction_K[:2] @ out) < FACING * float(np.hypot(out[0], out[1]))
            if e.traced and not facing and float(e.clearance(tip[None])[0]) < KNOWN_M:
                return True
        return False

    def inside_extent(self, points_K_m: Array) -> Mask:
        """(n,) True for points (n, 2) where the tip's centre may be."""
        return np.asarray(np.all(np.abs(points_K_m) <= self.half_extent_m + 1e-9, axis=1))

    def path_distance(self, points_K_m: Array) -> Array:
        """(n,) distance of points (n, 2) from the nearest path sample; infinite without a path."""
        points = np.asarray(points_K_m, dtype=np.float64).reshape(-1, 2)
        if len(self.path_K_m) == 0:
            return np.full(len(points), np.inf)
        return np.asarray(self._tree.query(points)[0], dtype=np.float64)

    def covered_fraction(self, coverage_radius_m: float) -> float:
        """Part of the permitted region that is near the path or inside an envelope, on a 5 mm grid."""
        axes = [np.linspace(-h, h, max(int(2 * h / GRID_STEP_M) + 1, 2)) for h in self.half_extent_m]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        covered = (self.path_distance(grid) <= coverage_radius_m) | self.inside_exclusion(grid)
        return float(np.mean(covered))

    @property
    def complete(self) -> bool:
        """All expected objects are traced."""
        return self.found >= self.expected

    @cached_property
    def _tree(self) -> scipy.spatial.cKDTree:
        return scipy.spatial.cKDTree(self.path_K_m)


def _frozen(a: Array) -> Array:
    a.setflags(write=False)
    return a
