"""The wrong models a plan asks for, written and given to the mission before it is loaded for good."""

from __future__ import annotations

from pathlib import Path

from glotouch_bt.faults.effects import ScaleParams
from glotouch_bt.faults.plan import FaultPlan
from glotouch_bt.mission import Mission
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import load_mesh


def wrong_models(plan: FaultPlan, mission: Mission, folder: Path) -> dict[str, str]:
    """Write the wrong models of a plan and give them as mission parameters; empty if the plan has none.

    Args:
        plan: A plan.
        mission: Whose object parameters are replaced.
        folder: Where the models go, each under its object's name.

    Raises:
        BadInput: The mission takes no object, or its model cannot be scaled so.
    """
    given: dict[str, str] = {}
    for spec in plan.faults:
        if not isinstance(spec.params, ScaleParams):
            continue
        if not mission.stl_parameters:
            raise BadInput(f"{spec.place}: {spec.name}: mission {mission.name!r} has no parameter of type stl")
        for name in mission.stl_parameters:
            source = Path(given.get(name, str(mission.parameters[name])))
            if source.suffix.lower() != ".stl":
                source = mission.world.objects.folder / f"{source}.stl"
            solid = load_mesh(source).as_trimesh()
            solid.apply_scale(spec.params.factor)
            target = folder / source.name
            try:
                folder.mkdir(parents=True, exist_ok=True)
                solid.export(target)
            except OSError as e:
                raise BadInput(f"{target}: the scaled model cannot be written ({e.strerror})") from e
            load_mesh(target)
            given[name] = str(target)
    return given
