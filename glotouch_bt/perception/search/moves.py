"""What an exploration plan asks for and what it is told: moves of the ball in the plane, and what was felt on the way.

A plan is a generator of `Move`s that is sent a `Felt` for each. It knows no robot: a skill drives it with the arm, the
planar simulator of `glotouch_bt.study` with geometry alone, so the code that is compared over thousands of layouts is
the code that explores.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from typing import Literal, TypeVar

from glotouch_bt.perception.touch import Contact
from glotouch_bt.robot import Array

T = TypeVar("T")

MoveKind = Literal["sweep", "step", "probe", "retreat", "hop"]
"""How the ball goes; speeds and guards are the driver's.

sweep    straight through unexplored space at sensing height; what opposes the motion stops it.
step     straight beside an object at sensing height; any touch stops it, a graze too.
probe    straight towards an object at sensing height; what opposes the motion stops it.
retreat  straight away from a contact just made; unguarded and short.
hop      up, across above the objects, and down again to sensing height; what it lands on stops it (`approach_K`
         is then straight down, and the ball is left standing above what it met).
"""


@dataclass(frozen=True)
class Move:
    """One straight move of the ball's centre.

    Attributes:
        kind: See `MoveKind`.
        goal_K_m: (2,) where the ball's centre shall go.
    """

    kind: MoveKind
    goal_K_m: Array


@dataclass(frozen=True)
class Felt:
    """What came of a move.

    Attributes:
        tip_K_m: (2,) where the ball's centre is now.
        path_K_m: (n, 2) where it has been AT SENSING HEIGHT during the move, in order; may be empty.
        contact: What stopped it, or None.
        refused: Why the move was not made (out of reach, in the way of a wall), or "". The ball is where it was.
    """

    tip_K_m: Array
    path_K_m: Array
    contact: Contact | None = None
    refused: str = ""


Plan = Generator[Move, Felt, T]
"""A plan that ends in a T."""
