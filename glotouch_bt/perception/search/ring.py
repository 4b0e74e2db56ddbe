"""Round a traced object at another height, from above: what is there stands within what was felt below it.

The shaft feels what stands over the ball, so a higher section reaches nowhere beyond the lower one: coming down beside
the lower envelope is clear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from glotouch_bt.perception.search.moves import Move, Plan
from glotouch_bt.perception.search.tracing import Trace, TraceParams, trace
from glotouch_bt.perception.touch import (
    Candidate,
    Contact,
    Contour,
    OutlineBelief,
    Ring,
    believe_contacts,
    signed_distance,
)
from glotouch_bt.perception.touch.outline import envelope, with_ring
from glotouch_bt.robot import Array

BEARINGS = 12
TRIES = 3
"""Ways down that are tried."""
OUT_M = np.arange(0.0, 0.12, 0.002)
"""Distances from the middle at which a way down is looked for."""
MIN_CONTACTS = 4
"""Fewer contacts higher up say nothing about a centre."""
SLIM_M = 0.010
"""A higher section may be much smaller than an object: a neck, a handle."""


def trace_ring(
    candidate: Candidate,
    tip_K_m: Array,
    tip_radius_m: float,
    params: TraceParams,
    *,
    round_tip: bool = True,
    half_extent_m: Array | None = None,
) -> Plan[Trace | None]:
    """Down beside the candidate, at whatever height the driver takes for sensing height, and round it; None if nothing
    was met there.

    Args:
        candidate: As traced lower down; the ball is above it.
        tip_K_m, tip_radius_m, params, round_tip, half_extent_m: As for `trace`.
    """
    middle = candidate.contour.centre_K_m
    places = _ways_down(envelope(candidate), middle, tip_radius_m + params.clearance_m)
    if half_extent_m is not None:
        places = places[np.all(np.abs(places) <= half_extent_m, axis=1)]
    order = np.argsort(np.linalg.norm(places - tip_K_m[:2], axis=1), kind="stable")
    for place in places[order][:TRIES]:
        felt = yield Move("hop", place)
        if felt.refused or felt.contact is not None:
            continue
        felt = yield Move("probe", middle)
        if felt.contact is not None:
            slim = replace(params, smallest_m=SLIM_M)
            plan = trace(
                felt.contact, felt.tip_K_m, tip_radius_m, slim, round_tip=round_tip, half_extent_m=half_extent_m
            )
            return (yield from plan)
    return None


def outline_of(contacts: Sequence[Contact], radius_m: float) -> OutlineBelief:
    """What contacts at one height say of an object that stands where they are; the radius is 0 for what is no ball."""
    places = [c if radius_m > 0 else replace(c, tip_K_m=np.array([*c.point_K_m, c.tip_K_m[2]])) for c in contacts]
    return believe_contacts([replace(c, pushed_K_m=np.zeros(2)) for c in places], radius_m)


def with_second_ring(candidate: Candidate, traced: Trace, height_m: float, lower_m: float) -> Candidate | None:
    """The candidate with what was traced higher up, moved along with the object if that pushed it; None if that was too
    little for an outline."""
    if traced.outline is None or len(traced.contacts) < MIN_CONTACTS:
        return None
    by = traced.displaced_K_m
    there = tuple(
        replace(c, tip_K_m=c.tip_K_m + np.array([*by, 0.0]), point_K_m=c.point_K_m + by) for c in candidate.contacts
    )
    ring = Ring(height_m, traced.outline.contour, traced.contacts)
    radius = traced.outline.touches.radius_m
    return with_ring(replace(candidate, contacts=there), outline_of(there, radius), ring, traced.outline, lower_m)


def _ways_down(room: Contour, middle: Array, clear_m: float) -> Array:
    """(k, 2) the nearest place to the middle, in each of some directions, so far outside the room an object takes."""
    angles = np.linspace(-np.pi, np.pi, BEARINGS, endpoint=False)
    u = np.column_stack([np.cos(angles), np.sin(angles)])
    places = middle + OUT_M[:, None, None] * u
    clear = signed_distance(room, places.reshape(-1, 2)).reshape(len(OUT_M), BEARINGS) >= clear_m
    first = np.argmax(clear, axis=0)
    return np.asarray(places[first, np.arange(BEARINGS)][clear.any(axis=0)])
