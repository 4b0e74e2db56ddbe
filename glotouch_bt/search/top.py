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
from scipy.spatial import ConvexHull, QhullError

from glotouch_bt.robot import Array, ParamError

BallMoveKind = Literal["over", "lift", "back", "down", "pass"]
"""How the ball goes; speeds and guards are the driver's.

over   up above everything, across, and no farther; the goal's height is not used.
lift   straight up; unguarded.
back   straight back from a contact just made in a pass; unguarded.
down   straight down; what opposes it stops it.
pass   level, just above what is known; any touch stops it.
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
        spacing_m: Between neighbouring tracks. A peak of no width between two of them hides as deep as the ball's
            section there is.
        inset_m: Tracks keep so far inside the outline.
        rim_inset_m, rim_reach_m: Places of the rim, moved inwards by the inset (about the ball's radius, which reaches
            out again), must be within the reach of a track; what is not gets a way out of its own (limbs of a figure).
        onward_m: From where a pass met something, so much farther on it is touched from above.
        back_m: Way back from there before the ball is lifted.
        lift_m: First lift there; doubled for as long as the way on is still blocked.
        near_m: Round the highest place the ball looks so far in four directions.
        climbs: Most rounds of that, each about the highest place by then.
        most_touches: The plan ends after so many touches from above.
    """

    clearance_m: float = 0.0008
    spacing_m: float = 0.028
    inset_m: float = 0.012
    rim_inset_m: float = 0.006
    rim_reach_m: float = 0.010
    onward_m: float = 0.004
    back_m: float = 0.003
    lift_m: float = 0.004
    near_m: float = 0.004
    climbs: int = 3
    most_touches: int = 20

    def __post_init__(self) -> None:
        for name in ("clearance_m", "spacing_m", "onward_m", "back_m", "lift_m"):
            if not getattr(self, name) > 0.0:
                raise ParamError(name, getattr(self, name), "positive")


def tracks(points_K_m: Array, yaw_rad: float, rule: TopRule) -> Array:
    """Waypoints (k, 2) of a zigzag over the hull of `points_K_m` (n, 2), its tracks along `yaw_rad`.

    The tracks are evenly spread across, at most `spacing_m` apart; each is the hull's chord there less the inset. Then
    the places of the rim that are out of reach are put in where they lengthen the way least, farthest first.
    """
    points = np.asarray(points_K_m, dtype=np.float64)[:, :2]
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    turn = np.array([[c, -s], [s, c]])  # K <- track frame
    local = points @ turn
    low, high = local[:, 1].min(), local[:, 1].max()
    inner = max(high - low - 2 * rule.inset_m, 0.0)
    count = int(np.ceil(inner / rule.spacing_m - 1e-9)) + 1
    across = np.linspace(-0.5, 0.5, count) * inner + 0.5 * (low + high) if count > 1 else np.array([0.5 * (low + high)])
    hull = _hull(local)
    way: list[Array] = []
    for k, y in enumerate(across):
        left, right = _chord(hull, float(y))
        middle, half = 0.5 * (left + right), max(0.5 * (right - left) - rule.inset_m, 0.0)
        ends = [np.array([middle - half, y]), np.array([middle + half, y])]
        way += ends if k % 2 == 0 else ends[::-1]
    return np.asarray(_with_rim(way, local, rule) @ turn.T)


def _with_rim(way: list[Array], points: Array, rule: TopRule) -> Array:
    """The way with detours to every place of the rim that it leaves out of reach."""
    inwards = points.mean(axis=0) - points
    far = np.linalg.norm(inwards, axis=1)
    rim = points + inwards * np.minimum(rule.rim_inset_m / np.maximum(far, 1e-9), 1.0)[:, None]
    for _ in range(len(rim)):
        away = _distance(rim, np.array(way))
        place = rim[int(np.argmax(away))]
        if away.max() <= rule.rim_reach_m:
            break
        after = [0.0, *(np.linalg.norm(b - a) for a, b in pairwise(way)), 0.0]
        to = [float(np.linalg.norm(place - w)) for w in way]
        longer = [(to[k - 1] if k else 0.0) + (to[k] if k < len(way) else 0.0) - after[k] for k in range(len(way) + 1)]
        way = way[:]
        way.insert(int(np.argmin(longer)), place)
    return np.array(way)


def _distance(points: Array, way: Array) -> Array:
    """(n,) distance of points (n, 2) from a polyline (k, 2)."""
    a, step = way[:-1], np.diff(way, axis=0)
    square = np.maximum((step * step).sum(axis=1), 1e-18)
    share = np.clip(((points[:, None] - a) * step).sum(axis=2) / square, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points[:, None] - a - share[..., None] * step, axis=2).min(axis=1))


def _hull(points: Array) -> Array:
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except (QhullError, ValueError):
        return points


def _chord(hull: Array, y: float) -> tuple[float, float]:
    """Least and greatest x of a convex polygon (n, 2) on the line of height y."""
    a, b = hull, np.roll(hull, -1, axis=0)
    cuts = (a[:, 1] - y) * (b[:, 1] - y) <= 0
    a, b = a[cuts], b[cuts]
    if not len(a):
        only = float(hull[int(np.argmin(np.abs(hull[:, 1] - y))), 0])
        return only, only
    rise = b[:, 1] - a[:, 1]
    flat = np.abs(rise) < 1e-12
    share = np.where(flat, 0.0, (y - a[:, 1]) / np.where(flat, 1.0, rise))
    x = np.concatenate([a[:, 0] + share * (b[:, 0] - a[:, 0]), b[flat, 0]])
    return float(x.min()), float(x.max())


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
    if np.linalg.norm(way[-1] - search.xy) < np.linalg.norm(way[0] - search.xy):
        way = way[::-1]
    done = 0
    for goal in way:
        done += yield from search.pass_to(goal)
    if search.best is not None and len(way) > 1:
        along = (way[1] - way[0]) / max(float(np.linalg.norm(way[1] - way[0])), 1e-9)
        yield from search.climb(along)
    return Top(search.best, search.touches, done / max(len(way), 1))


NEAR_M, FARTHEST_ONWARD_M = 0.012, 0.012
"""Stopped again within NEAR_M of the last touch, a pass is on a slope: it looks twice as far on, at most so far."""


class _Search:
    """Where the ball is and what is known; every method is a generator of moves."""

    def __init__(self, rule: TopRule, lowest_m: float, ceiling_m: float) -> None:
        self.rule, self.lowest_m, self.ceiling_m = rule, lowest_m, ceiling_m
        self.tip: Array = np.zeros(3)
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
        met = yield BallMove(kind, np.asarray(goal, dtype=np.float64))
        self.tip = np.asarray(met.tip_K_m, dtype=np.float64)
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
        while self.touches < rule.most_touches:
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
            yield from self._go("back", np.array([*(self.xy - rule.back_m * heading), self.tip[2]]))
            if self.tip[2] + lift >= self.ceiling_m - 1e-4:
                yield from self.over(aim)
                break
            yield from self.lift(float(self.tip[2]) + lift)
            met = yield from self._go("pass", np.array([*aim, self.tip[2]]))
            if met.refused:
                return False
            if met.touch_K_m is None:
                break
            lift *= 2
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
