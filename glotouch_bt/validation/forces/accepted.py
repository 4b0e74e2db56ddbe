"""Ask a robot which faults of the catalogue it accepts in a mission."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from glotouch_bt.faults import CATALOGUE, Duration, FaultInjector, FaultPlan, When, wrong_models
from glotouch_bt.lazy import load_all
from glotouch_bt.mission import load_mission, split_settings
from glotouch_bt.mission.read import limits_of, load_conditions
from glotouch_bt.robot import BadInput, load_backend
from glotouch_bt.runs import RunRequest
from glotouch_bt.validation.forces.draw import fault_of, is_index, plan_of

MAX_INDEX = 63
"""Largest index that is tried."""


def accepted_faults(request: RunRequest) -> dict[str, dict[str, list[int]]]:
    """Return the faults that can be armed on the robot of a request, each with the accepted values of its indices.

    Nothing moves: the robot is opened, every fault is armed, and the robot is closed.

    Raises:
        BadInput: The request is wrong, or the backend does not know the true force.
        BackendError: The backend did not open.
    """
    mission = load_mission(request.mission, request.settings, objects=request.objects, allow_paths=request.allow_paths)
    load_all()
    backend = load_backend(request.backend)
    options = split_settings(mission, request.settings)
    with (
        backend.open(mission.world, load_conditions(request.conditions), request.seed, options) as robot,
        TemporaryDirectory() as folder,
    ):
        if backend.referee(robot) is None:
            raise BadInput(f"--backend {request.backend}: does not know the true force; use a simulated one")
        injector = FaultInjector(
            robot, FaultPlan("none", ()), request.seed, disturber=backend.disturber(robot), may_kill=False
        )

        def accepts(plan: FaultPlan) -> bool:
            try:
                wrong_models(plan, mission, Path(folder))
                injector.add_fault(*plan.faults)
            except BadInput:
                return False
            return True

        return accepted_by(accepts)


def accepted_by(accepts: Callable[[FaultPlan], bool]) -> dict[str, dict[str, list[int]]]:
    """Return the faults, and the values of their indices, that `accepts` takes as a plan of one fault."""
    found: dict[str, dict[str, list[int]]] = {}
    for name, kind in CATALOGUE.items():
        indices = {}
        for key, field in kind.effect.Params.model_fields.items():
            if is_index(field):
                highest = min([MAX_INDEX, *(int(limit) for s, limit, _ in limits_of(field) if s == "<=")])
                indices[key] = [i for i in range(highest + 1) if accepts(_alone(name, {key: i}))]
        if all(indices.values()) and (indices or accepts(_alone(name, {}))):
            found[name] = indices
    return found


def _alone(name: str, given: dict[str, int]) -> FaultPlan:
    return plan_of([fault_of(name, given, When(), Duration(until="ever"))])
