"""Temporary rules of the clearance scene: allowed contacts, and candidates to keep clear of.

Each is a context manager, so that a rule ends however the skill ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from glotouch_bt.motion import Arm
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.perception.touch.outline import envelope

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


@contextmanager
def keeping_clear_of(arm: Arm, candidates: Iterable[Candidate]) -> Iterator[None]:
    """Keep every motion inside the block clear of traced candidates."""
    names: list[str] = []
    try:
        for candidate in candidates:
            hull = envelope(candidate)
            names.append(f"candidate {candidate.index}")
            arm.scene.add_obstacle(
                names[-1],
                hull.kind,
                centre_K_m=hull.centre_K_m,
                size_m=hull.size_m,
                height_m=max(candidate.height_m, MIN_HEIGHT_M),
                yaw_rad=hull.yaw_rad,
            )
        yield
    finally:
        for name in names:
            if name in arm.scene.obstacles:
                arm.scene.remove_obstacle(name)
