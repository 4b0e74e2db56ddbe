"""Exploration: find the next object, trace it, decide how many bodies it is, and check the doubtful ones."""

from __future__ import annotations

from functools import partial

from glotouch_bt.perception.search.belonging import joins, of_another, part_of, taken_by
from glotouch_bt.perception.search.candidates import (
    UNMET,
    Admitted,
    admit,
    all_separated,
    divided,
    division_of,
    regroup,
)
from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.perception.search.moves import SearchPlan
from glotouch_bt.perception.search.policies import SearchPolicy
from glotouch_bt.perception.search.seeking import Sought, seek
from glotouch_bt.perception.search.suspects import feel_suspect, next_suspect
from glotouch_bt.perception.search.tracing import Elsewhere, OutlineTrace, TraceParams, trace, trace_more
from glotouch_bt.perception.touch import Candidate, Contact
from glotouch_bt.robot import Array

WORTH_DIVIDING = 0.2
"""Share of the places left above which the search goes on without asking whether a candidate is two bodies: divisions
take time to compute, and are hardly ever likelier than a hidden object then. Source: ours."""
CHECKED_CHANCE = 0.1
"""Minimum probability that two candidates are one body for one of them to be traced further. Source: ours."""
CHECKED_CONTACTS = 12
"""Number of contacts from which on a doubtful candidate is not traced further. Source: ours."""


def seek_next(
    belief: SearchMap,
    known: tuple[Candidate, ...],
    policy: SearchPolicy,
    tip_K_m: Array,
    tip_radius_m: float,
    *,
    lowered: bool,
    round_tip: bool = True,
) -> SearchPlan[tuple[Sought, tuple[Candidate, ...]]]:
    """Search for the next object; where one of a known number is missing, find out whether a candidate is two bodies.

    The contact may be one with a candidate that is probably two bodies (`next_suspect`): its trace goes on from there.

    Args:
        belief, known: Map and candidates.
        policy, tip_K_m, lowered: As for `seek`.
        tip_radius_m, round_tip: As for `trace`.
    """
    radius, enough = tip_radius_m if round_tip else 0.0, WORTH_DIVIDING
    while True:
        while (suspect := next_suspect(belief, known, radius)) is not None:
            belief = belief.with_probed(suspect.index)
            sought = yield from feel_suspect(belief, suspect, tip_K_m, lowered=lowered)
            belief, tip_K_m, lowered = sought.belief, sought.tip_K_m, sought.lowered
            if sought.contact is not None:
                return sought, known
        belief = belief.with_probed(None)
        sought = yield from seek(belief, policy, tip_K_m, lowered=lowered, enough=enough)
        belief, tip_K_m, lowered = sought.belief, sought.tip_K_m, sought.lowered
        if sought.contact is not None or belief.complete:
            return sought, known
        two = division_of(belief, known, radius)
        if two is not None and two.is_likelier(belief):
            now = divided(belief, known, two, radius)
            belief, known = now.belief, now.candidates
        elif enough > 0.0:
            enough = two.share if two is not None and UNMET < two.share < enough else 0.0
        else:
            return sought, known


def trace_bodies(
    belief: SearchMap,
    known: tuple[Candidate, ...],
    first: Contact,
    tip_K_m: Array,
    tip_radius_m: float,
    params: TraceParams,
    height_m: float,
    exclusion_m: float,
    *,
    round_tip: bool = True,
) -> SearchPlan[tuple[Admitted, OutlineTrace]]:
    """Trace a touched object and add it to map and candidates.

    A contour that two bodies explain better than one becomes two candidates. Doubtful candidates are traced further
    before the search ends by count, and all their contacts are divided anew.

    Args:
        belief: Map before the trace.
        known: Candidates before the trace.
        first: Contact that started the trace.
        tip_K_m, tip_radius_m, params, round_tip: As for `trace`.
        height_m, exclusion_m: As for `admit`.
    """
    radius = tip_radius_m if round_tip else 0.0
    old = part_of(known, first, radius)

    def elsewhere(others: tuple[Candidate, ...]) -> Elsewhere:
        return lambda mine, contact: belief.at_wall(contact) or of_another(others, radius, mine, contact)

    traced = yield from trace(
        first,
        tip_K_m,
        tip_radius_m,
        params,
        round_tip=round_tip,
        half_extent_m=belief.half_extent_m,
        known=() if old is None else old.contacts,
        elsewhere=elsewhere(tuple(c for c in known if c is not old)),
        taken=partial(taken_by, tuple(c for c in known if c is not old), tip_radius_m),
        joined=partial(joins, known, radius_m=radius) if old is None else None,
    )
    admitted = admit(belief, known, first, traced, height_m, exclusion_m, part_of=old)
    checked: set[int] = set()
    while (pair := _next_check(admitted, checked)) is not None:
        whole, part = pair
        checked |= {whole.index, part.index}
        rest = tuple(c for c in admitted.candidates if c.index not in (whole.index, part.index))
        more = yield from trace_more(
            part.contacts,
            tip_K_m,
            tip_radius_m,
            params,
            round_tip=round_tip,
            half_extent_m=belief.half_extent_m,
            elsewhere=elsewhere(rest),
            taken=partial(taken_by, rest, tip_radius_m),
        )
        admitted = regroup(admitted, whole.index, part.index, more, exclusion_m)
    return all_separated(admitted, radius, exclusion_m), traced


def _next_check(admitted: Admitted, checked: set[int]) -> tuple[Candidate, Candidate] | None:
    """Return the next doubtful pair to check, the candidate to trace second; None: nothing needs a check now.

    The parts of one contour are checked at once, all others before the search ends by count.
    """
    ends = _all_traced(admitted)
    best: tuple[Candidate, Candidate] | None = None
    for pair in (doubt.pair for doubt in admitted.doubts if doubt.chance >= CHECKED_CHANCE):
        indices = {c.index for c in pair}
        if indices & checked or not (ends or indices <= set(admitted.changed)):
            continue
        whole, part = sorted(pair, key=lambda c: (-c.quality, c.index))
        if len(part.contacts) < CHECKED_CONTACTS and (best is None or part.quality < best[1].quality):
            best = whole, part
    return best


def _all_traced(admitted: Admitted) -> bool:
    """Return True if as many candidates are traced as a known number of objects."""
    return admitted.belief.expected is not None and admitted.belief.found >= admitted.belief.expected
