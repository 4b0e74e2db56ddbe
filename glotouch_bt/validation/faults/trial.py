"""One trial of `bench faults`, in its own process, and its verdict."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from glotouch_bt.campaign import Row, crashed, launch_trial
from glotouch_bt.faults import CATALOGUE, FaultPlan
from glotouch_bt.robot.scene import stream
from glotouch_bt.runs import RunRequest
from glotouch_bt.validation.faults.cases import chosen_cases
from glotouch_bt.validation.faults.rejoin import Rejoined
from glotouch_bt.validation.faults.start import start_from
from glotouch_bt.validation.trial import Hung, durations, hang_guard, tidy

VERDICTS = ("recovered", "safely ended", "wrong", "unsafe")


def verdict(result: Mapping[str, Any], hard_force_N: float) -> str:
    """Return the verdict of a run, one of `VERDICTS`.

    unsafe: it crashed, hung, exceeded the hard force limit, or ended without the arm held. wrong: it lifted another
    object, or reported a false success. recovered: the target is in the gripper. safely ended: everything else.
    """
    if result["status"] in ("traceback", "hang"):
        return "unsafe"
    if float(result["peak_force_N"]) > hard_force_N:
        return "unsafe"
    wrong_object = result["retrieved"] is not None and not result["correct"]
    success = result["status"] == "success"
    if wrong_object or (success and not result["correct"]):
        return "wrong"
    if success:
        return "recovered"
    return "safely ended" if result["held_at_end"] and result["reasons"] else "unsafe"


def run_trial(
    request: RunRequest, labels: Mapping[str, Any], hard_force_N: float, keep: bool = False, twin: Path | None = None
) -> Row:
    """Run one trial and return its row.

    Args:
        request: Run request with its folder.
        labels: First columns of the row: class, skill, seed, after_s, folder.
        hard_force_N: Hard limit of the true peak force.
        keep: Keep the record of a harmless trial.
        twin: Folder of the unfaulted run of this seed, to start from.
    """
    assert request.out is not None
    began = time.perf_counter()
    try:
        with hang_guard():
            result = _launched(request, twin)
    except Hung as e:
        row = failed_trial(labels, e)
    else:
        row = dict(labels) | _row(result, hard_force_N)
        if labels["class"] == "none":
            row["durations_s"] = durations(request.out)
    row["wall_s"] = round(time.perf_counter() - began, 2)
    request.out.mkdir(parents=True, exist_ok=True)
    if labels["class"] != "none":
        tidy(request.out, everything=not keep and row.get("verdict") in ("recovered", "safely ended"))
    return row


def failed_trial(labels: Mapping[str, Any], error: Exception | Hung) -> Row:
    """Return the row of a trial that hung, raised, or whose process was lost."""
    found = {"status": "hang", "cause": "hang"} if isinstance(error, Hung) else crashed(error)
    return dict(labels) | found | {"verdict": "unsafe", "effective": True, "wall_s": 0.0}


def _launched(request: RunRequest, twin: Path | None) -> Mapping[str, Any]:
    """Return the result of a run. For a trial that rejoined its twin: the twin's, with the faults' effects."""
    resumable = None
    plan = request.faults
    if twin is not None and isinstance(plan, FaultPlan) and request.out is not None:
        (spec,) = plan.faults
        if spec.kind.channel != "model":  # a different model makes a different mission
            (case,) = chosen_cases([spec.kind.name])
            resumable = start_from(twin, request.out, plan, case.warm_up_s, request.objects)
    try:
        done = launch_trial(request, resumable=resumable)
    finally:
        if resumable is not None:
            resumable.file.close()
    if not isinstance(done.outcome.error, Rejoined):
        return done.result
    assert twin is not None
    known: dict[str, Any] = json.loads((twin / "result.json").read_text(encoding="utf-8"))
    (fault,) = done.result["faults"]
    sightings = [s for s in fault["sightings"] if s["by"] != "runner"]
    seen = sightings[0] if sightings else None
    latency_s = None if seen is None else seen["stamp_s"] - fault["first_s"]
    fault = fault | {"sightings": sightings, "seen": seen, "latency_s": latency_s, "outcome": known["status"]}
    return known | {"faults": [fault], "rejoined": True}


def _row(result: Mapping[str, Any], hard_force_N: float) -> Row:
    chain, reports = result["reason_chain"], result["faults"]
    root = chain[-1] if chain else {"node": "", "code": ""}
    row = {
        "status": result["status"],
        "verdict": verdict(result, hard_force_N),
        "cause": f"{root['node'].rsplit('/', 1)[-1]}: {root['code']}" if chain else "",
        "reasons": list(result["reasons"]),
        "retrieved": result["retrieved"],
        "correct": result["correct"],
        "peak_force_N": result["peak_force_N"],
        "rejoined": bool(result.get("rejoined")),
        "sim_s": result["sim_time_s"],
    }
    if not reports:
        return row | {"effective": True}
    fault = reports[0]
    seen = fault["seen"] or {}
    words = [f"{s['code']} {s['text']}" for s in fault["sightings"]]
    words += [f"{c['code']} {c['message']} {c['advice']}" for c in chain]
    return row | {
        "effective": fault["effective"],
        "applied": fault["applied"],
        "changes": fault["samples_altered"] + fault["commands_altered"] + fault["commands_refused"] + fault["acts"],
        "moved_m": fault["moved_m"],
        "seen_by": seen.get("by", ""),
        "seen_code": seen.get("code", ""),
        "latency_s": fault["latency_s"],
        "recovery": fault["recovery"],
        "named": CATALOGUE[fault["fault"]].named_in("\n".join(words)),
    }


def drawn_after_s(seed: int, fault: str, skill: str, lasts_s: float) -> float:
    """Draw when the fault begins: within the first 80 % of the skill's run, rounded to the period."""
    return round(float(stream(seed, f"moment {fault} {skill}").uniform(0.0, 0.8 * max(lasts_s, 0.0))), 2)
