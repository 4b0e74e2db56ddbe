"""Finding how high an object is with a ball: touch down in the middle, then pass above it and touch what is higher.

A plan is a generator of `BallMove`s that is sent a `Met` for each; it knows no robot. A pass at the height of what is
known plus a clearance c that meets nothing bounds everything under it: nothing at a lateral distance d is more than
c + r - sqrt(r^2 - d^2) higher than what is known, for a ball of radius r. What a pass meets is touched from above, and
the pass goes on above that.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import scipy

from glotouch_bt.robot import Array, ParamError

BallMoveKind = Literal["over", "lift", "back", "down", "pass", "feel"]
"""How the ball goes; speeds and guards are the driver's.

over   up above everything, across, and no farther; the goal's height is not used.
lift   straight up; unguarded.
back   straight back and up from a contact just made in a pass; unguarded.
down   straight down; what opposes it stops it.
pass   level, just above what is known; any touch stops it.
feel   the same over a short way on which a touch is likely: slowly, since what is hit high up is easily pushed.
"""


@dataclass(frozen=True)
class BallMove:
    """One straight move of the ball's centre to `goal_K_m` (3,)."""

    kind: BallMoveKind
    goal_K_m: Array


@dataclass(frozen=True)
class Met:
    """What came of a move.

    Attributes:
        tip_K_m: (3,) where the ball's centre is now.
        touch_K_m: (3,) ball's centre when it met something, or None.
        refused: The move was not made (out of reach, in the way of a wall); the ball is where it was.
    """

    tip_K_m: Array
    touch_K_m: Array | None = None
    refused: bool = False


@dataclass(frozen=True)
class Top:
    """The highest place found.

    Attributes:
        ball_K_m: (3,) ball's centre as it touched it from above, or None: nothing was met anywhere.
        touches: How many touches from above met something.
        passed: Share of the tracks that was passed over.
    """

    ball_K_m: Array | None
    touches: int
    passed: float


TopPlan = Generator[BallMove, Met, Top]


@dataclass(frozen=True)
class TopRule:
    """How the top is looked for.

    Attributes:
        clearance_m: Passes go so far above what is known.
        inset_m: The way round keeps so far inside the outline; the ball reaches out again by about its radius.
        reach_m: No place inside is farther from the passes. A peak between them hides as deep as the ball is round.
        onward_m: From where a pass met something, so much farther on it is touched from above.
        back_m: Way back from there before the ball is lifted.
        lift_m: First lift there; three times as much for as long as the way on is still blocked.
        near_m: Round the highest place the ball looks so far in four directions.
        climbs: Most rounds of that, each about the highest place by then.
        max_touches: The plan ends after so many touches from above.
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

    def __post_init__(self) -> None:
        for name in ("clearance_m", "reach_m", "onward_m", "back_m", "lift_m"):
            if not getattr(self, name) > 0.0:
                raise ParamError(name, getattr(self, name), "positive")


def rounds(points_K_m: Array, centre_K_m: Array, rule: TopRule) -> Array:
    """Waypoints (k, 2) of the passes: once round, `inset_m` inside of the hull of `points_K_m` (n, 2), and through
    whatever that leaves out of reach within. Begins where the way round is nearest to `centre_K_m` (2,).
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


STRAIGHT_M, GRID_M = 0.003, 0.004
"""The way round leaves out corners flatter than the first; places inside are this far apart."""


def _with_all(way: list[Array], centre: Array, places: Array, rule: TopRule) -> Array:
    """The way with detours to every place (n, 2) that it leaves out of reach, farthest first, each where it lengthens
    the way least. The ball comes from the centre."""
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
    """The point of the segment a-b next to a place; all (2,)."""
    step = b - a
    share = float(np.clip((place - a) @ step / max(float(step @ step), 1e-18), 0.0, 1.0))
    return np.asarray(a + share * step)


def _hull(points: Array) -> Array:
    """Corners of the convex hull, anticlockwise; the two ends of points in a row."""
    try:
        return np.asarray(points[scipy.spatial.ConvexHull(points).vertices])
    except (scipy.spatial.QhullError, ValueError):
        along = np.linalg.svd(points - points.mean(axis=0))[2][0]
        return np.asarray(points[[int(np.argmin(points @ along)), int(np.argmax(points @ along))]])


def _plain(ring: Array, tolerance_m: float) -> Array:
    """A convex ring (n, 2) without the corners that lie within a tolerance of the line past them, flattest first."""
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
    """Places (n, 2) of a grid within a convex ring, anticlockwise."""
    low, high = ring.min(axis=0), ring.max(axis=0)
    x, y = (np.arange(low[i], high[i] + 1e-9, GRID_M) for i in range(2))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    edge = np.roll(ring, -1, axis=0) - ring
    offset = grid[:, None] - ring
    return np.asarray(grid[(edge[:, 0] * offset[..., 1] - edge[:, 1] * offset[..., 0] >= -1e-9).all(axis=1)])


def _distance(points: Array, way: Array) -> Array:
    """(n,) distance of points (n, 2) from a polyline (k, 2)."""
    a, step = way[:-1], np.diff(way, axis=0)
    square = np.maximum((step * step).sum(axis=1), 1e-18)
    share = np.clip(((points[:, None] - a) * step).sum(axis=2) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points[:, None] - a - share[..., None] * step, axis=2).min(axis=1))


