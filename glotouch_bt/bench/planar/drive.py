"""Execute an exploration plan in a planar world."""

from __future__ import annotations

from typing import Protocol, TypeVar

from glotouch_bt.perception.search import Move, MoveOutcome, SearchPlan

T = TypeVar("T")


class Executes(Protocol):
    """Anything that executes moves."""

    def execute(self, move: Move) -> MoveOutcome:
        """Execute one move and return what was felt."""
        ...


def drive(plan: SearchPlan[T], world: Executes) -> T:
    """Execute every move of a plan; return the plan's result."""
    try:
        move = next(plan)
        while True:
            move = plan.send(world.execute(move))
    except StopIteration as done:
        result: T = done.value
        return result
