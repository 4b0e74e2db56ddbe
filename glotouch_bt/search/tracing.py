"""Round an object: where the next probe says most for the way it costs, and when enough is known (paper III-D)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from glotouch_bt.robot import Array
from glotouch_bt.search.moves import Felt, Move, Plan
from glotouch_bt.touch import Contact, Contour
from glotouch_bt.touch.belief import OutlineBelief, believe_outline

BEARINGS = 72
"""Directions a next probe is chosen from."""
NEAR_CONTACT_M = 0.004
"""A place this near to a contact is no evidence of free space."""
INSIDE_M = 0.004
"""A probe that came this near to the object's supposed middle has passed through: nothing is there."""


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
class _State:
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


def trace(
    first: Contact,
    tip_K_m: Array,
    tip_radius_m: float,
    params: TraceParams | None = None,
    *,
    round_tip: bool = True,
    half_extent_m: Array | None = None,
) -> Plan[Trace]:
    """Trace the outline of what was touched. The ball ends beside it, at sensing height.

    Args:
        first: The contact that found it; the ball may have been retreated from it.
        tip_K_m: (2,) where the ball is.
        tip_radius_m: Its radius; of another section, that of a disc about as large.
        params: See `TraceParams`.
        round_tip: The section is a disc: outlines are fitted to its centres. Else to the contacts' points.
        half_extent_m: (2,) the ball's centre keeps within |x|, |y| of it in K; None: no walls near.
    """
    p = params or TraceParams()
    half = np.full(2, np.inf) if half_extent_m is None else np.asarray(half_extent_m, dtype=np.float64)
    s = _State(np.asarray(tip_K_m, dtype=np.float64)[:2], tip_radius_m, round_tip, [first], half)
    yield from _retreat(s, p)
    return (yield from _until_known(s, p))


