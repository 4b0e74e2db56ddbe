"""What the scene is told for as long as it holds: intended contact, and objects to keep clear of; taken back however a
skill ends."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from glotouch_bt.motion import Arm
from glotouch_bt.perception.touch import Candidate
from glotouch_bt.perception.touch.outline import envelope

MIN_HEIGHT_M = 0.01
"""An obstacle is at least this high, whatever its top touch said."""


@contextmanager
def may_touch(arm: Arm, part: str, *obstacles: str) -> Iterator[None]:
    """Let a part, or a group of parts, touch obstacles of the arm's scene inside the block.

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
    """Have every motion inside the block keep clear of traced candidates."""
    names: list[str] = []
    try:
        for candidate in candidates:
            room = envelope(candidate)
            names.append(f"candidate {candidate.index}")
            arm.scene.add_obstacle(
                names[-1],
                room.kind,
                centre_K_m=room.centre_K_m,
                size_m=room.size_m,
                height_m=max(candidate.height_m, MIN_HEIGHT_M),
                yaw_rad=room.yaw_rad,
            )
        yield
    finally:
        for name in names:
            if name in arm.scene.obstacles:
                arm.scene.remove_obstacle(name)
