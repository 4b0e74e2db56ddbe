"""Draw a random combination of faults from the seed of a trial alone."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from pydantic.fields import FieldInfo

from glotouch_bt.faults import CATALOGUE, Duration, FaultPlan, FaultSpec, Repeat, When
from glotouch_bt.mission.read import limits_of
from glotouch_bt.mission.spec import Place
from glotouch_bt.robot.scene import stream

Accepted = Mapping[str, Mapping[str, Sequence[int]]]
"""Faults that a robot accepts in a mission, each with the accepted values of its indices."""

FACTOR = 3.0
"""Largest factor between a drawn parameter and its default."""
MIN_S, MAX_S = 0.2, 20.0
"""Range of the duration of a fault that ends, s."""
EVER = 1.0 / 3.0
"""Share of the faults that last until the end of the run."""
DIGITS = 3
"""Significant digits of a drawn parameter."""


def draw_scene(seed: int, count: int) -> int:
    """Return the number, from 0, of the pair of mission and backend of a trial; `count` is the number of pairs."""
    return int(stream(seed, "scene of forces").integers(count))


def draw_plan(seed: int, accepted: Accepted, durations_s: Mapping[str, float], lasts_s: float) -> FaultPlan:
    """Return a plan of two or three different faults.

    Args:
        seed: Seed of the trial.
        accepted: Faults to choose from.
        durations_s: Duration of each node of the undisturbed run, s.
        lasts_s: Duration of the undisturbed run, s.
    """
    rng = stream(seed, "faults of forces")
    count = min(int(rng.integers(2, 4)), len(accepted))
    names = [str(n) for n in rng.choice(sorted(accepted), size=count, replace=False)]
    return plan_of([_fault(rng, n, accepted[n], durations_s, lasts_s) for n in names])


def plan_of(faults: Sequence[FaultSpec]) -> FaultPlan:
    """Return the plan of these faults, named after them."""
    return FaultPlan(" and ".join(f.name for f in faults), tuple(faults))


def fault_of(name: str, given: Mapping[str, Any], when: When, duration: Duration) -> FaultSpec:
    """Return a fault of the catalogue that occurs once; `given` are the parameters other than the defaults."""
    kind = CATALOGUE[name]
    return FaultSpec(name, kind, kind.effect.Params(**given), when, duration, Repeat(), Place("bench forces"))


def _fault(
    rng: np.random.Generator,
    name: str,
    indices: Mapping[str, Sequence[int]],
    durations_s: Mapping[str, float],
    lasts_s: float,
) -> FaultSpec:
    given = {}
    for field_name, field in CATALOGUE[name].effect.Params.model_fields.items():
        if field_name in indices:
            given[field_name] = int(rng.choice(indices[field_name]))
        elif is_number(field):
            given[field_name] = _number(rng, field)
    return fault_of(name, given, _when(rng, durations_s, lasts_s), _duration(rng))


def is_number(field: FieldInfo) -> bool:
    """Return True if a parameter is a number or a list of numbers."""
    values = field.default if isinstance(field.default, tuple) else (field.default,)
    return all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)


def is_index(field: FieldInfo) -> bool:
    """Return True if a parameter is an index: a whole number that is at least 0."""
    return field.annotation is int and any(symbol == ">=" and limit == 0 for symbol, limit, _ in limits_of(field))


def _number(rng: np.random.Generator, field: FieldInfo) -> Any:
    if isinstance(field.default, tuple):
        return tuple(_scaled(rng, float(v), field) for v in field.default)
    value = _scaled(rng, float(field.default), field)
    return round(value) if field.annotation is int else value


def _scaled(rng: np.random.Generator, default: float, field: FieldInfo) -> float:
    """Return the default times a log-uniform factor, with a random sign if negative values are valid, in its bounds."""
    value = default * math.exp(rng.uniform(-math.log(FACTOR), math.log(FACTOR)))
    limits = limits_of(field)
    if rng.random() < 0.5 and any(symbol in (">", ">=") and limit < 0.0 for symbol, limit, _ in limits):
        value = -value
    value = float(f"{value:.{DIGITS}g}") + 0.0  # no negative zero
    for symbol, limit, holds in limits:
        if not holds(value, limit):
            value = float(limit) if symbol in (">=", "<=") else (default + limit) / 2.0
    return value


def _when(rng: np.random.Generator, durations_s: Mapping[str, float], lasts_s: float) -> When:
    """Return a start: with the first sample, at a time of the run, or at a time in a node."""
    way = int(rng.integers(3))
    if way == 1:
        return When(time_s=_rounded(rng.uniform(0.0, max(lasts_s, 0.0))))
    if way == 2 and durations_s:
        node = str(rng.choice(sorted(durations_s)))
        return When(node=node, after_s=_rounded(rng.uniform(0.0, max(durations_s[node], 0.0))))
    return When()


def _duration(rng: np.random.Generator) -> Duration:
    if rng.random() < EVER:
        return Duration(until="ever")
    return Duration(duration_s=_rounded(math.exp(rng.uniform(math.log(MIN_S), math.log(MAX_S)))))


def _rounded(seconds: float) -> float:
    return round(float(seconds), 2)
