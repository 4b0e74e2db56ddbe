"""One trial of `bench forces`, in its own process, and its row."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from glotouch_bt.campaign import Row, crashed, launch_trial
from glotouch_bt.faults import FaultPlan, FaultSpec
from glotouch_bt.report import read_run
from glotouch_bt.robot import BackendError, BadInput, Limits
from glotouch_bt.runs import RunRequest
from glotouch_bt.untrusted import read_json
from glotouch_bt.validation.forces.accepted import accepted_faults
from glotouch_bt.validation.trial import Hung, durations, hang_guard, tidy

PLAN = "plan.yaml"
"""Name of the plan in the folder of an offending trial."""
OVER, FALSE, NO_RESULT = "over the hard limit", "false success", "no result"
"""Offences."""
REFUSED, NOT_STARTED = "refused", "not started"
"""Status of a trial whose plan cannot be applied, and of one whose robot failed before the first tick of the tree."""


def run_twin(request: RunRequest, labels: Mapping[str, Any]) -> Row:
    """Run a mission without faults; return its row, with what the draws need.

    Args:
        request: Run request with its folder.
        labels: First columns of the row.

    Raises:
        BadInput: As `accepted_faults`.
    """
    assert request.out is not None
    began = time.perf_counter()
    accepted = accepted_faults(request)
    try:
        with hang_guard():
            result = launch_trial(request).result
    except Hung as e:
        return failed_trial(labels, request.out, e)
    row = dict(labels) | row_of(result, False) | {"lifted": result["retrieved"] is not None}
    row |= {"accepted": accepted, "durations_s": _leaves(request.out), "result_written": True}
    tidy(request.out, everything=True)
    return row | {"wall_s": round(time.perf_counter() - began, 2)}


def run_trial(request: RunRequest, labels: Mapping[str, Any], lifts: bool, keep: bool = False) -> Row:
    """Run one trial and return its row.

    Args:
        request: Run request with its folder and its plan.
        labels: First columns of the row.
        lifts: A success of this mission means that an object is in the jaws.
        keep: Keep the record of a trial without offence.
    """
    assert request.out is not None
    began = time.perf_counter()
    for name in (PLAN, "result.json"):
        (request.out / name).unlink(missing_ok=True)
    try:
        with hang_guard():
            result = launch_trial(request).result
    except Hung as e:
        row = failed_trial(labels, request.out, e)
    except BadInput as e:  # the drawn plan cannot be applied; the undisturbed run of the same request was accepted
        row = dict(labels) | {"status": REFUSED, "cause": str(e), "effective": 0, "wall_s": 0.0}
    except BackendError as e:  # a fault stopped the robot before the first tick: nothing moved, no run was begun
        row = dict(labels) | {"status": NOT_STARTED, "cause": str(e), "effective": 0, "wall_s": 0.0}
    else:
        row = dict(labels) | row_of(result, lifts) | {"result_written": result_written(request.out)}
    row["wall_s"] = round(time.perf_counter() - began, 2)
    request.out.mkdir(parents=True, exist_ok=True)
    tidy(request.out, everything=not keep and not offences(row))
    return row


def failed_trial(labels: Mapping[str, Any], folder: Path, error: Exception | Hung) -> Row:
    """Return the row of a trial that hung, raised, or whose process was lost; it counts as effective."""
    found = {"status": "hang", "cause": "hang"} if isinstance(error, Hung) else crashed(error)
    effective = max(1, str(labels.get("faults", "")).count(";") + 1)
    return dict(labels) | found | {"effective": effective, "result_written": result_written(folder), "wall_s": 0.0}


def row_of(result: Mapping[str, Any], lifts: bool) -> Row:
    """Return the columns that follow from a result; `lifts` as in `run_trial`. Forces in N."""
    chain, unscored = result["reason_chain"], bool(result.get("unscored"))
    root = chain[-1] if chain else {"node": "", "code": ""}
    wrong = result["correct"] is False or (lifts and result["retrieved"] is None)
    return {
        "status": result["status"],
        "cause": f"{root['node'].rsplit('/', 1)[-1]}: {root['code']}" if chain else "",
        "effective": sum(bool(f["effective"]) for f in result.get("faults", ())),
        "without_effect": [f["name"] for f in result.get("faults", ()) if not f["effective"]],
        "peak_force_N": None if unscored else result["peak_force_N"],
        "felt_peak_N": result["sensed_peak_force_N"],
        "retrieved": result["retrieved"],
        "correct": result["correct"],
        "false_success": result["status"] == "success" and wrong and not unscored,
        "sim_s": result["sim_time_s"],
    }


def result_written(folder: Path) -> bool:
    """Return True if a folder holds a valid result.json."""
    try:
        found = read_json(folder / "result.json")
    except (BadInput, OSError):
        return False
    return isinstance(found, dict) and {"mission", "seed", "status", "peak_force_N"} <= found.keys()


def offences(row: Mapping[str, Any]) -> list[str]:
    """Return what a trial did that none may do; empty if nothing."""
    if row["status"] in (REFUSED, NOT_STARTED):
        return []
    peak = row.get("peak_force_N")
    found = ((OVER, peak is not None and float(peak) > Limits().hard_force_N), (FALSE, bool(row.get("false_success"))))
    return [what for what, is_so in (*found, (NO_RESULT, not row.get("result_written"))) if is_so]


def described(plan: FaultPlan) -> str:
    """Return the faults of a plan with parameters, start and duration, on one line."""
    return "; ".join(_described(f) for f in plan.faults)


def _described(fault: FaultSpec) -> str:
    given = ", ".join(f"{key}={_plain(value)}" for key, value in fault.params.model_dump(mode="json").items())
    when, lasts = fault.when.model_dump(exclude_defaults=True), fault.duration
    parts = [f"{fault.name}({given})"]
    if "time_s" in when:
        parts.append(f"at {when.pop('time_s'):g} s")
    if "node" in when:
        parts.append(f"in {when.pop('node')}")
    if "after_s" in when:
        parts.append(f"after {when.pop('after_s'):g} s")
    parts += [f"with {key}={value:g}" for key, value in when.items()]
    if len(parts) == 1:
        parts.append("from the first sample")
    parts.append("until the end" if lasts.duration_s is None else f"for {lasts.duration_s:g} s")
    return " ".join(parts)


def _plain(value: object) -> str:
    return str(value).replace("'", "").replace("; ", ", ")


def _leaves(folder: Path) -> dict[str, float]:
    """Return the durations of the nodes without children, s."""
    paths = {tick.node for tick in read_run(folder).ticks}
    parents = {p.rsplit("/", 1)[0] for p in paths}
    leaves = {p.rsplit("/", 1)[-1] for p in paths - parents}
    return {name: seconds for name, seconds in durations(folder).items() if name in leaves}
