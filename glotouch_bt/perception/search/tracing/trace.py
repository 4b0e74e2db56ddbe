"""Tracing of an outline: choose the most informative probe per travel until the outline is known (paper III-D)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from glotouch_bt.perception.search.moves import Move, SearchPlan
from glotouch_bt.perception.search.tracing.trace_params import Elsewhere, Taken, TraceParams, none_taken
from glotouch_bt.perception.search.tracing.trace_state import BEARINGS, OutlineTrace, TraceState, all_bearings, unit
from glotouch_bt.perception.search.tracing.ways import doubt_on_way, free_column, places_beside, way_round
from glotouch_bt.perception.touch import Contact
from glotouch_bt.perception.touch.outline import OutlineBelief, wrapped
from glotouch_bt.robot import Array

MIN_MORE = 3
"""Minimum number of new contacts with an object traced before."""
BESIDE_RAD = np.deg2rad(10.0)
"""Minimum angle between a route around the object and the bearing of an outlier beside it."""
OUTWARDS_M = (0.0, 0.012, 0.024)
"""Extra distances at which a hop is repeated after landing on an unpredicted part."""
OWN_M = 0.030
"""Maximum distance from a lone contact of another contact with the same object. Source: tuned in container_five
(gaps of 30 mm)."""
LOST = 2
"""Number of consecutive misses around a lone contact after which both its sides are probed."""
ALL_CONTACTS = 2
"""Maximum number of new contacts of a trace, as a multiple of `max_contacts`, with those that were dropped as another
object's. Between objects that touch, a trace can otherwise pass from one to the other for ever. Source: ours."""
INSIDE_M = 0.004
"""Distance from the predicted centre at which a probe ends: nothing is there."""


def trace(
    first: Contact,
    tip_K_m: Array,
    tip_radius_m: float,
    params: TraceParams | None = None,
    *,
    round_tip: bool = True,
    half_extent_m: Array | None = None,
    known: tuple[Contact, ...] = (),
    elsewhere: Elsewhere | None = None,
    joined: Callable[[tuple[Contact, ...]], bool] | None = None,
    taken: Taken = none_taken,
) -> SearchPlan[OutlineTrace]:
    """Trace the outline of a touched object. The ball ends beside it, at sensing height.

    Args:
        first: Contact that found the object; the ball may have retreated from it.
        tip_K_m: (2,) position of the ball.
        tip_radius_m: Radius of the ball, or of a disc similar to another section.
        params: See `TraceParams`.
        round_tip: The section is a disc: fit outlines to its centres, else to the contact points.
        half_extent_m: (2,) limits of |x| and |y| of the ball's centre in K; None: no walls near.
        known: Earlier contacts with the same object, at its current position.
        elsewhere, taken: See `Elsewhere` and `Taken`; nothing is felt for where the ball would overlap another object.
        joined: Returns True if the contacts belong to a known object, which ends the trace.
    """
    p = params or TraceParams()
    s = TraceState.begin([*_still(known), first], tip_K_m, tip_radius_m, round_tip, half_extent_m)
    s.given, s.taken = len(known), taken
    yield from _retreat(s, p)
    return (yield from _until_known(s, p, elsewhere, joined))


