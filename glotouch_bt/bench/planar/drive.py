"""Drive an exploration plan through a planar world."""

from __future__ import annotations

from typing import Protocol, TypeVar

from glotouch_bt.perception.search import Felt, Move, Plan

T = TypeVar("T")


class Executes(Protocol):
    """Anything that makes moves."""

    def execute(self, move: Move) -> Felt:
        """Make one move and say what came of it."""
        ...


def drive(plan: Plan[T], world: Executes) -> T:
    """Make every move the plan asks for; what the plan returns."""
    try:
        move = next(plan)
        while True:
            move = plan.send(world.execute(move))
    except StopIteration as done:
        result: T = done.value
        return result
