"""Exploration of one touched object: trace it, decide how many bodies it is, and check the doubtful ones."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from glotouch_bt.perception.search.bodies import CERTAIN_NATS, gain_of_two
from glotouch_bt.perception.search.candidates import Admitted, admit, joins, of_another, part_of, regroup
from glotouch_bt.perception.search.map import SearchMap
from glotouch_bt.perception.search.moves import SearchPlan
from glotouch_bt.perception.search.tracing import OutlineTrace, TraceParams, trace, trace_more
from glotouch_bt.perception.touch import Candidate, Contact
from glotouch_bt.robot import Array

POOR_QUALITY = 0.5
"""Quality below which a body that was separated from another one is traced further."""


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

    A contour that two bodies explain better than one becomes two candidates. A body whose existence is in doubt, or
    whose outline is poorly known, is traced further, and all contacts are divided anew.

    Args:
        belief: Map before the trace.
        known: Candidates before the trace.
        first: Contact that started the trace.
        tip_K_m, tip_radius_m, params, round_tip: As for `trace`.
        height_m, exclusion_m: As for `admit`.
    """
    radius = tip_radius_m if round_tip else 0.0
    old = part_of(known, first, radius)
    traced = yield from trace(
        first,
        tip_K_m,
        tip_radius_m,
        params,
        round_tip=round_tip,
        half_extent_m=belief.half_extent_m,
        known=() if old is None else old.contacts,
        elsewhere=partial(of_another, belief, tuple(c for c in known if c is not old)),
        joined=partial(joins, known, radius_m=radius) if old is None else None,
    )
    admitted = admit(belief, known, first, traced, height_m, exclusion_m, part_of=old)
    for index in reversed(admitted.changed[1:]):
        whole, part = (admitted.candidates[i] for i in (admitted.changed[0], index))
        gain = gain_of_two(whole, part, radius, admitted.belief.path_K_m)
        if gain > CERTAIN_NATS and part.quality > POOR_QUALITY:
            continue
        tip = traced.path_K_m[-1] if len(traced.path_K_m) else tip_K_m
        more = yield from trace_more(
            part.contacts,
            tip,
            tip_radius_m,
            params,
            round_tip=round_tip,
            half_extent_m=belief.half_extent_m,
            elsewhere=partial(of_another, belief, tuple(c for c in known if c.index != whole.index)),
        )
        admitted = regroup(admitted, whole.index, index, more, exclusion_m)
        traced = replace(traced, path_K_m=more.path_K_m if len(more.path_K_m) else traced.path_K_m)
    return admitted, traced