def trace_more(
    known: tuple[Contact, ...],
    tip_K_m: Array,
    tip_radius_m: float,
    params: TraceParams | None = None,
    *,
    round_tip: bool = True,
    half_extent_m: Array | None = None,
    columns: Callable[[], Array] | None = None,
    elsewhere: Elsewhere | None = None,
    taken: Taken = none_taken,
) -> SearchPlan[OutlineTrace]:
    """Continue the trace of an object from above: hop to where the outline is least certain.

    Args:
        known: Its contacts, at its current position.
        tip_K_m, tip_radius_m, params, round_tip, half_extent_m: As for `trace`; the ball may be raised.
        elsewhere, taken: As for `trace`.
        columns: Returns the places (n, 2) where the ball can come down through felt, free space.
    """
    p = params or TraceParams()
    s = TraceState.begin(_still(known), tip_K_m, tip_radius_m, round_tip, half_extent_m)
    s.known, s.given, s.columns, s.taken = len(known), len(known), columns or s.columns, taken
    outline, bearings = s.outline(), all_bearings()
    distance, sd = s.ring(outline, bearings, p)
    beside = places_beside(outline, bearings, distance, sd, p)
    walled = np.any(np.abs(beside) > s.half, axis=1) | s.taken(beside)
    for i in _apart(np.where(walled, -1.0, sd), p.misses):
        down, met = yield from _come_down(outline, s, p, float(bearings[i]))
        if not down:
            continue
        if met is None:
            outcome = yield Move("probe", outline.centre_K_m + INSIDE_M * unit(s.tip - outline.centre_K_m))
            s.record(outcome)
            met = outcome.contact
        if met is not None and not (elsewhere and elsewhere(s.present(), met)) and s.belongs(outline, met, p):
            s.add(met, outline, p)
            yield from _retreat(s, p)
            return (yield from _until_known(s, p, elsewhere))
    return replace(s.trace(outline, "it was not met again"), missing=True)


def _still(contacts: tuple[Contact, ...]) -> list[Contact]:
    """Return the contacts without their pushes, which their positions already contain."""
    return [replace(c, pushed_K_m=np.zeros(2)) for c in contacts]


