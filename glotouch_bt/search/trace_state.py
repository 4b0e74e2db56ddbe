"""What is known while an outline is traced: what was felt, what it says, and how far that can be trusted."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from glotouch_bt.robot import Array
from glotouch_bt.search.moves import Felt
from glotouch_bt.touch import Contact, Contour
from glotouch_bt.touch.belief import OutlineBelief, believe_outline

BEARINGS = 72
"""Directions a next probe is chosen from."""
NEAR_CONTACT_M = 0.004
"""A place this near to a contact is no evidence of free space."""


def all_bearings() -> Array:
    """(BEARINGS,) from -pi on, rad."""
    return np.linspace(-np.pi, np.pi, BEARINGS, endpoint=False)


def unit(v: Array) -> Array:
    """A vector (2,) scaled to length 1; one of no length stays."""
    scaled: Array = v / max(float(np.linalg.norm(v)), 1e-9)
    return scaled


@dataclass(frozen=True, kw_only=True)
class TraceParams:
    """How an outline is traced. Lengths in metres.

    Attributes:
        clearance_m: Ball to predicted outline while going round.
        margin_sds: So many standard deviations of the prediction are added to the clearance.
        widest_margin_m: No more than this is added.
        centre_sd_m: Enough is known when the centre's standard deviation is below this ...
        radial_sd_m: ... and the outline's nowhere above this.
        least_contacts, most_contacts: Bounds whatever the covariance says.
        step_m: Longest way round before the ball probes again.
        doubt_m: With a deviation above this on the way round, the ball goes along the surface instead ...
        along_m, along_reach_m: ... so far, and then looks for it so far deeper than it was.
        back: How much a bearing counts that lies behind, against the way round so far.
        way_m: Travel that every probe costs beside the way to it (in and out).
        reach_sds: A probe goes so many standard deviations past the prediction.
        facing: Cosine between the force on the ball and the direction from the object's middle below which the contact
            is with something else.
        same_m: A contact so near to an earlier one says nothing new.
        own_m: A contact within this (and twice the deviation) of the prediction is the object's own; farther out the
            evidence for one object or two decides.
        other: Odds, before it is looked at, that a contact on the way round belongs to another object.
        unmodelled_m: What no contact is near is not known better than this, whatever the families say that have been
            thought of ...
        near_m, far_m: ... fully so from the second of these distances on, not at all within the first.
        misses: So many probes may meet nothing, or be refused, one after another.
    """

    clearance_m: float = 0.005
    margin_sds: float = 0.7
    widest_margin_m: float = 0.010
    centre_sd_m: float = 0.0010
    radial_sd_m: float = 0.0035
    least_contacts: int = 4
    most_contacts: int = 14
    step_m: float = 0.045
    doubt_m: float = 0.008
    along_m: float = 0.026
    along_reach_m: float = 0.014
    back: float = 0.4
    way_m: float = 0.03
    reach_sds: float = 2.5
    facing: float = -0.4
    same_m: float = 0.003
    own_m: float = 0.010
    other: float = 0.02
    unmodelled_m: float = 0.006
    near_m: float = 0.024
    far_m: float = 0.042
    misses: int = 5


@dataclass(frozen=True)
class Trace:
    """What going round an object gave.

    Attributes:
        contacts: In the order they were made, moved along with the object to where it stands now.
        outline: What they say, or None if they say nothing.
        displaced_K_m: (2,) how far the object was pushed in all.
        path_K_m: (n, 2) where the ball has been at sensing height.
        strays: Contacts that belong to something else.
        ended: Why no more probes were made.
        missing: It was not met where it had been traced.
    """

    contacts: tuple[Contact, ...]
    outline: OutlineBelief | None
    displaced_K_m: Array
    path_K_m: Array
    strays: tuple[Contact, ...] = ()
    ended: str = ""
    missing: bool = False

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
        strays: Contacts with something else.
        blocked: Bearings that were tried in vain, rad.
        side: The way round so far: +1 counter-clockwise, 0 not chosen yet.
    """

    tip: Array
    radius: float
    round: bool
    raw: list[Contact]
    half: Array
    paths: list[Array] = field(default_factory=list)
    strays: list[Contact] = field(default_factory=list)
    blocked: list[float] = field(default_factory=list)
    side: float = 0.0

    @classmethod
    def begin(
        cls, contacts: list[Contact], tip_K_m: Array, radius_m: float, round_tip: bool, half_extent_m: Array | None
    ) -> TraceState:
        """With the contacts there are; no half extent: no walls near."""
        half = np.full(2, np.inf) if half_extent_m is None else np.asarray(half_extent_m, dtype=np.float64)
        return cls(np.asarray(tip_K_m, dtype=np.float64)[:2], radius_m, round_tip, contacts, half)

    def present(self) -> tuple[Contact, ...]:
        """The contacts moved to where the object stands now: each by all pushes from its own on."""
        push = np.array([c.pushed_K_m for c in self.raw])
        later = np.cumsum(push[::-1], axis=0)[::-1]
        return tuple(
            replace(c, tip_K_m=c.tip_K_m + np.array([*s, 0.0]), point_K_m=c.point_K_m + s)
            for c, s in zip(self.raw, later, strict=True)
        )

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
        distance, sd = outline.predict(bearings)
        at = outline.centre_K_m + distance[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
        known = np.array([self.place(c) for c in self.present()])
        apart = np.linalg.norm(at[:, None] - known[None], axis=2).min(axis=1)
        share = np.clip((apart - p.near_m) / (p.far_m - p.near_m), 0.0, 1.0)
        return distance + (0.0 if self.round else self.radius), np.hypot(sd, share * p.unmodelled_m)

    def is_new(self, contact: Contact, p: TraceParams) -> bool:
        """Whether a contact is not where there was one before."""
        known = np.array([self.place(c) for c in self.present()])
        return bool(np.linalg.norm(known - self.place(contact), axis=1).min() > p.same_m)

    def belongs(self, outline: OutlineBelief, contact: Contact, p: TraceParams) -> bool:
        """Whether a new contact was made with this object.

        Not if the surface it met faces the object's middle. Else if it is near to the prediction, or one object
        explains it together with the others better than two.
        """
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

    def free(self) -> Array:
        """(n, 2) places the ball has been, but for those so near to a contact that a push or the ball's own scatter
        could have put the object there."""
        if not self.paths:
            return np.zeros((0, 2))
        path = np.concatenate(self.paths)
        touched = np.array([c.tip_K_m[:2] for c in (*self.raw, *self.present())])
        far = np.linalg.norm(path[:, None] - touched[None], axis=2).min(axis=1) > NEAR_CONTACT_M
        return np.asarray(path[far])

    def trace(self, outline: OutlineBelief, ended: str) -> Trace:
        """All of it."""
        return Trace(
            self.present(),
            outline,
            np.sum([c.pushed_K_m for c in self.raw], axis=0),
            np.concatenate(self.paths) if self.paths else np.zeros((0, 2)),
            tuple(self.strays),
            ended,
        )

    def felt(self, felt: Felt) -> None:
        """Take note of a move."""
        self.tip = np.asarray(felt.tip_K_m)
        if len(felt.path_K_m):
            self.paths.append(np.asarray(felt.path_K_m))
