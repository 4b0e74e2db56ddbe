"""The content of a record as it grows, and the state of its mission at any time: the one source of all views.

Pure: it reads messages of a record and returns `SceneState`; it knows no page and no robot.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import Generic, TypeVar

import numpy as np

from glotouch_bt.mission.record import HIDDEN_EVENTS
from glotouch_bt.report.run_record import RecordedEvent, RecordReader, RunRecord
from glotouch_bt.report.state import parse
from glotouch_bt.report.state.tree import tree_order
from glotouch_bt.report.state.values import (
    CandidateOutline,
    FeltPatch,
    FittedTarget,
    LogLine,
    OutlineState,
    Phase,
    PlannedGrasp,
    SceneState,
    Share,
    TouchPoint,
)
from glotouch_bt.robot import Array, Pose

T = TypeVar("T")

PADS_S = 0.5
"""Age at which depth maps are no longer shown. Source: ours; pads send 60 maps a second while a skill asks for them."""
EPSILON_S = 1e-9
"""Tolerance of a comparison of stamps."""
SAMPLES_A_PERIOD = 10
"""Samples in a control period of 10 ms."""
LOG_LINES = 200
"""Events in the log of a state."""
DEFAULT_PAD_WINDOW_M = (0.017, 0.028)
"""Size of a pad along x_P and z_P if the record has none. Source: the shipped gripper, rounded."""
_PHASES: dict[str, Phase] = {"pause": "pausing", "paused": "paused", "resumed": "running"}
RESULTS = frozenset({"SUCCESS", "FAILURE"})
"""Status of a node that has ended. It stays in view when the node is reset, until it runs again."""
PROBE_LOST_CODES = frozenset({"tool_lost", "no_probe"})
"""Codes of failures that say that the probe is neither in the jaws nor in its holder."""
NEAR_S = 1.0
"""A node that failed within this time of a mark needs none of its own."""
MARKS = frozenset({"failure", "guard", "fault", "stuck", "ending"})
"""Events that a person jumps to."""


MAX_KEPT = 2**16
"""Rows that are kept, so that the view of a long mission stays small: 11 minutes at one row in 10 ms."""


class GrowingRows:
    """Rows of numbers that are appended; at most `MAX_KEPT` rows are kept, at a uniform spacing.

    When there would be more, each two neighbours become one, and later rows are merged to the same, doubled spacing.
    The last row may stand for fewer rows than the others: the newest numbers are always there.

    Args:
        width: Numbers in a row.
        peak: Column of which a merged row has the largest number; of the others it has the latest.
    """

    def __init__(self, width: int, peak: int | None = None) -> None:
        self._data = np.zeros((256, width))
        self._count = self._appended = 0
        self._stride = 1  # appended rows in a kept row
        self._peak = peak

    def append(self, rows: Array) -> None:
        """Append rows (n, width)."""
        if not len(rows):
            return
        begun = int(self._appended % self._stride > 0)  # the last row stands for less than a stride: it is merged on
        kept = self._count - begun
        new = self._merged(np.concatenate([self._data[kept : self._count], rows]), self._appended - begun, self._stride)
        self._appended += len(rows)
        needed = kept + len(new)
        if needed > len(self._data):
            bigger = np.zeros((max(needed, 2 * len(self._data)), self._data.shape[1]))
            bigger[:kept] = self._data[:kept]
            self._data = bigger
        self._data[kept:needed] = new
        self._count = needed
        while self._count > MAX_KEPT:
            halved = self._merged(self.rows, 0, 2)
            self._count, self._stride = len(halved), 2 * self._stride
            self._data[: self._count] = halved

    def _merged(self, rows: Array, index: int, stride: int) -> Array:
        """Return one row for each `stride` rows; `index` is the number of rows before the first one."""
        starts = np.append(0, np.arange(stride - index % stride, len(rows), stride))
        merged: Array = rows[np.append(starts[1:], len(rows)) - 1]
        if self._peak is not None:
            merged[:, self._peak] = np.maximum.reduceat(rows[:, self._peak], starts)
        return merged

    @property
    def rows(self) -> Array:
        """The kept rows (n, width); a view, which the next `append` may change."""
        return self._data[: self._count]

    def at(self, t_s: float) -> Array | None:
        """Return a copy of the last row whose first number is not after `t_s`, or None."""
        i = int(np.searchsorted(self.rows[:, 0], t_s + EPSILON_S, side="right")) - 1
        return self.rows[i].copy() if i >= 0 else None


class Stamped(Generic[T]):
    """Values in the order of their stamps."""

    def __init__(self) -> None:
        self.stamps: list[float] = []
        self.values: list[T] = []

    def add(self, stamp_s: float, value: T) -> None:
        """Add a value behind those that are not later."""
        at = bisect_right(self.stamps, stamp_s)
        self.stamps.insert(at, stamp_s)
        self.values.insert(at, value)

    def until(self, t_s: float) -> list[T]:
        """Return all values not after `t_s`."""
        return self.values[: bisect_right(self.stamps, t_s + EPSILON_S)]

    def last(self, t_s: float) -> T | None:
        """Return the last value not after `t_s`, or None."""
        found = bisect_right(self.stamps, t_s + EPSILON_S)
        return self.values[found - 1] if found else None


class RunModel:
    """A record, read as far as it was written.

    Args:
        planned: Paths of all nodes of its mission, parents first, if they are known.

    Attributes:
        record: Its description, result, events and ticks.
        motion: Rows (stamp_s, wrist force N, q ...), one for each control period, fewer in a long mission; the force
            is the largest norm since the row before. None before the first.
        jaws: Rows (stamp_s, aperture m, force N), as often.
        log: All events in words.
        marks: The events that a person jumps to.
    """

    def __init__(self, planned: Sequence[str] = ()) -> None:
        self.record: RunRecord | None = None
        self.motion: GrowingRows | None = None
        self.jaws = GrowingRows(3)
        self.log: Stamped[LogLine] = Stamped()
        self.marks: Stamped[LogLine] = Stamped()
        self._pads: Stamped[tuple[Array, Array]] = Stamped()
        self._touches: Stamped[TouchPoint] = Stamped()
        self._outlines: Stamped[CandidateOutline] = Stamped()
        self._patches: Stamped[FeltPatch] = Stamped()
        self._states: Stamped[dict[int, OutlineState]] = Stamped()
        self._shares: Stamped[tuple[Share, ...]] = Stamped()
        self._grasps: Stamped[PlannedGrasp | None] = Stamped()
        self._fits: Stamped[FittedTarget | None] = Stamped()
        self._tips: Stamped[float | None] = Stamped()
        self._lost: Stamped[bool] = Stamped()
        self._phases: Stamped[Phase] = Stamped()
        self._planned = set(planned)
        self._order: list[str] = list(planned)
        self._events_read = self._ticks_read = 0
        self._start_s, self._end_s = np.inf, -np.inf

    @property
    def span_s(self) -> tuple[float, float]:
        """Robot clock of the first and the last entry; (0, 0) if there is none."""
        return (float(self._start_s), float(self._end_s)) if self._start_s <= self._end_s else (0.0, 0.0)

    @property
    def ended(self) -> bool:
        """True if the record is complete."""
        return self.record is not None and self.record.complete

    @property
    def touch_stamps_s(self) -> list[float]:
        """Robot clock of each contact event."""
        return self._touches.stamps

    @property
    def pose_B_K(self) -> Pose:
        """The registered container frame in B; the identity if the record has none."""
        return (self.record.pose_B_K if self.record else None) or Pose(np.zeros(3))

    @property
    def window_m(self) -> tuple[float, float]:
        """Size of a pad along x_P and z_P."""
        try:
            window = self.record.of_run("robot", "description", "gripper", "pad_window_m") if self.record else None
            x, z = parse.vector(window, 2).tolist()
        except parse.MALFORMED:
            return DEFAULT_PAD_WINDOW_M
        return x, z

    @classmethod
    def of(cls, record: RunRecord) -> RunModel:
        """Return the model of a whole record, without its depth maps."""
        model = cls()
        if len(record.samples.get("stamp_s", ())):
            model._samples(record.samples)
        if len(record.cycles.get("stamp_s", ())):
            model._cycles(record.cycles)
        model._entries(record)
        return model

    def feed(self, reader: RecordReader) -> None:
        """Take over what a reader has read since the last call; its packed parts and its events are taken out."""
        for parts, take in ((reader.packed["samples"], self._samples), (reader.packed["cycles"], self._cycles)):
            while parts:
                take(parts.pop(0))
        while reader.packed["tactile"]:
            part = reader.packed["tactile"].pop(0)
            for stamp_s, left, right in zip(part["arrived_s"], part["left_m"], part["right_m"], strict=True):
                self._pads.add(float(stamp_s), (left.astype(np.float16), right.astype(np.float16)))
        reader.packed["images"].clear()
        reader.packed["image_requests"].clear()
        self._entries(reader.record)
        reader.record.events.clear()
        self._events_read = 0

    def _entries(self, record: RunRecord) -> None:
        """Take over the events and ticks of a record since the last call."""
        self.record = record
        for event in record.events[self._events_read :]:
            self._saw(event.stamp_s)
            self._event(event)
        self._events_read = len(record.events)
        ticks = record.ticks[self._ticks_read :]
        self._ticks_read = len(record.ticks)
        for tick in ticks:
            self._saw(tick.stamp_s)
        if record.complete:
            self._mark_failed(record)
        known = set(self._order)
        new = dict.fromkeys(t.node for t in ticks if t.node not in known)
        if new:
            self._order = tree_order([*self._order, *new])

    def state_at(self, t_s: float) -> SceneState:
        """Return the state of the mission at a robot clock."""
        row = self.motion.at(t_s) if self.motion is not None else None
        jaw = self.jaws.at(t_s)
        q = None if row is None or not np.isfinite(row[2:]).all() else row[2:]
        shares = self._shares.last(t_s) or ()
        return SceneState(
            t_s=t_s,
            phase=self._phase(t_s, row is not None),
            q=q,
            force_N=0.0 if row is None else float(row[1]),
            aperture_m=0.0 if jaw is None else float(jaw[1]),
            jaw_force_N=0.0 if jaw is None else float(jaw[2]),
            tip_m=self._tips.last(t_s),
            probe_lost=self._lost.last(t_s) or False,
            touches=tuple(self._touches.until(t_s)),
            patches=tuple(self._patches.until(t_s)),
            outlines=tuple({o.index: o for o in self._outlines.until(t_s)}.values()),
            states=self._candidate_states(t_s, shares),
            shares=shares,
            grasp=self._grasps.last(t_s),
            fit=self._fits.last(t_s),
            pads=self._pads_at(t_s),
            nodes=self._nodes(t_s),
            log=tuple(self.log.until(t_s)[-LOG_LINES:]),
        )

    def _phase(self, t_s: float, begun: bool) -> Phase:
        if self.ended and t_s >= self.span_s[1] - EPSILON_S:
            return "ended"
        return self._phases.last(t_s) or ("running" if begun else "waiting")

    def _candidate_states(self, t_s: float, shares: tuple[Share, ...]) -> dict[int, OutlineState]:
        states: dict[int, OutlineState] = {o.index: "found" for o in self._outlines.until(t_s)}
        best = next((s.index for s in shares if s.index is not None), None)
        if best is not None:
            states[best] = "best"
        return states | (self._states.last(t_s) or {})

    def _pads_at(self, t_s: float) -> tuple[Array, Array] | None:
        at = bisect_right(self._pads.stamps, t_s + EPSILON_S) - 1
        return self._pads.values[at] if at >= 0 and t_s - self._pads.stamps[at] <= PADS_S else None

    def _nodes(self, t_s: float) -> dict[str, str]:
        now: dict[str, str] = {}
        for tick in self.record.ticks if self.record is not None else ():
            if tick.stamp_s > t_s + EPSILON_S:
                break
            if tick.new != "INVALID" or now.get(tick.node) not in RESULTS:
                now[tick.node] = tick.new
        return {node: now.get(node, "") for node in self._order if node in now or node in self._planned}

    def _saw(self, stamp_s: float) -> None:
        self._start_s, self._end_s = min(self._start_s, stamp_s), max(self._end_s, stamp_s)

    def _samples(self, part: dict[str, Array]) -> None:
        """Keep the newest sample of each control period, and the largest force in it."""
        last = np.arange(len(part["stamp_s"]) - 1, -1, -SAMPLES_A_PERIOD)[::-1]
        first = np.maximum(last - SAMPLES_A_PERIOD + 1, 0)
        force = np.maximum.reduceat(np.nan_to_num(np.linalg.norm(part["force_S_N"], axis=1)), first)
        if self.motion is None:
            self.motion = GrowingRows(2 + part["q"].shape[1], peak=1)
        self.motion.append(np.column_stack([part["stamp_s"][last], force, part["q"][last]]))
        self._saw(float(part["stamp_s"][0]))
        self._saw(float(part["stamp_s"][-1]))

    def _cycles(self, part: dict[str, Array]) -> None:
        names = ("stamp_s", "gripper_aperture_m", "gripper_force_N")
        self.jaws.append(np.nan_to_num(np.column_stack([part[n] for n in names])))

    def _event(self, event: RecordedEvent) -> None:
        kind, stamp_s, data = event.kind, event.stamp_s, event.data
        if kind not in HIDDEN_EVENTS:
            self.log.add(stamp_s, parse.log_line(event))
        if kind in MARKS:
            self.marks.add(stamp_s, parse.log_line(event))
        if kind == "contact" and (touch := parse.touch_of(event)):
            self._touches.add(stamp_s, touch)
        if kind in ("candidate", "touchset") and (outline := parse.outline_of(event)):
            self._outlines.add(stamp_s, outline)
        if kind == "touchset":
            for patch in parse.patches_of(event, self.window_m):
                self._patches.add(stamp_s, patch)
        if shares := parse.shares_of(event):
            self._shares.add(stamp_s, shares)
        if kind == "plan" and (grasp := parse.grasp_of(event)):
            self._grasps.add(stamp_s, grasp)
        if kind == "ranking":
            self._fits.add(stamp_s, parse.fit_of(event))
        if kind == "tool":
            length = data.get("grasp_to_tip_m") if data.get("held") else None
            self._tips.add(stamp_s, float(length) if isinstance(length, int | float) else None)
            self._lost.add(stamp_s, False)
        if kind == "failure" and data.get("code") in PROBE_LOST_CODES:
            self._lost.add(stamp_s, True)
        if phase := _PHASES.get(kind):
            self._phases.add(stamp_s, phase)
        self._judge(event)

    def _mark_failed(self, record: RunRecord) -> None:
        """Mark where the node failed at which the mission ended: a condition that is false is no event."""
        reasons = record.result.get("reasons")
        node, _, text = str(reasons[-1] if isinstance(reasons, list) and reasons else "").partition(": ")
        failed = [t.stamp_s for t in record.ticks if t.new == "FAILURE" and f"/{t.node}".endswith(f"/{node}")]
        if failed and not any(abs(failed[-1] - stamp_s) < NEAR_S for stamp_s in self.marks.stamps):
            line = LogLine(failed[-1], "failed", f"{node.rsplit('/', 1)[-1]}: {text}", "bad")
            self.marks.add(failed[-1], line)
            self.log.add(failed[-1], line)

    def _judge(self, event: RecordedEvent) -> None:
        """Note which candidates an event excludes, rejects, lifts or puts back."""
        before = self._states.last(event.stamp_s) or {}
        states = dict(before)
        if isinstance(excluded := event.data.get("excluded"), list):
            states = {i: s for i, s in states.items() if s != "excluded"}
            states |= {i: "excluded" for i in excluded if isinstance(i, int) and i not in states}
        candidate = event.data.get("candidate")
        if event.kind == "reject" and isinstance(candidate, int):
            states[candidate] = "rejected"
        elif event.kind == "forgotten" and isinstance(forgotten := event.data.get("candidates"), list):
            states |= dict.fromkeys((i for i in forgotten if isinstance(i, int)), "rejected")
        elif event.kind in ("lift", "put_back"):
            grasp = self._grasps.last(event.stamp_s)
            if event.kind == "lift" and grasp is not None:
                states[grasp.candidate] = "taken"
            elif event.kind == "put_back":
                states = {i: s for i, s in states.items() if s != "taken"}
            self._grasps.add(event.stamp_s, None)
            self._fits.add(event.stamp_s, None)
        if states != before:
            self._states.add(event.stamp_s, states)