def top_plan(
    centre_K_m: Array, way_K_m: Array, rim_K_m: Array, lowest_K_m: float, ceiling_K_m: float, rule: TopRule
) -> TopPlan:
    """Touch the middle (or, where that is hollow, the rim) from above, then pass over the whole object.

    Args:
        centre_K_m: (2,) where the ball first goes down.
        way_K_m: (k, 2) waypoints of the passes.
        rim_K_m: (m, 2) where to go down if the centre is hollow, in order.
        lowest_K_m: The ball need not go lower: something is known to stand higher than that.
        ceiling_K_m: Ball's height above everything.
        rule: How to look.
    """
    search = _Search(rule, lowest_K_m, ceiling_K_m)
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
"""Every hit pushes the object, so few are better than a low last lift."""
NEAR_M, FARTHEST_ONWARD_M = 0.012, 0.012
"""Stopped again within NEAR_M of the last touch, a pass is on a slope: it looks twice as far on, at most so far."""


class _Search:
    """Where the ball is and what is known; every method is a generator of moves."""

    def __init__(self, rule: TopRule, lowest_m: float, ceiling_m: float) -> None:
        self.rule, self.lowest_m, self.ceiling_m = rule, lowest_m, ceiling_m
        self.tip: Array = np.zeros(3)
        self.came_m = 0.0  # how far across by the last move
        self.best: Array | None = None
        self.touches = 0

    @property
    def xy(self) -> Array:
        return self.tip[:2]

    @property
    def level_m(self) -> float:
        """Ball's height in a pass."""
        assert self.best is not None
        return float(self.best[2]) + self.rule.clearance_m

    def _go(self, kind: BallMoveKind, goal: Array) -> Generator[BallMove, Met, Met]:
        before = self.tip
        met = yield BallMove(kind, np.asarray(goal, dtype=np.float64))
        self.tip = np.asarray(met.tip_K_m, dtype=np.float64)
        self.came_m = float(np.linalg.norm((self.tip - before)[:2]))
        if met.touch_K_m is not None and (self.best is None or met.touch_K_m[2] > self.best[2]):
            self.best = np.asarray(met.touch_K_m, dtype=np.float64)
        return met

    def over(self, place: Array) -> Generator[BallMove, Met, None]:
        yield from self._go("over", np.array([*place, self.ceiling_m]))

    def lift(self, height_m: float) -> Generator[BallMove, Met, None]:
        if height_m > self.tip[2] + 1e-4:
            yield from self._go("lift", np.array([*self.xy, min(height_m, self.ceiling_m)]))

    def down(self, to_m: float | None = None) -> Generator[BallMove, Met, bool]:
        """Touch what is below, as far as anything there is of interest; True if something was met."""
        to = self.lowest_m if to_m is None else to_m
        if self.tip[2] <= to + 1e-4:
            return False
        met = yield from self._go("down", np.array([*self.xy, to]))
        self.touches += met.touch_K_m is not None
        return met.touch_K_m is not None

    def pass_to(self, goal: Array) -> Generator[BallMove, Met, bool]:
        """Above everything met on the way to `goal` (2,); False if a move was refused or it took too many touches."""
        rule = self.rule
        onward, last = rule.onward_m, None
        while self.touches < rule.max_touches:
            if self.tip[2] > self.level_m + 1e-4:  # come down to the pass, unless something is met
                yield from self.down(self.level_m)
            yield from self.lift(self.level_m)
            met = yield from self._go("pass", np.array([*goal, self.tip[2]]))
            if met.refused:
                return False
            if met.touch_K_m is None:
                return True
            touch = met.touch_K_m[:2]
            onward = rule.onward_m
            if last is not None and np.linalg.norm(touch - last) < NEAR_M:
                onward = min(2 * float(np.linalg.norm(touch - last)) + rule.onward_m, FARTHEST_ONWARD_M)
            if not (yield from self._above(touch, goal, float(onward))):
                return False
            last = self.xy.copy()
        return False

    def _above(self, touch: Array, goal: Array, onward_m: float) -> Generator[BallMove, Met, bool]:
        """Having met something at `touch` (2,) on the way to `goal`: touch it from above, a little farther on."""
        rule = self.rule
        heading = (goal - touch) / max(float(np.linalg.norm(goal - touch)), 1e-9)
        if np.linalg.norm(goal - touch) < 1e-3:
            heading = (touch - self.xy) / max(float(np.linalg.norm(touch - self.xy)), 1e-9)
        aim = touch + min(onward_m, max(float(np.linalg.norm(goal - touch)), 0.002)) * heading
        level = float(self.tip[2])
        lift = rule.lift_m
        while True:
            up = float(self.tip[2]) + lift
            off = self.xy - min(rule.back_m, self.came_m) * heading  # no farther than it is known to be free
            if up >= self.ceiling_m - 1e-4:
                yield from self._go("back", np.array([*off, self.tip[2]]))
                yield from self.over(aim)
                break
            yield from self._go("back", np.array([*off, up]))
            met = yield from self._go("feel", np.array([*aim, self.tip[2]]))
            if met.refused:
                return False
            if met.touch_K_m is None:
                break
            lift *= LIFT_GROWTH
        known = float(self.best[2]) if self.best is not None else level
        yield from self.down(max(known, level))
        return True

    def climb(self, along: Array) -> Generator[BallMove, Met, None]:
        """Look round the highest place, along and across `along` (2,), and again round what is found to be higher."""
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
