"""Interface of an exploration plan: a generator that yields a `Move` and receives its `MoveOutcome`.

A plan knows no robot. A skill drives it with the arm and `glotouch_bt.bench.planar` with geometry alone, so the
benchmarked code is the code that explores.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Literal, TypeVar

from glotouch_bt.perception.touch import Contact
from glotouch_bt.robot import Array

T = TypeVar("T")

MoveKind = Literal["sweep", "step", "probe", "retreat", "hop"]
"""Kind of motion; the driver chooses speeds and guards.

sweep    straight through unexplored space at sensing height; an opposing force stops it.
step     straight beside an object at sensing height; any contact stops it.
probe    straight towards an object at sensing height; an opposing force stops it.
retreat  straight away from the last contact; unguarded and short.
hop      up, across above the objects, and down to sensing height; a contact from above stops it (`approach_K` points
         down then, and the ball stays above the object).
"""


@dataclass(frozen=True)
class Move:
    """One straight move of the ball's centre.

    Attributes:
        kind: See `MoveKind`.
        goal_K_m: (2,) goal of the ball's centre.
    """

    kind: MoveKind
    goal_K_m: Array


@dataclass(frozen=True)
class MoveOutcome:
    """Outcome of a move.

    Attributes:
        tip_K_m: (2,) position of the ball's centre after the move.
        path_K_m: (n, 2) its positions AT SENSING HEIGHT during the move, in order; may be empty.
        contact: Contact that stopped the move, or None.
        refused: Reason why the move was not executed (reach, clearance), or "".
    """

    tip_K_m: Array
    path_K_m: Array
    contact: Contact | None = None
    refused: str = ""


SearchPlan = Generator[Move, MoveOutcome, T]
"""An exploration plan that returns a T."""
