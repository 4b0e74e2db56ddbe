"""Height measurement with a ball: touch the centre from above, then pass over the object and touch higher parts.

A plan is a generator that yields a `BallMove` and receives its `BallOutcome`. A contact-free pass at a clearance c
above the known height bounds the object: at lateral distance d nothing is more than c + r - sqrt(r^2 - d^2) higher, for
a ball of radius r. A part met by a pass is touched from above, and the pass continues above it.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import scipy

from glotouch_bt.robot import Array

BallMoveKind = Literal["over", "lift", "back", "down", "pass", "feel"]
"""Kind of motion; the driver chooses speeds and guards.

over   up above everything and across; the goal's height is not used.
lift   straight up; unguarded.
back   straight back and up from a contact of a pass; unguarded.
down   straight down; an opposing force stops it.
pass   horizontal, just above the known height; any contact stops it.
feel   a short, slow pass where a contact is likely: an object hit high up moves easily.
"""


@dataclass(frozen=True)
class BallMove:
    """One straight move of the ball's centre to `goal_K_m` (3,)."""

    kind: BallMoveKind
    goal_K_m: Array


@dataclass(frozen=True)
class BallOutcome:
    """Outcome of a move.

    Attributes:
        tip_K_m: (3,) ball centre after the move.
        touch_K_m: (3,) ball centre at the contact, or None.
        refused: The move was not executed (reach, clearance).
    """

    tip_K_m: Array
    touch_K_m: Array | None = None
    refused: bool = False


@dataclass(frozen=True)
class Top:
    """Highest point found.

    Attributes:
        ball_K_m: (3,) ball centre at the contact from above; None without any contact.
        touches: Number of contacts from above.
        passed: Fraction of the passes that was completed.
    """

    ball_K_m: Array | None
    touches: int
    passed: float


TopPlan = Generator[BallMove, BallOutcome, Top]


@dataclass(frozen=True)
class TopRule:
    """Parameters of the height measurement.

    Attributes:
        clearance_m: Height of a pass above the known height.
        inset_m: Distance of the first pass inside the outline; the ball reaches about its radius farther.
        reach_m: Maximum distance of an inner point from the passes.
        onward_m: Distance past a contact of a pass at which the part is touched from above.
        back_m: Retreat from a contact before the lift.
        lift_m: First lift after a contact; tripled while the pass is still blocked.
        near_m: Length of the four passes around the highest point.
        climbs: Maximum number of such rounds, each about the current highest point.
        max_touches: Maximum number of contacts from above.
    """

    clearance_m: float = 0.0008
    inset_m: float = 0.010
    reach_m: float = 0.014
    onward_m: float = 0.004
    back_m: float = 0.003
    lift_m: float = 0.006
    near_m: float = 0.004
    climbs: int = 3
    max_touches: int = 20


def rounds(points_K_m: Array, centre_K_m: Array, rule: TopRule) -> Array:
    """Return the waypoints (k, 2) of the passes: once around `inset_m` inside the hull of `points_K_m` (n, 2), with
    detours to inner points out of reach. The first waypoint is the nearest to `centre_K_m` (2,).
    """
    points = np.asarray(points_K_m, dtype=np.float64)[:, :2]
    centre = np.asarray(centre_K_m, dtype=np.float64)[:2]
    inwards = points.mean(axis=0) - points
    far = np.linalg.norm(inwards, axis=1)
    inset = points + inwards * np.minimum(rule.inset_m / np.maximum(far, 1e-9), 1.0)[:, None]
    ring = _plain(_hull(inset), STRAIGHT_M)
    edges = list(zip(ring, np.roll(ring, -1, axis=0), strict=True))
    starts = np.array([_nearest(centre, a, b) for a, b in edges])
    first = int(np.argmin(np.linalg.norm(starts - centre, axis=1)))
    way = [starts[first], *np.roll(ring, -first - 1, axis=0), starts[first]]
    return _with_all(way, centre, _inside(ring), rule)


STRAIGHT_M = 0.003
"""Maximum distance of an omitted corner from the path."""
GRID_M = 0.004
"""Spacing of the inner points."""


def _with_all(way: list[Array], centre: Array, places: Array, rule: TopRule) -> Array:
    """Return the path with detours to all points (n, 2) out of reach, farthest first, by cheapest insertion. The ball
    starts at the centre."""
    for _ in range(len(places)):
        away = _distance(places, np.array([centre, *way]))
        if away.max() <= rule.reach_m:
            break
        place = places[int(np.argmax(away))]
        step = [float(np.linalg.norm(b - a)) for a, b in pairwise([centre, *way])]
        to = [float(np.linalg.norm(place - w)) for w in (centre, *way)]
        longer = [to[k] + to[k + 1] - step[k] for k in range(len(way))] + [to[-1]]
        way.insert(int(np.argmin(longer)), place)
    return np.array(way)


