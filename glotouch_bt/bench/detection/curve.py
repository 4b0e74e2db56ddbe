"""The guard's operating curve on synthetic signals: false alarms in free motion, and detected forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, TypedDict, get_args

import numpy as np
import scipy

from glotouch_bt.bench.detection.signals import RATE_HZ, FreeMove, Hand, MoveKind, Wrist
from glotouch_bt.bench.statistics import Rate, wilson
from glotouch_bt.robot import Array, Conditions

Push = Literal["step", "slow"]
"""`step`: the whole force within one sample. `slow`: a linear ramp of `SLOW_S`."""
SLOW_S = 0.5
"""Ramp time of a slow push."""
HELD_S = 0.3
"""Time every push is held at full force."""
PUSH_AFTER_S = 0.5
"""Time from the start of a move to the push."""


class PerHour(TypedDict):
    """Events per hour with the exact 95 % Poisson interval."""

    rate: float
    lo: float
    hi: float
    count: int
    hours: float


def per_hour(count: int, hours: float) -> PerHour:
    """Return the rate with Garwood's interval (Biometrika 28, 1936), from gamma quantiles of order k and k + 1."""
    if hours <= 0:
        return {"rate": float("nan"), "lo": 0.0, "hi": float("inf"), "count": count, "hours": hours}
    lo = float(scipy.special.gammaincinv(count, 0.025)) if count else 0.0
    hi = float(scipy.special.gammaincinv(count + 1, 0.975))
    return {"rate": count / hours, "lo": lo / hours, "hi": hi / hours, "count": count, "hours": hours}


def draw_move(kind: MoveKind, rng: np.random.Generator) -> FreeMove:
    """Draw a move like those of exploration: sweeps of 50-350 mm at 40-50 mm/s, steps of 10-30 mm, 20-110 mm down."""
    bearing = rng.uniform(0.0, 2 * np.pi)
    across = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    low, high, slowest, fastest = {
        "sweep": (0.05, 0.35, 0.04, 0.05),
        "step": (0.01, 0.03, 0.03, 0.05),
        "down": (0.02, 0.11, 0.015, 0.04),
    }[kind]
    direction = np.array([0.0, 0.0, -1.0]) if kind == "down" else across
    return FreeMove(kind, rng.uniform(low, high), rng.uniform(slowest, fastest), direction)


def false_alarms(
    hand: Hand, conditions: Conditions, seeds: Sequence[int], *, hours: float, compensate: bool = True
) -> dict[MoveKind, PerHour]:
    """Return contacts reported per hour of guarded free motion, by kind of move; `hours` for each kind."""
    found: dict[MoveKind, PerHour] = {}
    for kind in get_args(MoveKind):
        count, heard_s = 0, 0.0
        for seed in seeds:
            rng = np.random.default_rng([seed, get_args(MoveKind).index(kind)])
            wrist = Wrist(hand, conditions, rng, compensate)
            share_s = 0.0
            while share_s < 3600.0 * hours / len(seeds):
                onset, listened_s = wrist.listen(draw_move(kind, rng))
                count += onset is not None
                share_s += listened_s
            heard_s += share_s
        found[kind] = per_hour(count, heard_s / 3600.0)
    return found


def force_of(push: Push, force_N: float, against_B: Array) -> Array:
    """Return the force (n, 3) on the ball in B, from the start of a move."""
    before = np.zeros(round(PUSH_AFTER_S * RATE_HZ))
    growing = np.linspace(0.0, 1.0, round(SLOW_S * RATE_HZ)) if push == "slow" else np.zeros(0)
    held = np.ones(round(HELD_S * RATE_HZ))
    return np.asarray(force_N * np.concatenate([before, growing, held])[:, None] * against_B)


def found_share(
    hand: Hand, conditions: Conditions, kind: MoveKind, push: Push, force_N: float, seeds: Sequence[int]
) -> Rate:
    """Return the share of pushes of `force_N` detected while they last, one push a seed. An earlier alarm is a miss."""
    hits = 0
    for seed in seeds:
        rng = np.random.default_rng([seed, 7])
        long = replace(draw_move(kind, rng), length_m=0.09, speed_m_s=0.04)
        force = force_of(push, force_N, -long.direction_B)
        onset, _ = Wrist(hand, conditions, rng).listen(long, force)
        hits += onset is not None and PUSH_AFTER_S <= onset.detected_s <= len(force) / RATE_HZ
    return wilson(hits, len(seeds))
