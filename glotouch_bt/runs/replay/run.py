"""Replay a run: tick its mission on the recorded observations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from glotouch_bt.mission import Mission, load_mission
from glotouch_bt.mission.checkpoint import UNFIT
from glotouch_bt.mission.execution import Outcome, TimedPauses, run_mission
from glotouch_bt.mission.record import REQUEST_DONE, Json, NullRecord, RunSummary, to_json
from glotouch_bt.report import RecordedEvent, RunRecord, read_run
from glotouch_bt.robot import BadInput, Limits, RobotDescription
from glotouch_bt.robot.supervision import SupervisionLimits
from glotouch_bt.runs.folder import require_run_folder
from glotouch_bt.runs.replay.compare import ReplayDifference, compare_events, compare_ticks
from glotouch_bt.runs.replay.robot import Divergence, RecordEnded, ReplayedRobot

EXTERNAL_EVENTS = frozenset({"guard", "stuck", "fault", "ending"})
"""Events that no skill makes: those of the supervision, the watchdog, fault injection and the safe stop."""
NO_LIMITS = SupervisionLimits(
    joint_slack_rad=1e9, speed_slack=1e9, reach_m=1e9, wrench_samples=10**9, following_m=1e9, following_rad=1e9,
    command_slack=1e9, gripper_age_s=1e9, tactile_age_s=1e9, stuck_s=1e9, late_periods=1e9, tolerated=10**9,
)  # fmt: skip
"""Limits that nothing exceeds. Where a guard aborted the run, its record ends anyway."""


class _ReplayLog(NullRecord):
    """Stores the events and ticks of a replay."""

    def __init__(self) -> None:
        self.events: list[RecordedEvent] = []
        self.ticks: list[tuple[float, str, str]] = []

    def event(self, kind: str, stamp_s: float, data: Mapping[str, object]) -> None:
        """Store it as the recorder would write it."""
        plain = to_json(data)
        assert isinstance(plain, dict)
        self.events.append(RecordedEvent(stamp_s, kind, plain))

    def tick(self, stamp_s: float, changes: Any) -> None:
        """Store the new states."""
        self.ticks += [(stamp_s, node, str(getattr(new, "value", new))) for node, _, new in changes]


@dataclass(frozen=True)
class Replay:
    """The result of a replay.

    Attributes:
        outcome: Outcome of the replay.
        divergence: The first command that differs from the recorded one, or None.
        ended: The record ended before the replay, for example because the run was stopped.
        compared: Number of compared events, by kind.
        largest: Largest numeric difference and its place, by kind.
        differences: Differences in order of time.
        statuses: (of the run, of the replay).
        cut_s: Robot clock at the end of an incomplete record (a killed run, a damaged file), or None.
    """

    outcome: Outcome
    divergence: Divergence | None
    ended: bool
    compared: Mapping[str, int]
    largest: Mapping[str, tuple[float, str]]
    differences: list[ReplayDifference]
    statuses: tuple[str, str]
    cut_s: float | None = None

    @property
    def same(self) -> bool:
        """True if there is no difference, and the replay ends as the run did, as far as its end is recorded."""
        then, now = self.statuses
        return not self.differences and then in (now, "unknown")


def replay(
    folder: Path,
    *,
    objects: Path | None = None,
    tolerance: float = 1e-4,
    on_progress: Callable[[float, float], None] | None = None,
) -> Replay:
    """Replay a run from its record.

    Args:
        folder: The run's folder.
        objects: Folder of its STL files, if they have moved.
        tolerance: Absolute (SI units) or relative tolerance of equal numbers in events.
        on_progress: Called with (seconds done, total seconds) of robot time.

    Raises:
        BadInput: There is no run, its record is of an older version, or its mission cannot be loaded.
    """
    require_run_folder(folder)
    record = read_run(folder)
    robot = replayed_robot(record)
    if not record.ticks:
        raise BadInput(f"{record.path}: it holds no tick of the tree, so there is nothing to compare")
    mission_file = record.path.parent / "mission.yaml"
    if not mission_file.is_file():
        raise BadInput(f"{folder}: its mission.yaml is missing")
    mission = load_mission(mission_file, objects=objects)
    with unfit_as_bad_input(record):
        return _replay(record, robot, mission, tolerance, on_progress)


def _replay(
    record: RunRecord,
    robot: ReplayedRobot,
    mission: Mission,
    tolerance: float,
    on_progress: Callable[[float, float], None] | None,
) -> Replay:
    first_s, last_s = record.span_s
    log = _ReplayLog()

    def progress(seconds: float, summary: RunSummary) -> None:
        if on_progress is not None:
            on_progress(seconds, last_s - first_s)

    pauses = TimedPauses(_pauses(record))
    outcome = run_mission(mission, robot, log, on_progress=progress, control=pauses, guard_limits=NO_LIMITS)
    ended = isinstance(outcome.error, RecordEnded)
    then_events, now_events = (
        [e for e in events if e.kind not in EXTERNAL_EVENTS] for events in (record.events, log.events)
    )
    differences, compared, largest = compare_events(then_events, now_events, tolerance)
    differences += compare_ticks([(t.stamp_s, t.node, t.new) for t in record.ticks], log.ticks)
    then = str(record.result.get("status", "unknown")) if isinstance(record.result, dict) else "unknown"
    # The record of an aborted run ends inside a skill; its replay ends there, too.
    now = then if ended and then in ("aborted", "unknown") else outcome.status
    return Replay(
        outcome,
        robot.divergence,
        ended,
        compared,
        largest,
        sorted(differences, key=lambda d: d.stamp_s),
        (then, now),
        None if record.complete else last_s,
    )


@contextmanager
def unfit_as_bad_input(record: RunRecord) -> Iterator[None]:
    """Turn errors that only data of a wrong structure raise into a `BadInput`; a tick's own errors do not get here."""
    try:
        yield
    except UNFIT as e:
        raise BadInput(
            f"{record.path}: cannot be replayed ({type(e).__name__}: {e}): it is damaged or of another version"
        ) from e


