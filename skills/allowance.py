"""Intended contact, for as long as it is intended: what may touch what, taken back however the skill ends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from glotouch_bt.motion import Arm


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
