"""Score pushes and clearings of one run: where each object stands in the map and in truth, and whether it stands."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from glotouch_bt.bench.planar import FeltSection
from glotouch_bt.bench.search import AGAIN, Found, TrueLayout, assign, true_layout
from glotouch_bt.report import RecordedEvent, RunRecord
from glotouch_bt.robot import Array, BadInput, Pose

TOPPLED_DEG = 30.0
"""Least tilt against its first pose at which an object counts as toppled. Source: ours."""
ENDED = {"nudge": "pushed", "clear": "set down"}
"""How the `candidate` event of each act says that the object was moved."""
OBJECT = re.compile(r"/object (\d+)$")
"""End of the path of the node that moves one object."""


@dataclass(frozen=True)
class Window:
    """Time in which one object was to be moved.

    Attributes:
        index: Index of the candidate.
        begin_s, end_s: Robot clock.
    """

    index: int
    begin_s: float
    end_s: float


def windows(record: RunRecord) -> list[Window]:
    """Return the time of each act, in order; one that did not end lasts to the end of the record."""
    begun: dict[int, float] = {}
    ended: dict[int, float] = {}
    for tick in record.ticks:
        found = OBJECT.search(tick.node)
        if found and tick.new == "RUNNING":
            begun.setdefault(int(found[1]), tick.stamp_s)
        elif found:
            ended[int(found[1])] = tick.stamp_s
    return [Window(k, begin, ended.get(k, record.span_s[1])) for k, begin in sorted(begun.items(), key=lambda b: b[1])]


def score(
    record: RunRecord, sections: Mapping[str, FeltSection], act: str, objects_at: Callable[[float], Any]
) -> list[dict[str, Any]]:
    """Return one row for each act of a run.

    Tilts compare the world before the first act with the end of the run: what a later act topples counts, too.

    Args:
        record: The run, with its truth.
        sections: Probe sections of the objects by name.
        act: `nudge` or `clear`.
        objects_at: Returns the true objects at a time of the robot clock, as a list of truth.json.

    Raises:
        BadInput: The record has no truth.
    """
    pose_B_K = record.pose_B_K
    if record.truth is None or pose_B_K is None:
        raise BadInput(f"{record.path}: no truth is written beside this record; only a simulation can be scored")
    places, acts = record.of_kind("candidate"), windows(record)
    if not acts:
        return []
    first = objects_at(acts[0].begin_s)

    def layout_of(objects: Any) -> TrueLayout:
        return true_layout({"start": first, "end": objects}, pose_B_K, dict(sections))

    whose = owners(places, layout_of(record.truth["start"]), acts[0].begin_s)
    rows = []
    for window in acts:
        row = _act(record, window, act)
        thing = whose.get(window.index)
        if thing is not None:
            before, after = (objects_at(t) for t in (window.begin_s, window.end_s))
            there, then, finally_ = (layout_of(o).centres_K_m[thing] for o in (before, after, record.truth["end"]))
            row |= {
                "object": first[thing]["name"],
                "position_error_mm": _off_mm(places, window.index, window.end_s, then),
                "error_before_mm": _off_mm(places, window.index, window.begin_s, there),
                "error_at_end_mm": _off_mm(places, window.index, np.inf, finally_),
                "moved_mm": 1e3 * float(np.linalg.norm(then - there)),
                "tilt_deg": tilt_deg(first[thing], record.truth["end"][thing]),
                "fallen_before": tilt_deg(record.truth["start"][thing], first[thing]) >= TOPPLED_DEG,
                "peak_N": _peak_N(record, window),
            }
            row["toppled"] = row["tilt_deg"] >= TOPPLED_DEG and not row["fallen_before"]
        rows.append(row)
    return rows


def _off_mm(places: Sequence[RecordedEvent], index: int, at_s: float, true_K_m: Array) -> float:
    """Return the distance of a candidate's place in the map, at a time, from the true one."""
    known = [e.data["candidate"] for e in places if e.data["candidate"]["index"] == index and e.stamp_s <= at_s]
    return 1e3 * float(np.linalg.norm(np.array(known[-1]["contour"]["centre_K_m"], dtype=np.float64) - true_K_m))


def owners(places: Sequence[RecordedEvent], layout: TrueLayout, until_s: float) -> dict[int, int]:
    """Return the true object of each candidate: the nearest at the start of the run, before any act."""
    traced: dict[int, Any] = {}
    for event in places:
        if event.stamp_s <= until_s:
            traced[int(event.data["candidate"]["index"])] = event.data["candidate"]["contour"]
    found = [Found(0.0, np.array(c["centre_K_m"]), c["kind"], float(c["yaw_rad"])) for c in traced.values()]
    whose = assign(found, replace(layout, after=layout.before))
    return {k: i for k, i in zip(traced, whose, strict=True) if i is not None}


def _act(record: RunRecord, window: Window, act: str) -> dict[str, Any]:
    """Return what the record says about one act."""
    events = [e for e in record.events if window.begin_s < e.stamp_s <= window.end_s]
    failures = [e for e in events if e.kind == "failure"]
    last = max((e.stamp_s for e in events if e.kind == "candidate" and e.data.get("ended") == ENDED[act]), default=None)
    later = [e for e in failures if last is not None and e.stamp_s >= last]
    done = last is not None and not later
    return {
        "candidate": window.index,
        "object": "",
        "tried": last is not None or any(e.kind in ("nudge", "grasp") for e in events),
        "done": done,
        "cause": "" if done else _cause(failures),
        "duration_s": window.end_s - window.begin_s,
    }


def _cause(failures: Sequence[RecordedEvent]) -> str:
    """Return skill and code of the last failure of an act."""
    named = [f"{AGAIN.sub('', str(e.data.get('node', '')))}: {e.data.get('code', '')}" for e in failures]
    return named[-1] if named else "not reached"


def _peak_N(record: RunRecord, window: Window) -> float | None:
    """Return the largest norm of the wrist's force during an act."""
    stamps = record.samples.get("stamp_s", np.zeros(0))
    inside = (stamps >= window.begin_s) & (stamps <= window.end_s)
    forces = record.samples.get("force_S_N")
    return float(np.linalg.norm(forces[inside], axis=1).max()) if forces is not None and inside.any() else None


def tilt_deg(start: Mapping[str, Any], end: Mapping[str, Any]) -> float:
    """Return the angle between the vertical axes of an object at the start and at the end of a run."""
    a, b = (_up(item["pose_B_O"]) for item in (start, end))
    return float(np.degrees(np.arccos(np.clip(a @ b, -1.0, 1.0))))


def _up(pose: Mapping[str, Any]) -> Array:
    """Return the vertical of B in an object's frame (3,): its change is the tilt, whatever the yaw."""
    return np.asarray(Pose(np.array(pose["position_m"], float), np.array(pose["quat"], float)).rotation[2])