def _pauses(record: RunRecord) -> list[tuple[float, float]]:
    """Return (start, end) of each pause of the run; a pause without an end lasts for ever."""
    ends = [e.stamp_s for e in record.of_kind("resumed")]
    spans = []
    for event in record.of_kind("pause"):
        after = [s for s in ends if s > event.stamp_s]
        spans.append((event.stamp_s, after[0] if after else float("inf")))
    return spans


def replayed_robot(record: RunRecord) -> ReplayedRobot:
    """Return a robot that replays a record.

    Raises:
        BadInput: The record has no robot description or no observations.
    """
    robot = record.of_run("robot")
    if not isinstance(robot, dict) or not len(record.cycles) or not len(record.samples):
        raise BadInput(
            f"{record.path}: it has no robot description or no observations: it is cut off or of an older version"
        )
    try:
        description = msgspec.convert(robot["description"], RobotDescription, dec_hook=_array, strict=False)
        limits = msgspec.convert(robot["limits"], Limits, strict=False)
        period_s = float(robot["period_s"])
    except (KeyError, TypeError, ValueError, msgspec.ValidationError) as e:
        raise BadInput(f"{record.path}: its robot description is of an unknown version ({e})") from e
    if not 1e-4 <= period_s <= 1.0:
        raise BadInput(f"{record.path}: its control period is {period_s} s, outside of 0.0001 .. 1 s")
    done = {
        int(e.data["number"]): (e.stamp_s, None if e.data.get("error") is None else str(e.data["error"]))
        for e in record.of_kind(REQUEST_DONE)
        if isinstance(e.data.get("number"), int)
    }
    try:
        return ReplayedRobot(
            description, limits, period_s, record.samples, record.cycles, record.tactile, record.images,
            record.image_requests, done,
        )  # fmt: skip
    except BadInput as e:
        raise BadInput(f"{record.path}: {e}: it is damaged or of an older version") from e


def _array(_: object, value: Json) -> np.ndarray[Any, Any]:
    return np.asarray(value, dtype=np.float64)