def trace_more(
    known: tuple[Contact, ...],
    tip_K_m: Array,
    tip_radius_m: float,
    params: TraceParams | None = None,
    *,
    round_tip: bool = True,
    half_extent_m: Array | None = None,
) -> Plan[Trace]:
    """Go on tracing what was traced before, from above: come down where the outline is least certain.

    Args:
        known: Its contacts, where it stands now.
        tip_K_m, tip_radius_m, params, round_tip, half_extent_m: As for `trace`; the ball may be raised.
    """
    p = params or TraceParams()
    half = np.full(2, np.inf) if half_extent_m is None else np.asarray(half_extent_m, dtype=np.float64)
    still = [replace(c, pushed_K_m=np.zeros(2)) for c in known]
    s = _State(np.asarray(tip_K_m, dtype=np.float64)[:2], tip_radius_m, round_tip, still, half)
    outline = s.outline()
    if _enough(outline, s, p):
        return s.trace(outline, "the outline is known")
    bearings = _bearings()
    distance, sd = s.ring(outline, bearings, p)
    ring = distance + p.clearance_m + np.minimum(2.0 * sd, p.widest_margin_m)
    places = outline.centre_K_m + ring[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    within = np.all(np.abs(places) <= s.half, axis=1)
    for i in _apart(np.where(within, sd, -1.0), p.misses):
        felt = yield Move("hop", places[i])
        s.felt(felt)
        if felt.refused or felt.contact is not None:
            continue
        felt = yield Move("probe", outline.centre_K_m + INSIDE_M * (places[i] - outline.centre_K_m) / ring[i])
        s.felt(felt)
        if felt.contact is not None and s.belongs(outline, felt.contact, p):
            s.raw.append(felt.contact)
            yield from _retreat(s, p)
            return (yield from _until_known(s, p))
    return replace(s.trace(outline, "it was not met again"), missing=True)


def _apart(worth: Array, n: int) -> list[int]:
    """Indices of up to n bearings of the most worth, none next to another; those below zero left out."""
    chosen: list[int] = []
    for i in np.argsort(-worth, kind="stable"):
        gaps = [min(abs(int(i) - j), BEARINGS - abs(int(i) - j)) for j in chosen]
        if worth[i] >= 0 and all(g >= BEARINGS // 12 for g in gaps):
            chosen.append(int(i))
        if len(chosen) == n:
            break
    return chosen


def _until_known(s: _State, p: TraceParams) -> Plan[Trace]:
    """Probe on until enough is known, from beside the object."""
    outline, missed, ended = s.outline(), 0, ""
    while not ended:
        ended = _enough(outline, s, p)
        if ended:
            break
        bearing, side = _choose(outline, s, p)
        if bearing is None:
            ended = "no side is left that can be reached"
            break
        s.side = s.side or side
        found = yield from _probe_at(outline, s, p, bearing, side)
        if found is None:
            missed += 1
            s.blocked.append(bearing)
        elif s.belongs(outline, found, p):
            if s.is_new(found, p):
                missed = 0
            else:
                missed += 1
                s.blocked.append(bearing)
            s.raw.append(found)
            yield from _retreat(s, p)
        else:
            missed += 1
            s.strays.append(found)
            s.blocked.append(bearing)
            s.felt((yield Move("retreat", s.tip + p.clearance_m * _unit(found.reaction_K[:2]))))
        if missed > p.misses:
            ended = f"{missed} probes in a row told nothing"
        outline = s.outline()
    return s.trace(outline, ended)


def _retreat(s: _State, p: TraceParams) -> Plan[None]:
    """Away from the last contact until the clearance is reached, along what the force, rather than the approach, says
    is outwards (they differ for a graze)."""
    last = s.raw[-1]
    out = _unit(2.0 * last.reaction_K[:2] - last.approach_K[:2])
    way = p.clearance_m - float((s.tip - last.tip_K_m[:2]) @ out)
    if way > 5e-4:
        s.felt((yield Move("retreat", s.tip + way * out)))


def _enough(outline: OutlineBelief, s: _State, p: TraceParams) -> str:
    n = len(s.raw)
    if n >= p.most_contacts:
        return f"{n} contacts"
    if n < p.least_contacts:
        return ""
    _, sd = s.ring(outline, _bearings(), p)
    if np.max(outline.centre_sd_m) <= p.centre_sd_m and float(np.max(sd)) <= p.radial_sd_m:
        return "the outline is known"
    return ""


def _bearings() -> Array:
    return np.linspace(-np.pi, np.pi, BEARINGS, endpoint=False)


def _unit(v: Array) -> Array:
    unit: Array = v / max(float(np.linalg.norm(v)), 1e-9)
    return unit


def _wrap(a: Array) -> Array:
    wrapped: Array = (np.asarray(a) + np.pi) % (2 * np.pi) - np.pi
    return wrapped


def _choose(outline: OutlineBelief, s: _State, p: TraceParams) -> tuple[float | None, float]:
    """The bearing with the most uncertainty for the way to it, and which way round (+1 counter-clockwise)."""
    bearings = _bearings()
    distance, sd = s.ring(outline, bearings, p)
    offset = s.tip - outline.centre_K_m
    here = float(np.arctan2(offset[1], offset[0]))
    best: tuple[float, float, float] | None = None
    step = 2 * np.pi / BEARINGS
    for side in (1.0, -1.0):
        turn = _wrap(side * (bearings - here)) % (2 * np.pi)
        order = np.argsort(turn, kind="stable")
        way = np.zeros(BEARINGS)
        way[order] = np.cumsum((distance + p.clearance_m)[order] * step)
        gain = sd / (way + p.way_m)
        gain[(way > p.step_m) | (turn > np.pi)] = 0.0
        if side == -s.side:
            gain *= p.back
        if s.blocked:
            near = np.min(np.abs(_wrap(bearings[:, None] - np.array(s.blocked)[None, :])), axis=1)
            gain[near < np.deg2rad(12.0)] = 0.0
        i = int(np.argmax(gain))
        if gain[i] > 0 and (best is None or gain[i] > best[0]):
            best = (float(gain[i]), float(bearings[i]), side)
    return (None, 1.0) if best is None else (best[1], best[2])


def _probe_at(outline: OutlineBelief, s: _State, p: TraceParams, bearing: float, side: float) -> Plan[Contact | None]:
    """Round to `bearing`, and inwards. A touch on the way round is as good as the one that was meant.

    Where the way round is too uncertain to be planned, the ball goes on along the surface it touched last.
    """
    beside = float(np.linalg.norm(s.tip - s.raw[-1].tip_K_m[:2])) < 3.0 * p.clearance_m
    if beside and _doubt(outline, s, p, bearing, side) > p.doubt_m:
        return (yield from _along(s, p, side))
    for waypoint in _way_round(outline, s, p, bearing, side):
        felt = yield Move("step", waypoint)
        s.felt(felt)
        if felt.refused:
            return None
        if felt.contact is not None:
            return felt.contact
    distance, sd = (float(v[0]) for v in s.ring(outline, np.array([bearing]), p))
    inner = max(distance - p.reach_sds * sd - 0.003, INSIDE_M)
    u = np.array([np.cos(bearing), np.sin(bearing)])
    felt = yield Move("probe", outline.centre_K_m + inner * u)
    s.felt(felt)
    return felt.contact


def _doubt(outline: OutlineBelief, s: _State, p: TraceParams, bearing: float, side: float) -> float:
    """Largest standard deviation of the outline on the way round to `bearing`."""
    _, sd = s.ring(outline, _angles(outline, s, bearing, side), p)
    return float(np.max(sd))


def _along(s: _State, p: TraceParams, side: float) -> Plan[Contact | None]:
    """A step along the tangent of the last contact, and inwards from there."""
    last = s.raw[-1]
    normal = _unit(2.0 * last.reaction_K[:2] - last.approach_K[:2])
    goal = np.clip(s.tip + p.along_m * side * np.array([-normal[1], normal[0]]), -s.half, s.half)
    for move in (Move("step", goal), Move("probe", goal - (p.clearance_m + p.along_reach_m) * normal)):
        felt = yield move
        s.felt(felt)
        if felt.refused or felt.contact is not None:
            return felt.contact
    return None


def _angles(outline: OutlineBelief, s: _State, bearing: float, side: float) -> Array:
    """(k,) bearings on the way round from where the ball is, this left out, to `bearing`."""
    offset = s.tip - outline.centre_K_m
    here = float(np.arctan2(offset[1], offset[0]))
    turn = float(_wrap(np.array(side * (bearing - here))) % (2 * np.pi))
    n = max(int(np.ceil(turn / np.deg2rad(5.0))), 1)
    return np.asarray(here + side * np.linspace(0.0, turn, n + 1)[1:])


def _way_round(outline: OutlineBelief, s: _State, p: TraceParams, bearing: float, side: float) -> Array:
    """(k, 2) waypoints outside the predicted outline, from where the ball is to `bearing`, pulled tight."""
    angles = _angles(outline, s, bearing, side)
    distance, sd = s.ring(outline, angles, p)
    ring = distance + p.clearance_m + np.minimum(p.margin_sds * sd, p.widest_margin_m)
    points = outline.centre_K_m + ring[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    points = np.clip(points, -s.half, s.half)
    return _tight(s, points, outline, p)


def _tight(s: _State, points: Array, outline: OutlineBelief, p: TraceParams) -> Array:
    """Leave out what can be cut without coming nearer to the predicted outline than the clearance."""
    kept: list[Array] = []
    here, i = s.tip, 0
    while i < len(points):
        j = len(points) - 1
        while j > i and not _clear(s, here, points[j], outline, p):
            j -= 1
        here = points[j]
        kept.append(here)
        i = j + 1
    return np.array(kept)


def _clear(s: _State, a: Array, b: Array, outline: OutlineBelief, p: TraceParams) -> bool:
    t = np.linspace(0.0, 1.0, 12)[1:-1, None]
    d = (1 - t) * a + t * b - outline.centre_K_m
    distance, sd = s.ring(outline, np.arctan2(d[:, 1], d[:, 0]), p)
    least = distance + 0.7 * p.clearance_m + 0.5 * np.minimum(p.margin_sds * sd, p.widest_margin_m)
    return bool(np.all(np.hypot(d[:, 0], d[:, 1]) >= least))
