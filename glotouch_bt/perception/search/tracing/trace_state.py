"""State of a trace: contacts, predicted outline and its uncertainty."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from glotouch_bt.perception.search.moves import MoveOutcome
from glotouch_bt.perception.search.tracing.trace_params import Taken, TraceParams, none_taken
from glotouch_bt.perception.touch import Contact, Contour, split_at_motion
from glotouch_bt.perception.touch.outline import OutlineBelief, infer_outline, wrapped
from glotouch_bt.robot import Array

BEARINGS = 72
"""Number of bearings considered for the next probe."""
TOUCH_SD_M = 0.0005
"""Standard deviation of a contact along the normal of a known outline."""
MIN_PART_CONTACTS = 2
"""Minimum number of contacts with each of two objects traced as one."""
PROTRUSION_M = 0.006
"""Half width of the region around a contact that a route avoids."""
NEAR_CONTACT_M = 0.004
"""Distance from a contact within which a path position is no evidence of free space."""


def all_bearings() -> Array:
    """Return BEARINGS evenly spaced bearings from -pi, rad."""
    return np.linspace(-np.pi, np.pi, BEARINGS, endpoint=False)


def unit(v: Array) -> Array:
    """Return a vector (2,) scaled to length 1; zero stays zero."""
    scaled: Array = v / max(float(np.linalg.norm(v)), 1e-9)
    return scaled


def _polar(outline: OutlineBelief, bearings: Array, distance: Array) -> Array:
    """Return points (n, 2) in K at distances (n,) from the outline's centre."""
    return np.asarray(outline.centre_K_m + distance[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)]))


def _moved_along(contacts: Sequence[Contact]) -> tuple[Contact, ...]:
    push = np.array([c.pushed_K_m for c in contacts])
    later = np.cumsum(push[::-1], axis=0)[::-1]
    return tuple(
        replace(c, tip_K_m=c.tip_K_m + np.array([*s, 0.0]), point_K_m=c.point_K_m + s)
        for c, s in zip(contacts, later, strict=True)
    )


@dataclass(frozen=True)
class OutlineTrace:
    """Result of tracing an object.

    Attributes:
        contacts: Contacts in order of time, moved to the object's current position.
        outline: Inferred outline, or None.
        displaced_K_m: (2,) total displacement of the object.
        path_K_m: (n, 2) positions of the ball at sensing height.
        outliers: Contacts with other objects.
        ended: Reason for the end.
        missing: The object was not found where it had been traced.
        moves: Number of restarts after an unobserved motion.
        continued: The object is the one whose contacts were given at the start.
    """

    contacts: tuple[Contact, ...]
    outline: OutlineBelief | None
    displaced_K_m: Array
    path_K_m: Array
    outliers: tuple[Contact, ...] = ()
    ended: str = ""
    missing: bool = False
    moves: int = 0
    continued: bool = False

    @property
    def contour(self) -> Contour | None:
        """The fitted contour."""
        return None if self.outline is None else self.outline.contour


