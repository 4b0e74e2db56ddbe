"""A replay for people and for programs."""

from __future__ import annotations

from typing import Any

from glotouch_bt.mission.record import to_json
from glotouch_bt.runs.replay.decisions import Decision
from glotouch_bt.runs.replay.run import Replay


def as_dict(replay: Replay) -> dict[str, Any]:
    """For --json."""
    parted = replay.parted
    return {
        "same": replay.same,
        "status": {"then": replay.statuses[0], "now": replay.statuses[1]},
        "parted": None if parted is None else {"cycle": parted.cycle, "stamp_s": parted.stamp_s, "what": parted.what},
        "record_ended": replay.ended,
        "compared": dict(replay.compared),
        "largest_difference": {k: {"value": v, "where": where} for k, (v, where) in replay.largest.items() if where},
        "differences": [
            {"stamp_s": d.stamp_s, "kind": d.kind, "where": d.where, "then": d.then, "now": d.now}
            for d in replay.differences
        ],
        "reasons": replay.outcome.reasons,
    }


def as_lines(replay: Replay, shown: int) -> list[str]:
    """For a terminal: what was compared, where the replay parted from the run, the first differences."""
    compared = ", ".join(f"{n} {kind}" for kind, n in replay.compared.items() if n)
    lines = [f"compared: {compared or 'nothing'}"]
    if replay.cut_s is not None:
        lines.append(f"the record is cut off or damaged at t={replay.cut_s:.2f} s: nothing after that is replayed")
    if replay.same:
        worst = max((v for v, _ in replay.largest.values()), default=0.0)
        then = replay.statuses[0]
        return [*lines, f"the same: every event and every decision, ends with {then} (largest difference {worst:.1g})"]
    if replay.parted is not None:
        p = replay.parted
        lines.append(f"parts from the run in cycle {p.cycle}, t={p.stamp_s:.2f} s: {p.what}")
        lines.append("  (what comes after answers other commands than it was given: read the first differences)")
    then, now = replay.statuses
    if then != now:
        lines.append(f"ended with {then}; the replay ends with {now}")
        lines += [f"  {r}" for r in replay.outcome.reasons]
    lines += [f"  {d}" for d in replay.differences[:shown]]
    left = len(replay.differences) - shown
    if left > 0:
        lines.append(f"  ... and {left} more (--json gives all)")
    return lines


def decision_as_dict(decision: Decision) -> dict[str, Any]:
    """For --json."""
    return {
        "stamp_s": decision.stamp_s,
        "target": decision.target,
        "matcher": decision.matcher,
        "same": decision.same,
        "then": decision.then,
        "now": to_json(decision.now, summarise=True),
    }
