"""Write the wrong models of a fault plan, to be passed to the mission as parameters."""

from __future__ import annotations

from pathlib import Path

from glotouch_bt.faults.effects import WrongScaleStlParams
from glotouch_bt.faults.plan import FaultPlan
from glotouch_bt.mission import Mission
from glotouch_bt.perception import touched_name
from glotouch_bt.robot import BadInput
from glotouch_bt.robot.scene import load_mesh, stl_files


def wrong_models(plan: FaultPlan, mission: Mission, folder: Path) -> dict[str, str]:
    """Write the wrong models of a plan; return them as mission parameters, empty if the plan has none.

    Args:
        plan: A fault plan.
        mission: The mission whose stl parameters are replaced.
        folder: Folder of the models, each named as its object.

    Raises:
        BadInput: The mission has no stl parameter, or the scaled model is unusable.
    """
    given: dict[str, str] = {}
    for spec in plan.faults:
        if not isinstance(spec.params, WrongScaleStlParams):
            continue
        if not mission.stl_parameters:
            raise BadInput(f"{spec.place}: {spec.name}: mission {mission.name!r} has no parameter of type stl")
        for name in mission.stl_parameters:
            if touched_name(str(mission.parameters[name])):
                raise BadInput(
                    f"{spec.place}: {spec.name}: {mission.parameters[name]!r} has no STL; choose another fault"
                )
            source = Path(given.get(name, str(mission.parameters[name])))
            if source.suffix.lower() != ".stl":
                source = stl_files(mission.world.objects.folder)[str(source)]
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