def _nearest(place: Array, a: Array, b: Array) -> Array:
    """Return the point of the segment a-b nearest to a point; all (2,)."""
    step = b - a
    share = float(np.clip((place - a) @ step / max(float(step @ step), 1e-18), 0.0, 1.0))
    return np.asarray(a + share * step)


def _hull(points: Array) -> Array:
    """Return the corners of the convex hull, counter-clockwise; the two ends of collinear points."""
    try:
        return np.asarray(points[scipy.spatial.ConvexHull(points).vertices])
    except (scipy.spatial.QhullError, ValueError):
        along = np.linalg.svd(points - points.mean(axis=0))[2][0]
        return np.asarray(points[[int(np.argmin(points @ along)), int(np.argmax(points @ along))]])


def _plain(ring: Array, tolerance_m: float) -> Array:
    """Simplify a convex ring (n, 2): remove corners within a tolerance of the chord past them, flattest first."""
    while len(ring) > 3:
        a, b = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
        chord = b - a
        off = np.abs(chord[:, 0] * (ring - a)[:, 1] - chord[:, 1] * (ring - a)[:, 0])
        off = off / np.maximum(np.linalg.norm(chord, axis=1), 1e-9)
        if off.min() > tolerance_m:
            break
        ring = np.delete(ring, int(np.argmin(off)), axis=0)
    return ring


def _inside(ring: Array) -> Array:
    """Return the grid points (n, 2) inside a convex, counter-clockwise ring."""
    low, high = ring.min(axis=0), ring.max(axis=0)
    x, y = (np.arange(low[i], high[i] + 1e-9, GRID_M) for i in range(2))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    edge = np.roll(ring, -1, axis=0) - ring
    offset = grid[:, None] - ring
    return np.asarray(grid[(edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0] >= -1e-9).all(axis=1)])


def _distance(points: Array, way: Array) -> Array:
    """Return the distances (n,) of points (n, 2) from a polyline (k, 2)."""
    a, step = way[:-1], np.diff(way, axis=0)
    square = np.maximum((step * step).sum(axis=1), 1e-18)
    share = np.clip(((points[:, None] - a) * step).sum(axis=2) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points[:, None] - a - share[..., None] * step, axis=2).min(axis=1))


def top_plan(
    centre_K_m: Array, way_K_m: Array, rim_K_m: Array, lowest_K_m: float, ceiling_K_m: float, rule: TopRule
) -> TopPlan:
    """Touch the centre (or, if hollow, the rim) from above, then pass over the whole object.

    Args:
        centre_K_m: (2,) first position to touch.
        way_K_m: (k, 2) waypoints of the passes.
        rim_K_m: (m, 2) positions to touch if the centre is hollow, in order.
        lowest_K_m: Minimum height of the ball: the object is known to be higher.
        ceiling_K_m: Height of the ball above everything.
        rule: Parameters.
    """
    search = _HeightSearch(rule, lowest_K_m, ceiling_K_m)
    for place in (centre_K_m, *rim_K_m):
        yield from search.over(place)
        yield from search.down()
        if search.best is not None:
            break
    else:
        return Top(None, 0, 0.0)
    way = np.asarray(way_K_m, dtype=np.float64)
    done = 0
    for goal in way:
        done += yield from search.pass_to(goal)
    if search.best is not None and len(way) > 1:
        along = (way[1] - way[0]) / max(float(np.linalg.norm(way[1] - way[0])), 1e-9)
        yield from search.climb(along)
    return Top(search.best, search.touches, done / max(len(way), 1))


LIFT_GROWTH = 3.0
"""Factor between successive lifts. Large, because every contact pushes the object."""
SLOPE_M = 0.012
"""Maximum distance between two contacts of a pass that indicates a slope; the next step is then longer."""
MAX_ONWARD_M = 0.012
"""Maximum step past a contact on a slope."""


