"""A world of discs and rectangles on a plane, and a searcher with a tip: counts what is found over travel."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from glotouch_bt.perception.search import SearchMap
from glotouch_bt.perception.touch import Contour, signed_distance

INTERIOR = np.array([0.40, 0.30])
TIP = 0.006


def random_layout(rng, n=5, gap=0.030):
    """Five contours 4-11 cm large, at least `gap` from each other and from the walls; outlines sampled, not circles."""
    while True:
        placed = []
        for _ in range(400):
            if len(placed) == n:
                return placed
            yaw = rng.uniform(-np.pi / 2, np.pi / 2)
            if rng.random() < 0.5:
                d = rng.uniform(0.04, 0.075)
                kind, size, yaw = "round", (d, d), 0.0
            else:
                long = rng.uniform(0.05, 0.11)
                kind, size = "box", (long, rng.uniform(0.04, min(long, 0.06)))
            c = Contour(kind, rng.uniform(-0.5, 0.5, 2) * INTERIOR, size, yaw, 0.0, np.zeros(0))
            line = c.outline_K_m(64) if kind == "round" else _dense(c.outline_K_m())
            if np.any(np.abs(line) > 0.5 * INTERIOR - gap):
                continue
            if all(np.min(signed_distance(o, line)) >= gap and np.min(signed_distance(c, l)) >= gap for o, l in placed):
                placed.append((c, line))


def _dense(polyline, step=0.003):
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(polyline, axis=0), axis=1))]
    at = np.arange(0, length[-1], step)
    return np.column_stack([np.interp(at, length, polyline[:, i]) for i in (0, 1)])


@dataclass
class Trial:
    touched_at: list  # travel (m) at each first touch
    travel: float  # total when it ended
    sweep: float  # without the orbits
    exhausted: bool
    belief: SearchMap


def run(policy, layout, start, *, limit_m=8.0, wall_gap=0.012, orbit=True):
    objects = [c for c, _ in layout]
    belief = SearchMap.blank(0.5 * INTERIOR - wall_gap, expected=len(objects))
    tip = np.array(start, dtype=float)
    known, touched_at = set(), []
    travel = sweep = 0.0
    while travel < limit_m and len(known) < len(objects):
        stretch = policy.next_stretch(belief, tip)
        if stretch is None:
            return Trial(touched_at, travel, sweep, True, belief)
        hit = None
        for goal in stretch.waypoints_K_m:
            n = max(int(np.linalg.norm(goal - tip) / 0.001), 1)
            line = tip + (goal - tip) * np.linspace(0, 1, n + 1)[1:, None]
            gaps = np.array([signed_distance(o, line) for o in objects]) - TIP
            contact = np.nonzero((gaps <= 0).any(axis=0))[0]
            if len(contact):
                k = contact[0]
                hit = int(np.argmin(gaps[:, k]))
                line = line[: k + 1]
            step = np.linalg.norm(line[-1] - tip)
            travel, sweep = travel + step, sweep + step
            belief = belief.with_path(np.vstack([tip, line]))
            before, tip = tip, line[-1]
            if hit is not None:
                break
        if hit is None:
            continue
        away = before - tip
        tip = tip + away / max(np.linalg.norm(away), 1e-9) * 0.006
        if hit in known:
            belief = belief.with_dropped(tip)
            continue
        known.add(hit)
        touched_at.append(travel)
        c = objects[hit]
        if orbit:
            a = np.linspace(0, 2 * np.pi, 90)
            ring = c.centre_K_m + (c.radius_m + 0.015) * np.c_[np.cos(a), np.sin(a)]
            ok = belief.inside_extent(ring) & (np.min([signed_distance(o, ring) for o in objects], axis=0) > TIP)
            travel += (c.radius_m + 0.015) * 2 * np.pi * 0.8
            for p in ring[ok]:
                belief = belief.with_path(p[None])
        belief = belief.with_exclusion(c, 0.010)
    return Trial(touched_at, travel, sweep, False, belief)


def summary(trials, budgets=(1.0, 3.0, 5.0), n=5):
    found = [[sum(t <= b for t in x.touched_at) for x in trials] for b in budgets]
    return [(round(float(np.mean(f)), 2), round(float(np.mean(np.array(f) == n)), 2)) for f in found]


@pytest.fixture(scope="session")
def planar():
    return SimpleNamespace(random_layout=random_layout, run=run, summary=summary, interior=INTERIOR)
