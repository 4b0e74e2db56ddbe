"""Replays of runs: the mission of a run's folder, ticked on what its robot sensed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from glotouch_bt.mission import load_mission
from glotouch_bt.mission.execution import Outcome, TimedPauses, run_mission
from glotouch_bt.mission.record import REQUEST_DONE, Json, NullRecord, RunSummary, to_json
from glotouch_bt.report import Event, RunRecord, read_run
from glotouch_bt.robot import BadInput, Limits, RobotDescription
from glotouch_bt.robot.supervision import SupervisionLimits
from glotouch_bt.runs.replay.compare import Difference, compare_events, compare_ticks
from glotouch_bt.runs.replay.robot import Parting, RecordEnded, ReplayedRobot

NOT_THE_TREES = frozenset({"guard", "stuck", "fault", "ending"})
"""Events of what watches the run from outside, and of its end when it was stopped: no skill made them."""
UNGUARDED = SupervisionLimits(
    joint_slack_rad=1e9, speed_slack=1e9, reach_m=1e9, wrench_samples=10**9, following_m=1e9, following_rad=1e9,
    command_slack=1e9, gripper_age_s=1e9, tactile_age_s=1e9, stuck_s=1e9, late_periods=1e9, tolerated=10**9,
)  # fmt: skip
"""What was let pass then is let pass again; where a guard ended the run, its record ends."""


class _Notes(NullRecord):
    """Keeps the events and ticks of a replay."""

    def __init__(self) -> None:
        self.events: list[Event] = []
        self.ticks: list[tuple[float, str, str]] = []

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """As the recorder would write it."""
        plain = to_json(data)
        assert isinstance(plain, dict)
        self.events.append(Event(stamp_s, kind, plain))

    def tick(self, stamp_s: float, changes: Any) -> None:
        """Keep the new states."""
        self.ticks += [(stamp_s, node, str(getattr(new, "value", new))) for node, _, new in changes]


@dataclass(frozen=True)
class Replay:
    """What a replay gave.

    Attributes:
        outcome: How the replay ended.
        parted: The first command that was not the recorded one, or None.
        ended: The record ended before the replay did (as the run itself may have: it was stopped).
        compared: How many events of each kind stand in both.
        largest: Largest difference of a number in events of each kind, and where.
        differences: What is not the same, in order of time.
        statuses: (of the run, of the replay).
        cut_s: Where a record ends that was not closed (a killed run, a damaged file), or None.
    """

    outcome: Outcome
    parted: Parting | None
    ended: bool
    compared: Mapping[str, int]
    largest: Mapping[str, tuple[float, str]]
    differences: list[Difference]
    statuses: tuple[str, str]
    cut_s: float | None = None

    @property
    def same(self) -> bool:
        """Everything was found and decided as then."""
        return not self.differences


def replay(
    folder: Path,
    *,
    objects: Path | None = None,
    tolerance: float = 1e-4,
    on_progress: Callable[[float, float], None] | None = None,
) -> Replay:
    """Do a run again from its record.

    Args:
        folder: The run's folder.
        objects: Where its STL files are now, if not where they were.
        tolerance: Numbers in events (SI units) are the same within this, absolutely or relative to their size.
        on_progress: Called with (seconds done, seconds in all) of robot time.

    Raises:
        BadInput: There is no run, its record is of an older version, or its mission cannot be loaded any more.
    """
    record = read_run(folder)
    robot = replayed_robot(record)
    mission_file = record.path.parent / "mission.yaml"
    if not mission_file.is_file():
        raise BadInput(f"{folder}: its mission.yaml is missing")
    mission = load_mission(mission_file, objects=objects)
    first_s, last_s = record.span_s
    notes = _Notes()

    def progress(seconds: float, summary: RunSummary) -> None:
        if on_progress is not None:
            on_progress(seconds, last_s - first_s)

    pauses = TimedPauses(_pauses(record))
    outcome = run_mission(mission, robot, notes, on_progress=progress, control=pauses, supervision=UNGUARDED)
    ended = isinstance(outcome.error, RecordEnded)
    then_events, now_events = (
        [e for e in events if e.kind not in NOT_THE_TREES] for events in (record.events, notes.events)
    )
    differences, compared, largest = compare_events(then_events, now_events, tolerance)
    differences += compare_ticks([(t.stamp_s, t.node, t.new) for t in record.ticks], notes.ticks)
    then = str(record.result.get("status", "unknown")) if isinstance(record.result, dict) else "unknown"
    # A run that was stopped from outside ends its record in the middle of a skill; so does the replay, and rightly.
    now = then if ended and then in ("aborted", "unknown") else outcome.status
    return Replay(
        outcome,
        robot.parted,
        ended,
        compared,
        largest,
        sorted(differences, key=lambda d: d.stamp_s),
        (then, now),
        None if record.complete else last_s,
    )


def _pauses(record: RunRecord) -> list[tuple[float, float]]:
    """From when to when the run was paused; a pause that nothing ended lasts for ever."""
    ends = [e.stamp_s for e in record.of_kind("resumed")]
    spans = []
    for event in record.of_kind("pause"):
        after = [s for s in ends if s > event.stamp_s]
        spans.append((event.stamp_s, after[0] if after else float("inf")))
    return spans


def replayed_robot(record: RunRecord) -> ReplayedRobot:
    """The robot of a record.

    Raises:
        BadInput: The record does not hold what a replay needs (an older version wrote it, or nothing was sensed).
    """
    told = record.of_run("robot")
    if not isinstance(told, dict) or not len(record.cycles) or not len(record.samples):
        raise BadInput(
            f"{record.path}: no robot or nothing sensed in it: it is cut off, or an older version wrote it; no replay"
        )
    try:
        description = msgspec.convert(told["description"], RobotDescription, dec_hook=_array, strict=False)
        limits = msgspec.convert(told["limits"], Limits, strict=False)
        period_s = float(told["period_s"])
    except (KeyError, TypeError, ValueError, msgspec.ValidationError) as e:
        raise BadInput(f"{record.path}: its robot is not described as this version reads it ({e})") from e
    done = {
        int(e.data["number"]): (e.stamp_s, e.data.get("error"))
        for e in record.of_kind(REQUEST_DONE)
        if isinstance(e.data.get("number"), int)
    }
    return ReplayedRobot(description, limits, period_s, record.samples, record.cycles, record.tactile, done)


def _array(_: object, value: Json) -> np.ndarray[Any, Any]:
    return np.asarray(value, dtype=np.float64)
