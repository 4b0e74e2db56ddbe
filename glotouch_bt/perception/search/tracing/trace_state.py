"""What is known while an outline is traced: what was felt, what it says, and how far that can be trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from glotouch_bt.perception.search.moves import Felt
from glotouch_bt.perception.search.tracing.trace_params import TraceParams
from glotouch_bt.perception.touch import Contact, Contour, split_moved
from glotouch_bt.perception.touch.outline import OutlineBelief, believe_outline, wrapped
from glotouch_bt.robot import Array

BEARINGS = 72
"""Directions a next probe is chosen from."""
TOUCH_SD_M = 0.0005
"""How well a contact says along its normal where an outline of known shape is."""
FEWEST_OF_ONE = 2
"""Contacts with one of two objects that were taken for one."""
LIMB_M = 0.006
"""What was touched is kept clear of so far to each side of the contact."""
NEAR_CONTACT_M = 0.004
"""A place this near to a contact is no evidence of free space."""


def all_bearings() -> Array:
    """(BEARINGS,) from -pi on, rad."""
    return np.linspace(-np.pi, np.pi, BEARINGS, endpoint=False)


def unit(v: Array) -> Array:
    """A vector (2,) scaled to length 1; one of no length stays."""
    scaled: Array = v / max(float(np.linalg.norm(v)), 1e-9)
    return scaled


def _polar(outline: OutlineBelief, bearings: Array, distance: Array) -> Array:
    """(n, 2) K, so far from the outline's middle."""
    return np.asarray(outline.centre_K_m + distance[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)]))


def _moved_along(contacts: Sequence[Contact]) -> tuple[Contact, ...]:
    push = np.array([c.pushed_K_m for c in contacts])
    later = np.cumsum(push[::-1], axis=0)[::-1]
    return tuple(
        replace(c, tip_K_m=c.tip_K_m + np.array([*s, 0.0]), point_K_m=c.point_K_m + s)
        for c, s in zip(contacts, later, strict=True)
    )