@dataclass
class TraceState:
    """Mutable state of a trace.

    Attributes:
        tip: (2,) position of the tool's reference point.
        radius: Radius of the tool, m.
        round: The section is a disc: fit outlines to its centres, else to contact points.
        raw: Contacts as measured.
        half: (2,) limits of |x| and |y| of the reference point.
        paths: Paths at sensing height.
        outliers: Contacts with other objects.
        blocked: Bearings probed without a new contact, rad.
        side: Direction around the object: +1 counter-clockwise, 0 not chosen yet.
        moves: Number of unobserved motions of the object.
        moved_K_m: (2,) their total displacement.
        fresh: Index of the first of `paths` after the last unobserved motion.
        odd: Index of the first surprising contact; -1 without one.
        raised: The tool stands above the object, not beside it.
        shift_information: (2, 2) 1/m^2 information of the new contacts about an unobserved motion.
        given: Number of contacts in `raw` at the start.
        known: Number of contacts in `raw` from an earlier trace.
        columns: Returns the places (n, 2) where the ball can come down through felt, free space.
        taken: Returns (n,) True for places (n, 2) of the ball where it would overlap another object.
    """

    tip: Array
    radius: float
    round: bool
    raw: list[Contact]
    half: Array
    paths: list[Array] = field(default_factory=list)
    outliers: list[Contact] = field(default_factory=list)
    blocked: list[float] = field(default_factory=list)
    side: float = 0.0
    moves: int = 0
    moved_K_m: Array = field(default_factory=lambda: np.zeros(2))
    fresh: int = 0
    odd: int = -1
    given: int = 0
    known: int = 0
    raised: bool = False
    shift_information: Array = field(default_factory=lambda: np.zeros((2, 2)))
    columns: Callable[[], Array] = lambda: np.zeros((0, 2))
    taken: Taken = none_taken

    @classmethod
    def begin(
        cls, contacts: list[Contact], tip_K_m: Array, radius_m: float, round_tip: bool, half_extent_m: Array | None
    ) -> TraceState:
        """Start from given contacts; without a half extent there are no walls."""
        half = np.full(2, np.inf) if half_extent_m is None else np.asarray(half_extent_m, dtype=np.float64)
        return cls(np.asarray(tip_K_m, dtype=np.float64)[:2], radius_m, round_tip, contacts, half)

    def present(self) -> tuple[Contact, ...]:
        """Return the contacts at the object's current position: each moved by its own and all later pushes."""
        return _moved_along(self.raw)

    def outline(self, more: tuple[Contact, ...] = (), *, alone: bool = False) -> OutlineBelief:
        """Infer the outline from all contacts and `more`, or from `more` alone."""
        now = more if alone else (*self.present(), *more)
        return infer_outline(
            np.array([self.place(c) for c in now]),
            self.radius if self.round else 0.0,
            approach_K=np.array([c.approach_K[:2] for c in now]),
            reaction_K=np.array([c.reaction_K[:2] for c in now]),
            free_K_m=self.free(),
        )

    def place(self, contact: Contact) -> Array:
        """Return the point (2,) of a contact that outlines are fitted to."""
        return contact.tip_K_m[:2] if self.round else contact.point_K_m

    def ring(self, outline: OutlineBelief, bearings: Array, p: TraceParams) -> tuple[Array, Array]:
        """Predict the distance (n,) m from the outline's centre at which the tool touches, and its deviation."""
        distance, at, sd = self._shape(outline, bearings, p)
        if self.known:
            sd = np.sqrt(sd**2 + self._shift_variance(outline, bearings, at, p))
        return distance + (0.0 if self.round else self.radius), sd

    def passing(
        self, outline: OutlineBelief, bearings: Array, p: TraceParams, clearance: float = 1.0, margin: float = 1.0
    ) -> Array:
        """Return the distances (n,) from the outline's centre at which the ball passes prediction and contacts.

        Args:
            outline, bearings, p: The outline, bearings (n,) rad, and clearances.
            clearance, margin: Fractions of the clearance and of the margin to keep.
        """
        distance, sd = self.ring(outline, bearings, p)
        out = distance + margin * np.minimum(p.margin_sds * sd, p.widest_margin_m)
        off = np.array([self.place(c) for c in self.present()]) - outline.centre_K_m
        far = np.hypot(off[:, 0], off[:, 1]) + (0.0 if self.round else self.radius)
        aside = np.abs(wrapped(bearings[:, None] - np.arctan2(off[:, 1], off[:, 0])[None, :])) * far
        limbs = np.where(aside < PROTRUSION_M, far, 0.0).max(axis=1)
        return np.asarray(np.maximum(out, limbs) + clearance * p.clearance_m)

    def _shape(self, outline: OutlineBelief, bearings: Array, p: TraceParams) -> tuple[Array, Array, Array]:
        """Predict distance (n,), point (n, 2) in K and deviation (n,) for an object without unobserved motion."""
        distance, sd = outline.predict(bearings)
        at = _polar(outline, bearings, distance)
        known = np.array([self.place(c) for c in self.present()])
        apart = np.linalg.norm(at[:, None] - known[None], axis=2).min(axis=1)
        odd = outline.family_weights["free"]
        share = (1.0 - odd) * np.clip((apart - p.near_m) / (p.far_m - p.near_m), 0.0, 1.0)
        share += odd * np.clip((apart - p.odd_near_m) / (p.odd_far_m - p.odd_near_m), 0.0, 1.0)
        return distance, at, np.hypot(sd, share * p.unmodelled_m)

    def _shift_variance(self, outline: OutlineBelief, bearings: Array, at_K_m: Array, p: TraceParams) -> Array:
        """Return the variance (n,) m^2 of the outline along its normal due to an unobserved motion."""
        step = np.deg2rad(2.0)
        ahead = _polar(outline, bearings + step, outline.predict(bearings + step)[0])
        along = ahead - at_K_m
        normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
        return np.asarray(np.einsum("ni,ij,nj->n", normal, self.shift_covariance(p), normal))

    def shift_covariance(self, p: TraceParams) -> Array:
        """Return the posterior covariance (2, 2) m^2 of an unobserved motion since earlier contacts; zeros if none."""
        if not self.known:
            return np.zeros((2, 2))
        return np.asarray(np.linalg.inv(np.eye(2) / p.unfelt_m**2 + self.shift_information))

    def add(self, contact: Contact, outline: OutlineBelief, p: TraceParams) -> None:
        """Add a contact with the object, given the outline before it."""
        if self.known:
            off = self.place(contact) - outline.centre_K_m
            _, _, sd = self._shape(outline, np.array([np.arctan2(off[1], off[0])]), p)
            normal = unit(2.0 * contact.reaction_K[:2] - contact.approach_K[:2])
            self.shift_information = self.shift_information + np.outer(normal, normal) / (
                TOUCH_SD_M**2 + float(sd[0]) ** 2
            )
        if self.odd < 0 and self.surprising(outline, contact, p):
            self.odd = len(self.raw)
        self.raw.append(contact)

    def bearing(self, outline: OutlineBelief) -> float:
        """Return the bearing of the ball from the outline's centre, rad."""
        off = self.tip - outline.centre_K_m
        return float(np.arctan2(off[1], off[0]))

    def lone(self, apart_m: float) -> bool:
        """Return True if all contacts are within `apart_m` of each other, e.g. at the end of a protruding part."""
        places = np.array([self.place(c) for c in self.present()])
        return bool(np.linalg.norm(places[:, None] - places[None], axis=2).max() < apart_m)

    def near(self, contact: Contact, apart_m: float) -> bool:
        """Return True if a contact is within `apart_m` of an earlier one."""
        known = np.array([self.place(c) for c in self.present()])
        return bool(np.linalg.norm(known - self.place(contact), axis=1).min() < apart_m)

    def belongs(self, outline: OutlineBelief, contact: Contact, p: TraceParams) -> bool:
        """Return True if a new contact belongs to this object.

        It does if it is near an earlier contact. It does not if its surface faces the object's centre. Otherwise it
        does if it is near the prediction, or if one object explains all contacts better than two.
        """
        points = np.array([c.point_K_m for c in self.present()])
        if float(np.linalg.norm(points - contact.point_K_m, axis=1).min()) < p.between_m:
            return True
        if self._faces_centre(outline, contact, p):
            return False
        off = contact.tip_K_m[:2] - outline.centre_K_m
        distance, sd = self.ring(outline, np.array([np.arctan2(off[1], off[0])]), p)
        if float(np.hypot(off[0], off[1])) < float(distance[0]) + p.own_m + 2.0 * float(sd[0]):
            return True
        one = self.outline((contact,)).log_evidence - outline.log_evidence
        two = self.outline((contact,), alone=True).log_evidence
        return bool(one > two + np.log(p.other))

    def released(self, outline: OutlineBelief, contact: Contact, p: TraceParams) -> bool:
        """Return True if the force changed because the tool left this object, not because it met another one.

        A light object can be pushed along with too little force to be noticed. The next move then starts in contact,
        and the force that ends seems to point towards the object. The tool is where the outline is predicted, nearer
        than it would pass.
        """
        off = contact.tip_K_m[:2] - outline.centre_K_m
        distance, _ = self.ring(outline, np.array([np.arctan2(off[1], off[0])]), p)
        near = float(np.hypot(off[0], off[1])) < float(distance[0]) + 0.5 * p.clearance_m
        return near and self._faces_centre(outline, contact, p)

    def _faces_centre(self, outline: OutlineBelief, contact: Contact, p: TraceParams) -> bool:
        off = contact.tip_K_m[:2] - outline.centre_K_m
        return bool(contact.reaction_K[:2] @ off < p.facing * np.hypot(off[0], off[1]))

    def surprising(self, outline: OutlineBelief, contact: Contact, p: TraceParams) -> bool:
        """Return True if a contact is far from the predicted outline."""
        off = self.place(contact) - outline.centre_K_m
        distance, sd = outline.predict(np.array([np.arctan2(off[1], off[0])]))
        gap = abs(float(np.hypot(off[0], off[1])) - float(distance[0]))
        return gap > p.surprise_m + p.surprise_sds * float(sd[0])

    def begin_anew(self, p: TraceParams) -> bool:
        """If the object has moved unobserved, keep only the contacts after the motion; return True in this case.

        Earlier paths are no evidence of free space at the object's current position.
        """
        if self.odd < 0 or self.moves >= p.moves:
            return False
        radius = self.radius if self.round else 0.0
        measured = [replace(c, tip_K_m=np.array([*self.place(c), c.tip_K_m[2]])) for c in self.raw]
        stray, _ = split_at_motion(measured, radius, likely=self.known)
        if not stray:
            return False
        stood = self.outline(_moved_along(stray), alone=True).centre_K_m
        stands = self.outline(_moved_along(self.raw[len(stray) :]), alone=True).centre_K_m
        if float(np.linalg.norm(stands - stood)) > p.farthest_m:
            self.odd = -1  # too far to be unobserved: the shape is unusual instead
            return False
        del self.raw[: len(stray)]
        self.given = max(self.given - len(stray), 0)
        self.odd, self.known = -1, 0
        self.blocked.clear()
        self.fresh = len(self.paths)
        self.moves += 1
        self.moved_K_m = self.moved_K_m + self.outline().centre_K_m - stood
        return True

    def keep_one(self, outline: OutlineBelief, p: TraceParams) -> bool:
        """If the outline is larger than any object, keep the contacts of one object; return True in this case.

        The cut across the long axis with the highest evidence separates two objects. The larger part is kept, the other
        contacts become outliers.
        """
        size = outline.contour.size_m
        if len(self.raw) < 2 * MIN_PART_CONTACTS or max(size) <= p.largest_m:
            return False
        now = self.present()
        places = np.array([self.place(c) for c in now])
        axis = np.linalg.svd(places - places.mean(axis=0))[2][0]
        order = np.argsort(places @ axis, kind="stable")
        best, kept = -np.inf, order
        for k in range(MIN_PART_CONTACTS, len(order) - MIN_PART_CONTACTS + 1):
            parts = [self.outline(tuple(now[i] for i in part), alone=True) for part in (order[:k], order[k:])]
            if sum(b.log_evidence for b in parts) > best:
                best = sum(b.log_evidence for b in parts)
                kept = (
                    order[:k]
                    if 2 * k > len(order) or (2 * k == len(order) and len(now) - 1 in order[:k])
                    else order[k:]
                )
        keep = {int(i) for i in kept}
        self.outliers += [c for i, c in enumerate(now) if i not in keep]
        self.raw = [c for i, c in enumerate(self.raw) if i in keep]
        self.given = sum(i < self.given for i in keep)
        self.odd, self.known = -1, 0
        self.blocked.clear()
        return True

    def free(self) -> Array:
        """Return the free positions (n, 2) of the ball, except those near a contact, where the object may be."""
        if not self.paths[self.fresh :]:
            return np.zeros((0, 2))
        path = np.concatenate(self.paths[self.fresh :])
        touched = np.array([c.tip_K_m[:2] for c in (*self.raw, *self.present())])
        far = np.linalg.norm(path[:, None] - touched[None], axis=2).min(axis=1) > NEAR_CONTACT_M
        return np.asarray(path[far])

    def trace(self, outline: OutlineBelief, ended: str) -> OutlineTrace:
        """Return the result of the trace."""
        return OutlineTrace(
            self.present(),
            outline,
            self.moved_K_m + np.sum([c.pushed_K_m for c in self.raw], axis=0),
            np.concatenate(self.paths) if self.paths else np.zeros((0, 2)),
            tuple(self.outliers),
            ended,
            moves=self.moves,
            continued=self.given > 0 or self.moves > 0,
        )

    def record(self, outcome: MoveOutcome) -> None:
        """Record the outcome of a move."""
        self.tip = np.asarray(outcome.tip_K_m)
        if len(outcome.path_K_m):
            self.paths.append(np.asarray(outcome.path_K_m))