class _HeightSearch:
    """State of the height measurement; every method is a generator of moves."""

    def __init__(self, rule: TopRule, lowest_m: float, ceiling_m: float) -> None:
        self.rule, self.lowest_m, self.ceiling_m = rule, lowest_m, ceiling_m
        self.tip: Array = np.zeros(3)
        self.came_m = 0.0  # horizontal length of the last move
        self.best: Array | None = None
        self.touches = 0

    @property
    def xy(self) -> Array:
        return self.tip[:2]

    @property
    def level_m(self) -> float:
        """Height of the ball in a pass."""
        assert self.best is not None
        return float(self.best[2]) + self.rule.clearance_m

    def _go(self, kind: BallMoveKind, goal: Array) -> Generator[BallMove, BallOutcome, BallOutcome]:
        before = self.tip
        outcome = yield BallMove(kind, np.asarray(goal, dtype=np.float64))
        self.tip = np.asarray(outcome.tip_K_m, dtype=np.float64)
        self.came_m = float(np.linalg.norm((self.tip - before)[:2]))
        if outcome.touch_K_m is not None and (self.best is None or outcome.touch_K_m[2] > self.best[2]):
            self.best = np.asarray(outcome.touch_K_m, dtype=np.float64)
        return outcome

    def over(self, place: Array) -> Generator[BallMove, BallOutcome, None]:
        yield from self._go("over", np.array([*place, self.ceiling_m]))

    def lift(self, height_m: float) -> Generator[BallMove, BallOutcome, None]:
        if height_m > self.tip[2] + 1e-4:
            yield from self._go("lift", np.array([*self.xy, min(height_m, self.ceiling_m)]))

    def down(self, to_m: float | None = None) -> Generator[BallMove, BallOutcome, bool]:
        """Touch down, not below `lowest_m`; return True on a contact."""
        to = self.lowest_m if to_m is None else to_m
        if self.tip[2] <= to + 1e-4:
            return False
        outcome = yield from self._go("down", np.array([*self.xy, to]))
        self.touches += outcome.touch_K_m is not None
        return outcome.touch_K_m is not None

    def pass_to(self, goal: Array) -> Generator[BallMove, BallOutcome, bool]:
        """Pass to `goal` (2,) above all contacts; return False after a refused move or too many contacts."""
        rule = self.rule
        onward, last = rule.onward_m, None
        while self.touches < rule.max_touches:
            if self.tip[2] > self.level_m + 1e-4:  # descend to the pass, or to a contact
                yield from self.down(self.level_m)
            yield from self.lift(self.level_m)
            outcome = yield from self._go("pass", np.array([*goal, self.tip[2]]))
            if outcome.refused:
                return False
            if outcome.touch_K_m is None:
                return True
            touch = outcome.touch_K_m[:2]
            onward = rule.onward_m
            if last is not None and np.linalg.norm(touch - last) < SLOPE_M:
                onward = min(2 * float(np.linalg.norm(touch - last)) + rule.onward_m, MAX_ONWARD_M)
            if not (yield from self._above(touch, goal, float(onward))):
                return False
            last = self.xy.copy()
        return False

    def _above(self, touch: Array, goal: Array, onward_m: float) -> Generator[BallMove, BallOutcome, bool]:
        """After a contact at `touch` (2,) on the way to `goal`, touch the part from above a little farther on."""
        rule = self.rule
        heading = (goal - touch) / max(float(np.linalg.norm(goal - touch)), 1e-9)
        if np.linalg.norm(goal - touch) < 1e-3:
            heading = (touch - self.xy) / max(float(np.linalg.norm(touch - self.xy)), 1e-9)
        aim = touch + min(onward_m, max(float(np.linalg.norm(goal - touch)), 0.002)) * heading
        level = float(self.tip[2])
        lift = rule.lift_m
        while True:
            up = float(self.tip[2]) + lift
            off = self.xy - min(rule.back_m, self.came_m) * heading  # only along the travelled, free path
            if up >= self.ceiling_m - 1e-4:
                yield from self._go("back", np.array([*off, self.tip[2]]))
                yield from self.over(aim)
                break
            yield from self._go("back", np.array([*off, up]))
            outcome = yield from self._go("feel", np.array([*aim, self.tip[2]]))
            if outcome.refused:
                return False
            if outcome.touch_K_m is None:
                break
            lift *= LIFT_GROWTH
        known = float(self.best[2]) if self.best is not None else level
        yield from self.down(max(known, level))
        return True

    def climb(self, along: Array) -> Generator[BallMove, BallOutcome, None]:
        """Pass around the highest point, along and across `along` (2,); repeat at every higher point found."""
        rule = self.rule
        across = np.array([-along[1], along[0]])
        for _ in range(rule.climbs):
            assert self.best is not None
            place, height = self.best[:2].copy(), float(self.best[2])
            for arm in (along, across, -along, -across):
                if not (yield from self.pass_to(place + rule.near_m * arm)):
                    return
            if self.best[2] < height + rule.clearance_m:
                return
