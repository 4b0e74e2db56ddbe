"""Explore a planar world as the skills explore the real one: seek, trace, exclude, until all is found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from glotouch_bt.robot import Array
from glotouch_bt.search import SearchMap, SearchPolicy, TraceParams, seek, trace
from glotouch_bt.search.moves import Felt, Move
from glotouch_bt.study.planar.drive import drive
from glotouch_bt.study.planar.world import PlanarWorld
from glotouch_bt.touch import Candidate, contour_quality, envelope
from skills.guarded_sweep import GuardedSweepParams
from skills.orbit_probe import LEAST_CONTACTS, OrbitProbeParams

BUDGET_M = 8.0
MOST_MOVES = 5000
"""No exploration needs so many; refused moves cost no travel, so the budget alone would not end it."""


@dataclass(frozen=True)
class Traced:
    """A candidate, and the planar travel at which it was added."""

    travel_m: float
    candidate: Candidate


@dataclass(frozen=True)
class Explored:
    """How an exploration went.

    Attributes:
        found: Candidates in order.
        travel_m: Planar length of all the ball's ways.
        ended: "complete", "exhausted" or "budget".
        belief: The map at the end.
        contacts: How many contacts the candidates have.
        untraced: How many first contacts gave no candidate.
    """

    found: tuple[Traced, ...]
    travel_m: float
    ended: str
    belief: SearchMap
    untraced: int

    @property
    def contacts(self) -> int:
        """Contacts of all candidates."""
        return sum(len(t.candidate.contacts) for t in self.found)


class _OutOfBudget(Exception):
    """The travel is spent."""


class _Budget:
    """A world that stops when the travel is spent."""

    def __init__(self, world: PlanarWorld, budget_m: float) -> None:
        self._world, self._budget_m, self._moves = world, budget_m, 0

    def execute(self, move: Move) -> Felt:
        """As the world does."""
        self._moves += 1
        if self._world.travel_m >= self._budget_m or self._moves > MOST_MOVES:
            raise _OutOfBudget
        return self._world.execute(move)


def explore(
    world: PlanarWorld,
    policy: SearchPolicy,
    expected: int,
    *,
    budget_m: float = BUDGET_M,
    tracing: TraceParams | None = None,
    sweep: GuardedSweepParams | None = None,
    orbit: OrbitProbeParams | None = None,
) -> Explored:
    """What the mission's exploration does, with geometry for an arm.

    Args:
        world: The layout; its travel meter must be at 0.
        policy: Where to go.
        expected: How many objects are looked for.
        budget_m: Travel after which it is broken off.
        tracing: How outlines are traced (default: as the skill's parameters say).
        sweep, orbit: Parameters of the skills; their defaults by default.
    """
    sweep, orbit = sweep or GuardedSweepParams(), orbit or OrbitProbeParams()
    tracing = tracing or trace_params(orbit)
    belief = SearchMap.blank(world.half_m + world.tip_radius_m - sweep.wall_gap_m, expected)
    found: list[Traced] = []
    limited, untraced, ended = _Budget(world, budget_m), 0, "complete"
    try:
        while not belief.complete:
            sought = drive(seek(belief, policy, world.tip_K_m, lowered=world.lowered), limited)
            belief = sought.belief
            if sought.contact is None:
                ended = "exhausted"
                break
            traced = drive(trace(sought.contact, world.tip_K_m, world.tip_radius_m, tracing), limited)
            belief = belief.with_path(traced.path_K_m).with_hints((*belief.hints, *traced.strays))
            if traced.outline is None or len(traced.contacts) < LEAST_CONTACTS:
                belief = belief.with_dropped(sought.contact.point_K_m)
                untraced += 1
                continue
            contour = traced.outline.contour
            tips: Array = np.array([c.tip_K_m[:2] for c in traced.contacts])
            quality = contour_quality(tips, contour)
            candidate = Candidate(len(found), contour, orbit.height_m, quality, traced.contacts)
            found.append(Traced(world.travel_m, candidate))
            belief = belief.with_exclusion(envelope(candidate), orbit.exclusion_m)
    except _OutOfBudget:
        ended = "budget"
    return Explored(tuple(found), world.travel_m, ended, belief, untraced)


def trace_params(orbit: OrbitProbeParams) -> TraceParams:
    """As `orbit_probe` makes them."""
    return TraceParams(
        clearance_m=orbit.clearance_m,
        centre_sd_m=orbit.centre_sd_m,
        radial_sd_m=orbit.radial_sd_m,
        least_contacts=orbit.least_contacts,
        most_contacts=orbit.most_contacts,
    )
