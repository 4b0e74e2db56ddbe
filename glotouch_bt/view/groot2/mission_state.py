"""The status of each node and the blackboard of a mission, from its record, as the protocol of Groot2 wants them."""

from __future__ import annotations

import math
import struct
from bisect import bisect_right
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from glotouch_bt.mission.export import MonitoredTree
from glotouch_bt.mission.nodes import btcpp_name
from glotouch_bt.report import TREE_TOPICS, PortWrite, RunRecord, Tick
from glotouch_bt.view.follow import RecordFollower

_IDLE = 0
_CODES = {"RUNNING": 1, "SUCCESS": 2, "FAILURE": 3}
"""Status of a node. Source: BehaviorTree.CPP 4.10, `NodeStatus` in basic_types.h."""
_IDLE_FROM = 10
"""Added to the last status of a node that is idle again. Source: BehaviorTree.CPP 4.10, groot2_publisher.cpp."""
_STATUS = struct.Struct("<HB")
"""Number and status of a node. Source: as above."""
EPSILON_S = 1e-9
"""Tolerance of a comparison of stamps."""

T = TypeVar("T", Tick, PortWrite)


class MissionState:
    """The state of a mission, read from its record as it grows.

    Args:
        folder: The run's folder; the record may not exist yet.
        tree: The mission's tree.
        clock: Returns the robot clock (s) at which the mission is shown; default: always its newest entry.
    """

    def __init__(self, folder: Path, tree: MonitoredTree, clock: Callable[[], float] = lambda: math.inf) -> None:
        self.tree = tree
        self._clock = clock
        self._follower = RecordFollower(folder, (TREE_TOPICS,))

    def update(self) -> None:
        """Read what is new.

        Raises:
            BadInput: The record is broken.
        """
        self._follower.read()

    def statuses(self) -> bytes:
        """Return the status of every node: three bytes each, in the order of their numbers."""
        codes = dict.fromkeys(self.tree.uids.values(), _IDLE)
        for tick in self._until_now(lambda record: record.ticks):
            uid = self.tree.uids.get(tick.node)
            if uid is not None:
                last = _CODES.get(tick.old)
                codes[uid] = _CODES.get(tick.new, _IDLE if last is None else _IDLE_FROM + last)
        return b"".join(_STATUS.pack(uid, code) for uid, code in codes.items())

    def blackboard(self, names: Sequence[str]) -> dict[str, Any] | None:
        """Return the blackboards of these names, each as a mapping from key to value; None if there is none of them."""
        if self.tree.name not in names:
            return None
        return {self.tree.name: {btcpp_name(p.key): p.value for p in self._until_now(lambda record: record.ports)}}

    def _until_now(self, entries: Callable[[RunRecord], list[T]]) -> list[T]:
        """Return the entries of the record up to the time that is shown."""
        if self._follower.reader is None:
            return []
        found, now_s = entries(self._follower.reader.record), self._clock() + EPSILON_S
        return found[: bisect_right(found, now_s, key=lambda entry: entry.stamp_s)]

    def close(self) -> None:
        """Close the record."""
        self._follower.close()
