"""The result of a replay as text and as JSON data."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from glotouch_bt.mission.record import to_json
from glotouch_bt.runs.replay.decisions import Decision
from glotouch_bt.runs.replay.run import Replay


def as_dict(replay: Replay) -> dict[str, Any]:
    """Return the JSON data of `--json`."""
    return {
        "same": replay.same,
        "status": {"then": replay.statuses[0], "now": replay.statuses[1]},
        "parted": None if replay.divergence is None else asdict(replay.divergence),
        "record_ended": replay.ended,
        "compared": dict(replay.compared),
        "largest_difference": {k: {"value": v, "where": where} for k, (v, where) in replay.largest.items() if where},
        "differences": [asdict(d) for d in replay.differences],
        "reasons": replay.outcome.reasons,
    }


def as_lines(replay: Replay, shown: int) -> list[str]:
    """For a terminal: what was compared, where the replay divergence from the run, the first differences."""
    compared = ", ".join(f"{n} {kind}" for kind, n in replay.compared.items() if n)
    lines = [f"compared: {compared or 'nothing'}"]
    if replay.cut_s is not None:
        lines.append(f"the record is cut off or damaged at t={replay.cut_s:.2f} s: the rest is not replayed")
    if replay.same:
        worst = max((v for v, _ in replay.largest.values()), default=0.0)
        then = replay.statuses[0]
        return [*lines, f"the same: every event and every decision; ends with {then} (largest difference {worst:.1g})"]
    if replay.divergence is not None:
        p = replay.divergence
        lines.append(f"differs from the run from cycle {p.cycle}, t={p.stamp_s:.2f} s: {p.what}")
        lines.append("  (later observations do not match the commands: read the first differences)")
    then, now = replay.statuses
    if then != now:
        lines.append(f"ended with {then}; the replay ends with {now}")
        lines += [f"  {r}" for r in replay.outcome.reasons]
    lines += [f"  {d}" for d in replay.differences[:shown]]
    hidden = len(replay.differences) - shown
    if hidden > 0:
        lines.append(f"  ... and {hidden} more (--json gives all)")
    return lines


def decision_as_dict(decision: Decision) -> dict[str, Any]:
    """Return the JSON data of `--json`."""
    return {
        "stamp_s": decision.stamp_s,
        "target": decision.target,
        "matcher": decision.matcher,
        "same": decision.same,
        "then": decision.then,
        "now": to_json(decision.now, summarise=True),
    }