def _apart(worth: Array, n: int) -> list[int]:
    """Return the indices of up to n bearings of the highest worth, spaced apart; skip negative worths."""
    chosen: list[int] = []
    for i in np.argsort(-worth, kind="stable"):
        gaps = [min(abs(int(i) - j), BEARINGS - abs(int(i) - j)) for j in chosen]
        if worth[i] >= 0 and all(g >= BEARINGS // 12 for g in gaps):
            chosen.append(int(i))
        if len(chosen) == n:
            break
    return chosen


def _until_known(
    s: TraceState,
    p: TraceParams,
    elsewhere: Elsewhere | None = None,
    joined: Callable[[tuple[Contact, ...]], bool] | None = None,
) -> SearchPlan[OutlineTrace]:
    """Probe from beside the object until the outline is known.

    After a surprising contact, test at each contact whether the object has moved unobserved (needs three contacts).
    """
    outline, missed, touches, ended, about = s.outline(), 0, 0, "", False
    while not ended:
        ended = _enough(outline, s, p)
        if touches >= ALL_CONTACTS * p.max_contacts:
            ended = f"{touches} contacts, some of them with other objects"
        if not ended and joined is not None and len(s.raw) >= p.min_contacts and joined(s.present()):
            ended = "it is an object that is known"
        if ended:
            break
        aim, beside = _choose(outline, s, p), False
        if (aim is None or missed == LOST) and not about and s.lone(OWN_M):
            about, bearing = True, s.bearing(outline)
            found = yield from _feel_about(s, p)
            beside = found is not None and s.near(found, OWN_M)
        elif aim is None:
            ended = "no side is left that can be reached"
            break
        else:
            bearing, s.side = aim.bearing, s.side or aim.side
            found = yield from _probe_at(outline, s, p, aim)
        touches += found is not None
        if found is None:
            missed += 1
            s.blocked.append(bearing)
        elif not (elsewhere is not None and elsewhere(s.present(), found)) and (beside or s.belongs(outline, found, p)):
            if s.near(found, p.same_m):
                missed += 1
                s.blocked.append(bearing)
            else:
                missed = 0
            s.add(found, outline, p)
            yield from _retreat(s, p)
            if s.begin_anew(p):
                missed = 0
        else:
            missed += 1
            out = found.reaction_K[:2]
            if s.released(outline, found, p):
                out = s.tip - outline.centre_K_m
            else:
                s.outliers.append(found)
                s.blocked.append(bearing)
            s.record((yield Move("retreat", s.tip + p.clearance_m * unit(out))))
        if missed > p.misses:
            ended = f"{missed} probes in a row told nothing"
        outline = s.outline()
        if s.keep_one(outline, p):
            outline, missed, ended = s.outline(), 0, ""
    return s.trace(outline, ended)


def _retreat(s: TraceState, p: TraceParams) -> SearchPlan[None]:
    """Retreat from the last contact to the clearance, mainly along the reaction (it differs from the approach in a
    graze)."""
    last = s.raw[-1]
    out = unit(2.0 * last.reaction_K[:2] - last.approach_K[:2])
    way = p.clearance_m - float((s.tip - last.tip_K_m[:2]) @ out)
    if way > 5e-4:
        s.record((yield Move("retreat", s.tip + way * out)))


def _enough(outline: OutlineBelief, s: TraceState, p: TraceParams) -> str:
    n = len(s.raw)
    if n >= p.max_contacts and (s.known or n >= s.given + MIN_MORE):
        return f"{n} contacts"
    if (
        n < p.min_contacts
        or max(outline.contour.size_m) < p.smallest_m
        or (s.known and s.odd >= 0 and n < s.odd + p.settling)
    ):
        return ""
    distance, sd = s.ring(outline, all_bearings(), p)
    sd = np.where(s.taken(places_beside(outline, all_bearings(), distance, sd, p)), 0.0, sd)
    centre_sd = np.sqrt(outline.centre_sd_m**2 + np.diag(s.shift_covariance(p)))
    if np.max(centre_sd) <= p.centre_sd_m and float(np.max(sd)) <= p.radial_sd_m:
        return "the outline is known"
    return ""


class _Aim(NamedTuple):
    """Next probe: bearing, rad; direction around the object (+1 counter-clockwise); True to reach it by a hop."""

    bearing: float
    side: float
    over: bool


def _choose(outline: OutlineBelief, s: TraceState, p: TraceParams) -> _Aim | None:
    """Return the probe with the highest uncertainty per travel; None if none is reachable."""
    bearings = all_bearings()
    distance, sd = s.ring(outline, bearings, p)
    here = s.bearing(outline)
    beside = places_beside(outline, bearings, distance, sd, p)
    walled, taken = np.any(np.abs(beside) > s.half, axis=1), s.taken(beside)
    over_m = np.where(walled, np.inf, p.hop_m)
    best, worth = None, 0.0
    step = 2 * np.pi / BEARINGS
    for side in (1.0, -1.0):
        turn = wrapped(side * (bearings - here)) % (2 * np.pi)
        order = np.argsort(turn, kind="stable")
        way = np.zeros(BEARINGS)
        way[order] = np.cumsum((distance + p.clearance_m)[order] * step)
        barred = (way > p.step_m) | (turn > np.pi) | (turn > _barred(outline, s, p, here, side)) | s.raised
        over = barred & np.isfinite(over_m)
        gain = sd**p.keen / (np.where(barred, over_m, way) + p.way_m)
        if side == -s.side:
            gain *= p.back
        gain[taken] = 0.0
        if s.blocked:
            near = np.min(np.abs(wrapped(bearings[:, None] - np.array(s.blocked)[None, :])), axis=1)
            gain[near < np.deg2rad(12.0)] = 0.0
        i = int(np.argmax(gain))
        if gain[i] > worth:
            best, worth = _Aim(float(bearings[i]), side, bool(over[i])), float(gain[i])
    return best


def _barred(outline: OutlineBelief, s: TraceState, p: TraceParams, here: float, side: float) -> float:
    """Return the angle, rad, by which the ball can go around the object before it meets an outlier."""
    off = np.array([c.tip_K_m[:2] for c in s.outliers]).reshape(-1, 2) - outline.centre_K_m
    at = np.arctan2(off[:, 1], off[:, 0])
    beside = np.hypot(off[:, 0], off[:, 1]) < s.passing(outline, at, p) + s.radius
    turns = wrapped(side * (at[beside] - here)) % (2 * np.pi)
    return float(np.min(turns - BESIDE_RAD, initial=2 * np.pi))


def _probe_at(outline: OutlineBelief, s: TraceState, p: TraceParams, aim: _Aim) -> SearchPlan[Contact | None]:
    """Move to the bearing and probe inwards; return the first contact, also one on the way.

    If the outline is too uncertain on the way, follow the surface from the last contact instead.
    """
    if aim.over:
        down, met = yield from _come_down(outline, s, p, aim.bearing)
        if met is not None or not down:
            return met
    else:
        beside = float(np.linalg.norm(s.tip - s.raw[-1].tip_K_m[:2])) < 3.0 * p.clearance_m
        if beside and doubt_on_way(outline, s, p, aim.bearing, aim.side) > p.doubt_m:
            return (yield from _along(s, p, aim.side))
        for waypoint in way_round(outline, s, p, aim.bearing, aim.side):
            outcome = yield Move("step", waypoint)
            s.record(outcome)
            if outcome.refused:
                return None
            if outcome.contact is not None:
                return outcome.contact
    distance, sd = (float(v[0]) for v in s.ring(outline, np.array([aim.bearing]), p))
    inner = max(distance - p.reach_sds * sd - 0.003, INSIDE_M)
    u = np.array([np.cos(aim.bearing), np.sin(aim.bearing)])
    outcome = yield Move("probe", outline.centre_K_m + inner * u)
    s.record(outcome)
    return outcome.contact


def _come_down(
    outline: OutlineBelief, s: TraceState, p: TraceParams, bearing: float
) -> SearchPlan[tuple[bool, Contact | None]]:
    """Hop beside the object at `bearing`, farther out after landing on it.

    If a free column is near, come down there and step beside the object, which is faster than to descend slowly.

    Returns:
        True at sensing height, and the contact of that step, or None.
    """
    at = np.array([bearing])
    distance, sd = s.ring(outline, at, p)
    for farther in OUTWARDS_M:
        place = places_beside(outline, at, distance + farther, sd, p)[0]
        if np.any(np.abs(place) > s.half):
            return False, None
        column = free_column(outline, s, p, place) if farther == 0.0 else None
        outcome = yield Move("hop", place if column is None else column)
        s.record(outcome)
        if outcome.refused:
            return False, None
        s.raised = outcome.contact is not None
        if s.raised:
            continue
        if column is not None:
            outcome = yield Move("step", place)
            s.record(outcome)
        return not outcome.refused, outcome.contact
    return False, None


def _along(s: TraceState, p: TraceParams, side: float) -> SearchPlan[Contact | None]:
    """Step along the tangent of the last contact and probe inwards."""
    last = s.raw[-1]
    normal = unit(2.0 * last.reaction_K[:2] - last.approach_K[:2])
    goal = np.clip(s.tip + p.along_m * side * np.array([-normal[1], normal[0]]), -s.half, s.half)
    for move in (Move("step", goal), Move("probe", goal - (p.clearance_m + p.along_reach_m) * normal)):
        outcome = yield move
        s.record(outcome)
        if outcome.refused or outcome.contact is not None:
            return outcome.contact
    return None


def _feel_about(s: TraceState, p: TraceParams) -> SearchPlan[Contact | None]:
    """Probe to both sides of the last contact along the surface, first against the current direction.

    A part touched at its end, e.g. a limb, is not ahead of the contact, where every outline predicts it.
    """
    last = s.raw[-1]
    beside = last.tip_K_m[:2] + p.clearance_m * unit(2.0 * last.reaction_K[:2] - last.approach_K[:2])
    for side in (-(s.side or 1.0), s.side or 1.0):
        outcome = yield Move("step", np.clip(beside, -s.half, s.half))
        s.record(outcome)
        if outcome.refused or outcome.contact is not None:
            return outcome.contact
        found = yield from _along(s, p, side)
        if found is not None:
            return found
    return None