@dataclass(frozen=True)
class Trace:
    """What going round an object gave.

    Attributes:
        contacts: In the order they were made, moved along with the object to where it stands now.
        outline: What they say, or None if they say nothing.
        displaced_K_m: (2,) how far the object was pushed in all.
        path_K_m: (n, 2) where the ball has been at sensing height.
        outliers: Contacts that belong to something else.
        ended: Why no more probes were made.
        missing: It was not met where it had been traced.
        moves: So many times it moved without being felt to, and was traced anew.
        continued: It is the object whose contacts were given at the beginning.
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
        """The fitted outline."""
        return None if self.outline is None else self.outline.contour


@dataclass
class TraceState:
    """Everything felt so far.

    Attributes:
        tip: (2,) where the tool's reference point is.
        radius: Of the tool, m.
        round: Its section is a disc: outlines are fitted to its centres, exactly. Else to contact points.
        raw: The contacts as they were felt.
        half: (2,) it keeps within |x|, |y| of this.
        paths: Where it has been.
        outliers: Contacts with something else.
        blocked: Bearings that were tried in vain, rad.
        side: The way round so far: +1 counter-clockwise, 0 not chosen yet.
        moves: So many times the object moved unfelt.
        moved_K_m: (2,) how far in all.
        fresh: Index of the first of `paths` since the last of them.
        odd: Index of the first contact that was odd; -1: none was.
        raised: It stands on the object, not beside it.
        told: (2, 2) 1/m^2 what contacts made now say of such a move.
        given: How many of `raw` were there at the beginning.
        known: How many of `raw` were made before, with who knows what in between.
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
    told: Array = field(default_factory=lambda: np.zeros((2, 2)))

    @classmethod
    def begin(
        cls, contacts: list[Contact], tip_K_m: Array, radius_m: float, round_tip: bool, half_extent_m: Array | None
    ) -> TraceState:
        """With the contacts there are; no half extent: no walls near."""
        half = np.full(2, np.inf) if half_extent_m is None else np.asarray(half_extent_m, dtype=np.float64)
        return cls(np.asarray(tip_K_m, dtype=np.float64)[:2], radius_m, round_tip, contacts, half)

    def present(self) -> tuple[Contact, ...]:
        """The contacts moved to where the object stands now: each by all pushes from its own on."""
        return _moved_along(self.raw)

    def outline(self, more: tuple[Contact, ...] = (), *, alone: bool = False) -> OutlineBelief:
        """What the contacts say, with some more, or those alone."""
        now = more if alone else (*self.present(), *more)
        return believe_outline(
            np.array([self.place(c) for c in now]),
            self.radius if self.round else 0.0,
            approach_K=np.array([c.approach_K[:2] for c in now]),
            reaction_K=np.array([c.reaction_K[:2] for c in now]),
            free_K_m=self.free(),
        )

    def place(self, contact: Contact) -> Array:
        """(2,) what the outline is fitted to."""
        return contact.tip_K_m[:2] if self.round else contact.point_K_m

    def ring(self, outline: OutlineBelief, bearings: Array, p: TraceParams) -> tuple[Array, Array]:
        """Distance from the outline's middle at which the reference point would touch, (n,) m, and its deviation."""
        distance, at, sd = self._shape(outline, bearings, p)
        if self.known:
            sd = np.sqrt(sd**2 + self._shift_variance(outline, bearings, at, p))
        return distance + (0.0 if self.round else self.radius), sd

    def passing(
        self, outline: OutlineBelief, bearings: Array, p: TraceParams, clearance: float = 1.0, margin: float = 1.0
    ) -> Array:
        """(n,) distance from the outline's middle at which the ball goes past: clear of what is predicted, and of what
        was touched there, which may stick out of every family of outlines.

        Args:
            outline, bearings, p: Of what, (n,) rad, with which clearances.
            clearance, margin: Parts of the clearance and of the margin that are kept.
        """
        distance, sd = self.ring(outline, bearings, p)
        out = distance + margin * np.minimum(p.margin_sds * sd, p.widest_margin_m)
        off = np.array([self.place(c) for c in self.present()]) - outline.centre_K_m
        far = np.hypot(off[:, 0], off[:, 1]) + (0.0 if self.round else self.radius)
        aside = np.abs(wrapped(bearings[:, None] - np.arctan2(off[:, 1], off[:, 0])[None, :])) * far
        limbs = np.where(aside < LIMB_M, far, 0.0).max(axis=1)
        return np.asarray(np.maximum(out, limbs) + clearance * p.clearance_m)

    def _shape(self, outline: OutlineBelief, bearings: Array, p: TraceParams) -> tuple[Array, Array, Array]:
        """As `ring` for an object that never moved unfelt, and where that is: (n,), (n, 2) K, (n,)."""
        distance, sd = outline.predict(bearings)
        at = _polar(outline, bearings, distance)
        known = np.array([self.place(c) for c in self.present()])
        apart = np.linalg.norm(at[:, None] - known[None], axis=2).min(axis=1)
        odd = outline.family_weights["free"]
        share = (1.0 - odd) * np.clip((apart - p.near_m) / (p.far_m - p.near_m), 0.0, 1.0)
        share += odd * np.clip((apart - p.odd_near_m) / (p.odd_far_m - p.odd_near_m), 0.0, 1.0)
        return distance, at, np.hypot(sd, share * p.unmodelled_m)

    def _shift_variance(self, outline: OutlineBelief, bearings: Array, at_K_m: Array, p: TraceParams) -> Array:
        """(n,) m^2 that an unfelt move adds to the outline's deviation along its normal."""
        step = np.deg2rad(2.0)
        ahead = _polar(outline, bearings + step, outline.predict(bearings + step)[0])
        along = ahead - at_K_m
        normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
        return np.asarray(np.einsum("ni,ij,nj->n", normal, self.shift_covariance(p), normal))

    def shift_covariance(self, p: TraceParams) -> Array:
        """(2, 2) m^2 of how far the object may have moved unfelt before the contacts made now; zeros if all are."""
        if not self.known:
            return np.zeros((2, 2))
        return np.asarray(np.linalg.inv(np.eye(2) / p.unfelt_m**2 + self.told))

    def add(self, contact: Contact, outline: OutlineBelief, p: TraceParams) -> None:
        """A contact with the object, of which `outline` was known."""
        if self.known:
            off = self.place(contact) - outline.centre_K_m
            _, _, sd = self._shape(outline, np.array([np.arctan2(off[1], off[0])]), p)
            normal = unit(2.0 * contact.reaction_K[:2] - contact.approach_K[:2])
            self.told = self.told + np.outer(normal, normal) / (TOUCH_SD_M**2 + float(sd[0]) ** 2)
        if self.odd < 0 and self.surprising(outline, contact, p):
            self.odd = len(self.raw)
        self.raw.append(contact)

    def is_new(self, contact: Contact, p: TraceParams) -> bool:
        """Whether a contact is not where there was one before."""
        return not self.near(contact, p.same_m)

    def bearing(self, outline: OutlineBelief) -> float:
        """Where the ball is, seen from the outline's middle, rad."""
        off = self.tip - outline.centre_K_m
        return float(np.arctan2(off[1], off[0]))

    def lone(self, apart_m: float) -> bool:
        """Whether all contacts are nearer to one another than this: they may be with the end of a limb."""
        places = np.array([self.place(c) for c in self.present()])
        return bool(np.linalg.norm(places[:, None] - places[None], axis=2).max() < apart_m)

    def near(self, contact: Contact, apart_m: float) -> bool:
        """Whether a contact is nearer than this to one made before."""
        known = np.array([self.place(c) for c in self.present()])
        return bool(np.linalg.norm(known - self.place(contact), axis=1).min() < apart_m)

    def belongs(self, outline: OutlineBelief, contact: Contact, p: TraceParams) -> bool:
        """Whether a new contact was made with this object.

        It is if it is so near to another one that no second object has room. Else not if the surface it met faces the
        object's middle. Else if it is near to the prediction, or one object explains it together with the others
        better than two.
        """
        points = np.array([c.point_K_m for c in self.present()])
        if float(np.linalg.norm(points - contact.point_K_m, axis=1).min()) < p.between_m:
            return True
        off = contact.tip_K_m[:2] - outline.centre_K_m
        far = float(np.hypot(off[0], off[1]))
        if float(contact.reaction_K[:2] @ off) < p.facing * far:
            return False
        distance, sd = self.ring(outline, np.array([np.arctan2(off[1], off[0])]), p)
        if far < float(distance[0]) + p.own_m + 2.0 * float(sd[0]):
            return True
        one = self.outline((contact,)).log_evidence - outline.log_evidence
        two = self.outline((contact,), alone=True).log_evidence
        return bool(one > two + np.log(p.other))

    def surprising(self, outline: OutlineBelief, contact: Contact, p: TraceParams) -> bool:
        """Whether a contact lies where the outline was thought not to be."""
        off = self.place(contact) - outline.centre_K_m
        distance, sd = outline.predict(np.array([np.arctan2(off[1], off[0])]))
        gap = abs(float(np.hypot(off[0], off[1])) - float(distance[0]))
        return gap > p.surprise_m + p.surprise_sds * float(sd[0])

    def begin_anew(self, p: TraceParams) -> bool:
        """If no one pose explains the contacts, keep the latest that one does; whether it was so.

        What the ball passed before is no evidence about the object where it stands now.
        """
        if self.odd < 0 or self.moves >= p.moves:
            return False
        radius = self.radius if self.round else 0.0
        felt = [replace(c, tip_K_m=np.array([*self.place(c), c.tip_K_m[2]])) for c in self.raw]
        stray, _ = split_moved(felt, radius, likely=self.known)
        if not stray:
            return False
        stood = self.outline(_moved_along(stray), alone=True).centre_K_m
        stands = self.outline(_moved_along(self.raw[len(stray) :]), alone=True).centre_K_m
        if float(np.linalg.norm(stands - stood)) > p.farthest_m:
            self.odd = -1  # it would have been felt: the outline is odder than thought
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
        """If what was traced is larger than any object, keep the contacts with one of two; whether it was so.

        The two are told by the best cut across the long side; the others are outliers. The larger part is kept.
        """
        size = outline.contour.size_m
        if len(self.raw) < 2 * FEWEST_OF_ONE or max(size) <= p.largest_m:
            return False
        now = self.present()
        places = np.array([self.place(c) for c in now])
        axis = np.linalg.svd(places - places.mean(axis=0))[2][0]
        order = np.argsort(places @ axis, kind="stable")
        best, kept = -np.inf, order
        for k in range(FEWEST_OF_ONE, len(order) - FEWEST_OF_ONE + 1):
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
        """(n, 2) places the ball has been, but for those so near to a contact that a push or the ball's own scatter
        could have put the object there."""
        if not self.paths[self.fresh :]:
            return np.zeros((0, 2))
        path = np.concatenate(self.paths[self.fresh :])
        touched = np.array([c.tip_K_m[:2] for c in (*self.raw, *self.present())])
        far = np.linalg.norm(path[:, None] - touched[None], axis=2).min(axis=1) > NEAR_CONTACT_M
        return np.asarray(path[far])

    def trace(self, outline: OutlineBelief, ended: str) -> Trace:
        """All of it."""
        return Trace(
            self.present(),
            outline,
            self.moved_K_m + np.sum([c.pushed_K_m for c in self.raw], axis=0),
            np.concatenate(self.paths) if self.paths else np.zeros((0, 2)),
            tuple(self.outliers),
            ended,
            moves=self.moves,
            continued=self.given > 0 or self.moves > 0,
        )

    def felt(self, felt: Felt) -> None:
        """Take note of a move."""
        self.tip = np.asarray(felt.tip_K_m)
        if len(felt.path_K_m):
            self.paths.append(np.asarray(felt.path_K_m))
