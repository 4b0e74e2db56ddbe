"""Explore a planar world like the skills do: seek, trace, exclude, until all objects are found."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import count
from typing import Any

from glotouch_bt.bench.planar.world import PlanarWorld
from glotouch_bt.mission.read import SkillRegistry
from glotouch_bt.motion import drive
from glotouch_bt.perception.search import (
    LEFT_BELOW,
    Move,
    MoveOutcome,
    SearchMap,
    SearchPolicy,
    lost_among,
    of_another,
    refined,
    seek_next,
    taken_by,
    trace_bodies,
    trace_more,
)
from glotouch_bt.perception.touch import Candidate

BUDGET_M = 8.0
"""Travel at which an exploration of five objects on `FLOOR_M2` stops; a mission has no limit. Source: ours."""
FLOOR_M2 = 0.30 * 0.40
"""Floor of the world container_five."""
MAX_MOVES = 5000
"""Limit on moves. Refused moves cost no travel, so the travel budget alone would not end an exploration."""


@dataclass(frozen=True)
class Traced:
    """A candidate, the planar travel at which it (or the last part of it) was traced, and its states before."""

    travel_m: float
    candidate: Candidate
    earlier: tuple[Traced, ...] = ()


@dataclass(frozen=True)
class Explored:
    """Result of an exploration.

    Attributes:
        found: Candidates in order.
        travel_m: Planar path length of the ball.
        ended: "complete", "exhausted" or "budget".
        belief: The map at the end.
        maps: The maps before and after each sweep.
        contacts: Number of contacts of the candidates.
    """

    found: tuple[Traced, ...]
    travel_m: float
    ended: str
    belief: SearchMap
    maps: tuple[SearchMap, ...] = ()

    @property
    def contacts(self) -> int:
        """Return the contacts of all candidates."""
        return sum(len(t.candidate.contacts) for t in self.found)


def travel_budget_m(world: PlanarWorld) -> float:
    """Return the travel at which an exploration stops: in proportion to the objects or the floor, whichever is more."""
    x_m, y_m = 2 * (world.half_m + world.tip_radius_m)
    return BUDGET_M * max(float(x_m * y_m) / FLOOR_M2, len(world.sections) / 5)


class _OutOfBudget(Exception):
    """The travel budget is spent."""


def _limited(world: PlanarWorld, budget_m: float | None) -> Callable[[Move], MoveOutcome]:
    """Return the world's `execute`, which raises once the travel budget is spent."""
    moves, limit_m = count(), travel_budget_m(world) if budget_m is None else budget_m

    def execute(move: Move) -> MoveOutcome:
        if world.travel_m >= limit_m or next(moves) >= MAX_MOVES:
            raise _OutOfBudget
        return world.execute(move)

    return execute


@cache
def _defaults(skill: str) -> Any:
    """Return the default parameters of an installed skill."""
    return SkillRegistry()[skill].Params()


def explore(
    world: PlanarWorld,
    policy: SearchPolicy,
    expected: int | None,
    *,
    budget_m: float | None = None,
    left_below: float = LEFT_BELOW,
) -> Explored:
    """Run the mission's exploration on geometry alone.

    Args:
        world: The layout; its travel meter must be at 0.
        policy: Search policy.
        expected: Number of objects to find; None: unknown.
        budget_m: Travel at which it stops; None: see `travel_budget_m`.
        left_below: With an unknown number, the chance that something is left below which it stops.
    """
    sweep, orbit = _defaults("guarded_sweep"), _defaults("orbit_probe")
    half = world.half_m + world.tip_radius_m
    belief = SearchMap.blank(half - sweep.wall_gap_m, expected, left_below, (2 * float(half[0]), 2 * float(half[1])))
    maps: list[SearchMap] = []
    found: dict[int, Traced] = {}
    candidates: tuple[Candidate, ...] = ()
    execute, ended = _limited(world, budget_m), "complete"
    try:
        while not belief.complete:
            tip_K_m, radius = world.tip_K_m, world.tip_radius_m
            search = seek_next(belief, candidates, policy, tip_K_m, radius, lowered=world.lowered)
            sought, candidates = drive(search, execute)
            maps += belief, sought.belief
            belief = sought.belief
            found = _updated(found, world.travel_m, candidates)
            if sought.contact is None:
                ended = "complete" if belief.complete else "exhausted"
                break
            first = sought.contact
            plan = trace_bodies(
                belief, candidates, first, world.tip_K_m, radius, orbit.rule(), orbit.height_m, orbit.exclusion_m
            )
            admitted = drive(plan, execute)[0]
            belief, candidates = admitted.belief, admitted.candidates
            found = _updated(found, world.travel_m, candidates)
    except _OutOfBudget:
        ended = "budget"
    return Explored(tuple(found[i] for i in sorted(found)), world.travel_m, ended, belief, tuple(maps))


def _updated(found: dict[int, Traced], travel_m: float, candidates: tuple[Candidate, ...]) -> dict[int, Traced]:
    """Return the present candidates; those that changed were traced now."""
    now: dict[int, Traced] = {}
    for c in candidates:
        before = found.get(c.index)
        if before is None or before.candidate is not c:
            before = Traced(travel_m, c, () if before is None else (*before.earlier, before))
        now[c.index] = before
    return now


def refine_all(world: PlanarWorld, explored: Explored, *, budget_m: float | None = None) -> tuple[Traced, ...]:
    """Refine the candidates of an exploration; return all of them in their order.

    The least certain candidate comes first. Candidates beyond the travel budget stay unchanged.

    Args:
        world: The world after the exploration.
        explored: Result of the exploration.
        budget_m: Travel at which it stops, the exploration included; None: see `travel_budget_m`.
    """
    tracing, half = _defaults("refine_outline").rule(), explored.belief.half_extent_m
    out, execute = list(explored.found), _limited(world, budget_m)
    for i, traced in sorted(enumerate(explored.found), key=lambda item: item[1].candidate.quality):
        others = tuple(t.candidate for j, t in enumerate(out) if j != i)
        radius = world.tip_radius_m
        more = trace_more(
            traced.candidate.contacts,
            world.tip_K_m,
            radius,
            tracing,
            half_extent_m=half,
            elsewhere=partial(of_another, others, radius),
            taken=partial(taken_by, others, radius),
        )
        try:
            better = refined(traced.candidate, drive(more, execute))
        except _OutOfBudget:
            break
        if better is not None and not lost_among(traced.candidate, better, others):
            out[i] = Traced(world.travel_m, better)
    return tuple(out)
