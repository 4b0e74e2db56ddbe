"""Temporary rules of the clearance scene: allowed contacts, and candidates to keep clear of.

Each is a context manager, so that a rule ends however the skill ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from glotouch_bt.motion import Arm
from glotouch_bt.perception.touch import Candidate, signed_distance
from glotouch_bt.perception.touch.outline import envelope, footprint

MIN_HEIGHT_M = 0.01
"""Least height of an obstacle, whatever height was touched."""


@contextmanager
def may_touch(arm: Arm, part: str, *obstacles: str) -> Iterator[None]:
    """Allow a part, or a group of parts, to touch obstacles of the arm's scene inside the block.

    Raises:
        UnknownName: No such part, group or obstacle.
    """
    try:
        for obstacle in obstacles:
            arm.scene.allow(part, obstacle)
        yield
    finally:
        for obstacle in obstacles:
            arm.scene.disallow(part, obstacle)


def neighbours(candidates: Iterable[Candidate], index: int) -> list[Candidate]:
    """Return the candidates to keep clear of while the hand works on the one of an index.

    Of two candidates with the centre of one inside the outline of the other, at least one outline is wrong: two
    bodies cannot overlap by that much. Such a neighbour may be the object itself and would keep the hand off it; the
    descent is guarded.
    """
    every = list(candidates)
    own = next((c for c in every if c.index == index), None)
    return [c for c in every if c.index != index and not (own and _overlap(own, c))]


def _overlap(one: Candidate, other: Candidate) -> bool:
    pairs = ((one, other), (other, one))
    return any(signed_distance(envelope(a), b.contour.centre_K_m[None])[0] < 0.0 for a, b in pairs)


@contextmanager
def keeping_clear_of(arm: Arm, candidates: Iterable[Candidate]) -> Iterator[None]:
    """Keep every motion inside the block clear of traced candidates.

    Of one whose outline is uncertain, only what was met counts: what is only presumed would keep the hand off objects
    that it can reach, and the hand moves guarded beside objects.
    """
    names: list[str] = []
    try:
        for candidate in candidates:
            names.append(f"candidate {candidate.index}")
            outline = footprint(candidate, presumed=False)
            arm.scene.add_obstacle(names[-1], outline, height_m=max(candidate.height_m, MIN_HEIGHT_M))
        yield
    finally:
        for name in names:
            if name in arm.scene.obstacles:
                arm.scene.remove_obstacle(name)
