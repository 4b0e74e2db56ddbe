"""Ways of the ball around a predicted outline, and places beside it.

Bearings are in rad, seen from the outline's centre. `side` is the direction around it: +1 counter-clockwise, -1
clockwise. Lengths are in m, positions in K.
"""

from __future__ import annotations

import numpy as np

from glotouch_bt.perception.search.tracing.trace_params import TraceParams
from glotouch_bt.perception.search.tracing.trace_state import TraceState
from glotouch_bt.perception.touch.outline import OutlineBelief, wrapped
from glotouch_bt.robot import Array


def way_round(outline: OutlineBelief, s: TraceState, p: TraceParams, bearing: float, side: float) -> Array:
    """Return waypoints (k, 2) outside the predicted outline from the ball to `bearing`, with shortcuts."""
    angles = _angles(outline, s, bearing, side)
    ring = s.passing(outline, angles, p)
    points = outline.centre_K_m + ring[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    points = np.clip(points, -s.half, s.half)
    return _tight(s, points, outline, p)


def doubt_on_way(outline: OutlineBelief, s: TraceState, p: TraceParams, bearing: float, side: float) -> float:
    """Return the maximum standard deviation of the outline, m, on the way from the ball to `bearing`."""
    _, sd = s.ring(outline, _angles(outline, s, bearing, side), p)
    return float(np.max(sd))


def places_beside(outline: OutlineBelief, bearings: Array, distance: Array, sd: Array, p: TraceParams) -> Array:
    """Return positions (n, 2) for the descent at bearings (n,), outside an outline at `distance` (n,) from its centre.

    `sd` (n,) is the standard deviation of that distance.
    """
    ring = distance + p.clearance_m + np.minimum(2.0 * sd, p.widest_margin_m)
    return np.asarray(outline.centre_K_m + ring[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)]))


def free_column(outline: OutlineBelief, s: TraceState, p: TraceParams, place: Array) -> Array | None:
    """Return the nearest free column from which the ball can step to `place` beside the outline, or None."""
    found = s.columns()
    away = np.linalg.norm(found - place, axis=1)
    for i in np.argsort(away, kind="stable"):
        if away[i] > p.aside_m:
            break
        if _clear(s, found[i], place, outline, p):
            return np.asarray(found[i])
    return None


def _angles(outline: OutlineBelief, s: TraceState, bearing: float, side: float) -> Array:
    """Return the bearings (k,) on the way around from the ball (excluded) to `bearing`."""
    here = s.bearing(outline)
    turn = float(wrapped(np.array(side * (bearing - here))) % (2 * np.pi))
    n = max(int(np.ceil(turn / np.deg2rad(5.0))), 1)
    return np.asarray(here + side * np.linspace(0.0, turn, n + 1)[1:])


def _tight(s: TraceState, points: Array, outline: OutlineBelief, p: TraceParams) -> Array:
    """Remove waypoints whose shortcut keeps the clearance from the predicted outline."""
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


def _clear(s: TraceState, a: Array, b: Array, outline: OutlineBelief, p: TraceParams) -> bool:
    """Return True if the straight way from a to b keeps its distance from the outline."""
    t = np.linspace(0.0, 1.0, 12)[1:-1, None]
    d = (1 - t) * a + t * b - outline.centre_K_m
    least = s.passing(outline, np.arctan2(d[:, 1], d[:, 0]), p, 0.7, 0.5)
    return bool(np.all(np.hypot(d[:, 0], d[:, 1]) >= least))
