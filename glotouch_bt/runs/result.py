"""The description of a run before it starts and its result when it has ended.

The truth of a simulated world is read here after the run, for scoring only.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from glotouch_bt.mission import Mission
from glotouch_bt.mission.execution import Outcome
from glotouch_bt.mission.read import conditions_name, shown
from glotouch_bt.mission.record import to_json
from glotouch_bt.perception import touched_name
from glotouch_bt.robot import Conditions, Robot
from glotouch_bt.robot.scene import stl_files
from glotouch_bt.robot.simulation import Referee, TrueObject
from glotouch_bt.runs.request import RunRequest
from glotouch_bt.version import __version__

GO_ON = "glotouch resume RUN"
"""How an aborted run goes on, as in its result; RUN is its folder."""
RECORDED_PACKAGES = ("mujoco", "numpy", "pin", "py_trees", "ruckig", "scipy", "trimesh")


def mission_yaml(request: RunRequest, mission: Mission, robot: str) -> str:
    """Return the resolved mission as YAML, with a comment that says how and with which robot it was run."""
    head = f"# backend {request.backend}, seed {request.seed}, conditions {request.conditions}\n"
    head += f"# robot {json.dumps(robot)}\n"
    return head + mission.resolved_yaml()


def description(request: RunRequest, mission: Mission, conditions: Conditions, robot: Robot) -> dict[str, object]:
    """Return the description stored in the record; with its `robot` a replay needs no backend."""
    world = mission.world
    objects = dataclasses.replace(world.objects, folder=Path(shown(world.objects.folder)))
    return {
        "mission": mission.name,
        "description": mission.description,
        "backend": request.backend,
        "seed": request.seed,
        "conditions": conditions,
        "parameters": dict(mission.parameters),
        "pose_B_K": world.container.pose_B_K,
        "container": world.container,
        "probe": world.probe,
        "holder": world.holder,
        "objects": objects,
        "robot": {"description": robot.description, "limits": robot.limits, "period_s": robot.period_s},
        "versions": installed_versions(),
    }


@dataclass(frozen=True)
class FinalTruth:
    """The truth of a simulated world after a run; see `Referee`."""

    objects: list[TrueObject]
    peak_force_N: float
    samples_over_limit: int
    contact_softness_s: float
    tip_B_m: list[float]
    silent_axes: tuple[str, ...]


def final_truth(referee: Referee | None) -> tuple[FinalTruth | None, str]:
    """Return the truth, or None and why there is none. A dead or broken simulation must not cost the result."""
    if referee is None:
        return None, ""
    try:
        return FinalTruth(
            objects=referee.objects(),
            peak_force_N=referee.peak_force_N(),
            samples_over_limit=referee.samples_over_limit(),
            contact_softness_s=referee.contact_softness_s(),
            tip_B_m=referee.tip_B_m().tolist(),
            silent_axes=referee.silent_axes(),
        ), ""
    except Exception as e:  # also of the solver's geometry, when a world has exploded
        return None, f"the simulated world can no longer be asked for the truth: {e}"


def score(
    request: RunRequest, mission: Mission, outcome: Outcome, seen: FinalTruth | None, robot: Robot
) -> dict[str, Any]:
    """Return the content of result.json without wall times; without the truth, nothing counts as retrieved."""
    found = outcome.summary
    target = _target(mission)
    retrieved: str | None = None
    correct: bool | None = None
    peak = found.peak_force_N
    if seen is not None:
        held = [o.name for o in seen.objects if o.in_gripper]
        retrieved = held[0] if held else None
        correct = _is(target, retrieved, mission)
        peak = seen.peak_force_N
    return {
        "mission": mission.name,
        "backend": request.backend,
        "robot": robot.description.name,
        "seed": request.seed,
        "conditions": conditions_name(request.conditions),
        "status": outcome.status,
        "reasons": outcome.reasons,
        "reason_chain": [to_json(f.as_dict()) for f in outcome.chain],
        "target": target,
        "retrieved": retrieved,
        "correct": correct,
        "results": found.results,
        "ranking": found.ranking,
        "calibration": found.calibration,
        "candidates": found.candidates,
        "contacts": found.contacts,
        "sim_time_s": round(outcome.end_s - outcome.start_s, 6),
        "skill_time_s": {
            name: round(cycles * robot.period_s, 6) for name, cycles in sorted(found.skill_cycles.items()) if name
        },
        "paused_s": round(outcome.paused_s, 6),
        "guards": dict(outcome.guards),
        "ending": outcome.safe_stop,
        "ticks": outcome.ticks,
        "probe_path_m": round(found.probe_path_m, 6),
        "peak_force_N": round(float(peak), 6),
        "true_peak_force_N": None if seen is None else round(float(seen.peak_force_N), 6),
        "true_samples_over_limit": None if seen is None else seen.samples_over_limit,
        "contact_softness_s": None if seen is None else round(seen.contact_softness_s, 6),
        "sensed_peak_force_N": round(found.peak_force_N, 6),
        # without paths of this machine
        "parameters": {k: _stem(str(v)) if k in mission.stl_parameters else v for k, v in mission.parameters.items()},
        "versions": installed_versions(),
    } | ({"go_on": GO_ON} if outcome.status == "aborted" else {})


def _is(target: str | None, retrieved: str | None, mission: Mission) -> bool | None:
    """Return True if the target was retrieved; None without one, or if no object of the world has its name."""
    if target is None:
        return None
    name = touched_name(target)
    if name and name not in stl_files(mission.world.objects.folder):
        return None
    return retrieved == (name or target)


def _target(mission: Mission) -> str | None:
    """Return the target of the mission, the stem of its first stl parameter, or None."""
    for name in mission.stl_parameters:
        if name in mission.parameters:
            return _stem(str(mission.parameters[name]))
    return None


def _stem(given: str) -> str:
    return Path(given).stem if given.lower().endswith(".stl") else given


def truth(objects: list[TrueObject]) -> list[Any]:
    """Return true objects as JSON data."""
    return [to_json(o) for o in objects]


def installed_versions() -> dict[str, str]:
    """Return the versions of this package and of those that may change a result."""
    found = {"glotouch-bt": __version__}
    for package in RECORDED_PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
